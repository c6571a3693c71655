use glam::Vec3;

use osp::math::Aabb;

/// Default number of binary levels below the root: five full cycles, 65,535 nodes. Each further level halves the leaves and
/// doubles the memory.
pub const DEFAULT_MAX_DEPTH: u32 = 15;

/// Largest depth of a tree. Larger depths are reduced to it. All nodes exist from the start, and 21 levels already have
/// four million nodes.
pub const MAX_MAX_DEPTH: u32 = 21;

/// The splitting planes of an OSP tree (the paper's section 2.2, input ①: centre, size, maximum depth).
///
/// The position of every plane is computed from its number on its level, never from its parent's position. So it does not
/// depend on the path to the plane, and neighbouring cells share their border, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OspGrid {
    min: Vec3,
    size_m: f32,
    max_depth: u32,
}

impl OspGrid {
    /// A cube around `center`. A centre or size that is not finite makes a cube of size 0 at the origin. Every polygon
    /// is then outside the cube, but queries still find it.
    pub fn new(center: Vec3, size_m: f32, max_depth: u32) -> Self {
        let max_depth = max_depth.min(MAX_MAX_DEPTH);
        if center.is_finite() && size_m.is_finite() && size_m >= 0.0 {
            Self { min: center - Vec3::splat(size_m * 0.5), size_m, max_depth }
        } else {
            Self { min: Vec3::ZERO, size_m: 0.0, max_depth }
        }
    }

    /// Number of binary levels below the root.
    pub fn max_depth(&self) -> u32 {
        self.max_depth
    }

    /// Number of times that an axis is halved on the way from the root to a leaf.
    pub(super) fn levels(&self, axis: usize) -> u32 {
        (self.max_depth + 2 - axis as u32) / 3
    }

    /// Border number `k` of `axis`, counted from the cube's minimum, if the axis is cut into `2^level` cells. It never
    /// decreases with `k`; in a small cube far from the origin, neighbouring borders may be equal.
    pub(super) fn border(&self, axis: usize, k: u32, level: u32) -> f32 {
        self.min[axis] + self.size_m * (k as f32 / (1u32 << level) as f32)
    }

    pub(super) fn cell_box(&self, cell: &Cell) -> Aabb {
        let corner = |add: u32| {
            Vec3::from_array(std::array::from_fn(|a| self.border(a, cell.k[a] + add, cell.level[a])))
        };
        Aabb::new(corner(0), corner(1))
    }

    /// The cube.
    pub fn root_box(&self) -> Aabb {
        self.cell_box(&Cell::ROOT)
    }

    /// The length of the cube's edges, metres.
    pub(super) fn size_m(&self) -> f32 {
        self.size_m
    }
}

/// A cell: on each axis its number, and the level, which cuts the axis into `2^level` cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) k: [u32; 3],
    pub(super) level: [u32; 3],
}

impl Cell {
    pub(super) const ROOT: Self = Self { k: [0; 3], level: [0; 3] };

    /// Position of the plane that halves the cell across an axis.
    pub(super) fn split(&self, grid: &OspGrid, axis: usize) -> f32 {
        grid.border(axis, 2 * self.k[axis] + 1, self.level[axis] + 1)
    }

    /// One half of the cell, in front of this plane (`1`) or behind it (`0`).
    pub(super) fn half(&self, axis: usize, front: u32) -> Self {
        let mut half = *self;
        half.k[axis] = 2 * self.k[axis] + front;
        half.level[axis] += 1;
        half
    }
}
