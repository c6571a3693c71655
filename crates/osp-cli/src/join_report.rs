//! The final report of `osp join`.

use std::io::{self, Write as _};

use anyhow::Context;
use serde::Serialize;
use serde_json::json;

use super::{
    author_rows::{self, AuthorRow},
    join_recording::Written,
    output::one_line,
};
use osp_lab::report::thousands;
use osp_net::live::{Connection, Latency, Status};
use osp_session::{
    recording::{self, OpenOptions, Pace},
    replay::{Player, fingerprint_of_frame, summarize_each},
};

/// The state when the member ended.
pub(super) struct Report {
    pub(super) address: String,
    pub(super) status: Status,
    pub(super) latency: Latency,
    pub(super) secs: f64,
    pub(super) authors: Vec<AuthorRow>,
    pub(super) recording: Written,
    pub(super) played: Option<u64>,
    pub(super) undelivered: u64,
}

/// Counts and fingerprint of the session, read from its recording.
#[derive(Default, Serialize)]
struct Shape {
    strokes: u64,
    polygons: u64,
    fingerprint: String,
}

impl Report {
    /// Reads the recording again. `None` if no recording was written.
    fn shape(&self) -> anyhow::Result<Option<Shape>> {
        if self.recording.is_empty {
            return Ok(None);
        }
        let session = recording::open(&self.recording.path, &OpenOptions::default())?;
        let player = Player::new(session, Pace::Samples(1)).merging_frames();
        let (_, end, read) = summarize_each(player, |_, _| {});
        read?;
        let scene = end.scene;
        Ok(Some(Shape {
            strokes: scene.strokes().len() as u64,
            polygons: scene.polygon_count() as u64,
            fingerprint: format!("{:016x}", fingerprint_of_frame(scene.visible_ids())),
        }))
    }

    fn connection(&self) -> &'static str {
        match self.status.connection {
            Connection::Connecting => "connecting",
            Connection::Reading { .. } => "reading",
            Connection::Live => "live",
            Connection::Silent => "silent",
            Connection::Crowded => "crowded",
            Connection::Full => "full",
        }
    }

    pub(super) fn print_json(&self) -> anyhow::Result<()> {
        let line = json!({
            "address": self.address,
            "connection": self.connection(),
            "trouble": self.status.trouble,
            "author": self.status.author.map(|author| author.0),
            "secs": self.secs,
            "file": self.recording.path.to_string_lossy(),
            "bytes": self.recording.bytes,
            "bytes_beyond": self.recording.beyond,
            "xxh3": format!("{:032x}", self.recording.hash),
            "session": self.shape()?,
            "played": self.played,
            "undelivered": self.undelivered,
            "counts": self.status.counts,
            "latency": self.latency,
            "authors": self.authors,
        });
        writeln!(io::stdout().lock(), "{line}").context("standard output")
    }

    pub(super) fn text(&self) -> String {
        let (counts, latency) = (&self.status.counts, &self.latency);
        let mut lines = vec![format!(
            "{}: {} bytes of the session {}, XXH3 {:032x}",
            one_line(&self.recording.path.to_string_lossy()),
            thousands(self.recording.bytes),
            self.address,
            self.recording.hash
        )];
        match self.shape() {
            Ok(None) => {
                lines =
                    vec![format!("no event of the session {} was received: no file is written", self.address)]
            }
            Ok(Some(shape)) => lines.push(format!(
                "  {:<11} {} strokes, {} polygons, fingerprint {}",
                "holds",
                thousands(shape.strokes),
                thousands(shape.polygons),
                shape.fingerprint
            )),
            Err(error) => lines.push(format!("  it cannot be read again: {error:#}")),
        }
        lines.extend(author_rows::lines(&self.authors));
        lines.push(format!(
            "  {:<11} {} ({} own), {} events; sent again {}, log requested again {}, connections {}",
            "messages",
            thousands(counts.messages),
            thousands(counts.own_messages),
            thousands(counts.events),
            thousands(counts.resent),
            thousands(counts.reopened),
            thousands(counts.connections),
        ));
        if counts.ignored() > 0 {
            lines.push(format!(
                "  {:<11} {} duplicates, {} gaps, {} of strangers, {} garbage, {} refused, {} beyond limits",
                "ignored",
                thousands(counts.duplicates),
                thousands(counts.gaps),
                thousands(counts.strangers),
                thousands(counts.garbage),
                thousands(counts.refused),
                thousands(counts.beyond_limits),
            ));
        }
        if latency.messages > 0 {
            let ms = |us: u64| us as f64 / 1000.0;
            lines.push(format!(
                "  {:<11} messages came back after p50 {:.2}, p95 {:.2}, p99 {:.2}, at most {:.2} ms ({})",
                "latency",
                ms(latency.p50_us),
                ms(latency.p95_us),
                ms(latency.p99_us),
                ms(latency.max_us),
                thousands(latency.messages),
            ));
        }
        if self.recording.beyond > 0 {
            lines.push(format!(
                "  {:<11} the file has {} bytes more than the session on the server; osp keeps these bytes",
                "beyond",
                thousands(self.recording.beyond)
            ));
        }
        lines.join("\n")
    }
}
