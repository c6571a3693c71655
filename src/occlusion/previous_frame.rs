//! Previous-frame occluders: the polygons that were visible in the last frame are filled into a software depth buffer and
//! occlude in this one. For machines without a usable GPU.
//!
//! What hides in a painting is not a few large polygons but thousands of small ones together. Those that were drawn in the
//! last frame are most of what is visible in this one (temporal coherence, as in N. Greene, M. Kass, G. Miller,
//! "Hierarchical Z-Buffer Visibility", 1993); they are only a guess at good occluders, so moves, new strokes and sudden
//! turns need no care: every occluder is part of the model as it is now.
//!
//! The buffer counts only pixels that an occluder covers wholly, so that nothing visible
//! is culled. Edges between neighbours in a ribbon would stay open by it: each two neighbours that share an edge are
//! filled in as one outline, too, where that is convex.

use glam::Vec3;

use super::{DepthBuffer, DepthConfig, Extent, OcclusionCuller, ShadowVolume, Verdict, pair::shadow_of_pair};
use crate::{
    polygon::{ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
    view::ViewWindow,
};

/// Polygons with neighbouring numbers that are tested as one first.
const GROUP: usize = 4;

/// Outlines that fill fewer pixels of the buffer hide next to nothing: few of those pixels lie in them wholly.
const LEAST_PX: f64 = 8.0;

/// What [`PreviousFrameOccluders::cull`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PreviousFrameCounts {
    /// Outlines filled.
    pub occluders: u64,
    /// Tiles of the buffer that are covered at least partly.
    pub tiles: u64,
    /// Groups and polygons tested.
    pub tests: u64,
}

impl PreviousFrameCounts {
    /// About the time of that, nanoseconds, estimated from the counts: the same on every machine. Measured like [`super::work_ns`].
    pub fn work_ns(&self) -> f64 {
        self.occluders as f64 * 1200.0 + self.tests as f64 * 120.0
    }
}

/// Previous-frame occluders: the polygons that were visible in the last frame are filled into a software depth buffer and
/// occlude in this one. For models of many small polygons, and machines without a usable GPU.
#[derive(Clone, Debug)]
pub struct PreviousFrameOccluders {
    depth: DepthBuffer,
    shadows: Vec<ShadowVolume>,
    /// By view the polygons that were drawn in the last frame.
    drawn: Vec<VisibleBlocks>,
}

impl PreviousFrameOccluders {
    /// Most outlines that are filled for a view in a frame.
    pub const MOST_OUTLINES: usize = 1 << 16;

    /// Culling that has seen nothing yet, with room for a scene of so many polygons (and, for the outlines of a frame, up
    /// to 28 MB).
    pub fn new(depth: DepthConfig, polygons: usize) -> Self {
        Self::with_buffer(DepthBuffer::new(depth), polygons)
    }

    /// The same with a buffer of the caller's own.
    pub fn with_buffer(mut depth: DepthBuffer, polygons: usize) -> Self {
        let shadows = polygons.saturating_mul(2).saturating_add(4).min(Self::MOST_OUTLINES);
        depth.reserve(shadows);
        let drawn = vec![VisibleBlocks::with_capacity(polygons)];
        Self { depth, shadows: Vec::with_capacity(shadows), drawn }
    }

    fn drawn_in(&mut self, view: usize) -> &mut VisibleBlocks {
        if self.drawn.len() <= view {
            self.drawn.resize_with(view + 1, VisibleBlocks::new);
        }
        &mut self.drawn[view]
    }

    /// Treats everything in view as visible in the last frame of view number `view`.
    pub fn begin(&mut self, view: usize, in_view: &VisibleBlocks) {
        self.drawn_in(view).copy_from(in_view);
    }

    /// Fills the buffer for view number `view` with those polygons in view that were drawn in the last frame.
    pub fn build(
        &mut self,
        view: usize,
        geometry: &dyn Geometry,
        window: &ViewWindow,
        in_view: &VisibleBlocks,
    ) -> PreviousFrameCounts {
        self.drawn_in(view);
        let known = &self.drawn[view];
        let pixels_of = self.depth.area_in_pixels(window);
        self.shadows.clear();
        // The one before, if the next number is a neighbour.
        let mut before: Option<(PolygonId, ConvexPolygon, f64)> = None;
        for id in in_view.ids() {
            if self.shadows.len() + 4 > Self::MOST_OUTLINES {
                break;
            }
            let last = before.take();
            let Some(polygon) = known.contains(id).then(|| geometry.occluder(id)).flatten() else { continue };
            let area_px = pixels_of(&polygon);
            if area_px >= LEAST_PX {
                ShadowVolume::push_polygon(polygon.vertices(), window, &mut self.shadows);
            }
            if let Some((_, last, last_px)) = last.filter(|(last, ..)| last.0 + 1 == id.0)
                && last_px + area_px >= LEAST_PX
            {
                self.shadows.extend(shadow_of_pair(&last, &polygon, window));
            }
            before = Some((id, polygon, area_px));
        }
        let counts = self.depth.build(window, &self.shadows);
        PreviousFrameCounts { occluders: self.shadows.len() as u64, tiles: u64::from(counts.nodes), tests: 0 }
    }

    /// Appends to `drawn` those of the polygons in view that the buffer does not hide, and remembers them for the next
    /// frame of this view. The buffer has been built for it.
    pub fn cull(
        &mut self,
        view: usize,
        geometry: &dyn Geometry,
        in_view: &VisibleBlocks,
        drawn: &mut impl Extend<PolygonId>,
        counts: &mut PreviousFrameCounts,
    ) {
        let known = &mut self.drawn[view];
        if self.shadows.is_empty() {
            known.copy_from(in_view);
            drawn.extend(in_view.ids());
            return;
        }
        known.clear();
        let depth = &self.depth;
        let mut is_hidden = |extent: &Extent| {
            counts.tests += 1;
            depth.test_extent(extent).verdict == Verdict::Hidden
        };
        let (mut ids, mut group) = (in_view.ids(), [PolygonId(0); GROUP]);
        let mut extents = [Extent::NOTHING; GROUP];
        loop {
            let mut count = 0;
            for ((place, extent), id) in group.iter_mut().zip(&mut extents).zip(ids.by_ref()) {
                (*place, *extent) = (id, depth.extent_of(corners_of(geometry, id).points()));
                count += 1;
            }
            let (group, extents) = (&group[..count], &extents[..count]);
            if group.is_empty() {
                break;
            }
            let is_compact =
                group.len() > 1 && group[group.len() - 1].0.wrapping_sub(group[0].0) < GROUP as u32;
            if is_compact && is_hidden(&extents.iter().fold(Extent::NOTHING, Extent::with)) {
                continue;
            }
            for (&id, extent) in group.iter().zip(extents) {
                if !is_hidden(extent) {
                    drawn.extend([id]);
                    known.insert(id);
                }
            }
        }
    }
}

/// The corners of a polygon, or of the box of what is no single polygon.
struct Corners {
    corners: [Vec3; 8],
    count: usize,
}

impl Corners {
    fn points(&self) -> &[Vec3] {
        &self.corners[..self.count]
    }
}

#[inline]
fn corners_of(geometry: &dyn Geometry, id: PolygonId) -> Corners {
    let mut corners = [Vec3::ZERO; 8];
    match geometry.polygon(id) {
        Some(polygon) => {
            let vertices = polygon.vertices();
            corners[..vertices.len()].copy_from_slice(vertices);
            Corners { corners, count: vertices.len() }
        }
        None => Corners { corners: geometry.bounds(id).corners(), count: 8 },
    }
}
