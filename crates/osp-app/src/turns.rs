//! Turns: slices of time for work between frames.

use std::time::Duration;

use osp_session::platform::time::Instant;

/// Largest duration of a turn, as a multiple of the smallest duration.
const MOST_TURNS: u32 = 8;

/// Chooses the durations of turns.
#[derive(Debug)]
pub(crate) struct Turns {
    least: Duration,
    ended: Option<Instant>,
}

impl Turns {
    /// Turns of at least this duration.
    pub(crate) fn of(least: Duration) -> Self {
        Self { least, ended: None }
    }

    pub(crate) fn end(&mut self) {
        self.ended = Some(Instant::now());
    }

    /// Returns the duration of the next turn, which is the duration of the last frame, within limits. So slow frames
    /// have long turns.
    pub(crate) fn next(&self, now: Instant) -> Duration {
        let frame = self.ended.map_or(Duration::ZERO, |ended| now.saturating_duration_since(ended));
        frame.clamp(self.least, self.least * MOST_TURNS)
    }
}
