use std::fmt;
use std::path::PathBuf;

/// Limits of a session's size, because a small compressed file can expand to more than fits into memory.
///
/// Everything that takes memory is counted before it is stored. A reader returns the events before a limit is exceeded,
/// and then [`RecordingError::Limit`](super::RecordingError::Limit). A lenient reader ends with a warning instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest number of polygons, counted before they are created. A sample of a ribbon or wall counts as one, a
    /// sample of a tube as eight. A face counts as the number of its corners minus two. Quads that are not flat become
    /// two polygons, so a session may have up to twice this number.
    pub polygons: u64,
    /// Largest ratio of decompressed to compressed bytes. It does not apply to the first [`Limits::FREE_BYTES`].
    /// Compression shrinks hand drawings to a third or a fifth.
    pub unpacking: u64,
}

impl Limits {
    pub const DEFAULT: Self = Self { polygons: 4_000_000, unpacking: 32 };
    /// Number of bytes to which any compressed file may expand.
    pub const FREE_BYTES: u64 = 1 << 20;

    /// Largest number of strokes, and of groupings: a quarter of [`Limits::polygons`].
    pub fn strokes(&self) -> u64 {
        self.polygons / 4
    }

    /// Largest number of events: four times [`Limits::polygons`]. Each stroke that an edit lists counts as a further
    /// event.
    pub fn events(&self) -> u64 {
        self.polygons.saturating_mul(4)
    }

    /// Largest number of frames at the recorded pace: half of [`Limits::polygons`], six hours at 90 frames a second. A
    /// replay stores the cost of each frame.
    pub fn frames(&self) -> u64 {
        self.polygons / 2
    }

    /// Largest size of a file whose format requires the whole file in memory, bytes: four times [`Limits::polygons`].
    pub fn whole_bytes(&self) -> u64 {
        self.polygons.saturating_mul(4)
    }

    /// Largest number of bytes that are read from a pipe: 128 times [`Limits::polygons`]. A sample of a recording has up to
    /// 128 bytes.
    pub fn piped_bytes(&self) -> u64 {
        self.polygons.saturating_mul(128).max(Self::FREE_BYTES)
    }

    /// Largest decompressed size of a file of `packed` compressed bytes, bytes.
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
    /// The whole file, or an unknown position.
    #[default]
    File,
    /// Number of the current line, from 1.
    Line(u64),
    /// Offset of the next byte, from 0.
    Byte(u64),
}

/// The position as text that follows a file's name in a message.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excess {
    pub path: PathBuf,
    /// Position in the file at which the limit was exceeded.
    pub place: Place,
    pub most: u64,
    /// Name of what the limit counts, such as `polygons`.
    pub what: String,
    /// The option of `osp` that raises the limit.
    pub option: &'static str,
    /// The amounts read so far, if they are available.
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
