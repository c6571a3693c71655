use rstar::{
    ParentNode, RStarInsertionStrategy, RTree, RTreeNode, RTreeObject, RTreeParams,
    primitives::{GeomWithData, Rectangle},
};

use super::adapter::PeerTree;
use osp::{
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

type Entry = GeomWithData<Rectangle<[f32; 3]>, u32>;

struct Wide;

impl RTreeParams for Wide {
    const MIN_SIZE: usize = 6;
    const MAX_SIZE: usize = 16;
    const REINSERTION_COUNT: usize = 5;
    type DefaultInsertionStrategy = RStarInsertionStrategy;
}

pub(super) struct Rstar(RTree<Entry, Wide>);

impl Default for Rstar {
    fn default() -> Self {
        Self(RTree::new_with_params())
    }
}

fn entry(id: u32, bounds: &Aabb) -> Entry {
    Entry::new(Rectangle::from_corners(bounds.min.to_array(), bounds.max.to_array()), id)
}

/// Visits the nodes below `node` by recursion. The recursion is only a few levels deep, because the tree is balanced.
fn walk(node: &ParentNode<Entry>, mask: PlaneMask, frustum: &Frustum, out: &mut Vec<PolygonId>) {
    for child in node.children() {
        let envelope = child.envelope();
        let below = if mask.is_empty() {
            mask
        } else {
            let bounds = Aabb::new(envelope.lower().into(), envelope.upper().into());
            match frustum.classify_masked(&bounds, mask) {
                (Containment::Outside, ..) => continue,
                (_, below, _) => below,
            }
        };
        match child {
            RTreeNode::Leaf(leaf) => out.push(PolygonId(leaf.data)),
            RTreeNode::Parent(parent) => walk(parent, below, frustum, out),
        }
    }
}

/// Bytes of the subtree, without reserved memory, because the crate does not expose its size.
fn bytes(node: &ParentNode<Entry>) -> usize {
    let below = |child: &RTreeNode<Entry>| match child {
        RTreeNode::Leaf(_) => 0,
        RTreeNode::Parent(parent) => bytes(parent),
    };
    size_of_val(node.children()) + node.children().iter().map(below).sum::<usize>()
}

impl PeerTree for Rstar {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        self.0.insert(entry(id, bounds));
    }

    fn remove(&mut self, id: u32, bounds: &Aabb) {
        self.0.remove(&entry(id, bounds));
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        walk(self.0.root(), PlaneMask::ALL, frustum, out);
    }

    fn bytes(&self) -> usize {
        bytes(self.0.root())
    }
}
