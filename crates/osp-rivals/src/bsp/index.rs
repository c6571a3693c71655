use std::{any::Any, collections::VecDeque};

use glam::Vec3;

use super::{
    BspConfig, BspCounts,
    build::BspBuilder,
    order::{BspNode, Order},
};
use crate::rebuilt::Rebuilt;
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts},
    math::{Aabb, Frustum, Ray},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId},
};

/// A binary space partition along the polygons' planes; see [`osp::index`] for the contract of every index.
///
/// The tree reads the polygons themselves ([`SpatialIndex::announce`], [`Bsp::shape`]). If only the box of a polygon is
/// known, a rectangle in the middle of the box replaces it.
#[derive(Debug)]
pub struct Bsp(Rebuilt<BspBuilder>, Announced);

/// The corners of announced polygons, in the order of the next insertions and updates.
#[derive(Debug, Default)]
struct Announced(VecDeque<(PolygonId, ConvexPolygon)>);

impl Announced {
    fn take(&mut self, id: PolygonId) -> Option<ConvexPolygon> {
        let at = self.0.iter().position(|(next, _)| *next == id)?;
        self.0.drain(..=at).next_back().map(|(_, polygon)| polygon)
    }
}

fn is_finite(polygon: &ConvexPolygon) -> bool {
    polygon.vertices().iter().all(|p| p.is_finite())
}

impl Bsp {
    /// An empty tree.
    pub fn new(config: BspConfig, index: &IndexConfig) -> Self {
        Self(Rebuilt::new(BspBuilder::new(config), index.room()), Announced::default())
    }

    /// `index` as a BSP tree; `None` for another kind of index.
    pub fn of(index: &mut dyn SpatialIndex) -> Option<&mut Self> {
        let index: &mut dyn Any = index;
        index.downcast_mut()
    }

    /// Sets the corners of a polygon in the tree, world space. Necessary after an `insert` or `update` without an
    /// announcement, because both delete the corners. Ignores polygons that are not in the tree or not finite.
    pub fn shape(&mut self, id: PolygonId, polygon: &ConvexPolygon) {
        if self.0.contains(id) && is_finite(polygon) {
            self.0.builder_mut().set_shape(id, Some(*polygon));
        }
    }

    /// Calls `draw` with the pieces of all polygons as of the last commit, from back to front as seen from `eye`. No
    /// piece hides any part of a later piece. `draw` gets the id of the polygon and the corners of the piece, in order.
    ///
    /// The order is exact except for pieces in leaves with several pieces ([`BspCounts::unordered`]) and for the bend of
    /// quads that are not quite flat.
    pub fn back_to_front(&self, eye: Vec3, draw: &mut impl FnMut(PolygonId, &[Vec3])) {
        self.0.builder().order().walk(eye, Order::BackToFront, draw);
    }

    /// Like [`Bsp::back_to_front`], in the opposite order. A later piece hides no part of an earlier piece.
    pub fn front_to_back(&self, eye: Vec3, draw: &mut impl FnMut(PolygonId, &[Vec3])) {
        self.0.builder().order().walk(eye, Order::FrontToBack, draw);
    }

    /// The node at the top of the tree; `None` if the tree is empty.
    pub fn top(&self) -> Option<BspNode<'_>> {
        BspNode::at(self.0.builder().order(), 0)
    }

    /// Calls `draw` with the planes of at most `most` nodes, level by level. It gets the level, 0 at the top, and the
    /// outline of the plane within the planes above and `bounds`, world space.
    pub fn splits(&self, bounds: &Aabb, most: usize, draw: &mut impl FnMut(u32, &[Vec3])) {
        self.0.builder().order().splits(bounds, most, draw);
    }

    /// Size of the tree at the last commit.
    pub fn counts(&self) -> BspCounts {
        self.0.builder().order().counts()
    }
}

impl SpatialIndex for Bsp {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    fn announce(&mut self, geometry: &dyn Geometry, changes: &[Change]) {
        let announced = changes.iter().filter_map(|change| match *change {
            Change::Insert(id) | Change::Update(id) => Some((id, geometry.polygon(id).filter(is_finite)?)),
            Change::Remove(_) | Change::Repaint(_) | Change::Place(_) => None,
        });
        self.1.0.extend(announced);
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.0.insert(id, bounds)?;
        self.0.builder_mut().set_shape(id, self.1.take(id));
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.0.remove(id)?;
        self.0.builder_mut().set_shape(id, None);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.0.update(id, bounds)?;
        // Replaces the corners, because the old corners lie at the old position.
        self.0.builder_mut().set_shape(id, self.1.take(id));
        Ok(())
    }

    fn may_skip_commits(&self) -> bool {
        true
    }

    fn commit(&mut self) {
        self.1.0.clear();
        self.0.commit();
        if self.0.is_empty() {
            self.0.builder_mut().clear_order();
            self.0.commit();
        }
    }

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.0.frustum_cull(frustum, draw_list)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.0.traverse(frustum, visitor)
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        self.0.ray_nearest(ray, t_max, hit)
    }

    fn nearest(
        &self,
        point: Vec3,
        count: usize,
        distance_m: &mut dyn FnMut(PolygonId) -> f32,
        out: &mut Vec<(PolygonId, f32)>,
    ) -> WorkCounts {
        self.0.nearest(point, count, distance_m, out)
    }

    fn upkeep(&self) -> Option<Upkeep> {
        self.0.upkeep()
    }

    fn bytes(&self) -> usize {
        self.0.bytes()
    }

    fn clear(&mut self) {
        self.0.builder_mut().clear();
        self.0.clear();
    }
}
