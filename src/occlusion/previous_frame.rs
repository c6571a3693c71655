//! Previous-frame occluders: the polygons that were visible in the last frame are filled into a software depth buffer and
//! occlude in this one. For machines without a usable GPU.
//!
//! What hides in a painting is not a few large polygons but thousands of small ones together. Those that were drawn in the
//! last frame are most of what is visible in this one (temporal coherence, as in N. Greene, M. Kass, G. Miller,
//! "Hierarchical Z-Buffer Visibility", 1993); they are only a guess at good occluders, so moves, new strokes and sudden
//! turns need no care: every occluder is part of the model as it is now.
//!
//! The buffer counts only pixels that an occluder covers wholly ([`super::Coverage::WholePixels`]), so that nothing visible
//! is culled. Edges between neighbours in a ribbon would stay open by it: each two neighbours that share an edge are
//! filled in as one outline, too, where that is convex.

use glam::Vec3;

use super::{DepthBuffer, DepthConfig, OcclusionCuller, ShadowVolume, Soundness, Verdict, patch::Patch};
use crate::{
    polygon::{Geometry, PolygonId, VisibleBlocks},
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
        self.occluders as f64 * 3000.0 + self.tests as f64 * 250.0
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
        let mut depth = DepthBuffer::new(depth);
        let shadows = (2 * polygons + 4).min(Self::MOST_OUTLINES);
        depth.reserve(shadows);
        let drawn = vec![VisibleBlocks::with_capacity(polygons)];
        Self { depth, shadows: Vec::with_capacity(shadows), drawn }
    }

    /// Whether its answers can be relied upon: those of its buffer.
    pub fn soundness(&self) -> Soundness {
        self.depth.soundness()
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
        let occluder = |id: PolygonId| {
            if known.contains(id) { geometry.occluder(id) } else { None }
        };
        let pixels_of = self.depth.area_in_pixels(window);
        self.shadows.clear();
        let mut ids = in_view.ids().peekable();
        while let Some(id) = ids.next() {
            if self.shadows.len() + 4 > Self::MOST_OUTLINES {
                break;
            }
            let Some(polygon) = occluder(id) else { continue };
            let area_px = pixels_of(&polygon);
            if area_px >= LEAST_PX {
                ShadowVolume::push_polygon(polygon.vertices(), window, &mut self.shadows);
            }
            let Some(next) = ids.peek().copied().filter(|next| next.0 == id.0 + 1) else { continue };
            let Some(next_polygon) = occluder(next) else { continue };
            if area_px + pixels_of(&next_polygon) >= LEAST_PX
                && let Some(both) = Patch::new(id, &polygon).joined(next, &next_polygon)
            {
                self.shadows.extend(both.shadow(window));
            }
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
        let mut is_hidden = |ids: &[PolygonId]| {
            counts.tests += 1;
            let corners = || ids.iter().flat_map(|&id| Corners::of(geometry, id));
            depth.test_points(corners).verdict == Verdict::Hidden
        };
        let (mut ids, mut group) = (in_view.ids(), [PolygonId(0); GROUP]);
        loop {
            let mut count = 0;
            for (place, id) in group.iter_mut().zip(ids.by_ref()) {
                (*place, count) = (id, count + 1);
            }
            let group = &group[..count];
            if group.is_empty() {
                break;
            }
            let is_compact =
                group.len() > 1 && group[group.len() - 1].0.wrapping_sub(group[0].0) < GROUP as u32;
            if is_compact && is_hidden(group) {
                continue;
            }
            for &id in group {
                if !is_hidden(&[id]) {
                    drawn.extend([id]);
                    known.insert(id);
                }
            }
        }
    }
}

/// The corners of a polygon, or of the box of what is no single polygon, one after the other.
#[derive(Clone)]
struct Corners {
    corners: [Vec3; 8],
    count: usize,
    next: usize,
}

impl Corners {
    fn of(geometry: &dyn Geometry, id: PolygonId) -> Self {
        let mut corners = [Vec3::ZERO; 8];
        let count = match geometry.polygon(id) {
            Some(polygon) => {
                let vertices = polygon.vertices();
                corners[..vertices.len()].copy_from_slice(vertices);
                vertices.len()
            }
            None => {
                corners = geometry.bounds(id).corners();
                8
            }
        };
        Self { corners, count, next: 0 }
    }
}

impl Iterator for Corners {
    type Item = Vec3;

    fn next(&mut self) -> Option<Vec3> {
        let corner = self.corners[..self.count].get(self.next).copied();
        self.next += 1;
        corner
    }
}
