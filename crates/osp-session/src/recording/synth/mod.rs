//! Synthetic sessions: a simulated artist with a hand and a head draws a subject by rules and a seed.
//!
//! Synthetic sessions replace recorded sessions in tests and benchmarks, and can have any length. The hand moves like a
//! human hand (smooth strokes that slow down in bends, tremor, pauses), and the head follows the work at arm's length.
//! Sometimes the artist undoes, erases or moves a stroke. The same seed gives the same events, bit for bit, on every
//! machine: transcendental functions come from [`libm`], everything else is plain `f64` arithmetic.
//!
//! Each file depends only on those before it: `kind`, `random` (numbers), `vector` (rotations), `path` (of a
//! stroke), `hand` (motion along a path), `head`, `artist` (clock, events and edits). At the end of this list, each
//! subject has its own file.

mod artist;
mod brushes;
mod hand;
mod head;
mod kind;
mod path;
mod portrait;
mod random;
mod room;
mod scribble;
mod vector;

pub use kind::SynthKind;

use artist::{Artist, Subject};
use glam::Vec3;

use super::{Event, EventSource, Header, RecordingError, Root, Session};

/// Edge of the modelling volume, metres.
const VOLUME_M: f32 = 4.0;
/// Centre of the modelling volume, 1.5 m above the floor.
const CENTER: Vec3 = Vec3::new(0.0, 1.5, 0.0);

/// Returns a synthetic session of about `polygons` polygons. It ends with the first stroke that reaches this number.
/// Polygons that are later erased or undone also count. Events are generated when they are read, so memory does not
/// grow.
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
    };
    // The session needs no later format, so programs for the first format can read it.
    let root = Some(Root { center: CENTER, size });
    let header = Header { format: 1, root, ..Header::new(kind.name(), source) };
    Session { header, format: "synth", events: Box::new(Synth { artist, subject }) }
}

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
