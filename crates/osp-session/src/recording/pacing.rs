use std::str::FromStr;

use thiserror::Error;

use super::{Event, RecordingError};

/// Number of events in a frame of a replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// By time stamps, at [`Pace::FRAMES_A_SECOND`]; pauses are cut to [`Pace::LONGEST_PAUSE_SECS`].
    Recorded,
    /// This many samples of the hand a frame, whatever the time stamps are. The paper reads one sample a frame.
    Samples(u32),
}

impl Pace {
    /// Frames a second of [`Pace::Recorded`]: the rate of common headsets.
    pub const FRAMES_A_SECOND: f64 = 90.0;
    /// Most events of a frame, so that a frame's memory does not grow with a file that has no samples.
    pub const MOST_EVENTS: usize = 4096;
    /// Longest pause of a replay, seconds: real sketches pause for hours, and longer pauses are cut to it.
    pub const LONGEST_PAUSE_SECS: f64 = 1.0;
}

/// Error of a text that names no pace.
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

/// Cuts a stream of events into frames, in the order of the file.
#[derive(Debug)]
pub struct Pacer<I> {
    events: I,
    pace: Pace,
    /// Event that was read but belongs to a later frame.
    next: Option<Event>,
    frame_end_secs: Option<f64>,
    last_secs: f64,
    ended: bool,
}

impl<I: Iterator<Item = Result<Event, RecordingError>>> Pacer<I> {
    /// A pacer over a session's events.
    pub fn new(events: I, pace: Pace) -> Self {
        Self { events, pace, next: None, frame_end_secs: None, last_secs: 0.0, ended: false }
    }

    /// The session's events that are not read yet.
    pub fn into_events(self) -> I {
        self.events
    }

    /// Replaces `frame` by the events of the next frame. `false`: there is no further frame.
    ///
    /// # Errors
    /// The recording is damaged; the events before the damage are in `frame`, and the next call ends the replay.
    pub fn next_frame(&mut self, frame: &mut Vec<Event>) -> Result<bool, RecordingError> {
        frame.clear();
        let mut samples = 0;
        if let Some(end) = &mut self.frame_end_secs {
            // Stamps may be so large that a frame is below their precision: the clock still has to advance.
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
            if self.is_due(&event, samples, frame.len()) {
                samples += u32::from(event.is_sample());
                self.last_secs = event.time_secs();
                frame.push(event);
            } else {
                self.next = Some(event);
                return Ok(true);
            }
        }
        Ok(!frame.is_empty())
    }

    fn is_due(&mut self, event: &Event, samples: u32, events: usize) -> bool {
        match self.pace {
            Pace::Samples(n) => !(event.is_sample() && samples >= n) && events < Pace::MOST_EVENTS,
            Pace::Recorded => {
                let t = event.time_secs();
                let end = self.frame_end_secs.get_or_insert(t);
                // Time may run backwards: then the clock goes back too. A long pause is cut short.
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
