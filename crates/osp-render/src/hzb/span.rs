//! Parameters of the compute shaders.

use bytemuck::{Pod, Zeroable};

use super::{
    DrawnCounts, HzbBound, HzbConfig, HzbFine,
    pyramid::{Levels, MAX_LEVELS},
};

/// Size of a [`Span`], bytes.
pub(super) const SPAN_BYTES: u64 = size_of::<Span>() as u64;
/// Size of [`Params`], bytes.
pub(super) const PARAMS_BYTES: u64 = size_of::<Params>() as u64;
/// Distance between spans in their buffer, bytes. No adapter requires a larger alignment.
pub(super) const SPAN_STRIDE: u32 = 256;

/// Number of words of `args` before the words of the first page. These counters have the number of hidden transparent
/// polygons, polygons of the depth pass, and opaque polygons of the colour pass.
pub(super) const COUNTERS: u32 = 3;

/// The work of one dispatch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Span {
    /// Number of the first item: a handle, a position in the list, or a level of the pyramid.
    pub(super) first: u32,
    pub(super) end: u32,
    /// Index in `sums` for a page, or in `candidates` for the list of a chunk.
    pub(super) first_sum: u32,
    pub(super) base: u32,
    /// Index in the words of `args` of the page's count, which the page's draw calls follow. For a chunk, index of its
    /// count in `candidates`.
    pub(super) args: u32,
    pub(super) first_polygon: u32,
    /// Number of draw calls of the page for depth; the page has as many for colours.
    pub(super) draws: u32,
    /// Largest number of polygons of a draw call.
    pub(super) draw_len: u32,
}

impl Span {
    pub(super) fn len(&self) -> u32 {
        self.end - self.first
    }

    /// Offsets of the page's draw calls in `args`, bytes, first for depth, then for colours.
    pub(super) fn draw_calls(&self) -> [u64; 2] {
        [0, self.draws].map(|before| u64::from(self.args + 1 + before * 5) * 4)
    }
}

/// Parameters of all dispatches of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Params {
    levels: [[u32; 4]; MAX_LEVELS],
    width: u32,
    height: u32,
    level_count: u32,
    group: u32,
    bound: u32,
    is_fine: u32,
    nothing: [u32; 2],
}

impl Params {
    pub(super) fn new((width, height): (u32, u32), levels: &Levels, config: HzbConfig) -> Self {
        Self {
            levels: levels.words(),
            width,
            height,
            level_count: levels.count() as u32,
            group: config.group.polygons(),
            bound: match config.bound {
                HzbBound::Corners => 0,
                HzbBound::Box => 1,
                #[cfg(test)]
                HzbBound::Farthest => 2,
            },
            is_fine: u32::from(config.fine == HzbFine::Triangles),
            nothing: [0; 2],
        }
    }
}

/// The counts of a frame, from the shaders' results in `args` and the CPU's own counts.
pub(super) fn counts(args: &[u8], known: DrawnCounts, transparent: u64) -> DrawnCounts {
    let word = |at: usize| {
        let bytes = args.get(at * 4..at * 4 + 4).and_then(|bytes| bytes.try_into().ok());
        u64::from(bytes.map_or(0, u32::from_le_bytes))
    };
    let drawn_transparent = transparent - word(0).min(transparent);
    DrawnCounts { first_pass: word(1), second_pass: drawn_transparent + word(2), ..known }
}

/// Each span with its offset in the buffer, bytes.
pub(super) fn with_offsets(spans: &[Span], first: u32) -> impl Iterator<Item = (&Span, u32)> {
    spans.iter().enumerate().map(move |(i, span)| (span, first + i as u32 * SPAN_STRIDE))
}
