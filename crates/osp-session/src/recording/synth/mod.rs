//! Synthetic sessions: an artist with a hand, a head and a subject, drawn by rules from a seed.
//!
//! They replace recorded sessions where there are none, and can have any length. The hand moves as hands do
//! (smooth strokes that slow down in bends, tremor, pauses), the head follows the work at arm's length and walks, and
//! now and then something is undone, erased or moved. The same seed gives the same events, bit for bit, on every
//! machine: transcendental functions come from [`libm`], everything else is plain `f64` arithmetic.
//!
//! The files, each knowing those before it: `random` (numbers), `vector` (rotations), `path` (where a stroke goes),
//! `hand` (how the hand follows it), `head`, `artist` (clock, events and edits), and a file for each subject.

mod artist;
mod brushes;
mod class;
mod hand;
mod head;
mod path;
mod portrait;
mod random;
mod room;
mod scribble;
mod vector;

use std::fmt;
use std::str::FromStr;

use artist::{Artist, Subject};
use glam::Vec3;
use thiserror::Error;

use super::{AUTHORS_FORMAT, Event, EventSource, Header, RecordingError, Root, Session};

/// The kinds of synthetic sessions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SynthKind {
    /// A bust, larger than life: dense small strokes in thin layers; the artist walks around it.
    Portrait,
    /// Rooms with walls, furniture and decoration; the artist walks from room to room.
    Room,
    /// Long loose strokes that fill the whole 4 m volume.
    Scribble,
    /// A card of samples: a wave of each brush, in rows.
    Brushes,
    /// Several artists scribble in one volume at once.
    Class,
}

impl SynthKind {
    /// Every kind.
    pub const ALL: [Self; 5] = [Self::Portrait, Self::Room, Self::Scribble, Self::Brushes, Self::Class];

    /// How many artists there are in [`SynthKind::Class`], unless it is said.
    pub const CLASS_AUTHORS: u32 = 3;

    /// Most artists that there can be in it.
    pub const MOST_AUTHORS: u32 = class::Class::MOST;

    /// The kinds that an artist draws, with a hand, a head and second thoughts.
    pub const DRAWN_BY_ARTISTS: [Self; 3] = [Self::Portrait, Self::Room, Self::Scribble];

    /// The kind's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portrait => "portrait",
            Self::Room => "room",
            Self::Scribble => "scribble",
            Self::Brushes => "brushes",
            Self::Class => "class",
        }
    }
}

impl fmt::Display for SynthKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A kind that is none.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("expected portrait, room, scribble, brushes or class; found `{0}`")]
pub struct ParseSynthKindError(String);

impl FromStr for SynthKind {
    type Err = ParseSynthKindError;

    fn from_str(text: &str) -> Result<Self, ParseSynthKindError> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == text)
            .ok_or_else(|| ParseSynthKindError(text.to_owned()))
    }
}

/// A synthetic session of about `polygons` polygons: it ends with the first stroke that reaches the number. Polygons
/// that are erased or undone later count, too. Events are made as they are asked for; memory does not grow.
pub fn synthesize(kind: SynthKind, polygons: u32, seed: u64) -> Session {
    let source = format!("osp synth {kind} --polygons {polygons} --seed {seed}");
    let mut artist = Artist::new(polygons, seed);
    let (subject, size): (Box<dyn Subject>, f32) = match kind {
        SynthKind::Portrait => (Box::new(portrait::Portrait::new(&mut artist)), VOLUME_M),
        SynthKind::Room => {
            let rooms = room::Rooms::new(&mut artist);
            let size = rooms.root_size_m();
            (Box::new(rooms), size)
        }
        SynthKind::Scribble => (Box::new(scribble::Scribble::new(&mut artist)), VOLUME_M),
        SynthKind::Brushes => {
            let card = brushes::Brushes::new(polygons, seed);
            return Session { header: card.header(source), format: "synth", events: Box::new(card) };
        }
        SynthKind::Class => return synthesize_class(SynthKind::CLASS_AUTHORS, polygons, seed),
    };
    // Nothing in it came with a later format, so programs of the first can read it.
    let root = Some(Root { center: CENTER, size });
    let header = Header { format: 1, root, ..Header::new(kind.name(), source) };
    Session { header, format: "synth", events: Box::new(Synth { artist, subject }) }
}

/// A session of [`SynthKind::Class`] with so many artists, of whom each draws a part of the polygons.
pub fn synthesize_class(authors: u32, polygons: u32, seed: u64) -> Session {
    let authors = authors.clamp(1, SynthKind::MOST_AUTHORS);
    let kind = SynthKind::Class;
    let source = format!("osp synth {kind} --authors {authors} --polygons {polygons} --seed {seed}");
    let root = Some(Root { center: CENTER, size: VOLUME_M });
    let header = Header { format: AUTHORS_FORMAT, root, ..Header::new(kind.name(), source) };
    Session { header, format: "synth", events: Box::new(class::Class::new(authors, polygons, seed)) }
}

/// Edge of the modelling volume, metres.
const VOLUME_M: f32 = 4.0;

/// Centre of the modelling volume: between knee and hand at full stretch.
const CENTER: Vec3 = Vec3::new(0.0, 1.5, 0.0);

struct Synth {
    artist: Artist,
    subject: Box<dyn Subject>,
}

impl EventSource for Synth {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        loop {
            if let Some(event) = self.artist.next_event() {
                return Ok(Some(event));
            }
            if self.artist.has_finished() {
                return Ok(None);
            }
            self.subject.work(&mut self.artist);
        }
    }
}
