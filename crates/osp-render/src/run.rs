//! Runs of the draw list, and clusters of polygons.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use osp::polygon::{PolygonId, bits};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// The polygons hide the background, except where a brush cuts holes.
    Opaque,
    /// The polygons' light is added to the background.
    Additive,
    /// The background shines through the polygons.
    Transparent,
}

/// The blending of 64 polygons, a bit each. Polygons in neither mask are opaque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Classes {
    /// Polygons that the background shines through.
    pub transparent: u64,
    /// Polygons whose light is added to the background.
    pub additive: u64,
}

/// A part of the draw list whose polygons have the same page, style and blending. A page is a part of the scene's GPU
/// memory that one bind group binds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Positions in [`DrawOrder::ids`](super::DrawOrder::ids) if `is_listed`, else polygon numbers.
    pub range: Range<u32>,
    /// Whether `range` has positions. If not, a polygon in `range` is drawn if its bit is set in
    /// [`DrawOrder::span_bits`](super::DrawOrder::span_bits).
    pub is_listed: bool,
    /// Number of the page. It begins at polygon number `page` times the page's length.
    pub page: u32,
    pub style: u32,
    pub blend: Blend,
}

impl Run {
    /// The positions to draw: `first` is added to positions of a listed run, and `all_from` to polygon numbers of
    /// another run.
    pub(super) fn places(&self, first: u32, all_from: u32) -> Range<u32> {
        let from = if self.is_listed { first } else { all_from };
        from + self.range.start..from + self.range.end
    }
}

/// Number of consecutive polygons that are culled together on the GPU.
pub(super) const CLUSTER: usize = 64;

/// A mask of the opaque polygons to draw in one cluster.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Handle {
    /// Number of the cluster. Its first polygon has [`CLUSTER`] times this number.
    pub(super) cluster: u32,
    /// Mask of the polygons to draw: the lower 32 bits, then the upper 32 bits.
    pub(super) mask: [u32; 2],
}

impl Handle {
    pub(super) fn new(first: usize, bits: u64) -> Self {
        Self { cluster: (first / CLUSTER) as u32, mask: [bits as u32, (bits >> 32) as u32] }
    }

    /// The mask as one word. The lowest bit is the polygon with the lowest number.
    pub(super) fn bits(&self) -> u64 {
        u64::from(self.mask[0]) | u64::from(self.mask[1]) << 32
    }

    /// The polygons of the mask, in ascending order.
    pub(super) fn ids(&self) -> impl Iterator<Item = PolygonId> + use<> {
        let first = self.cluster * CLUSTER as u32;
        bits::bits_of(self.bits()).map(move |bit| PolygonId(first + bit as u32))
    }
}

/// The cluster masks whose polygons lie in one page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct HandleRun {
    pub(super) range: Range<u32>,
    pub(super) page: u32,
    pub(super) polygons: u32,
}

/// Appends a polygon to the list, to the last run if page, style and blending are the same.
pub(super) fn push(
    ids: &mut Vec<PolygonId>,
    runs: &mut Vec<Run>,
    page_len: usize,
    id: PolygonId,
    style: u32,
    blend: Blend,
) {
    let page = id.0 / page_len as u32;
    let at = ids.len() as u32;
    ids.push(id);
    match runs.last_mut() {
        Some(run) if run.blend == blend && run.page == page && run.style == style => run.range.end = at + 1,
        _ => runs.push(Run { range: at..at + 1, is_listed: true, page, style, blend }),
    }
}
