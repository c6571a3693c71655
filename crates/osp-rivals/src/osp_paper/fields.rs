use glam::Vec3;

use super::tree::OspPaper;
use osp::{math::Aabb, polygon::PolygonId};

/// The fields of a node of [`OspPaper`], named as in the paper's Fig. 3, for drawings of the tree.
#[derive(Clone, Copy, Debug)]
pub struct OspPaperNode<'a> {
    /// `Centerpoint`, metres.
    pub center: Vec3,
    /// `Width`: the longest edge, metres.
    pub width_m: f32,
    /// `OSPBox`, metres.
    pub bounds: Aabb,
    /// `Depth`, in binary levels: 0 at the root.
    pub depth: u32,
    /// `state`: the axis that the node's plane cuts; 0 is x, 1 is y, 2 is z.
    pub axis: usize,
    /// `Spliter`: the position of the node's plane on that axis, metres.
    pub plane_m: f32,
    /// `IsLeaf`: whether the node is at the maximum depth.
    pub is_leaf: bool,
    /// `IsPolygon`: whether the node has polygons of its own.
    pub is_polygon: bool,
    /// `IsSubnode`: whether nodes below have polygons.
    pub is_subnode: bool,
    /// `TriName`: the polygons that lie in this node and in no child.
    pub polygons: &'a [PolygonId],
    /// Number of polygons in the node and below.
    pub polygons_in_all: usize,
}

impl OspPaper {
    /// A node by its number: 0 is the root; behind the plane of node `i` is node `2 i + 1`, in front of it `2 i + 2`. `None`
    /// beyond the deepest level.
    pub fn node(&self, number: usize) -> Option<OspPaperNode<'_>> {
        let node = self.nodes.get(number)?;
        Some(OspPaperNode {
            center: node.center,
            width_m: node.width_m,
            bounds: node.bounds(),
            depth: node.depth,
            axis: node.state.axis(),
            plane_m: -node.splitter.d,
            is_leaf: node.is_leaf,
            is_polygon: node.is_polygon,
            is_subnode: node.is_subnode,
            polygons: &node.tri_names,
            polygons_in_all: node.polygons as usize,
        })
    }

    /// The polygons that are not wholly inside the cube, and their common box.
    pub fn outside(&self) -> (&[PolygonId], Aabb) {
        let bounds = self.outside.iter().fold(Aabb::EMPTY, |all, &id| all.union(&self.boxes.get(id)));
        (&self.outside, bounds)
    }
}
