use std::any::Any;

use glam::Vec3;
use thiserror::Error;

use super::{Upkeep, Visit, Visitor, WorkCounts, mask_writer::SetAll, probe, simd::Backend};
use crate::{
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{Change, Geometry, PolygonId, VisibleBlocks},
};

/// The reason why an index refused a change. The refused change has no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum IndexError {
    /// The box is empty, infinite or not a number.
    #[error("polygon {}: expected a finite box with min <= max", .0.0)]
    InvalidBounds(PolygonId),
    /// The id is already in the index.
    #[error("polygon {}: it is in the index already", .0.0)]
    Duplicate(PolygonId),
    /// The id is not in the index.
    #[error("polygon {}: it is not in the index", .0.0)]
    Unknown(PolygonId),
    /// The id is not below [`PolygonId::LIMIT`].
    #[error("polygon {}: expected an id below {}", .0.0, PolygonId::LIMIT)]
    IdBeyondLimit(PolygonId),
}

impl IndexError {
    /// The polygon of the refused change.
    pub fn polygon(self) -> PolygonId {
        match self {
            Self::InvalidBounds(id) | Self::Duplicate(id) | Self::Unknown(id) | Self::IdBeyondLimit(id) => id,
        }
    }
}

/// A structure that stores polygons by their boxes and finds the polygons that a view may see. An engine's own structure
/// needs only the methods without a default implementation.
///
/// Contracts, tested for every implementation against [`super::BruteForce`]:
/// * `frustum_cull` reports every polygon whose box [`Frustum::may_see`] accepts, each once, and no other.
/// * Polygons that lie outside the root cube, are very large or coincide are inserted like all others.
/// * A refused change leaves the index unchanged.
pub trait SpatialIndex: Any + Send + Sync {
    /// The name of the index on the command line and in tables.
    fn name(&self) -> &'static str;

    /// Number of polygons in the index.
    fn len(&self) -> usize;

    /// Whether the index is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Announces the next changes, which `geometry` already contains. The index can prefetch the memory that these
    /// changes will touch, or read more than the boxes of the polygons. No query result changes.
    fn announce(&mut self, _geometry: &dyn Geometry, _changes: &[Change]) {}

    /// Inserts a polygon. Queries return it after the next [`SpatialIndex::commit`].
    ///
    /// # Errors
    /// [`IndexError::IdBeyondLimit`], [`IndexError::InvalidBounds`], [`IndexError::Duplicate`].
    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError>;

    /// Removes a polygon.
    ///
    /// # Errors
    /// [`IndexError::Unknown`].
    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError>;

    /// Sets a new box of a polygon.
    ///
    /// # Errors
    /// [`IndexError::Unknown`], [`IndexError::InvalidBounds`].
    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError>;

    /// Sets new boxes of polygons. The result is the same as with a call of [`SpatialIndex::update`] for each, in
    /// order. So the last update of an id counts. Appends the errors of refused updates to `refused`, in the order of
    /// the updates. The default implementation calls `update` for each; an index may be faster for consecutive ids.
    fn update_all(&mut self, updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        refused.extend(updates.iter().filter_map(|(id, bounds)| self.update(*id, bounds).err()));
    }

    /// Ends a batch of changes. The index does the work that the next query requires, such as a rebuild or a bounded
    /// part of the upkeep. Called once in each frame; cheap if nothing has changed.
    fn commit(&mut self);

    /// Whether a commit only does the work that the next query requires, such as a rebuild. Before a commit with a query,
    /// a caller may then leave out commits without one. An index whose commits do upkeep returns `false`.
    #[doc(hidden)]
    fn may_skip_commits(&self) -> bool {
        false
    }

    /// Appends the polygons that the frustum may see to `draw_list`, in any order. An index may need room for 272 more
    /// entries than it appends.
    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts;

    /// Adds the polygons that the frustum may see to an empty set. They are the polygons of
    /// [`SpatialIndex::frustum_cull`], in the form that the rest of a frame uses.
    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let list = |ids: &mut Vec<PolygonId>| self.frustum_cull(frustum, ids);
        visible.fill_by_list(list, |visible, ids| Backend::detect().run(SetAll { visible, ids }))
    }

    /// Culls for several views (eyes, walls, faces of a cube, shadow cascades). Adds to `visible[i]` exactly the
    /// polygons that [`SpatialIndex::frustum_cull_blocks`] finds for `frusta[i]`. All sets have to be empty. Further
    /// elements of the longer slice are ignored. An index may cull all views in one traversal. The counts are then
    /// those of this traversal, but reported polygons are summed over the views.
    fn frustum_cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = WorkCounts::default();
        for (frustum, visible) in frusta.iter().zip(visible) {
            work += self.frustum_cull_blocks(frustum, visible);
        }
        work
    }

    /// Traverses the nodes that the frustum may see, from the top, and calls `visitor` at each node. The visitor
    /// receives each polygon in the frustum once, except polygons below nodes that it skips. A visitor that skips
    /// nothing receives the set of `frustum_cull`. The default implementation has no nodes: the visitor receives all
    /// polygons in the frustum.
    #[doc(hidden)]
    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        let mut in_view = Vec::new();
        let work = self.frustum_cull(frustum, &mut in_view);
        visitor.polygons(&in_view, Visit::Descend);
        work
    }

    /// Removes the polygons that `visitor` skips from `visible`, the result of [`SpatialIndex::frustum_cull_blocks`] for
    /// this frustum. It never calls [`Visitor::polygons`], and does not read the polygons of nodes that are taken. It
    /// returns `false`, and changes nothing, if the index cannot do this.
    #[doc(hidden)]
    fn thin_out(&self, _frustum: &Frustum, _visible: &mut VisibleBlocks, _visitor: &mut dyn Visitor) -> bool {
        false
    }

    /// Appends the polygons whose boxes share a point with `bounds` to `out`, in any order, each once. Boxes that touch
    /// share a point ([`Aabb::intersects`]). A box with a NaN finds nothing.
    fn box_query(&self, bounds: &Aabb, out: &mut Vec<PolygonId>) -> WorkCounts {
        probe::box_query(bounds, out, |frustum, list| self.frustum_cull(frustum, list))
    }

    /// The nearest polygon that a ray meets at `t <= t_max`, and its `t`. Among several polygons at the same `t` the
    /// lowest id wins.
    ///
    /// `hit` is the exact test: it returns the `t` at which the ray meets the polygon itself, or `None` for a miss. It
    /// is called for every polygon whose box the ray enters no later than the nearest hit so far, and perhaps for
    /// others. Rounding may make the `t` of `hit` smaller than the `t` of entry into the box, by at most one part in
    /// ten thousand.
    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        probe::ray_nearest(ray, t_max, hit, |visitor| self.traverse(&Frustum::everything(), visitor))
    }

    /// Any polygon that a ray meets at `t <= t_max`, and its `t`: the first hit that the search finds. This is enough
    /// for shadows and visibility tests, and cheaper than [`SpatialIndex::ray_nearest`]. `hit` tests a polygon as in
    /// `ray_nearest`. The search calls it until the first hit.
    fn ray_any(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        probe::ray_any(t_max, hit, |first| self.ray_nearest(ray, t_max, first))
    }

    /// Appends the polygons within a sphere to `out`, in any order, each once.
    ///
    /// `within` is the exact test: it returns whether the polygon itself shares a point with the sphere. It is called
    /// once for every polygon whose box shares a point with the sphere ([`Aabb::distance_squared`]), and perhaps for
    /// others.
    fn sphere_query(
        &self,
        sphere: &Sphere,
        within: &mut dyn FnMut(PolygonId) -> bool,
        out: &mut Vec<PolygonId>,
    ) -> WorkCounts {
        probe::sphere_query(sphere, within, out, |visitor| self.traverse(&Frustum::everything(), visitor))
    }

    /// Replaces the contents of `out` by the `count` polygons nearest to a point with their distances in metres, the
    /// nearest first. At the same distance lower ids come first. A smaller index yields all its polygons.
    ///
    /// `distance_m` returns the exact distance, at least the distance of the polygon's box. If it returns NaN, the
    /// polygon is skipped. It is called once for every polygon whose box is nearer than the farthest polygon of the
    /// result, and perhaps for others.
    fn nearest(
        &self,
        point: Vec3,
        count: usize,
        distance_m: &mut dyn FnMut(PolygonId) -> f32,
        out: &mut Vec<(PolygonId, f32)>,
    ) -> WorkCounts {
        let walk = |nearest: &mut probe::NearestPolygons<'_>| self.traverse(&Frustum::everything(), nearest);
        probe::nearest_by(point, count, self.len(), distance_m, out, walk)
    }

    /// Counts of upkeep for all changes so far; `None` if the index does not count them.
    #[doc(hidden)]
    fn upkeep(&self) -> Option<Upkeep> {
        None
    }

    /// Checks the invariants that answers do not show, for tests. Takes time proportional to all contents.
    ///
    /// # Errors
    /// A description of the broken invariant.
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }

    /// Memory held, bytes.
    fn bytes(&self) -> usize;

    /// Removes all polygons; keeps the memory.
    fn clear(&mut self);
}
