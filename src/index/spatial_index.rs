use glam::Vec3;
use thiserror::Error;

use super::{DrawList, Upkeep, WorkCounts, probe};
use crate::{
    math::{Aabb, Containment, Frustum, Ray, Sphere},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
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
pub trait SpatialIndex: Send + Sync {
    /// Its name on the command line and in tables.
    fn name(&self) -> &'static str;

    /// Number of polygons in the index.
    fn len(&self) -> usize;

    /// Whether the index is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Hears which changes come next, so that an index can ask the memory for what they will touch. Changes nothing.
    fn announce(&self, _geometry: &dyn Geometry, _changes: &[Change]) {}

    /// Inserts a polygon. Queries see it after the next [`SpatialIndex::commit`].
    ///
    /// # Errors
    /// [`IndexError::IdBeyondLimit`], [`IndexError::InvalidBounds`], [`IndexError::Duplicate`].
    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError>;

    /// Takes a polygon out.
    ///
    /// # Errors
    /// [`IndexError::Unknown`].
    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError>;

    /// Gives a polygon a new box.
    ///
    /// # Errors
    /// [`IndexError::Unknown`], [`IndexError::InvalidBounds`].
    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError>;

    /// Gives polygons new boxes: the same as [`SpatialIndex::update`] with one after the other, so of an id that comes more than
    /// once the last counts. Appends why updates were refused to `refused`, in their order. A call of `update` for each, unless
    /// an index does better for neighbours that follow each other.
    fn update_all(&mut self, updates: &[(PolygonId, Aabb)], refused: &mut Vec<IndexError>) {
        refused.extend(updates.iter().filter_map(|(id, bounds)| self.update(*id, bounds).err()));
    }

    /// Whether the index needs the corners of a polygon, not only its box (only `Bsp` does). Then call
    /// [`SpatialIndex::shape`] for every polygon that was inserted or updated.
    fn wants_shapes(&self) -> bool {
        false
    }

    /// Tells the corners of a polygon in the index, world space, after `insert` or `update` (which forgets what was told
    /// before). Changes no answer of a query. Of a polygon that is not in the index or not finite, nothing is kept.
    fn shape(&mut self, _id: PolygonId, _polygon: &ConvexPolygon) {}

    /// Ends a batch of changes: whatever the structure has to do before the next query (a rebuild, a bounded share of
    /// upkeep). Called once a frame; cheap when nothing has changed.
    fn commit(&mut self);

    /// Appends the polygons that the frustum may see to `draw_list`, in any order.
    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut DrawList) -> WorkCounts;

    /// Adds the polygons that the frustum may see to a set that was cleared before: the same polygons as
    /// [`SpatialIndex::frustum_cull`], in the form that the rest of a frame goes on with.
    fn frustum_cull_blocks(&self, frustum: &Frustum, visible: &mut VisibleBlocks) -> WorkCounts {
        visible.fill_by_list(|ids| {
            let mut list = DrawList::of(std::mem::take(ids));
            let work = self.frustum_cull(frustum, &mut list);
            *ids = list.into_ids();
            work
        })
    }

    /// Culls for several views (eyes, walls, faces of a cube, shadow cascades): adds to each set what
    /// [`SpatialIndex::frustum_cull_blocks`] with the frustum at its place would add, the same polygons exactly. All sets have
    /// to be empty. If there are more frusta than sets, or more sets than frusta, the rest is left alone. An index may find all
    /// in one walk; the counts are then those of this walk, and what it reports for each view is summed up.
    fn frustum_cull_views(&self, frusta: &[Frustum], visible: &mut [VisibleBlocks]) -> WorkCounts {
        let mut work = WorkCounts::default();
        for (frustum, visible) in frusta.iter().zip(visible) {
            work += self.frustum_cull_blocks(frustum, visible);
        }
        work
    }

    /// Walks the nodes that the frustum may see from the top, asking `visitor` at each one, and hands it the polygons
    /// of the nodes it does not skip that pass the frustum (each once, the same set as `frustum_cull` if nothing is
    /// skipped).
    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts;

    /// Takes out of `visible`, which [`SpatialIndex::frustum_cull_blocks`] has found for this frustum, the polygons that
    /// `thinner` says are hidden: the same as a [`SpatialIndex::traverse`] leaves out whose visitor answers alike. Nothing
    /// is listed, and what is not hidden is not read. `false` if the index cannot: nothing has happened then.
    fn thin_out(&self, _frustum: &Frustum, _visible: &mut VisibleBlocks, _thinner: &mut dyn Thinner) -> bool {
        false
    }

    /// Appends the polygons whose boxes share a point with `bounds` (touching counts) to `out`, in any order, each
    /// once: the set that [`Aabb::intersects`] accepts. A box with a NaN finds nothing.
    fn box_query(&self, bounds: &Aabb, out: &mut Vec<PolygonId>) -> WorkCounts {
        probe::box_query(self, bounds, out)
    }

    /// The nearest polygon that a ray meets at `t <= t_max`, and its `t`; of several at the same `t` the one with the
    /// lowest id.
    ///
    /// `hit` is the exact test: where the ray meets the polygon itself, if it does. It is asked about every polygon
    /// whose box the ray enters no later than the nearest hit so far, and perhaps about others; the order is free. By rounding,
    /// its `t` may be smaller than the `t` of entry into the box, by one part in ten thousand at most.
    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        probe::ray_nearest(self, ray, t_max, hit)
    }

    /// A polygon that a ray meets at `t <= t_max`, and its `t`: any, the first that is found. For shadows and for "is
    /// anything there"; cheaper than [`SpatialIndex::ray_nearest`]. `hit` is asked as there, and not again after it
    /// has said yes.
    fn ray_any(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        probe::ray_any(self, ray, t_max, hit)
    }

    /// Appends the polygons within a sphere to `out`, in any order, each once.
    ///
    /// `within` is the exact test: whether the polygon itself shares a point with the sphere. It is asked once about
    /// every polygon whose box does ([`Aabb::distance_squared`]), and perhaps about others.
    fn sphere_query(
        &self,
        sphere: &Sphere,
        within: &mut dyn FnMut(PolygonId) -> bool,
        out: &mut Vec<PolygonId>,
    ) -> WorkCounts {
        probe::sphere_query(self, sphere, within, out)
    }

    /// Replaces `out` by the `count` polygons nearest to a point with their distances in metres, the nearest first; of
    /// those at the same distance the lower ids. Fewer if there are fewer.
    ///
    /// `distance_m` is the exact distance, not less than that of the polygon's box (NaN: the polygon is left out). It is
    /// asked once about every polygon whose box is nearer than the last of the answer, and about others.
    fn nearest(
        &self,
        point: Vec3,
        count: usize,
        distance_m: &mut dyn FnMut(PolygonId) -> f32,
        out: &mut Vec<(PolygonId, f32)>,
    ) -> WorkCounts {
        probe::nearest(self, point, count, distance_m, out)
    }

    /// What following the changes took so far; `None` if it is not counted.
    fn upkeep(&self) -> Option<Upkeep> {
        None
    }

    /// Checks every invariant of the structure; for tests, O(everything).
    ///
    /// # Errors
    /// What is broken.
    fn validate(&self) -> Result<(), String>;

    /// Memory held, bytes.
    fn bytes(&self) -> usize;

    /// Takes everything out; keeps the memory.
    fn clear(&mut self);
}

/// A node as a visitor sees it.
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    /// Holds every polygon of the node and below.
    pub bounds: &'a Aabb,
    /// 0 at the top.
    pub depth: u32,
    /// How the node's box lies to the frustum (never [`Containment::Outside`]).
    pub containment: Containment,
    /// Polygons in the node and below; an upper bound where the structure does not know it exactly.
    pub polygons: usize,
    /// Whether nothing is below.
    pub is_leaf: bool,
}

/// What to do with a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visit {
    /// Leave it and everything below out.
    Skip,
    /// Go on: ask again for the nodes below.
    Descend,
    /// Take it and everything below that passes the frustum, without asking again.
    Take,
}

/// Asked at every node of a [`SpatialIndex::traverse`].
pub trait Visitor {
    /// Decides about a node.
    fn node(&mut self, node: &Node<'_>) -> Visit;

    /// Whether it would rather decide about neighbouring leaves together, by [`Visitor::leaves`]. Polygons whose own box was asked
    /// about there are then received as if the answer had been [`Visit::Take`].
    fn asks_together(&self) -> bool {
        false
    }

    /// Decides about at most sixteen leaves; leaf `i` holds `polygons[i]` polygons. All of them lie in the last node, leaves not
    /// counted, that [`Visitor::node`] was asked about.
    fn leaves(&mut self, _bounds: &[Aabb], _polygons: &[u8], answers: &mut [Visit]) {
        answers.fill(Visit::Descend);
    }

    /// Receives polygons that pass the frustum. `asked` is
    /// [`Visit::Descend`] or [`Visit::Take`], whatever was answered for the node that they are in.
    fn polygons(&mut self, ids: &[PolygonId], asked: Visit);
}

/// Says in a [`SpatialIndex::thin_out`] what is hidden.
pub trait Thinner {
    /// A node of fewer polygons is kept without a question.
    fn least_polygons(&self) -> usize;

    /// Whether the polygons of leaves are asked about one by one.
    fn asks_polygons(&self) -> bool;

    /// Decides about a node with this box and at most so many polygons: [`Visit::Skip`] if all of it is hidden,
    /// [`Visit::Take`] if nothing of it can be.
    fn node(&mut self, bounds: &Aabb, polygons: usize) -> Visit;

    /// [`Thinner::node`] for at most sixteen boxes, with at most so many polygons each.
    fn nodes(&mut self, bounds: &[Aabb], polygons: &[u8], answers: &mut [Visit]) {
        for ((answer, bounds), &polygons) in answers.iter_mut().zip(bounds).zip(polygons) {
            *answer = self.node(bounds, usize::from(polygons));
        }
    }

    /// Whether a polygon with this box is hidden.
    fn is_hidden(&mut self, bounds: &Aabb) -> bool;

    /// Which of at most sixteen polygons with these boxes are hidden, a bit for each.
    fn hidden_of(&mut self, boxes: &[Aabb]) -> u16 {
        boxes
            .iter()
            .enumerate()
            .fold(0, |hidden, (i, bounds)| hidden | u16::from(self.is_hidden(bounds)) << i)
    }
}
