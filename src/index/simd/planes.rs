use super::{Boxes, Kernel};
use crate::math::Frustum;

/// A plane made ready for boxes in rows: which row holds the corner farthest along the normal, and which the one
/// farthest against it, per axis.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct PreparedPlane {
    pub(super) normal: [f32; 3],
    pub(super) d: f32,
    /// Rows of the positive vertex; below 6.
    pub(super) far: [u8; 3],
    /// Rows of the negative vertex; below 6.
    pub(super) near: [u8; 3],
}

/// The six planes of a frustum, made ready.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct PlaneSet {
    planes: [PreparedPlane; 6],
}

impl PlaneSet {
    /// Mask of all six planes.
    pub(in crate::index) const ALL: u8 = 0b11_1111;

    pub(in crate::index) fn new(frustum: &Frustum) -> Self {
        let planes = frustum.planes().map(|plane| {
            let normal = plane.normal.to_array();
            let pick =
                |axis: usize, along: bool| (axis + if (normal[axis] >= 0.0) == along { 3 } else { 0 }) as u8;
            PreparedPlane {
                normal,
                d: plane.d,
                far: [pick(0, true), pick(1, true), pick(2, true)],
                near: [pick(0, false), pick(1, false), pick(2, false)],
            }
        });
        Self { planes }
    }

    /// How sixteen boxes lie to the planes of `mask`.
    #[inline(always)]
    pub(in crate::index) fn sides<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<16>) -> Sides {
        let mut all = Sides { behind: 0, cut: 0, cut_by: [0; 6] };
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let (behind, inside) = kernel.sides(&self.planes[i], boxes);
            all.add(i, behind, inside);
        }
        all
    }

    /// How eight boxes lie to the planes of `mask`.
    #[inline(always)]
    pub(in crate::index) fn sides8<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<8>) -> Sides {
        let mut all = Sides { behind: 0, cut: 0, cut_by: [0; 6] };
        let mut left = mask;
        while left != 0 {
            let i = left.trailing_zeros() as usize;
            left &= left - 1;
            let (behind, inside) = kernel.sides8(&self.planes[i], boxes);
            all.add(i, behind, inside);
        }
        all
    }

    /// The boxes of `lanes` that are behind no plane, and how many planes that took.
    #[inline(always)]
    pub(in crate::index) fn seen<K: Kernel>(&self, kernel: K, boxes: &Boxes<16>, lanes: u32) -> (u32, u32) {
        let mut seen = lanes;
        for (i, plane) in self.planes.iter().enumerate() {
            if seen == 0 {
                return (0, i as u32);
            }
            seen &= !kernel.behind(plane, boxes);
        }
        (seen, 6)
    }

    /// The boxes behind one of the planes of `mask`.
    #[inline(always)]
    pub(in crate::index) fn behind<K: Kernel>(&self, kernel: K, mask: u8, boxes: &Boxes<16>) -> u32 {
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

/// How some boxes lie to some planes; a bit a box.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct Sides {
    /// Wholly behind a plane.
    pub(in crate::index) behind: u32,
    /// Not wholly on the inner side of every plane.
    pub(in crate::index) cut: u32,
    /// The same, by plane; only the planes asked for.
    cut_by: [u32; 6],
}

impl Sides {
    #[inline(always)]
    fn add(&mut self, plane: usize, behind: u32, inside: u32) {
        self.behind |= behind;
        self.cut |= !inside;
        self.cut_by[plane] = !inside;
    }

    /// The planes of `mask` that cut box `lane`.
    #[inline(always)]
    pub(in crate::index) fn planes_at(&self, mask: u8, lane: usize) -> u8 {
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
