//! A hierarchy that inserts polygons one at a time and never rebuilds.
//!
//! Source: Erin Catto, "Dynamic Bounding Volume Hierarchies" (2019) and the tree of Box2D v3 that follows it. A greedy,
//! bounded descent finds the cheapest sibling for a new polygon by surface area. On the way back to the root, every
//! node may exchange a child with a child of its other child, if that makes boxes smaller.
//!
//! # Differences from the source
//! * It has three dimensions, with surfaces (in `f64`, whose squares do not overflow) instead of perimeters.
//! * Boxes have no margins: a box that moves is removed and inserted again, because every query here is exact.
//! * If two children cost the same, the descent goes to the child with the nearer centre. If the distances are equal,
//!   too, it goes to the subtree of smaller height. Otherwise coincident polygons would form a chain with one level for
//!   each polygon.
//! * The heights of two siblings may differ by 32 at most; beyond this limit the taller sibling is rotated up, at any cost.
//!   So no order of insertion makes a chain, not even boxes around boxes.

mod query;
mod tree;

pub(super) use tree::BoxTree;

use super::by_id::{ById, InsertedBoxes};
use osp::{
    index::{IndexConfig, IndexError, SpatialIndex, Upkeep, Visitor, WorkCounts, kernels::Nearest},
    math::{Aabb, Frustum, Ray},
    polygon::PolygonId,
};

/// The dynamic hierarchy as an index.
#[derive(Debug)]
pub struct DynamicBvh {
    inserted: InsertedBoxes,
    leaf: ById<u32>,
    tree: BoxTree,
}

impl DynamicBvh {
    /// An empty tree.
    pub fn new(config: &IndexConfig) -> Self {
        let mut leaf = ById::new(tree::NONE);
        leaf.reserve(config.room());
        Self {
            inserted: InsertedBoxes::with_capacity(config.room()),
            leaf,
            tree: BoxTree::with_capacity(config.room()),
        }
    }
}

impl SpatialIndex for DynamicBvh {
    fn name(&self) -> &'static str {
        "dynamic-bvh"
    }

    fn len(&self) -> usize {
        self.inserted.len()
    }

    fn insert(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.insert(id, bounds)?;
        self.leaf.set(id, self.tree.insert(id, bounds));
        Ok(())
    }

    fn remove(&mut self, id: PolygonId) -> Result<(), IndexError> {
        self.inserted.remove(id)?;
        self.tree.remove(self.leaf.get(id));
        self.leaf.set(id, tree::NONE);
        Ok(())
    }

    fn update(&mut self, id: PolygonId, bounds: &Aabb) -> Result<(), IndexError> {
        self.inserted.update(id, bounds)?;
        self.tree.remove(self.leaf.get(id));
        self.leaf.set(id, self.tree.insert(id, bounds));
        Ok(())
    }

    fn commit(&mut self) {}

    fn frustum_cull(&self, frustum: &Frustum, draw_list: &mut Vec<PolygonId>) -> WorkCounts {
        self.tree.frustum_cull(frustum, draw_list)
    }

    fn traverse(&self, frustum: &Frustum, visitor: &mut dyn Visitor) -> WorkCounts {
        self.tree.traverse(frustum, visitor)
    }

    fn ray_nearest(
        &self,
        ray: &Ray,
        t_max: f32,
        hit: &mut dyn FnMut(PolygonId) -> Option<f32>,
    ) -> Option<(PolygonId, f32)> {
        let mut nearest = Nearest::new(t_max, hit);
        self.tree.ray_nearest(ray, &mut nearest);
        nearest.found()
    }

    fn upkeep(&self) -> Option<Upkeep> {
        Some(self.tree.upkeep())
    }

    fn bytes(&self) -> usize {
        self.inserted.bytes() + self.leaf.bytes() + self.tree.bytes()
    }

    fn clear(&mut self) {
        self.inserted.clear();
        self.leaf.clear();
        self.tree.clear();
    }
}
