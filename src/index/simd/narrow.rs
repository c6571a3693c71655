use std::mem::MaybeUninit;

use super::{Boxes, Kernel, PreparedPlane, scalar::Scalar};

/// Four numbers in a SIMD register that every processor of the target has.
pub(super) trait Four: Copy {
    /// The outcomes of four comparisons.
    type Mask: Copy;

    fn load(numbers: &[f32; 4]) -> Self;
    fn splat(number: f32) -> Self;
    fn mul(self, other: Self) -> Self;
    fn add(self, other: Self) -> Self;

    /// Lanes below 0; NaN does not count.
    fn negative(self) -> Self::Mask;

    /// Lanes not below 0; NaN does not count.
    fn not_negative(self) -> Self::Mask;

    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;

    /// Converts two masks of four lanes to eight bits.
    fn bits(low: Self::Mask, high: Self::Mask) -> u32;

    /// The implementation of [`Kernel::pack`].
    #[inline(always)]
    fn pack(numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        Scalar::new().pack(numbers, mask, out)
    }

    /// The implementation of [`Kernel::write_ids`] for a mask with some lanes unset.
    #[inline(always)]
    fn write_ids(first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        Scalar::new().write_ids(first, mask, out)
    }
}

/// The kernel of an instruction set whose registers hold four numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Narrow<V>(std::marker::PhantomData<V>);

impl<V: Four> Narrow<V> {
    pub(super) const fn new() -> Self {
        Self(std::marker::PhantomData)
    }

    /// Signed distances of the corners of four boxes from lane `at` on. All kernels compute this one expression, see
    /// [`crate::math`].
    #[inline(always)]
    fn distances<const N: usize>(plane: &PreparedPlane, rows: [usize; 3], boxes: &Boxes<N>, at: usize) -> V {
        let row = |axis: usize| {
            let numbers = boxes.rows[rows[axis] / 8][at..].first_chunk();
            V::load(numbers.unwrap_or(&[f32::NAN; 4]))
        };
        let [nx, ny, nz] = plane.normal.map(V::splat);
        nx.mul(row(0)).add(ny.mul(row(1))).add(nz.mul(row(2))).add(V::splat(plane.d))
    }

    #[inline(always)]
    fn far<const N: usize>(plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> V::Mask {
        Self::distances(plane, plane.far, boxes, at).negative()
    }

    #[inline(always)]
    fn near<const N: usize>(plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> V::Mask {
        Self::distances(plane, plane.near, boxes, at).not_negative()
    }
}

impl<V: Four> Kernel for Narrow<V> {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        let half = |at| V::bits(Self::far(plane, boxes, at), Self::far(plane, boxes, at + 4));
        half(0) | half(8) << 8
    }

    #[inline(always)]
    fn not_negative<const N: usize>(self, numbers: &[f32; N]) -> u32 {
        numbers.as_chunks::<4>().0.chunks_exact(2).enumerate().fold(0, |lanes, (part, pair)| {
            let [low, high] = [&pair[0], &pair[1]].map(|four| V::load(four).not_negative());
            lanes | V::bits(low, high) << (8 * part)
        })
    }

    #[inline(always)]
    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32 {
        let mut behind = [0, 4, 8, 12].map(|at| Self::far(&planes[0], boxes, at));
        let bits = |b: &[V::Mask; 4]| V::bits(b[0], b[1]) | V::bits(b[2], b[3]) << 8;
        for (i, plane) in planes.iter().enumerate().skip(1) {
            for (quarter, at) in behind.iter_mut().zip([0, 4, 8, 12]) {
                *quarter = V::or(*quarter, Self::far(plane, boxes, at));
            }
            // The result is read after every second plane only, because reading it costs as much as testing a plane.
            if i % 2 == 1 && bits(&behind) == 0xFFFF {
                return 0xFFFF;
            }
        }
        bits(&behind)
    }

    #[inline(always)]
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> (u32, u32) {
        let behind = V::bits(Self::far(plane, boxes, at), Self::far(plane, boxes, at + 4));
        (behind, V::bits(Self::near(plane, boxes, at), Self::near(plane, boxes, at + 4)))
    }

    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        if mask == 0xFFFF {
            self.write_sixteen(first, out);
            return 16;
        }
        V::write_ids(first, mask, out)
    }

    #[inline(always)]
    fn write_sixteen(self, first: u32, out: &mut [MaybeUninit<u32>; 16]) {
        Scalar::new().write_sixteen(first, out);
    }

    #[inline(always)]
    fn copy(self, numbers: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]) {
        Scalar::new().copy(numbers, out);
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        V::pack(numbers, mask, out)
    }
}
