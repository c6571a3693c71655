use glam::Vec3;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, TraversalAction};

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

#[derive(Default)]
pub(super) struct Growing(Bvh);

impl PeerTree for Growing {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.0.insert(box_of(bounds), id);
    }

    fn remove(&mut self, id: u32, _bounds: &Aabb) {
        self.0.remove(id);
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        cull(&self.0, frustum, |id| out.push(PolygonId(id)));
    }

    fn bytes(&self) -> usize {
        self.0.heap_memory_size()
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
