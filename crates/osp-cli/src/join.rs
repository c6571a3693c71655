//! `osp join`: takes part in a shared session without a window.

use std::{
    fmt::Write as _,
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use anyhow::{bail, ensure};

use super::{
    author_rows::AuthorRows,
    join_args::JoinArgs,
    join_player::{self, Playing},
    join_recording::SharedRecording,
    join_report::Report,
    output::{Outcome, keep_standard_output_for_a_file, one_line, print_result, warn},
    shared,
};
use osp_lab::report::thousands;
use osp_net::live::{Address, Connection, Link, News, Status, header};
use osp_session::{output_file::is_same_file, recording::Event};

/// Longest time to wait at the end until all events of this member are in the session.
const CLOSING_TIME: Duration = Duration::from_secs(3);
/// Longest time for the final report after a signal.
const REPORT: Duration = Duration::from_secs(20);
/// Interval at which the recording is flushed to its file and the connection is checked.
const BETWEEN: Duration = Duration::from_millis(200);

impl JoinArgs {
    fn recording(&self, address: &Address) -> anyhow::Result<SharedRecording> {
        let session = &address.session;
        let path = self.file.clone().unwrap_or_else(|| PathBuf::from(format!("{session}.ron")));
        if let Some(played) = &self.play {
            ensure!(
                !is_same_file(&path, played),
                "{}: is the session to play, too; name another file",
                path.display()
            );
        }
        SharedRecording::open(&path, &header(session), self.force.force)
    }
}

pub(super) fn run(args: &JoinArgs) -> anyhow::Result<Outcome> {
    let address = args.server.address(&args.address)?;
    if args.until_empty && !args.watch && args.play.is_none() {
        bail!(
            "--until-empty: expected --watch or --play; otherwise this member stays, and the session is never empty"
        );
    }
    let playing = match &args.play {
        Some(path) => Some(Playing::open(path, &args.reading, args.pace, args.speed, args.play_author)?),
        None => None,
    };
    let recording = args.recording(&address)?;
    if args.json {
        // Other messages are not JSON, so they must not go to standard output.
        keep_standard_output_for_a_file();
    }
    let link = Link::open(&address, &shared::role(args.watch, &args.name), || {})?;
    let ending = Arc::new(AtomicBool::new(false));
    #[cfg(unix)]
    shared::end_on_signals(&ending, CLOSING_TIME + REPORT);
    let is_done = AtomicBool::new(false);
    let mut member = Member {
        args,
        address: &address,
        link: &link,
        recording,
        rows: AuthorRows::default(),
        present: 0,
        had_authors: false,
        has_left: args.watch,
        refused: 0,
        shown: Shown::default(),
        started: Instant::now(),
    };
    let ended = thread::scope(|scope| {
        let hand = link.hand();
        let (ending, is_done) = (&ending, &is_done);
        let player = playing.map(|playing| {
            scope.spawn(move || {
                let played = join_player::play(playing, &hand, || ending.load(Ordering::Relaxed));
                hand.leave();
                if played.is_err() {
                    // An error also ends the member, even without a connection.
                    ending.store(true, Ordering::Relaxed);
                }
                is_done.store(true, Ordering::Relaxed);
                played
            })
        });
        let ended = member.take_part(ending, is_done);
        ending.store(true, Ordering::Relaxed);
        match player.map(|player| player.join()) {
            Some(Err(panic)) => std::panic::resume_unwind(panic),
            Some(Ok(played)) => ended.and_then(|()| played.map(Some)),
            None => ended.map(|()| None),
        }
    });
    let played = match ended {
        Ok(played) => played,
        Err(error) => {
            let undelivered = link.status().pending as u64 + member.refused;
            if let Some(problem) = missing_events(undelivered) {
                warn(&format!("error: {problem}"));
            }
            return Err(error);
        }
    };
    member.report(played)
}

/// The last state of the connection that was reported.
#[derive(Debug, Default)]
struct Shown {
    connection: Connection,
    trouble: Option<String>,
    faulty: u64,
}

struct Member<'a> {
    args: &'a JoinArgs,
    address: &'a Address,
    link: &'a Link,
    recording: SharedRecording,
    rows: AuthorRows,
    /// Number of authors that have joined and not left.
    present: u64,
    had_authors: bool,
    has_left: bool,
    /// Number of this member's events that the session has refused.
    refused: u64,
    shown: Shown,
    started: Instant,
}

impl Member<'_> {
    /// Writes the session's events to the recording until this member leaves.
    fn take_part(&mut self, ending: &AtomicBool, is_played: &AtomicBool) -> anyhow::Result<()> {
        let time = self.args.for_secs.map(Duration::from_secs_f64);
        let mut leaving = None;
        let mut shown = Instant::now();
        loop {
            let news = self.link.news_within(Duration::from_millis(20))?;
            let is_quiet = news.is_none();
            if let Some(news) = news {
                self.take(news)?;
            }
            if is_quiet || shown.elapsed() > BETWEEN {
                shown = Instant::now();
                self.recording.flush()?;
                self.show();
            }
            let has_left = self.has_left;
            let is_over = ending.load(Ordering::Relaxed)
                || self.shown.connection == Connection::Full
                || time.is_some_and(|time| self.started.elapsed() >= time);
            if is_over && leaving.is_none() {
                leaving = Some(Instant::now());
                ending.store(true, Ordering::Relaxed);
                // With --play, the player itself leaves after all its events.
                if self.args.play.is_none() {
                    self.link.hand().leave();
                }
            }
            let is_late = leaving.is_some_and(|since: Instant| since.elapsed() >= CLOSING_TIME);
            // An event that is not written yet may be the join of another author.
            let is_empty =
                is_quiet && self.had_authors && self.present == 0 && self.link.status().has_caught_up;
            let is_enough = match self.args.until_empty {
                true => has_left && is_empty,
                // With --play, the program ends after the last event. Without it, an option or a signal ends the
                // program.
                false => has_left && is_played.load(Ordering::Relaxed),
            };
            if is_late || is_enough || (is_over && has_left) {
                // Writes all events that have arrived until now.
                while let Some(news) = self.link.news()? {
                    self.take(news)?;
                }
                return self.recording.flush();
            }
        }
    }

    fn take(&mut self, news: News) -> anyhow::Result<()> {
        match news {
            News::Events { events, .. } => self.write(&events)?,
            News::Refused { why, own } => {
                self.refused += own as u64;
                warn(&format!(
                    "warning: {} events of this member were refused: {why}",
                    thousands(own as u64)
                ));
            }
            News::Joined(author) => warn(&format!("this is author {author}")),
            News::Left => self.has_left = true,
        }
        Ok(())
    }

    fn write(&mut self, events: &[Event]) -> anyhow::Result<()> {
        for event in events {
            self.recording.write(event)?;
            self.rows.note(event);
            match event {
                Event::Join { author, name, .. } => {
                    (self.present, self.had_authors) = (self.present + 1, true);
                    warn(&format!("author {author} has joined{}", called(name)));
                }
                Event::Leave { author, .. } => {
                    self.present = self.present.saturating_sub(1);
                    warn(&format!("author {author} has left"));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Reports a change of the connection.
    fn show(&mut self) {
        let status = self.link.status();
        let is_new =
            std::mem::discriminant(&status.connection) != std::mem::discriminant(&self.shown.connection);
        let is_short = matches!(status.connection, Connection::Reading { read, of } if of - read < 1000);
        if (is_new && !is_short) || status.trouble != self.shown.trouble {
            warn(&described(self.address, &status));
        }
        let faulty = status.counts.faulty();
        if faulty > self.shown.faulty {
            let why = status.last_passed.as_deref().unwrap_or_default();
            warn(&format!(
                "warning: {} messages are ignored; the last one is {}",
                thousands(faulty),
                one_line(why)
            ));
        }
        self.shown = Shown { connection: status.connection, trouble: status.trouble, faulty };
    }

    fn report(self, played: Option<u64>) -> anyhow::Result<Outcome> {
        let status = self.link.status();
        let undelivered = status.pending as u64 + self.refused;
        let refusal = if self.args.watch { None } else { refusal(self.address, &status) };
        let report = Report {
            address: self.address.to_string(),
            latency: self.link.latency(),
            secs: self.started.elapsed().as_secs_f64(),
            authors: self.rows.finish(),
            recording: self.recording.finish()?,
            played,
            undelivered,
            status,
        };
        match self.args.json {
            true => report.print_json()?,
            false => print_result(&report.text())?,
        }
        let problems = [missing_events(undelivered), refusal];
        problems.iter().flatten().for_each(|problem| warn(&format!("error: {problem}")));
        Ok(if problems.iter().any(Option::is_some) { Outcome::CheckFailed } else { Outcome::Done })
    }
}

/// Returns the error text if some of this member's events are not in the session.
fn missing_events(events: u64) -> Option<String> {
    (events > 0).then(|| format!("{} events of this member are not in the session", thousands(events)))
}

/// Returns an error text with a remedy if the session is full or too crowded to join.
fn refusal(address: &Address, status: &Status) -> Option<String> {
    match (&status.connection, status.author) {
        (Connection::Crowded, _) => {
            Some(format!("this member has not joined {address}: too many have joined; try again later"))
        }
        (Connection::Full, None) => Some(format!(
            "{address} is full, nobody can join it: watch it with --watch, or begin a session of another name"
        )),
        (Connection::Full, Some(_)) => Some(format!(
            "{address} is full and accepts no more events: continue in a session with another name"
        )),
        _ => None,
    }
}

fn called(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(": {}", one_line(name)) }
}

pub(super) fn described(address: &Address, status: &Status) -> String {
    let mut text = match &status.connection {
        Connection::Connecting => format!("connecting to {address}"),
        Connection::Reading { read, of } => {
            format!("reading the session: {} of {} messages", thousands(*read), thousands(*of))
        }
        Connection::Live => format!("connected to {address}"),
        Connection::Silent => format!("{address} does not answer; your events stay here and are sent later"),
        Connection::Crowded => {
            format!("{address}: too many have joined; this member joins when there is room")
        }
        Connection::Full => format!("{address} is full: no more events are accepted"),
    };
    if let Some(trouble) = &status.trouble {
        // Writing to a string does not fail.
        let _ = write!(text, " ({})", one_line(trouble));
    }
    text
}
