use glam::Vec3;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace, TraversalAction};

use super::adapter::PeerTree;
use crate::by_id::InsertedBoxes;
use osp::{
    math::{Aabb, Frustum},
    polygon::PolygonId,
};

fn box_of(bounds: &Aabb) -> parry3d::bounding_volume::Aabb {
    let corner = |v: Vec3| parry3d::math::Vector::new(v.x, v.y, v.z);
    parry3d::bounding_volume::Aabb::new(corner(bounds.min), corner(bounds.max))
}

fn cull(tree: &Bvh, frustum: &Frustum, mut found: impl FnMut(u32)) {
    tree.traverse(|node| {
        let (min, max) = (node.mins(), node.maxs());
        let bounds = Aabb::new([min.x, min.y, min.z].into(), [max.x, max.y, max.z].into());
        if !frustum.may_see(&bounds) {
            return TraversalAction::Prune;
        }
        if let Some(leaf) = node.leaf_data() {
            found(leaf);
        }
        TraversalAction::Continue
    });
}

/// If more than one in this number of leaves was updated, a refit of the whole tree is faster than a refit leaf by
/// leaf.
const FEW: usize = 16;

#[derive(Default)]
pub(super) struct Growing {
    tree: Bvh,
    updated: Vec<u32>,
    workspace: BvhWorkspace,
}

impl Growing {
    /// Restores the boxes above the updated leaves.
    fn refit(&mut self) {
        if self.updated.is_empty() {
            return;
        }
        if self.updated.len() * FEW <= self.tree.leaf_count() as usize {
            self.tree.refit_partial(&[], &self.updated);
        } else {
            self.tree.refit(&mut self.workspace);
        }
        self.updated.clear();
        if std::env::var_os("PARRY_OPT").is_some() {
            self.tree.optimize_incremental(&mut self.workspace);
        }
    }
}

impl PeerTree for Growing {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.refit();
        self.tree.insert(box_of(bounds), id);
    }

    fn remove(&mut self, id: u32, _bounds: &Aabb) {
        self.refit();
        self.tree.remove(id);
    }

    fn update(&mut self, id: u32, _before: &Aabb, bounds: &Aabb) {
        self.tree.insert_or_update_partially(box_of(bounds), id, 0.0);
        self.updated.push(id);
    }

    fn commit(&mut self, _filed: &InsertedBoxes) {
        self.refit();
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        cull(&self.tree, frustum, |id| out.push(PolygonId(id)));
    }

    fn bytes(&self) -> usize {
        self.tree.heap_memory_size() + self.updated.capacity() * size_of::<u32>()
    }
}

#[derive(Default)]
pub(super) struct Rebuilt {
    ids: Vec<PolygonId>,
    boxes: Vec<parry3d::bounding_volume::Aabb>,
    tree: Bvh,
}

impl PeerTree for Rebuilt {
    fn insert(&mut self, _id: u32, _bounds: &Aabb) {}

    fn remove(&mut self, _id: u32, _bounds: &Aabb) {}

    fn commit(&mut self, inserted: &InsertedBoxes) {
        self.ids.clear();
        self.boxes.clear();
        self.ids.extend(inserted.iter().map(|(id, _)| id));
        self.boxes.extend(inserted.iter().map(|(_, bounds)| box_of(bounds)));
        self.tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &self.boxes);
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        cull(&self.tree, frustum, |leaf| out.push(self.ids[leaf as usize]));
    }

    fn bytes(&self) -> usize {
        self.tree.heap_memory_size()
    }
}
