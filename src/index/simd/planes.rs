use super::{Boxes, Halves, Kernel, PreparedPlane};
use crate::math::{Aabb, Frustum};

/// The six planes of a frustum, prepared for tests of many boxes at once.
#[derive(Clone, Copy, Debug)]
pub struct PlaneSet {
    pub(crate) planes: [PreparedPlane; 6],
}

impl PlaneSet {
    /// The mask that selects all six planes.
    pub const ALL: u8 = 0b11_1111;

    /// The planes of a frustum, prepared for tests of many boxes.
    pub fn new(frustum: &Frustum) -> Self {
        let prepare = |i: usize| {
            let plane = frustum.planes()[i];
            let normal = plane.normal.to_array();
            let pick =
                |axis: usize, along: bool| 8 * (axis + if (normal[axis] >= 0.0) == along { 3 } else { 0 });
            PreparedPlane {
                normal,
                d: plane.d,
                far: [pick(0, true), pick(1, true), pick(2, true)],
                near: [pick(0, false), pick(1, false), pick(2, false)],
            }
        };
        // The six calls are spelt out, because the compiler does not inline `map` on an array.
        Self { planes: [prepare(0), prepare(1), prepare(2), prepare(3), prepare(4), prepare(5)] }
    }

    /// Positions of sixteen boxes, in halves of eight, relative to the planes of `mask`.
    #[inline(always)]
    pub(crate) fn sides16<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Halves) -> Sides {
        let mut all = Sides::NONE;
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let low = kernel.sides(&self.planes[i], &boxes.0[0], 0);
            let high = kernel.sides(&self.planes[i], &boxes.0[1], 0);
            all.add(i, low.0 | high.0 << 8, low.1 | high.1 << 8);
        }
        all
    }

    /// Among sixteen boxes, the boxes wholly behind one of the planes of `mask`.
    #[inline(always)]
    pub(crate) fn behind16<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Halves) -> u32 {
        let mut behind = 0;
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let (low, _) = kernel.sides(&self.planes[i], &boxes.0[0], 0);
            let (high, _) = kernel.sides(&self.planes[i], &boxes.0[1], 0);
            behind |= low | high << 8;
        }
        behind
    }

    /// Positions of sixteen boxes, in rows of sixteen, relative to the planes of `mask`. If all lie behind planes, the
    /// rest is unspecified.
    #[inline(always)]
    pub fn sides_rows<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<16>) -> Sides {
        let mut all = Sides::NONE;
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let (behind, inside) = kernel.sides16(&self.planes[i], boxes);
            all.add(i, behind, inside);
            if all.behind == 0xFFFF {
                break;
            }
        }
        all
    }

    /// Positions of eight boxes relative to the planes of `mask`.
    #[inline(always)]
    pub fn sides8<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<8>) -> Sides {
        let mut all = Sides::NONE;
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let (behind, inside) = kernel.sides(&self.planes[i], boxes, 0);
            all.add(i, behind, inside);
        }
        all
    }

    /// The boxes wholly behind one of the six planes.
    #[inline(always)]
    pub fn behind_any<K: Kernel>(&self, kernel: K, boxes: &Boxes<16>) -> u32 {
        kernel.behind_any(&self.planes, boxes)
    }

    /// One of the planes.
    #[inline(always)]
    pub(crate) fn plane(&self, i: usize) -> PreparedPlane {
        self.planes[i]
    }

    /// The boxes wholly behind one of the planes of `mask`.
    #[inline(always)]
    pub fn behind<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<16>) -> u32 {
        let mut behind = 0;
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            behind |= kernel.behind(&self.planes[i], boxes);
        }
        behind
    }
}

/// The six planes of a frustum as lanes, to test one box against all of them at once. Unused lanes are 0, so every box
/// lies on their inner side.
#[derive(Clone, Copy, Debug)]
pub struct PlaneLanes {
    normal: [[f32; 8]; 3],
    d: [f32; 8],
    /// For each axis, whether the normal of a plane has a component of at least 0. If so, the corner farthest along the
    /// normal has the box's maximum on this axis.
    rises: [[bool; 8]; 3],
}

impl PlaneLanes {
    /// Prepares the planes of a frustum.
    pub fn new(frustum: &Frustum) -> Self {
        let mut all = Self { normal: [[0.0; 8]; 3], d: [0.0; 8], rises: [[true; 8]; 3] };
        for (i, plane) in frustum.planes().iter().enumerate() {
            for axis in 0..3 {
                all.normal[axis][i] = plane.normal[axis];
                all.rises[axis][i] = plane.normal[axis] >= 0.0;
            }
            all.d[i] = plane.d;
        }
        all
    }

    /// The planes of `mask` that cut a box; `None` if the box lies wholly behind one of them. The kernel argument only
    /// selects the instruction set.
    #[inline(always)]
    pub fn cut<K: Kernel>(&self, _kernel: K, mask: u8, bounds: &Aabb) -> Option<u8> {
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        let distances = |is_far: bool| -> [f32; 8] {
            std::array::from_fn(|i| {
                let at = |axis: usize| if self.rises[axis][i] == is_far { max[axis] } else { min[axis] };
                let [x, y, z] =
                    [self.normal[0][i] * at(0), self.normal[1][i] * at(1), self.normal[2][i] * at(2)];
                ((x + y) + z) + self.d[i]
            })
        };
        let bits = |test: [bool; 8]| (0..8).fold(0, |bits, i| bits | u8::from(test[i]) << i);
        let behind = bits(distances(true).map(|distance| distance < 0.0));
        if behind & mask != 0 {
            return None;
        }
        Some(mask & !bits(distances(false).map(|distance| distance >= 0.0)))
    }
}

/// Positions of boxes relative to planes, a bit for each box.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    /// Boxes that lie wholly behind a plane.
    pub behind: u32,
    /// Boxes that do not lie wholly on the inner side of every plane.
    pub cut: u32,
    /// For each requested plane, the boxes that do not lie wholly on its inner side. Entries 6 and 7 are 0; they fill a SIMD
    /// register.
    cut_by: [u32; 8],
}

impl Sides {
    /// The result of no test: no box is behind or cut.
    pub(crate) const NONE: Self = Self { behind: 0, cut: 0, cut_by: [0; 8] };

    /// The planes of `mask` that cut one of these boxes.
    #[inline(always)]
    pub(crate) fn cutting(&self, mask: u8, boxes: u32) -> u8 {
        let mut planes = 0;
        for (plane, cut) in self.cut_by.iter().enumerate() {
            planes |= u8::from(cut & boxes != 0) << plane;
        }
        mask & planes
    }

    /// The boxes that exactly one plane of `mask` cuts.
    #[inline(always)]
    pub(crate) fn cut_once(&self, mask: u8) -> u32 {
        let (mut once, mut again) = (0, 0);
        let mut left = mask;
        while left != 0 {
            let cut = self.cut_by(left.trailing_zeros() as usize);
            left &= left - 1;
            again |= once & cut;
            once |= cut;
        }
        once & !again
    }

    /// The boxes that a requested plane cuts.
    #[inline(always)]
    pub(crate) fn cut_by(&self, plane: usize) -> u32 {
        self.cut_by[plane]
    }

    #[inline(always)]
    fn add(&mut self, plane: usize, behind: u32, inside: u32) {
        self.behind |= behind;
        self.cut |= !inside;
        self.cut_by[plane] = !inside;
    }

    /// The planes of `mask` that cut box `lane`.
    #[inline(always)]
    pub fn planes_at(&self, mask: u8, lane: usize) -> u8 {
        if mask & mask.wrapping_sub(1) == 0 {
            return if self.cut >> lane & 1 == 1 { mask } else { 0 };
        }
        let mut planes = 0;
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            planes |= ((self.cut_by[i] >> lane & 1) as u8) << i;
        }
        planes
    }
}
