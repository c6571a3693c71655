use std::fmt;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SynthKind {
    /// A bust, larger than life: dense small strokes in thin layers. The artist walks around it.
    Portrait,
    /// Rooms with walls, furniture and decoration. The artist walks from room to room.
    Room,
    /// Long loose strokes that fill the whole 4 m volume.
    Scribble,
    /// A sample sheet: a wave of each brush, in rows.
    Brushes,
}

impl SynthKind {
    pub const ALL: [Self; 4] = [Self::Portrait, Self::Room, Self::Scribble, Self::Brushes];

    pub fn name(self) -> &'static str {
        match self {
            Self::Portrait => "portrait",
            Self::Room => "room",
            Self::Scribble => "scribble",
            Self::Brushes => "brushes",
        }
    }
}

impl fmt::Display for SynthKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
