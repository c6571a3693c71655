//! Finds the node of a polygon without the descent: Morton codes of both corners, XOR, leading zeros.
//!
//! The idea is from Thatcher Ulrich, "Loose Octrees" (Game Programming Gems, 2000) and from the Morton order (G. M.
//! Morton, "A Computer Oriented Geodetic Data Base", 1966). The number of leading bits that two codes share is the
//! depth of the smallest cell around both points. A test compares this node with the node at which the descent of the
//! paper's Fig. 5 ends.

use super::grid::OspGrid;
use osp::math::Aabb;

/// A node of the tree, given by its path from the root.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OspPlace {
    /// Depth of the node; 0 at the root.
    pub depth: u32,
    /// One bit for each step of the path: 1 to the front child, 0 to the back child. The first step is the highest of
    /// `depth` bits.
    pub path: u32,
}

impl OspPlace {
    pub(super) fn of_node(node: u32) -> Self {
        let depth = (node + 1).ilog2();
        Self { depth, path: node + 1 - (1 << depth) }
    }
}

impl OspGrid {
    /// The node at which the descent of the paper's Fig. 5 ends. [`None`] for a box that is not wholly inside the cube.
    /// O(1); reads no node of the tree.
    ///
    /// The descent goes to the front of a plane if the box's minimum is greater than the plane's coordinate. It goes to
    /// the back if the maximum is less. Otherwise it stops, so it stops at every plane from `min` to `max`, both
    /// included. Each axis is divided into the finest cells of the tree. The cell of `min` is the number of planes
    /// strictly below `min`; the cell of `max` is the number of planes at or below `max`. Then the descent continues
    /// exactly as long as both cells lie in the same half.
    pub fn place(&self, bounds: &Aabb) -> Option<OspPlace> {
        if !self.root_box().contains(bounds) {
            return None;
        }
        let cell = |corner: [f32; 3], on_plane: OnPlane| {
            std::array::from_fn(|axis| self.finest_cell(axis, corner[axis], on_plane))
        };
        let least = self.interleave(cell(bounds.min.to_array(), OnPlane::Behind));
        let greatest = self.interleave(cell(bounds.max.to_array(), OnPlane::InFront));
        let differing_bits = u32::BITS - (least ^ greatest).leading_zeros();
        Some(OspPlace { depth: self.max_depth() - differing_bits, path: least >> differing_bits })
    }

    /// The number of the finest cell of `axis` that contains a coordinate.
    fn finest_cell(&self, axis: usize, x: f32, on_plane: OnPlane) -> u32 {
        let level = self.levels(axis);
        let last = (1u32 << level) - 1;
        let is_past = |k: u32| {
            let border = self.border(axis, k, level);
            border < x || (on_plane == OnPlane::InFront && border == x)
        };
        // Rounding may make the quotient wrong by one, so comparisons with the borders correct it.
        let quotient = (x - self.border(axis, 0, level)) / self.size_m() * (last + 1) as f32;
        let mut k = (quotient as u32).min(last);
        while k < last && is_past(k + 1) {
            k += 1;
        }
        while k > 0 && !is_past(k) {
            k -= 1;
        }
        k
    }

    /// The bits of three cell numbers in the order of the splits: x, y, z, the highest first.
    fn interleave(&self, cell: [u32; 3]) -> u32 {
        let mut code = 0;
        for (axis, k) in cell.into_iter().enumerate() {
            // The lowest bit of an axis belongs to its last split. `splits_after` is the number of splits of other axes
            // after this split.
            let splits_after = (self.max_depth() + 2 - axis as u32) % 3;
            code |= spread_by_three(k) << splits_after;
        }
        code
    }
}

/// The side of a plane to which a coordinate on the plane belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OnPlane {
    Behind,
    InFront,
}

/// Moves bit `i` to bit `3 i`, for numbers below 2^10.
fn spread_by_three(k: u32) -> u32 {
    let mut x = k & 0x3ff;
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}
