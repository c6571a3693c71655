use std::str::FromStr;

use thiserror::Error;

use super::{Event, RecordingError};

/// The rule that divides a session's events into the frames of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Frames follow the time stamps, at [`Pace::FRAMES_A_SECOND`]. Longer pauses are shortened to
    /// [`Pace::LONGEST_PAUSE_SECS`].
    Recorded,
    /// Each frame has this number of samples of the hand, whatever their time stamps. The paper reads one sample per
    /// frame.
    Samples(u32),
}

impl Pace {
    /// Frame rate of [`Pace::Recorded`] in Hz: the rate of common headsets.
    pub const FRAMES_A_SECOND: f64 = 90.0;
    /// Largest number of events of a frame, so that a frame's memory is bounded even for a file without samples.
    pub const MOST_EVENTS: usize = 4096;
    /// Longest pause of a replay, seconds; longer pauses are shortened. Real sketches have pauses of hours.
    pub const LONGEST_PAUSE_SECS: f64 = 1.0;
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("expected `recorded` or `samples:N` with N of 1 or more; found `{0}`")]
pub struct ParsePaceError(String);

impl FromStr for Pace {
    type Err = ParsePaceError;

    fn from_str(text: &str) -> Result<Self, ParsePaceError> {
        let samples = text.strip_prefix("samples:").and_then(|n| n.parse::<u32>().ok()).filter(|&n| n > 0);
        match (text, samples) {
            ("recorded", _) => Ok(Self::Recorded),
            (_, Some(n)) => Ok(Self::Samples(n)),
            _ => Err(ParsePaceError(text.to_owned())),
        }
    }
}

impl std::fmt::Display for Pace {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Recorded => f.write_str("recorded"),
            Self::Samples(n) => write!(f, "samples:{n}"),
        }
    }
}

/// Divides a stream of events into frames, in the order of the file.
#[derive(Debug)]
pub struct Pacer<I> {
    events: I,
    pace: Pace,
    /// An event that was read but belongs to a later frame.
    next: Option<Event>,
    frame_end_secs: Option<f64>,
    last_secs: f64,
    ended: bool,
}

impl<I: Iterator<Item = Result<Event, RecordingError>>> Pacer<I> {
    pub fn new(events: I, pace: Pace) -> Self {
        Self { events, pace, next: None, frame_end_secs: None, last_secs: 0.0, ended: false }
    }

    pub fn into_events(self) -> I {
        self.events
    }

    /// Replaces `frame` by the events of the next frame. Returns `false` after the last frame.
    ///
    /// # Errors
    /// The recording is damaged. `frame` has the events before the damage, and the next call ends the replay.
    pub fn next_frame(&mut self, frame: &mut Vec<Event>) -> Result<bool, RecordingError> {
        frame.clear();
        self.extend_frame(frame)
    }

    /// Does the same as [`Pacer::next_frame`], but appends the events to `frame`.
    pub(crate) fn extend_frame(&mut self, frame: &mut Vec<Event>) -> Result<bool, RecordingError> {
        let (mut samples, first) = (0, frame.len());
        if let Some(end) = &mut self.frame_end_secs {
            // The clock must advance even if a frame is shorter than the rounding error of large time stamps.
            *end = (*end + 1.0 / Pace::FRAMES_A_SECOND).max(end.next_up());
        }
        while !self.ended {
            let event = match self.next.take().map(Ok).or_else(|| self.events.next()) {
                None => {
                    self.ended = true;
                    break;
                }
                Some(Err(error)) => {
                    self.ended = true;
                    return Err(error);
                }
                Some(Ok(event)) => event,
            };
            if self.is_due(&event, samples, frame.len() - first) {
                samples += u32::from(event.is_sample());
                self.last_secs = event.time_secs();
                frame.push(event);
            } else {
                self.next = Some(event);
                return Ok(true);
            }
        }
        Ok(frame.len() > first)
    }

    fn is_due(&mut self, event: &Event, samples: u32, events: usize) -> bool {
        match self.pace {
            Pace::Samples(n) => !(event.is_sample() && samples >= n) && events < Pace::MOST_EVENTS,
            Pace::Recorded => {
                let t = event.time_secs();
                let end = self.frame_end_secs.get_or_insert(t);
                // If time stamps decrease, the clock is set back. A long pause is shortened.
                if t < self.last_secs {
                    *end = t;
                } else if t > *end + Pace::LONGEST_PAUSE_SECS {
                    *end = t - Pace::LONGEST_PAUSE_SECS;
                }
                t <= *end
            }
        }
    }
}
