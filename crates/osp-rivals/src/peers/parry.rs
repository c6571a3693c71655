use glam::Vec3;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace, TraversalAction};

use super::adapter::PeerTree;
use crate::by_id::InsertedBoxes;
use osp::{
    math::{Aabb, Containment, Frustum},
    polygon::PolygonId,
};

fn box_of(bounds: &Aabb) -> parry3d::bounding_volume::Aabb {
    let corner = |v: Vec3| parry3d::math::Vector::new(v.x, v.y, v.z);
    parry3d::bounding_volume::Aabb::new(corner(bounds.min), corner(bounds.max))
}

fn cull(tree: &Bvh, frustum: &Frustum, mut found: impl FnMut(u32)) {
    tree.traverse_indexed(None, |node, at| {
        let (min, max) = (node.mins(), node.maxs());
        let bounds = Aabb::new([min.x, min.y, min.z].into(), [max.x, max.y, max.z].into());
        match (frustum.classify(&bounds), node.leaf_data()) {
            (Containment::Outside, _) => TraversalAction::Prune,
            (_, Some(leaf)) => {
                found(leaf);
                TraversalAction::Prune
            }
            (Containment::Inside, None) => {
                // All below is in view: it is listed without a test.
                tree.traverse_indexed(Some(at), |below, _| {
                    below.leaf_data().into_iter().for_each(&mut found);
                    TraversalAction::Continue
                });
                TraversalAction::Prune
            }
            (Containment::Intersects, None) => TraversalAction::Continue,
        }
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
    }
}

impl PeerTree for Growing {
    fn build(&mut self, inserted: &InsertedBoxes) -> bool {
        // The crate numbers one or two leaves from 0.
        if inserted.len() < 3 {
            return false;
        }
        let boxes = inserted.iter().map(|(id, bounds)| (id.index(), box_of(bounds)));
        self.tree = Bvh::from_iter(BvhBuildStrategy::Binned, boxes);
        self.updated.clear();
        true
    }

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
