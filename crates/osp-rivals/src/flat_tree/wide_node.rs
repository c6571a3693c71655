use osp::index::kernels::Boxes;

/// Children of a node.
pub(super) const WIDTH: usize = 8;

/// The child is a leaf.
pub(super) const LEAF: u32 = u32::MAX;

/// A node with up to eight children; those that are not there have empty boxes.
#[derive(Clone, Debug)]
pub(super) struct WideNode {
    pub(super) boxes: Boxes<WIDTH>,
    /// The node of each child, or [`LEAF`].
    pub(super) children: [u32; WIDTH],
    /// The polygons of each child: place of the first, and their number, holes included.
    pub(super) first: [u32; WIDTH],
    pub(super) polygons: [u32; WIDTH],
    pub(super) used: u32,
}
