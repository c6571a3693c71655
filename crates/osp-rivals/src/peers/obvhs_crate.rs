use std::sync::{Mutex, PoisonError};

use obvhs::{
    bvh2::{Bvh2, node::Bvh2Node},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use super::adapter::PeerTree;
use crate::by_id::InsertedBoxes;
use osp::{
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

fn box_of(bounds: &Aabb) -> obvhs::aabb::Aabb {
    obvhs::aabb::Aabb::new(bounds.min.into(), bounds.max.into())
}

#[derive(Default)]
pub(super) struct Growing {
    tree: Bvh2,
    updated: Vec<(u32, obvhs::aabb::Aabb)>,
    stack: Mutex<Vec<(u32, PlaneMask)>>,
}

/// If more than one in this number of leaves has moved, building a new tree is faster than resizing nodes leaf by leaf.
const MOST: usize = 2;

impl Growing {
    /// Builds the tree again by the crate's fastest method.
    fn build(&mut self, inserted: &InsertedBoxes) {
        let (ids, boxes): (Vec<u32>, Vec<_>) = inserted.iter().map(|(id, b)| (id.0, box_of(b))).unzip();
        let numbers = (0..boxes.len() as u32).collect();
        let (distance, precision) = (PlocSearchDistance::Minimum, SortPrecision::U64);
        self.tree = PlocBuilder::new().build(distance, &boxes, numbers, precision, 0);
        let Bvh2 { nodes, primitive_indices, primitives_to_nodes, .. } = &mut self.tree;
        primitive_indices.iter_mut().for_each(|at| *at = ids[*at as usize]);
        // The crate's own function expects numbers without gaps.
        let end = ids.iter().max().map_or(0, |last| *last as usize + 1);
        *primitives_to_nodes = vec![u32::MAX; end];
        for (number, node) in (0..).zip(nodes).filter(|(_, node)| node.is_leaf()) {
            for at in node.first_index..node.first_index + node.prim_count {
                primitives_to_nodes[primitive_indices[at as usize] as usize] = number;
            }
        }
    }

    /// Sets the boxes of the updated leaves.
    fn resize(&mut self) {
        self.tree.init_primitives_to_nodes_if_uninit();
        for (id, bounds) in self.updated.drain(..) {
            self.tree.resize_node(self.tree.primitives_to_nodes[id as usize] as usize, bounds);
        }
    }

    fn walk(&self, frustum: &Frustum, mut found: impl FnMut(u32)) {
        if self.tree.nodes.is_empty() {
            return;
        }
        let mut stack = self.stack.lock().unwrap_or_else(PoisonError::into_inner);
        stack.push((0, PlaneMask::ALL));
        while let Some((at, mask)) = stack.pop() {
            let node = &self.tree.nodes[at as usize];
            let bounds = Aabb::new(node.aabb().min.into(), node.aabb().max.into());
            let below = if mask.is_empty() {
                mask
            } else {
                match frustum.classify_masked(&bounds, mask) {
                    (Containment::Outside, ..) => continue,
                    (_, below, _) => below,
                }
            };
            if node.is_leaf() {
                for i in node.first_index..node.first_index + node.prim_count {
                    found(self.tree.primitive_indices[i as usize]);
                }
            } else {
                stack.push((node.first_index, below));
                stack.push((node.first_index + 1, below));
            }
        }
    }
}

impl PeerTree for Growing {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.resize();
        self.tree.insert_primitive(box_of(bounds), id);
    }

    fn remove(&mut self, id: u32, _bounds: &Aabb) {
        self.resize();
        self.tree.remove_primitive(id);
    }

    fn update(&mut self, id: u32, _before: &Aabb, bounds: &Aabb) {
        self.updated.push((id, box_of(bounds)));
    }

    fn commit(&mut self, inserted: &InsertedBoxes) {
        if self.updated.len() * MOST > inserted.len() {
            self.build(inserted);
            self.updated.clear();
        } else {
            self.resize();
        }
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        self.walk(frustum, |id| out.push(PolygonId(id)));
    }

    fn bytes(&self) -> usize {
        let Bvh2 { nodes, primitive_indices, primitives_to_nodes, parents, .. } = &self.tree;
        let numbers = primitive_indices.capacity() + primitives_to_nodes.capacity() + parents.capacity();
        nodes.capacity() * size_of::<Bvh2Node>() + numbers * size_of::<u32>()
    }
}

#[derive(Default)]
pub(super) struct Rebuilt {
    ids: Vec<PolygonId>,
    boxes: Vec<obvhs::aabb::Aabb>,
    of: Growing,
}

impl PeerTree for Rebuilt {
    fn insert(&mut self, _id: u32, _bounds: &Aabb) {}

    fn remove(&mut self, _id: u32, _bounds: &Aabb) {}

    fn commit(&mut self, inserted: &InsertedBoxes) {
        self.ids.clear();
        self.boxes.clear();
        self.ids.extend(inserted.iter().map(|(id, _)| id));
        self.boxes.extend(inserted.iter().map(|(_, bounds)| box_of(bounds)));
        if self.boxes.is_empty() {
            self.of.tree = Bvh2::default();
            return;
        }
        let indices = (0..self.boxes.len() as u32).collect();
        self.of.tree =
            PlocBuilder::new().build(PlocSearchDistance::Low, &self.boxes, indices, SortPrecision::U64, 0);
        self.of.tree.reorder_in_stack_traversal_order();
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        self.of.walk(frustum, |at| out.push(self.ids[at as usize]));
    }

    fn bytes(&self) -> usize {
        self.of.bytes()
    }
}
