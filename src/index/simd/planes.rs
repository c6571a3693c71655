use super::{Boxes, Kernel, PreparedPlane, lanes_of};
use crate::math::Frustum;

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

    /// Positions of 8 or 16 boxes relative to the planes of `mask`.
    #[inline(always)]
    pub fn sides<K: Kernel, const B: usize>(&self, kernel: K, mask: u8, boxes: &Boxes<B>) -> Sides {
        self.sides_until(kernel, mask, boxes, u32::MAX)
    }

    /// Does the same for sixteen boxes, and ends early if all lie behind planes. The rest is then unspecified.
    #[inline(always)]
    pub fn sides_in_order<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<16>) -> Sides {
        self.sides_until(kernel, mask, boxes, 0xFFFF)
    }

    /// Ends if the boxes behind planes are `last`.
    #[inline(always)]
    fn sides_until<K: Kernel, const B: usize>(
        &self,
        kernel: K,
        mask: u8,
        boxes: &Boxes<B>,
        last: u32,
    ) -> Sides {
        // Two variables of their own stay in registers.
        let (mut all, mut behind, mut cut) = (Sides::NONE, 0, 0);
        for i in lanes_of(mask) {
            let sides = kernel.sides(&self.planes[i], boxes);
            (behind, cut) = (behind | sides.0, cut | !sides.1);
            all.cut_by[i] = !sides.1;
            if behind == last {
                break;
            }
        }
        (all.behind, all.cut) = (behind, cut);
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
        for i in lanes_of(mask) {
            behind |= kernel.behind(&self.planes[i], boxes);
        }
        behind
    }
}

/// Positions of boxes relative to planes, a bit for each box.
#[derive(Clone, Copy, Debug)]
pub struct Sides {
    /// Boxes that lie wholly behind a plane.
    pub behind: u32,
    /// Boxes that do not lie wholly on the inner side of every plane.
    pub cut: u32,
    /// For each requested plane, the boxes that do not lie wholly on its inner side.
    cut_by: [u32; 8],
}

impl Sides {
    /// The result of no test: no box is behind or cut.
    pub(crate) const NONE: Self = Self { behind: 0, cut: 0, cut_by: [0; 8] };

    /// Adds the positions relative to the planes of another view. Then a box is behind if it is for both views, and cut if
    /// it is for one of them.
    #[inline(always)]
    pub(crate) fn join(&mut self, other: &Self) {
        self.behind &= other.behind;
        self.cut |= other.cut;
        for (own, other) in self.cut_by.iter_mut().zip(other.cut_by) {
            *own |= other;
        }
    }

    /// The boxes that exactly one plane of `mask` cuts.
    #[inline(always)]
    pub(crate) fn cut_once(&self, mask: u8) -> u32 {
        let (mut once, mut again) = (0, 0);
        for plane in lanes_of(mask) {
            let cut = self.cut_by(plane);
            again |= once & cut;
            once |= cut;
        }
        once & !again
    }

    /// The boxes that a requested plane cuts.
    #[inline(always)]
    pub(crate) fn cut_by(&self, plane: usize) -> u32 {
        self.cut_by[plane % 8]
    }

    /// The planes of `mask` that cut box `lane`.
    #[inline(always)]
    pub fn planes_at(&self, mask: u8, lane: usize) -> u8 {
        if mask & mask.wrapping_sub(1) == 0 {
            return if self.cut >> lane & 1 == 1 { mask } else { 0 };
        }
        let mut planes = 0;
        for i in lanes_of(mask) {
            planes |= ((self.cut_by(i) >> lane & 1) as u8) << i;
        }
        planes
    }
}
