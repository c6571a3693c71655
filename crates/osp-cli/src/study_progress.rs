//! How far a study is: a bar on a terminal, a line a minute elsewhere.

use std::{
    io::IsTerminal,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use indicatif::{HumanDuration, ProgressBar};

use super::{output::complain, progress};
use osp_lab::study::WorkFolder;

/// Time between two lines where no bar can be drawn.
const BETWEEN_LINES: Duration = Duration::from_secs(60);

/// The state of a piece of work.
pub(super) struct StudyProgress {
    what: &'static str,
    /// Counts weights, not pieces: the time that is left depends on them.
    bar: ProgressBar,
    is_drawn: bool,
    pieces: std::sync::Arc<AtomicU64>,
    last_line: Mutex<Instant>,
}

impl StudyProgress {
    /// Work of this weight in all.
    pub(super) fn new(what: &'static str, weight: u64) -> Self {
        let is_drawn = std::io::stderr().is_terminal() && weight > 0;
        let bar = progress::bar_like(weight, "{msg} {wide_bar} {percent} %, {eta} left");
        bar.set_message(format!("0 {what}"));
        if is_drawn {
            bar.enable_steady_tick(Duration::from_secs(1));
        }
        Self { what, bar, is_drawn, pieces: std::sync::Arc::default(), last_line: Mutex::new(Instant::now()) }
    }

    /// A piece of this weight is done.
    pub(super) fn done(&self, weight: u64) {
        let pieces = self.pieces.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.inc(weight);
        self.bar.set_message(format!("{pieces} {}", self.what));
        if self.is_drawn {
            return;
        }
        let mut last = self.last_line.lock().unwrap_or_else(PoisonError::into_inner);
        if last.elapsed() >= BETWEEN_LINES {
            *last = Instant::now();
            complain(&format!("{pieces} {}, about {} left", self.what, HumanDuration(self.bar.eta())));
        }
    }

    /// Should a signal end the program, it says what is kept.
    pub(super) fn speak_before_a_signal_ends(&self, folder: &WorkFolder) {
        let (bar, pieces, what) = (self.bar.clone(), std::sync::Arc::clone(&self.pieces), self.what);
        let folder = folder.path().display().to_string();
        osp_session::atomic_file::before_a_signal_ends(Some(Box::new(move || {
            bar.abandon();
            let pieces = pieces.load(Ordering::Relaxed);
            complain(&format!(
                "stopped: {pieces} {what}, kept in {folder}; the same command goes on from there"
            ));
        })));
    }

    /// All is done.
    pub(super) fn end(self) {
        osp_session::atomic_file::before_a_signal_ends(None);
        self.bar.finish_and_clear();
    }
}
