use glam::Vec3;

use super::grid::{Cell, OspGrid};
use osp::{
    math::{Aabb, Plane},
    polygon::PolygonId,
};

/// The number that stands for no node; a leaf has no children.
pub(super) const NONE: u32 = u32::MAX;

/// A node with the fields of the paper's Fig. 3, where it is called `BIOCTREENODE`.
#[derive(Clone, Debug)]
pub struct OspNode {
    /// `Spliter`: the plane that halves the node; its normal points to the front child.
    pub splitter: Plane,
    /// `Front`: the child on the side of growing coordinates, or `u32::MAX`.
    pub front: u32,
    /// `Back`: the other child, or `u32::MAX`.
    pub back: u32,
    /// `IsLeaf`: the node is at the maximum depth.
    pub is_leaf: bool,
    /// `IsPolygon`: the node's own list is not empty.
    pub is_polygon: bool,
    /// `IsSubnode`: whether nodes below have polygons.
    pub is_subnode: bool,
    /// `state` (Fig. 4): the axis that the node's plane cuts; 0 is x, 1 is y, 2 is z.
    pub axis: usize,
    /// `Depth`, in binary levels: 0 at the root.
    pub depth: u32,
    /// `Centerpoint`, metres.
    pub center: Vec3,
    /// `Width`: the longest edge, metres.
    pub width_m: f32,
    /// `OSPBox`: the eight corners, in the order of [`Aabb::corners`], metres.
    pub osp_box: [Vec3; 8],
    /// `TriName`: the polygons that no child contains.
    pub tri_names: Vec<PolygonId>,
    /// Not in the paper: number of polygons in the node and below.
    pub polygons: u32,
}

impl OspNode {
    pub(super) fn new(grid: &OspGrid, cell: &Cell, depth: u32, children: Option<(u32, u32)>) -> Self {
        let axis = depth as usize % 3;
        let bounds = grid.cell_box(cell);
        let (front, back) = children.unwrap_or((NONE, NONE));
        Self {
            splitter: Plane { normal: Vec3::AXES[axis], d: -cell.split(grid, axis) },
            front,
            back,
            is_leaf: children.is_none(),
            is_polygon: false,
            is_subnode: false,
            axis,
            depth,
            center: bounds.center(),
            width_m: grid.size_m() / (1u32 << (depth / 3)) as f32,
            osp_box: bounds.corners(),
            tri_names: Vec::new(),
            polygons: 0,
        }
    }

    /// The box whose corners are `OSPBox`.
    pub fn bounds(&self) -> Aabb {
        Aabb::new(self.osp_box[0], self.osp_box[7])
    }

    /// Position of the plane on its axis, metres.
    pub fn plane_m(&self) -> f32 {
        -self.splitter.d
    }

    /// Whether the node or the nodes below have polygons.
    pub(super) fn holds_any(&self) -> bool {
        self.is_polygon || self.is_subnode
    }
}
