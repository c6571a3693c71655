//! Opens sessions of any format for the commands, and reads ahead on a thread.

use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
};

use anyhow::Context;
use indicatif::ProgressBar;

use super::{
    output::{one_line, warn},
    progress,
    reading::ReadArgs,
};
use osp_session::recording::{self, Event, EventSource, Header, Notes, OpenOptions, RecordingError};

/// Largest number of events in a batch from the reading thread.
const BATCH: usize = 1024;
/// Largest number of polygon corners and stroke numbers in a batch. A batch of a single event may have more.
const BATCH_LISTS: usize = 1 << 16;
/// Largest number of batches that the reader may be ahead. The limit bounds the memory for large files.
const WAITING: usize = 16;

enum Message {
    Events(Vec<Event>),
    Damage(RecordingError),
    Notes(Notes),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reader {
    /// A separate thread, which reads ahead.
    Thread,
    /// The thread that processes the events. For work that uses only one core.
    Here,
}

/// Source of the events.
enum Feed {
    Thread(Receiver<Message>),
    Here(Box<dyn EventSource>),
}

pub(super) struct OpenSession {
    pub(super) header: Header,
    pub(super) format: &'static str,
    feed: Feed,
    batch: std::vec::IntoIter<Event>,
    notes: Notes,
    path: PathBuf,
    ended: bool,
    progress: ProgressBar,
}

impl OpenSession {
    /// Opens a session of any format. A separate thread reads it.
    pub(super) fn open(path: &Path, reading: &ReadArgs) -> anyhow::Result<Self> {
        Self::read_by(Reader::Thread, path, reading)
    }

    /// Opens a session of any format.
    pub(super) fn read_by(reader: Reader, path: &Path, reading: &ReadArgs) -> anyhow::Result<Self> {
        let session = recording::open(path, &reading.options())?;
        match reader {
            Reader::Thread => Self::of(session, path),
            Reader::Here => {
                let recording::Session { header, format, events } = session;
                Ok(Self::fed(header, format, Feed::Here(events), path))
            }
        }
    }

    fn of(session: recording::Session, path: &Path) -> anyhow::Result<Self> {
        let (header, format) = (session.header.clone(), session.format);
        let (sender, messages) = sync_channel(WAITING);
        thread::Builder::new()
            .name("reader".to_owned())
            .spawn(move || read(session, &sender))
            .context("a thread to read the session")?;
        Ok(Self::fed(header, format, Feed::Thread(messages), path))
    }

    fn fed(header: Header, format: &'static str, feed: Feed, path: &Path) -> Self {
        Self {
            header,
            format,
            feed,
            batch: Vec::new().into_iter(),
            notes: Notes::default(),
            path: path.to_owned(),
            ended: false,
            progress: ProgressBar::hidden(),
        }
    }

    /// Shows the number of events that have been read, if standard error is a terminal.
    pub(super) fn counted(mut self) -> Self {
        self.progress = progress::events(&self.path.to_string_lossy());
        self
    }

    /// Prints the reader's warnings. They are complete after the last event.
    pub(super) fn warn(&self) {
        self.notes.warnings.iter().for_each(|warning| warn(&format!("warning: {warning}")));
    }

    /// The parts of the session that are not shown, in one line.
    pub(super) fn not_shown(&self) -> Option<String> {
        let parts = self.header.left_out.join("; ");
        (!parts.is_empty()).then(|| format!("{}: not shown: {}", self.path.display(), one_line(&parts)))
    }

    /// Prints the parts that are not shown, and the reader's warnings.
    pub(super) fn warn_losses(&self) {
        self.not_shown().iter().for_each(|line| warn(&format!("warning: {line}")));
        self.warn();
    }

    /// Returns the reader's remarks. They are complete after the last event.
    pub(super) fn notes(&self) -> &Notes {
        &self.notes
    }
}

/// Returns a hint for recovering the readable part of a damaged session. `None` for other errors, or if no event is
/// readable.
pub(super) fn rescue(error: &anyhow::Error) -> Option<String> {
    let damaged = error.chain().find_map(|cause| match cause.downcast_ref()? {
        RecordingError::Line { path, .. } | RecordingError::Byte { path, .. } => Some(path),
        RecordingError::Limit(excess) => Some(&excess.path),
        RecordingError::Io { .. } | RecordingError::Unknown { .. } => None,
    })?;
    rescue_of(damaged)
}

/// The same for a damaged file.
pub(super) fn rescue_of(damaged: &Path) -> Option<String> {
    // A pipe is read by now.
    if recording::is_pipe(damaged) {
        return None;
    }
    // The damage may be in an entry of an archive or of a folder.
    let session = damaged.ancestors().take(3).find(|path| {
        let opened = recording::open(path, &OpenOptions::LENIENT);
        opened.is_ok_and(|mut session| matches!(session.events.next_event(), Ok(Some(_))))
    })?;
    let name = quoted(&session.to_string_lossy());
    let stem = session.file_stem().unwrap_or_default().to_string_lossy();
    let rescued = quoted(&format!("{stem}-rescued.ron"));
    let draw = match cfg!(feature = "window") {
        true => format!(", `osp sketch --lenient {name}` draws on a copy of it"),
        false => String::new(),
    };
    Some(format!("; `osp import --lenient {name} {rescued}` keeps what can be read{draw}"))
}

/// Quotes a path for a shell.
pub(super) fn quoted(path: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+,:=@%".contains(c);
    if path.chars().all(is_plain) { path.to_owned() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

fn read(mut session: recording::Session, sender: &SyncSender<Message>) {
    let mut batch = Vec::with_capacity(BATCH);
    let mut lists = 0;
    loop {
        let (event, last) = match session.events.next_event() {
            Ok(Some(event)) => (Some(event), None),
            Ok(None) => (None, Some(Message::Notes(session.events.notes()))),
            Err(error) => (None, Some(Message::Damage(error))),
        };
        lists += event.as_ref().map_or(0, Event::list_len);
        batch.extend(event);
        let ends = last.is_some();
        let is_full = batch.len() == BATCH || lists >= BATCH_LISTS;
        // Sending fails if the receiver is gone; in this case the thread ends.
        if (ends || is_full)
            && sender.send(Message::Events(std::mem::replace(&mut batch, Vec::with_capacity(BATCH)))).is_err()
        {
            return;
        }
        if is_full {
            lists = 0;
        }
        if let Some(last) = last {
            let _ = sender.send(last);
            return;
        }
    }
}

impl Iterator for OpenSession {
    type Item = Result<Event, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(event) = self.batch.next() {
                return Some(Ok(event));
            }
            let messages = match &mut self.feed {
                Feed::Thread(messages) => messages,
                Feed::Here(source) => {
                    let event = source.next_event();
                    if !matches!(event, Ok(Some(_))) {
                        self.notes = source.notes();
                    }
                    return event.transpose();
                }
            };
            match messages.recv() {
                Ok(Message::Events(batch)) => {
                    self.progress.inc(batch.len() as u64);
                    self.batch = batch.into_iter();
                }
                Ok(Message::Damage(error)) => {
                    self.progress.finish_and_clear();
                    self.ended = true;
                    return Some(Err(error));
                }
                Ok(Message::Notes(notes)) => {
                    self.progress.finish_and_clear();
                    self.ended = true;
                    self.notes = notes;
                }
                Err(_) if self.ended => return None,
                // The thread ended without an error message. This must not look like the end of the session.
                Err(_) => {
                    self.ended = true;
                    let cause = std::io::Error::other("the thread that reads it has stopped");
                    return Some(Err(RecordingError::io(&self.path, cause)));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    };

    use super::*;
    use osp_session::recording::{Author, StrokeId};
    use osp_testkit::wait_until;

    /// Produces events without end and counts them. Each event contains the given number of stroke numbers.
    struct Endless(Arc<AtomicUsize>, usize);

    impl EventSource for Endless {
        fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
            let t = self.0.fetch_add(1, Ordering::Relaxed) as f64;
            let strokes = vec![StrokeId(0); self.1];
            Ok(Some(Event::Move { author: Author::SOLE, t, strokes, by: glam::Vec3::ZERO }))
        }

        fn notes(&self) -> Notes {
            Notes::default()
        }
    }

    #[test]
    fn the_reader_runs_ahead_but_not_without_bound() {
        let read = Arc::new(AtomicUsize::new(0));
        let events = Box::new(Endless(Arc::clone(&read), 0));
        let session = recording::Session { header: Header::new("", ""), format: "test", events };
        let mut session = OpenSession::of(session, Path::new("test")).expect("a thread");
        let most = (WAITING + 2) * BATCH;
        let until = |least: usize| {
            wait_until("the reader", || read.load(Ordering::Relaxed) >= least);
            read.load(Ordering::Relaxed)
        };
        // Nobody has taken an event yet.
        assert!(until(WAITING * BATCH) <= most);
        for i in 0..5 * BATCH {
            let event = session.next().expect("more").expect("whole");
            assert_eq!(event.time_secs(), i as f64);
        }
        assert!(until((WAITING + 4) * BATCH) <= most + 5 * BATCH);
    }
}
