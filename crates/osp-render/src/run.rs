//! Runs of the draw list, and clusters of polygons.

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use osp::polygon::{PolygonId, bits};

/// The blending of polygons with the background.
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

/// A part of the draw list with one page, style and blending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Positions in [`DrawOrder::ids`](super::DrawOrder::ids), or polygon numbers.
    pub range: Range<u32>,
    /// Whether `range` has positions in the list. If not, it has polygon numbers, and the polygons whose bit is set in
    /// [`DrawOrder::span_bits`](super::DrawOrder::span_bits) are drawn.
    pub is_listed: bool,
    /// Page of the scene's polygons. The page begins at polygon number `page` times the page's length.
    pub page: u32,
    /// Number of the style.
    pub style: u32,
    /// Blending.
    pub blend: Blend,
}

impl Run {
    /// The positions to draw. Positions of a listed run count from `first`, polygon numbers of another run from `all_from`.
    pub(super) fn places(&self, first: u32, all_from: u32) -> Range<u32> {
        let from = if self.is_listed { first } else { all_from };
        from + self.range.start..from + self.range.end
    }
}

/// Number of consecutive polygons that are culled together on the GPU.
pub(super) const CLUSTER: usize = 64;

/// The opaque polygons of one cluster that are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Handle {
    /// Number of the cluster; its first polygon is [`CLUSTER`] times this.
    pub(super) cluster: u32,
    /// Mask of the polygons to draw: the lower 32 bits, then the upper 32 bits.
    pub(super) mask: [u32; 2],
}

impl Handle {
    pub(super) fn new(first: usize, bits: u64) -> Self {
        Self { cluster: (first / CLUSTER) as u32, mask: [bits as u32, (bits >> 32) as u32] }
    }

    /// A bit for each polygon, from the lowest number on.
    pub(super) fn bits(&self) -> u64 {
        u64::from(self.mask[0]) | u64::from(self.mask[1]) << 32
    }

    /// The polygons in the order of numbers.
    pub(super) fn ids(&self) -> impl Iterator<Item = PolygonId> + use<> {
        let first = self.cluster * CLUSTER as u32;
        bits::bits_of(self.bits()).map(move |bit| PolygonId(first + bit as u32))
    }
}

/// Handles of one page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct HandleRun {
    /// Range in [`DrawOrder::handles`](super::DrawOrder::handles).
    pub(super) range: Range<u32>,
    /// The page.
    pub(super) page: u32,
    /// Number of polygons in these handles.
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
