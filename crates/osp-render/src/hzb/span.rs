//! Parameters of the compute shaders.

use bytemuck::{Pod, Zeroable};

use super::{
    DrawnCounts,
    pyramid::{Levels, MAX_LEVELS},
};

pub(super) const PARAMS_BYTES: u64 = size_of::<Params>() as u64;
/// Distance between two [`Span`]s in their buffer, bytes. No adapter requires a larger alignment of dynamic offsets.
pub(super) const SPAN_STRIDE: u32 = 256;

/// Number of invocations of a workgroup. Each invocation processes one [`Handle`](crate::run::Handle).
pub(super) const LANES: u32 = 256;

/// Number of counters at the beginning of `args`. They count hidden transparent polygons, polygons of the depth pass,
/// and opaque polygons of the colour pass.
pub(super) const COUNTERS: u32 = 3;

/// The input range of one dispatch of a compute shader, and where its results go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Span {
    /// Number of the first item: a cluster mask, a position in the draw list, or a level of the pyramid.
    pub(super) first: u32,
    pub(super) end: u32,
    /// For a page, index in `sums` of its first prefix sum. For a chunk, index in `candidates` of its first candidate.
    pub(super) first_sum: u32,
    pub(super) base: u32,
    /// For a page, index in `args` of its count, in words; its draw calls follow the count. For a chunk, index of its
    /// count in `candidates`.
    pub(super) args: u32,
    pub(super) first_polygon: u32,
    /// Number of draw calls of the page for depth. The page has the same number for colours.
    pub(super) draws: u32,
    pub(super) draw_len: u32,
}

impl Span {
    pub(super) fn len(&self) -> u32 {
        self.end - self.first
    }

    /// Offsets in `args` of the page's first draw call for depth and of its first draw call for colours, bytes.
    pub(super) fn draw_calls(&self) -> [u64; 2] {
        [0, self.draws].map(|before| u64::from(self.args + 1 + before * 5) * 4)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Params {
    levels: [[u32; 4]; MAX_LEVELS],
    width: u32,
    height: u32,
    level_count: u32,
    is_wrong: u32,
}

impl Params {
    /// With `is_wrong`, bounds are too far away: a test must detect it.
    pub(super) fn new((width, height): (u32, u32), levels: &Levels, is_wrong: bool) -> Self {
        Self {
            levels: levels.levels,
            width,
            height,
            level_count: levels.count as u32,
            is_wrong: u32::from(is_wrong),
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

/// A [`Span`] in a uniform buffer, selected by a dynamic offset.
pub(super) fn binding() -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: true,
        min_binding_size: wgpu::BufferSize::new(size_of::<Span>() as u64),
    }
}

/// Yields each span with its offset in the buffer, bytes. `first` is the offset of the first span.
pub(super) fn with_offsets(spans: &[Span], first: u32) -> impl Iterator<Item = (&Span, u32)> {
    spans.iter().enumerate().map(move |(i, span)| (span, first + i as u32 * SPAN_STRIDE))
}
