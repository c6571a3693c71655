use glam::Vec3;

use super::{
    grid::{Cell, OspGrid},
    state::State,
};
use osp::{
    math::{Aabb, Plane},
    polygon::PolygonId,
};

/// The number that stands for no node; a leaf has no children.
pub(super) const NONE: u32 = u32::MAX;

/// A node with the fields of the paper's Fig. 3, where it is called `BIOCTREENODE`.
#[derive(Clone, Debug)]
pub(super) struct OspNode {
    /// `Spliter`: the plane that halves the node; its normal points to the front child.
    pub(super) splitter: Plane,
    /// `Front`: the child on the side of growing coordinates, or [`NONE`].
    pub(super) front: u32,
    /// `Back`: the other child, or [`NONE`].
    pub(super) back: u32,
    /// `IsLeaf`: the node is at the maximum depth.
    pub(super) is_leaf: bool,
    /// `IsPolygon`: the node's own list is not empty.
    pub(super) is_polygon: bool,
    /// `IsSubnode`: whether nodes below have polygons.
    pub(super) is_subnode: bool,
    /// `state`: the orientation of the node's plane.
    pub(super) state: State,
    /// `Depth`, in binary levels: 0 at the root.
    pub(super) depth: u32,
    /// `Centerpoint`.
    pub(super) center: Vec3,
    /// `Width`: the longest edge, metres.
    pub(super) width_m: f32,
    /// `OSPBox`: the eight corners, in the order of [`Aabb::corners`].
    pub(super) osp_box: [Vec3; 8],
    /// `TriName`: the polygons that no child contains.
    pub(super) tri_names: Vec<PolygonId>,
    /// Not in the paper: number of polygons in the node and below.
    pub(super) polygons: u32,
}

impl OspNode {
    pub(super) fn new(grid: &OspGrid, cell: &Cell, depth: u32, children: Option<(u32, u32)>) -> Self {
        let state = State::at_depth(depth);
        let bounds = grid.cell_box(cell);
        let (front, back) = children.unwrap_or((NONE, NONE));
        Self {
            splitter: Plane { normal: state.normal(), d: -cell.split(grid, state) },
            front,
            back,
            is_leaf: children.is_none(),
            is_polygon: false,
            is_subnode: false,
            state,
            depth,
            center: bounds.center(),
            width_m: grid.size_m() / (1u32 << (depth / 3)) as f32,
            osp_box: bounds.corners(),
            tri_names: Vec::new(),
            polygons: 0,
        }
    }

    /// The box whose corners are `OSPBox`.
    pub(super) fn bounds(&self) -> Aabb {
        Aabb::new(self.osp_box[0], self.osp_box[7])
    }

    /// Whether the node or the nodes below have polygons.
    pub(super) fn holds_any(&self) -> bool {
        self.is_polygon || self.is_subnode
    }
}
