//! Modelling sessions as streams of [`Event`]s: the recording format, its reader and writer, importers of foreign
//! formats, and synthetic sessions.
//!
//! A recording is text, one RON value per line: a [`Header`], then events. A session that is being drawn is written
//! line by line, so a crash loses at most the last line.
//!
//! A recording may have several [`Author`]s. Each event contains its author, or the number of a stroke, which contains
//! the author's number. A [`Reducer`] makes one session from the messages of several senders.
//!
//! Depends on [`math`](osp::math); the importers use the names of [`brush`](crate::brush)es.

mod alteration;
mod author;
mod environment;
mod error;
mod event;
mod header;
pub mod import;
mod input;
mod limited;
mod limits;
mod members;
mod open_options;
mod opening;
mod pacing;
mod reducer;
mod ron_camera;
mod ron_file;
mod ron_line;
mod ron_reader;
mod ron_scan;
mod ron_writer;
mod session;
mod sketch_extensions;
mod source;
mod synth;
mod tally;
mod unknown_brushes;
mod unpacked;

pub use alteration::{Alteration, Motion};
pub use author::{Author, GroupId, StrokeId};
pub use environment::Environment;
pub use error::RecordingError;
pub use event::{
    AUTHORS_FORMAT, Event, FORMAT_VERSION, MAX_LINE_BYTES, NormalRule, ONE_AUTHOR_FORMAT, Paint, Shading,
    Tool, Transform,
};
pub use header::{Camera, Header, Layer, Root};
pub use input::MemoryFiles;
pub use limits::{Excess, Limits, Place};
pub use open_options::{OpenOptions, Up, unit_m};
pub use opening::{is_pipe, looks_like_session, open, open_bytes, open_ron};
pub use pacing::{Pace, Pacer, ParsePaceError};
pub use reducer::{Message, Reduced, Reducer, Sender};
pub use ron_file::{LastLine, RecordingFile};
pub use ron_line::{push_event, read_event};
pub use ron_reader::RonReader;
pub use ron_writer::{Flush, RonWriter};
pub use session::Session;
pub use sketch_extensions::SketchExtensions;
pub use source::{EventSource, Notes};
pub use synth::{SynthKind, synthesize};
pub use tally::Tally;
