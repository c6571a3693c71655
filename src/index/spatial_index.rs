use std::any::Any;

use glam::Vec3;
use thiserror::Error;

use super::{DrawList, Thinner, Upkeep, Visitor, WorkCounts, mask_writer::SetAll, probe, simd::Backend};
use crate::{
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{Change, Geometry, PolygonId, VisibleBlocks},
};

/// Why an index refused a change. It is then as it was before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
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
    /// The polygon that the change was about.
    pub fn polygon(self) -> PolygonId {
        match self {
            Self::InvalidBounds(id) | Self::Duplicate(id) | Self::Unknown(id) | Self::IdBeyondLimit(id) => id,
        }
    }
}

/// A structure that holds polygons by their boxes and answers visibility queries.
///
/// Contracts, tested for every implementation against [`super::BruteForce`]:
/// * `frustum_cull` reports every polygon whose box [`Frustum::may_see`] accepts, each once, and no other.
/// * Polygons outside the root cube, over-sized or coincident are inserted like any other.
/// * A refused change leaves the index as it was.
pub trait SpatialIndex: Any + Send + Sync {
    /// Its name on the command line and in tables.
    fn name(&self) -> &'static str;

    /// Number of polygons in the index.
    fn len(&self) -> usize;

    /// Whether the index is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Announces the next changes, which `geometry` has already made. An index can prefetch the memory that they will touch, or
    /// read more of the polygons than their boxes. Changes no answer.
    fn announce(&mut self, _geometry: &dyn Geometry, _changes: &[Change]) {}

    /// Inserts a polygon. Queries see it after the next [`SpatialIndex::commit`].
    ///
    /// # Errors
    /// [`IndexError::IdBeyondLimit`], [`IndexError::InvalidBounds`], [`IndexError::Duplicate`].
    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError>;

    /// Removes a polygon.
    ///
    /// # Errors
    /// [`IndexError::Unknown`].
    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError>;

    /// Gives a polygon a new box.
    ///
    /// # Errors
    /// [`IndexError::Unknown`], [`IndexError::InvalidBounds`].
    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError>;

    /// Gives polygons new boxes: the same as [`SpatialIndex::update`] with one after the other, so the last update of
    /// an id counts. Appends the errors of refused updates to `refused`, in their order. By default it calls `update`
    /// for each; an index may be faster for consecutive neighbours.
    fn update_all(&mut self, updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        refused.extend(updates.iter().filter_map(|(id, bounds)| self.update(*id, bounds).err()));
    }

    /// Ends a batch of changes: whatever the structure has to do before the next query (a rebuild, a bounded share of
    /// upkeep). Called once a frame; cheap when nothing has changed.
    fn commit(&mut self);

    /// Appends the polygons that the frustum may see to `draw_list`, in any order.
    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut DrawList) -> WorkCounts;

    /// Adds the polygons that the frustum may see to a set that was cleared before: the same polygons as
    /// [`SpatialIndex::frustum_cull`], in the form that the rest of a frame uses.
    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        let list = |ids: &mut Vec<PolygonId>| {
            let mut list = DrawList::of(std::mem::take(ids));
            let work = self.frustum_cull(frustum, &mut list);
            *ids = list.into_ids();
            work
        };
        visible.fill_by_list(list, |visible, ids| Backend::detect().run(SetAll { visible, ids }))
    }

    /// Culls for several views (eyes, walls, faces of a cube, shadow cascades). Adds to `visible[i]` exactly the polygons that
    /// [`SpatialIndex::frustum_cull_blocks`] finds for `frusta[i]`. All sets have to be empty. Further elements of the longer
    /// slice are ignored. An index may find all in one walk. The counts are
    /// then those of this walk, with the results of all views summed up.
    fn frustum_cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = WorkCounts::default();
        for (frustum, visible) in frusta.iter().zip(visible) {
            work += self.frustum_cull_blocks(frustum, visible);
        }
        work
    }

    /// Walks the nodes that the frustum may see from the top, and calls `visitor` at each one. The visitor gets the
    /// polygons in the frustum of the nodes that it does not skip. It gets each once, and the set of `frustum_cull` if
    /// it skips nothing.
    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts;

    /// Clears the polygons that `thinner` finds hidden from `visible`, the result of [`SpatialIndex::frustum_cull_blocks`]
    /// for this frustum. A [`SpatialIndex::traverse`] with the same answers omits the same polygons. Nothing is listed,
    /// and polygons that are not hidden are not read. `false` if the index cannot do this; nothing has changed then.
    fn thin_out(&self, _frustum: &Frustum, _visible: &mut VisibleBlocks, _thinner: &mut dyn Thinner) -> bool {
        false
    }

    /// Appends the polygons whose boxes share a point with `bounds` (touching counts) to `out`, in any order, each
    /// once: the set that [`Aabb::intersects`] accepts. A box with a NaN finds nothing.
    fn box_query(&self, bounds: &Aabb, out: &mut Vec<PolygonId>) -> WorkCounts {
        probe::box_query(bounds, out, |frustum, list| self.frustum_cull(frustum, list))
    }

    /// The nearest polygon that a ray meets at `t <= t_max`, and its `t`; of several at the same `t` the one with the
    /// lowest id.
    ///
    /// `hit` is the exact test: the `t` at which the ray meets the polygon itself, if it does. It is called for every
    /// polygon whose box the ray enters no later than the nearest hit so far, and perhaps for others. By rounding, its
    /// `t` may be smaller than the `t` of entry into the box, by at most one part in ten thousand.
    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        probe::ray_nearest(ray, t_max, hit, |visitor| self.traverse(&Frustum::everything(), visitor))
    }

    /// Any polygon that a ray meets at `t <= t_max`, and its `t`: the first one found. For shadows and visibility
    /// tests; cheaper than [`SpatialIndex::ray_nearest`]. `hit` is called as there, and not again after a hit.
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
    /// `within` is the exact test: whether the polygon itself shares a point with the sphere. It is called once for
    /// every polygon whose box does ([`Aabb::distance_squared`]), and perhaps for others.
    fn sphere_query(
        &self,
        sphere: &Sphere,
        within: &mut dyn FnMut(PolygonId) -> bool,
        out: &mut Vec<PolygonId>,
    ) -> WorkCounts {
        probe::sphere_query(sphere, within, out, |visitor| self.traverse(&Frustum::everything(), visitor))
    }

    /// Replaces `out` by the `count` polygons nearest to a point with their distances in metres, the nearest first. At
    /// the same distance lower ids come first. Fewer if there are fewer.
    ///
    /// `distance_m` is the exact distance, not less than that of the polygon's box (NaN: the polygon is left out). It is
    /// called once for every polygon whose box is nearer than the last one of the result, and for others.
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

    /// Upkeep for the changes so far; `None` if it is not counted.
    fn upkeep(&self) -> Option<Upkeep> {
        None
    }

    /// Checks every invariant of the structure; for tests, O(everything).
    ///
    /// # Errors
    /// A description of the broken invariant.
    fn validate(&self) -> Result<(), String>;

    /// Memory held, bytes.
    fn bytes(&self) -> usize;

    /// Removes all polygons; keeps the memory.
    fn clear(&mut self);
}
