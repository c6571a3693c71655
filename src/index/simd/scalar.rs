use std::mem::MaybeUninit;

use super::{Boxes, Kernel, PreparedPlane};

/// Plain Rust; the form that the others are tested against.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct Scalar;

impl Scalar {
    #[inline(always)]
    fn below<const N: usize>(plane: &PreparedPlane, rows: [u8; 3], boxes: &Boxes<N>) -> [f32; N] {
        let [x, y, z] = rows.map(|row| &boxes.rows[usize::from(row)]);
        let [nx, ny, nz] = plane.normal;
        std::array::from_fn(|i| ((nx * x[i] + ny * y[i]) + nz * z[i]) + plane.d)
    }

    #[inline(always)]
    fn mask<const N: usize>(distances: [f32; N], test: impl Fn(f32) -> bool) -> u32 {
        distances.iter().enumerate().fold(0, |mask, (i, &distance)| mask | u32::from(test(distance)) << i)
    }
}

impl Kernel for Scalar {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        Self::mask(Self::below(plane, plane.far, boxes), |distance| distance < 0.0)
    }

    #[inline(always)]
    fn sides(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> (u32, u32) {
        let inside = Self::mask(Self::below(plane, plane.near, boxes), |distance| distance >= 0.0);
        (self.behind(plane, boxes), inside)
    }

    #[inline(always)]
    fn sides8(self, plane: &PreparedPlane, boxes: &Boxes<8>) -> (u32, u32) {
        let behind = Self::mask(Self::below(plane, plane.far, boxes), |distance| distance < 0.0);
        let inside = Self::mask(Self::below(plane, plane.near, boxes), |distance| distance >= 0.0);
        (behind, inside)
    }

    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        let mut left = mask;
        let mut n = 0;
        while left != 0 {
            out[n].write(first + left.trailing_zeros());
            n += 1;
            left &= left - 1;
        }
        n
    }

    #[inline(always)]
    fn prefetch<T>(self, _place: &T) {}
}
