//! Modelling sessions as streams of [`Event`]s: the recording format, its reader and writer, importers of foreign
//! formats, and synthetic sessions.
//!
//! A recording is text, one RON value a line: a [`Header`], then events. A session that is being drawn is appended
//! line by line, so a crash loses at most the line being written.

mod error;
mod event;
mod pacing;
mod source;

pub use error::RecordingError;
pub use event::{
    Camera, Event, FORMAT_VERSION, GroupId, Header, NormalRule, Root, StrokeId, Tool, Transform,
};
pub use pacing::{Pace, Pacer, ParsePaceError};
pub use source::{EventSource, Notes, Session};
