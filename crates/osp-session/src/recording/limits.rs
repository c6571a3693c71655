use std::fmt;
use std::path::PathBuf;

/// Limits of a session's size: a small packed file can claim to be more than fits into memory.
///
/// Everything that costs memory is counted as it is read, before it is kept. A reader that reaches a limit returns the
/// events before it, and then [`RecordingError::Limit`](super::RecordingError::Limit). A lenient reader notes the
/// limit and ends there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most polygons, counted before they are made. A sample of a ribbon or wall counts as one, of a tube as eight, a
    /// face as the number of its corners less two. (A bent quad becomes two, so there may be up to twice as many.)
    pub polygons: u64,
    /// Most bytes that each byte of a packed file may become, beyond [`Limits::FREE_BYTES`]. Drawings by hand pack to
    /// a third or a fifth; data that pack to a hundredth are repetitions.
    pub unpacking: u64,
}

impl Limits {
    /// The limits of [`OpenOptions::default`](super::OpenOptions::default).
    pub const DEFAULT: Self = Self { polygons: 4_000_000, unpacking: 32 };
    /// Bytes that any packed file may become.
    pub const FREE_BYTES: u64 = 1 << 20;

    /// Most strokes, and most groupings: a quarter of [`Limits::polygons`].
    pub fn strokes(&self) -> u64 {
        self.polygons / 4
    }

    /// Most events: four times [`Limits::polygons`]. Each stroke that an edit names counts as one more.
    pub fn events(&self) -> u64 {
        self.polygons.saturating_mul(4)
    }

    /// Most frames at the recorded pace: half of [`Limits::polygons`], six hours at 90 frames a second. A replay
    /// stores the cost of each frame.
    pub fn frames(&self) -> u64 {
        self.polygons / 2
    }

    /// Most bytes of a file that has to be held whole: four times [`Limits::polygons`].
    pub fn whole_bytes(&self) -> u64 {
        self.polygons.saturating_mul(4)
    }

    /// Most bytes that so many packed ones may become.
    pub fn unpacked_bytes(&self, packed: u64) -> u64 {
        packed.saturating_mul(self.unpacking).saturating_add(Self::FREE_BYTES)
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// A reader's position in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// Unknown, or the file as a whole.
    #[default]
    File,
    /// The line read last, from 1.
    Line(u64),
    /// The byte to be read next, from 0.
    Byte(u64),
}

/// The text that follows a file's name in a message.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// A session that exceeds one of the [`Limits`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excess {
    /// The file.
    pub path: PathBuf,
    /// Position in the file.
    pub place: Place,
    /// The limit.
    pub most: u64,
    /// Name of the things that the limit counts.
    pub what: String,
    /// The option of `osp` that raises it.
    pub option: &'static str,
    /// Amount read up to there, if that is known.
    pub read: Option<String>,
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, place, most, what, option, read } = self;
        write!(
            f,
            "{}{place}: expected at most {most} {what} ({option} allows more); found more",
            path.display()
        )?;
        read.iter().try_for_each(|read| write!(f, "; read before: {read}"))
    }
}
