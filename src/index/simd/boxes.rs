use crate::math::Aabb;
use glam::Vec3;

/// `N` boxes, one array per number: `[min x, min y, min z, max x, max y, max z]`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(in crate::index) struct Boxes<const N: usize> {
    pub(in crate::index) rows: [[f32; N]; 6],
}

impl<const N: usize> Boxes<N> {
    /// No box in any lane.
    pub(in crate::index) const EMPTY: Self = {
        let (inf, neg) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        Self { rows: [inf, inf, inf, neg, neg, neg] }
    };

    #[inline]
    pub(in crate::index) fn get(&self, lane: usize) -> Aabb {
        let at = |row: usize| self.rows[row][lane];
        Aabb { min: Vec3::new(at(0), at(1), at(2)), max: Vec3::new(at(3), at(4), at(5)) }
    }

    #[inline]
    pub(in crate::index) fn set(&mut self, lane: usize, bounds: &Aabb) {
        let numbers = [bounds.min.x, bounds.min.y, bounds.min.z, bounds.max.x, bounds.max.y, bounds.max.z];
        for (row, number) in self.rows.iter_mut().zip(numbers) {
            row[lane] = number;
        }
    }

    /// Widens a lane so that it holds `bounds`; false if it did already.
    #[inline]
    pub(in crate::index) fn widen(&mut self, lane: usize, bounds: &Aabb) -> bool {
        let old = self.get(lane);
        if old.contains(bounds) {
            return false;
        }
        self.set(lane, &old.union(bounds));
        true
    }

    /// The box around the lanes of `mask`.
    #[inline]
    pub(in crate::index) fn around(&self, mask: u32) -> Aabb {
        let mut all = Aabb::EMPTY;
        let mut left = mask;
        while left != 0 {
            all = all.union(&self.get(left.trailing_zeros() as usize));
            left &= left - 1;
        }
        all
    }
}
