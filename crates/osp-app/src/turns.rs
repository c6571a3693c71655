//! Turns of work between frames.

use std::time::Duration;

use osp_session::platform::time::Instant;

/// A turn between slow frames is at most so many times as long.
const MOST_TURNS: u32 = 8;

/// How long something is worked on at a time.
#[derive(Debug, Default)]
pub(crate) struct Turns {
    least: Duration,
    /// When the last turn ended.
    ended: Option<Instant>,
}

impl Turns {
    /// Turns that last so long at least.
    pub(crate) fn of(least: Duration) -> Self {
        Self { least, ended: None }
    }

    /// Takes so long at least from now on.
    #[cfg(feature = "live")]
    pub(crate) fn set_least(&mut self, least: Duration) {
        self.least = least;
    }

    /// A turn has ended.
    pub(crate) fn end(&mut self) {
        self.ended = Some(Instant::now());
    }

    /// As long as the frame before took: where frames are slow, the session is not to wait for all of them.
    pub(crate) fn next(&self, now: Instant) -> Duration {
        let frame = self.ended.map_or(Duration::ZERO, |ended| now.saturating_duration_since(ended));
        frame.clamp(self.least, self.least * MOST_TURNS)
    }
}
