use std::mem::MaybeUninit;

use super::{Boxes, Kernel, PreparedPlane};

/// The kernel in plain Rust. The other kernels are tested against it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar;

impl Scalar {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self
    }

    #[inline(always)]
    fn distances<const N: usize>(
        plane: &PreparedPlane,
        rows: [usize; 3],
        boxes: &Boxes<N>,
        at: usize,
    ) -> [f32; 8] {
        let [x, y, z] = rows.map(|row| &boxes.rows[row / 8][at..at + 8]);
        let [nx, ny, nz] = plane.normal;
        std::array::from_fn(|i| ((nx * x[i] + ny * y[i]) + nz * z[i]) + plane.d)
    }

    #[inline(always)]
    fn mask(distances: [f32; 8], test: impl Fn(f32) -> bool) -> u32 {
        distances.iter().enumerate().fold(0, |mask, (i, &distance)| mask | u32::from(test(distance)) << i)
    }
}

impl Kernel for Scalar {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        let below = |at| Self::mask(Self::distances(plane, plane.far, boxes, at), |distance| distance < 0.0);
        below(0) | below(8) << 8
    }

    #[inline(always)]
    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32 {
        let mut behind = 0;
        for plane in planes {
            behind |= self.behind(plane, boxes);
            if behind == 0xFFFF {
                break;
            }
        }
        behind
    }

    #[inline(always)]
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> (u32, u32) {
        let behind = Self::mask(Self::distances(plane, plane.far, boxes, at), |distance| distance < 0.0);
        let inside = Self::mask(Self::distances(plane, plane.near, boxes, at), |distance| distance >= 0.0);
        (behind, inside)
    }

    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        let mut left = mask;
        let mut n = 0;
        while left != 0 {
            out[n].write(first.wrapping_add(left.trailing_zeros()));
            n += 1;
            left &= left - 1;
        }
        n
    }

    #[inline(always)]
    fn write_sixteen(self, first: u32, out: &mut [MaybeUninit<u32>; 16]) {
        for (i, place) in out.iter_mut().enumerate() {
            place.write(first.wrapping_add(i as u32));
        }
    }

    #[inline(always)]
    fn copy(self, numbers: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]) {
        *out = numbers.map(MaybeUninit::new);
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        let mut left = mask;
        let mut n = 0;
        while left != 0 {
            out[n].write(numbers[left.trailing_zeros() as usize]);
            n += 1;
            left &= left - 1;
        }
        n
    }
}
