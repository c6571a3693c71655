use std::sync::{Mutex, PoisonError};

use ::bvh::{
    aabb::Bounded,
    bounding_hierarchy::BHShape,
    bvh::{Bvh, BvhNode},
};
use glam::Vec3;

use super::adapter::PeerTree;
use crate::by_id::InsertedBoxes;
use osp::{
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::PolygonId,
};

struct Shape {
    id: PolygonId,
    bounds: Aabb,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> ::bvh::aabb::Aabb<f32, 3> {
        let corner = |v: Vec3| nalgebra::Point3::new(v.x, v.y, v.z);
        ::bvh::aabb::Aabb::with_bounds(corner(self.bounds.min), corner(self.bounds.max))
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

#[derive(Default)]
pub(super) struct BvhCrate {
    shapes: Vec<Shape>,
    tree: Option<Bvh<f32, 3>>,
    /// Whether a polygon was removed since the last commit.
    is_stale: bool,
    stack: Mutex<Vec<(usize, PlaneMask)>>,
}

impl PeerTree for BvhCrate {
    fn insert(&mut self, id: u32, bounds: &Aabb) {
        if self.is_stale {
            return; // The commit builds everything.
        }
        let at = self.shapes.len();
        self.shapes.push(Shape { id: PolygonId(id), bounds: *bounds, node: 0 });
        let tree = self.tree.get_or_insert_with(|| Bvh { nodes: Vec::new() });
        tree.add_shape(&mut self.shapes, at);
    }

    fn remove(&mut self, _id: u32, _bounds: &Aabb) {
        self.is_stale = true;
    }

    fn commit(&mut self, inserted: &InsertedBoxes) {
        if std::mem::take(&mut self.is_stale) {
            self.shapes.clear();
            self.shapes.extend(inserted.iter().map(|(id, bounds)| Shape { id, bounds: *bounds, node: 0 }));
            self.tree = (!self.shapes.is_empty()).then(|| Bvh::build(&mut self.shapes));
        }
    }

    fn cull(&self, frustum: &Frustum, out: &mut Vec<PolygonId>) {
        let Some(tree) = &self.tree else { return };
        let mut stack = self.stack.lock().unwrap_or_else(PoisonError::into_inner);
        stack.push((0, PlaneMask::ALL));
        while let Some((at, mask)) = stack.pop() {
            match &tree.nodes[at] {
                BvhNode::Leaf { shape_index, .. } => {
                    let shape = &self.shapes[*shape_index];
                    if frustum.classify_masked(&shape.bounds, mask).0 != Containment::Outside {
                        out.push(shape.id);
                    }
                }
                BvhNode::Node { child_l_index, child_l_aabb, child_r_index, child_r_aabb, .. } => {
                    for (child, bounds) in [(*child_l_index, child_l_aabb), (*child_r_index, child_r_aabb)] {
                        if mask.is_empty() {
                            stack.push((child, mask));
                            continue;
                        }
                        let (min, max) = (bounds.min, bounds.max);
                        let bounds = Aabb::new([min.x, min.y, min.z].into(), [max.x, max.y, max.z].into());
                        let (containment, below, _) = frustum.classify_masked(&bounds, mask);
                        if containment != Containment::Outside {
                            stack.push((child, below));
                        }
                    }
                }
            }
        }
    }

    fn bytes(&self) -> usize {
        self.tree.as_ref().map_or(0, |t| t.nodes.capacity() * size_of::<BvhNode<f32, 3>>())
            + self.shapes.capacity() * size_of::<Shape>()
    }
}
