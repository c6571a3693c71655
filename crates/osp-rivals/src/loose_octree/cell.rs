use glam::Vec3;

use osp::math::Aabb;

/// A cell: its level, its coordinates on this level, and its number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cell {
    pub(super) level: u32,
    at: [u32; 3],
    /// Cells are numbered level by level from the root, on each level along the Morton curve. So the eight children of a
    /// cell are consecutive.
    pub(super) number: u32,
}

impl Cell {
    pub(super) const ROOT: Self = Self { level: 0, at: [0; 3], number: 0 };

    fn new(level: u32, at: [u32; 3]) -> Self {
        let code = (0..level).fold(0, |code, bit| {
            code | (0..3).fold(0, |three, axis| three | (at[axis] >> bit & 1) << axis) << (3 * bit)
        });
        Self { level, at, number: first_of(level) as u32 + code }
    }

    pub(super) fn parent(&self) -> Option<Self> {
        let level = self.level.checked_sub(1)?;
        Some(Self { level, at: self.at.map(|k| k >> 1), number: (self.number - 1) / 8 })
    }

    pub(super) fn child(&self, i: u32) -> Self {
        let at = std::array::from_fn(|axis| 2 * self.at[axis] + (i >> axis & 1));
        Self { level: self.level + 1, at, number: 8 * self.number + 1 + i }
    }
}

/// Number of the first cell of a level.
fn first_of(level: u32) -> usize {
    ((1 << (3 * level)) - 1) / 7
}

#[derive(Clone, Copy, Debug)]
pub(super) struct LooseGrid {
    min: Vec3,
    size_m: f32,
    pub(super) max_depth: u32,
}

impl LooseGrid {
    /// The smallest cube that contains `root` and has the same centre. An invalid root makes a cube of size 0, which
    /// contains nothing.
    pub(super) fn new(root: &Aabb, max_depth: u32) -> Self {
        let size_m = root.extent().max_element();
        if root.is_valid() && size_m.is_finite() {
            Self { min: root.center() - Vec3::splat(0.5 * size_m), size_m, max_depth }
        } else {
            Self { min: Vec3::ZERO, size_m: 0.0, max_depth }
        }
    }

    pub(super) fn cell_count(&self) -> usize {
        first_of(self.max_depth + 1)
    }

    /// The loose box of a cell: twice the cell's edges, around the cell's centre.
    pub(super) fn loose_box(&self, cell: &Cell) -> Aabb {
        let edge_m = self.size_m / (1u32 << cell.level) as f32;
        let corner = |by: f32| self.min + Vec3::from_array(cell.at.map(|k| k as f32 + by)) * edge_m;
        Aabb::new(corner(-0.5), corner(1.5))
    }

    /// The deepest cell that is at least as large as the box and contains the box's centre. [`None`] if the centre is
    /// outside the root, or the box is larger than the root.
    pub(super) fn place(&self, bounds: &Aabb) -> Option<Cell> {
        let center = bounds.center();
        let root = Aabb::new(self.min, self.min + Vec3::splat(self.size_m));
        let extent_m = bounds.extent().max_element();
        if !root.contains(&Aabb::new(center, center)) || extent_m > self.size_m {
            return None;
        }
        // Each level halves the edge, so the quotient's exponent is the level. For a point the quotient is infinite.
        let ratio = (self.size_m / extent_m).max(1.0);
        let level = ((ratio.to_bits() >> 23) - 127).min(self.max_depth);
        let cells = (1u32 << level) as f32;
        let place = (center - self.min) / self.size_m * cells;
        let last = (1u32 << level) - 1;
        let at = [place.x, place.y, place.z].map(|k| (k as u32).min(last));
        let mut next = Some(Cell::new(level, at));
        while let Some(cell) = next {
            if self.loose_box(&cell).contains(bounds) {
                return Some(cell);
            }
            next = cell.parent();
        }
        None
    }
}
