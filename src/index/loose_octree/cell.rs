use glam::Vec3;

use crate::math::Aabb;

/// A cell: its level, and its place on that level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) level: u32,
    pub(super) at: [u32; 3],
}

impl Cell {
    pub(super) const ROOT: Self = Self { level: 0, at: [0; 3] };

    pub(super) fn parent(&self) -> Option<Self> {
        Some(Self { level: self.level.checked_sub(1)?, at: self.at.map(|k| k >> 1) })
    }

    pub(super) fn child(&self, i: u32) -> Self {
        Self { level: self.level + 1, at: std::array::from_fn(|axis| 2 * self.at[axis] + (i >> axis & 1)) }
    }
}

/// Where the cells lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct LooseGrid {
    min: Vec3,
    size_m: f32,
    pub(super) max_depth: u32,
}

impl LooseGrid {
    /// The smallest cube around the root's middle that holds it. A root that is no box makes a cube of size 0, outside
    /// of which everything is.
    pub(super) fn new(root: &Aabb, max_depth: u32) -> Self {
        let size_m = root.extent().max_element();
        if root.is_valid() && size_m.is_finite() {
            Self { min: root.center() - Vec3::splat(0.5 * size_m), size_m, max_depth }
        } else {
            Self { min: Vec3::ZERO, size_m: 0.0, max_depth }
        }
    }

    /// Cells of all levels.
    pub(super) fn cell_count(&self) -> usize {
        Self::first_of(self.max_depth + 1)
    }

    /// Number of the first cell of a level.
    fn first_of(level: u32) -> usize {
        ((1 << (3 * level)) - 1) / 7
    }

    pub(super) fn number(&self, cell: &Cell) -> usize {
        let [x, y, z] = cell.at.map(|k| k as usize);
        Self::first_of(cell.level) + (((z << cell.level) | y) << cell.level | x)
    }

    /// The cell with a number.
    pub(super) fn cell_at(&self, number: usize) -> Cell {
        let level = (0..=self.max_depth).rev().find(|&level| number >= Self::first_of(level)).unwrap_or(0);
        let place = number - Self::first_of(level);
        let mask = (1 << level) - 1;
        Cell { level, at: [0, 1, 2].map(|axis| (place >> (axis * level) & mask) as u32) }
    }

    /// The loose box of a cell: twice its edge, around its middle.
    pub(super) fn loose_box(&self, cell: &Cell) -> Aabb {
        let edge_m = self.size_m / (1u32 << cell.level) as f32;
        let corner = |by: f32| self.min + Vec3::from_array(cell.at.map(|k| k as f32 + by)) * edge_m;
        Aabb::new(corner(-0.5), corner(1.5))
    }

    /// The deepest cell that is at least as large as the box and holds its centre; [`None`] outside the root, or if
    /// the box is larger.
    pub(super) fn place(&self, bounds: &Aabb) -> Option<Cell> {
        let center = bounds.center();
        let root = Aabb::new(self.min, self.min + Vec3::splat(self.size_m));
        let extent_m = bounds.extent().max_element();
        if !root.contains(&Aabb::new(center, center)) || extent_m > self.size_m {
            return None;
        }
        // Each level halves the edge: the quotient's exponent is the level. A point has an infinite quotient.
        let ratio = (self.size_m / extent_m).max(1.0);
        let level = ((ratio.to_bits() >> 23) - 127).min(self.max_depth);
        let cells = (1u32 << level) as f32;
        let place = (center - self.min) / self.size_m * cells;
        let last = (1u32 << level) - 1;
        let at = [place.x, place.y, place.z].map(|k| (k as u32).min(last));
        let mut next = Some(Cell { level, at });
        while let Some(cell) = next {
            if self.loose_box(&cell).contains(bounds) {
                return Some(cell);
            }
            next = cell.parent();
        }
        None
    }
}
