use std::mem::MaybeUninit;

use super::{Boxes, EyeBoxes, PreparedPlane};

/// Tests of many boxes at once. Every method returns the same result on every kernel, bit for bit.
pub trait Kernel: Copy {
    /// The lanes whose boxes lie wholly behind the plane. Lanes without a box have unspecified results.
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32;

    /// The lanes whose boxes lie wholly behind at least one of the planes.
    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32;

    /// Among 8 or 16 boxes: the lanes wholly behind the plane, and the lanes wholly on its inner side.
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>) -> (u32, u32);

    /// Writes `first + lane` (modulo 2^32) for every lane of `mask`, ascending, to the beginning of `out`; returns the
    /// number of ids. Overwrites the rest of `out`.
    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        if mask == 0xFFFF {
            self.write_sixteen(first, out);
            return 16;
        }
        for (place, lane) in out.iter_mut().zip(lanes_of(mask)) {
            place.write(first.wrapping_add(lane as u32));
        }
        mask.count_ones() as usize
    }

    /// Writes the sixteen consecutive ids from `first` on.
    #[inline(always)]
    fn write_sixteen(self, first: u32, out: &mut [MaybeUninit<u32>; 16]) {
        for (place, lane) in out.iter_mut().zip(0..) {
            place.write(first.wrapping_add(lane));
        }
    }

    /// Writes the numbers in the lanes of `mask` to the beginning of `out`; returns how many. Overwrites the rest of
    /// `out`.
    #[inline(always)]
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        for (place, lane) in out.iter_mut().zip(lanes_of(mask)) {
            place.write(numbers[lane % 16]);
        }
        mask.count_ones() as usize
    }

    /// Among 8 or 16 lanes, the lanes whose number is at least 0; NaN does not count.
    #[inline(always)]
    fn not_negative<const N: usize>(self, numbers: &[f32; N]) -> u32 {
        numbers.iter().enumerate().fold(0, |lanes, (i, &number)| lanes | u32::from(number >= 0.0) << i)
    }

    /// The numbers of `inside` in the lanes of `mask`, and of `outside` in the other lanes.
    #[inline(always)]
    fn select(self, mask: u32, inside: &[f32; 16], outside: &[f32; 16]) -> [f32; 16] {
        let mut numbers = *outside;
        for (lane, number) in numbers.iter_mut().enumerate() {
            *number = if mask >> lane & 1 == 1 { inside[lane] } else { *number };
        }
        numbers
    }

    /// The cells of a square of 8 x 8, row by row, at which `at + across * x + up * y` is at least 0 for every line; NaN
    /// does not count. The cell in column `x` and row `y` has bit `8 y + x`.
    #[inline(always)]
    fn half_planes<const N: usize>(self, at: [f32; N], across: [f32; N], up: [f32; N]) -> u64 {
        let mut cells = u64::MAX;
        for line in 0..N {
            let (step, mut over, mut values) = (2.0 * up[line], 0, [0.0; 16]);
            for (k, value) in values.iter_mut().enumerate() {
                *value = at[line] + (across[line] * (k % 8) as f32 + up[line] * (k / 8) as f32);
            }
            for pair in 0..4 {
                over |= u64::from(self.not_negative(&values)) << (16 * pair);
                for value in &mut values {
                    *value += step;
                }
            }
            cells &= over;
        }
        cells
    }

    /// Two masks of lanes: boxes wholly behind the plane by their slack, and boxes wholly in front by it. The plane has a
    /// unit normal and the signed distance `distance` from the eye.
    #[inline(always)]
    fn beyond_and_in_front(self, normal: [f64; 3], distance: f64, boxes: &EyeBoxes) -> (u32, u32) {
        let [x, y, z] = normal;
        let (mut beyond, mut before) = (0, 0);
        for lane in 0..16 {
            let ([cx, cy, cz], [hx, hy, hz]) = (&boxes.center, &boxes.half);
            let middle = x * cx[lane] + y * cy[lane] + z * cz[lane];
            let reach = x.abs() * hx[lane] + y.abs() * hy[lane] + z.abs() * hz[lane];
            let slack = boxes.slack[lane];
            beyond |= u32::from((middle - reach) - distance >= slack) << lane;
            before |= u32::from((middle + reach) - distance <= -slack) << lane;
        }
        (beyond, before)
    }
}

/// The lanes of a mask, ascending.
#[derive(Clone)]
pub(crate) struct Lanes(u32);

/// The lanes of a mask, ascending.
#[inline(always)]
pub(crate) fn lanes_of(mask: impl Into<u32>) -> Lanes {
    Lanes(mask.into())
}

impl Iterator for Lanes {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros() as usize;
        if self.0 == 0 {
            return None;
        }
        self.0 &= self.0 - 1;
        Some(lane)
    }
}

/// Code that can run on any kernel. Mark `run` with `#[inline(always)]`, so that it is compiled once for each
/// instruction set.
pub trait WithKernel {
    /// Result of `run`.
    type Output;

    /// Runs the code with the given kernel.
    fn run<K: Kernel>(self, kernel: K) -> Self::Output;
}
