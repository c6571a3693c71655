use osp::index::kernels::Boxes;

pub(super) const WIDTH: usize = 8;

/// Value in `children` of a child that is a leaf.
pub(super) const LEAF: u32 = u32::MAX;

/// A node with up to eight children. Unused children have empty boxes.
#[derive(Clone, Debug)]
pub(super) struct WideNode {
    pub(super) boxes: Boxes<WIDTH>,
    /// The number of each child's node, or [`LEAF`].
    pub(super) children: [u32; WIDTH],
    /// The position of each child's first polygon.
    pub(super) first: [u32; WIDTH],
    /// The number of each child's polygons, including holes.
    pub(super) polygons: [u32; WIDTH],
    pub(super) used: u32,
}
