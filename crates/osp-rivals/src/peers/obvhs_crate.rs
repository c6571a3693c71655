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
    /// Builds the tree again by the crate's fastest method, and lays siblings out in the order of the walk.
    fn build_again(&mut self, inserted: &InsertedBoxes) {
        let (ids, boxes): (Vec<u32>, Vec<_>) = inserted.iter().map(|(id, b)| (id.0, box_of(b))).unzip();
        let numbers = (0..boxes.len() as u32).collect();
        let (distance, precision) = (PlocSearchDistance::Minimum, SortPrecision::U64);
        self.tree = PlocBuilder::new().build(distance, &boxes, numbers, precision, 0);
        self.tree.reorder_in_stack_traversal_order();
        self.updated.clear();
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
        let mut visit = |node: &Bvh2Node, mask: PlaneMask, stack: &mut Vec<(u32, PlaneMask)>| {
            let bounds = || Aabb::new(node.aabb().min.into(), node.aabb().max.into());
            let below = match mask.is_empty() {
                true => mask,
                false => match frustum.classify_masked(&bounds(), mask) {
                    (Containment::Outside, ..) => return,
                    (_, below, _) => below,
                },
            };
            if node.is_leaf() {
                let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
                self.tree.primitive_indices[range].iter().for_each(|&id| found(id));
            } else {
                stack.push((node.first_index, below));
            }
        };
        visit(&self.tree.nodes[0], PlaneMask::ALL, &mut stack);
        // Siblings lie side by side and are tested together.
        while let Some((at, mask)) = stack.pop() {
            self.tree.nodes[at as usize..at as usize + 2]
                .iter()
                .for_each(|node| visit(node, mask, &mut stack));
        }
    }
}

impl PeerTree for Growing {
    fn build(&mut self, inserted: &InsertedBoxes) -> bool {
        self.build_again(inserted);
        true
    }

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
            self.build_again(inserted);
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
