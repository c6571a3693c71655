use glam::{Vec3, Vec4, Vec4Swizzles};

use crate::math::Aabb;

/// `N` boxes as six rows of `N` numbers: `[min x, min y, min z, max x, max y, max z]`. Column `i` of all rows is lane
/// `i`, one box.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Boxes<const N: usize> {
    pub(crate) rows: [[f32; N]; 6],
}

impl<const N: usize> Boxes<N> {
    /// Boxes with an empty box in every lane.
    pub const EMPTY: Self = {
        let (inf, neg) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        Self { rows: [inf, inf, inf, neg, neg, neg] }
    };

    /// The box of a lane.
    #[inline]
    pub fn get(&self, lane: usize) -> Aabb {
        let at = |row: usize| self.rows[row][lane];
        Aabb { min: Vec3::new(at(0), at(1), at(2)), max: Vec3::new(at(3), at(4), at(5)) }
    }

    /// Replaces the box of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, bounds: &Aabb) {
        let numbers = [bounds.min.x, bounds.min.y, bounds.min.z, bounds.max.x, bounds.max.y, bounds.max.z];
        for (row, number) in self.rows.iter_mut().zip(numbers) {
            row[lane] = number;
        }
    }

    /// Sets the box of a lane.
    #[inline]
    pub(crate) fn set_wide(&mut self, lane: usize, bounds: Wide) {
        self.set(lane, &bounds.to_box());
    }

    /// Widens the box of a lane so that it contains `bounds`. Returns false if the box contained `bounds`
    /// before.
    #[inline]
    pub fn widen(&mut self, lane: usize, bounds: &Aabb) -> bool {
        let old = self.get(lane);
        if old.contains(bounds) {
            return false;
        }
        self.set(lane, &old.union(bounds));
        true
    }

    /// Widens the box of a lane so that it contains `bounds`, without a branch.
    #[inline(always)]
    pub fn grow(&mut self, lane: usize, bounds: &Aabb) {
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        for axis in 0..3 {
            let (low, high) = (self.rows[axis][lane], self.rows[axis + 3][lane]);
            self.rows[axis][lane] = if min[axis] < low { min[axis] } else { low };
            self.rows[axis + 3][lane] = if max[axis] > high { max[axis] } else { high };
        }
    }

    /// The box around the boxes in the lanes of `mask`, which is below `2^N`.
    #[inline]
    pub fn around(&self, mask: u32) -> Aabb {
        let is_selected: [bool; N] = std::array::from_fn(|lane| mask >> lane & 1 == 1);
        // Each step compares one half of the lanes with the other half, so that SIMD compares many lanes at once.
        let fold = |row: usize, none: f32, takes: fn(f32, f32) -> bool| {
            let mut lanes: [f32; N] =
                std::array::from_fn(|lane| if is_selected[lane] { self.rows[row][lane] } else { none });
            let mut half = N / 2;
            while half > 0 {
                for lane in 0..half {
                    let (a, b) = (lanes[lane], lanes[lane + half]);
                    lanes[lane] = if takes(a, b) { a } else { b };
                }
                half /= 2;
            }
            lanes[0]
        };
        let low = |row| fold(row, f32::INFINITY, |a, b| a < b);
        let high = |row| fold(row, f32::NEG_INFINITY, |a, b| a > b);
        Aabb { min: Vec3::new(low(0), low(1), low(2)), max: Vec3::new(high(3), high(4), high(5)) }
    }
}

/// A box in two SIMD registers, min and max. The fourth number of each repeats the third, so it changes no comparison
/// and no maximum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wide {
    min: Vec4,
    max: Vec4,
}

impl Wide {
    /// The empty box, as [`Aabb::EMPTY`].
    pub(crate) const EMPTY: Self = Self { min: Vec4::INFINITY, max: Vec4::NEG_INFINITY };

    #[inline]
    pub(crate) fn from_box(bounds: &Aabb) -> Self {
        let (min, max) = (bounds.min, bounds.max);
        // Two loads of four consecutive numbers each are faster than six loads.
        let low = Vec4::new(min.x, min.y, min.z, max.x);
        let high = Vec4::new(min.z, max.x, max.y, max.z);
        Self { min: low.xyzz(), max: high.yzww() }
    }

    #[inline]
    pub(crate) fn to_box(self) -> Aabb {
        Aabb { min: self.min.truncate(), max: self.max.truncate() }
    }

    /// Whether an index accepts the box, see [`Aabb::is_valid`].
    #[inline]
    pub(crate) fn is_valid(self) -> bool {
        let is_finite = self.min.cmpgt(Vec4::NEG_INFINITY) & self.max.cmplt(Vec4::INFINITY);
        (self.min.cmple(self.max) & is_finite).all()
    }

    #[inline]
    pub(crate) fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    #[inline]
    pub(crate) fn contains(self, other: Self) -> bool {
        (self.min.cmple(other.min) & other.max.cmple(self.max)).all()
    }

    /// Length of the longest edge.
    #[inline]
    pub(crate) fn length(self) -> f32 {
        (self.max - self.min).max_element()
    }

    /// Centre of the box; overflows for huge boxes.
    #[inline]
    pub(crate) fn center(self) -> Vec4 {
        (self.min + self.max) * 0.5
    }
}
