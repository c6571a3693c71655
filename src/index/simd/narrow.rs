#![cfg_attr(target_arch = "aarch64", expect(unsafe_code, reason = "an intrinsic; it reads no memory"))]

use glam::{BVec4A, Vec4};

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::wasm_simd128;
use super::{Boxes, Kernel, PreparedPlane};

/// The kernel of SIMD registers of four numbers, which every processor of the target has: SSE2, NEON or simd128. Without
/// them, it is plain Rust.
#[derive(Clone, Copy, Debug)]
pub(super) struct Narrow;

impl Narrow {
    /// Signed distances of the corners of four boxes from lane `at` on. All kernels compute this one expression, see
    /// [`crate::math`].
    #[inline(always)]
    fn distances<const N: usize>(
        plane: &PreparedPlane,
        rows: [usize; 3],
        boxes: &Boxes<N>,
        at: usize,
    ) -> Vec4 {
        let row = |axis: usize| {
            let numbers = boxes.rows[rows[axis] / 8][at..].first_chunk();
            Vec4::from_array(*numbers.unwrap_or(&[f32::NAN; 4]))
        };
        let [nx, ny, nz] = plane.normal.map(Vec4::splat);
        nx * row(0) + ny * row(1) + nz * row(2) + Vec4::splat(plane.d)
    }

    #[inline(always)]
    fn far<const N: usize>(plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> BVec4A {
        Self::distances(plane, plane.far, boxes, at).cmplt(Vec4::ZERO)
    }

    #[inline(always)]
    fn near<const N: usize>(plane: &PreparedPlane, boxes: &Boxes<N>, at: usize) -> BVec4A {
        Self::distances(plane, plane.near, boxes, at).cmpge(Vec4::ZERO)
    }
}

/// Converts the outcomes of two comparisons to eight bits.
#[inline(always)]
fn bits(low: BVec4A, high: BVec4A) -> u32 {
    #[cfg(target_arch = "aarch64")]
    {
        use std::arch::aarch64::*;
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe {
            let bytes = vmovn_u16(vcombine_u16(vmovn_u32(low.into()), vmovn_u32(high.into())));
            // Lane `i` keeps bit `i`; their sum is the mask.
            u32::from(vaddv_u8(vand_u8(bytes, vcreate_u8(0x8040_2010_0804_0201))))
        }
    }
    #[cfg(not(target_arch = "aarch64"))]
    {
        low.bitmask() | high.bitmask() << 4
    }
}

impl Kernel for Narrow {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        let half = |at| bits(Self::far(plane, boxes, at), Self::far(plane, boxes, at + 4));
        half(0) | half(8) << 8
    }

    #[inline(always)]
    fn not_negative<const N: usize>(self, numbers: &[f32; N]) -> u32 {
        numbers.as_chunks::<4>().0.chunks_exact(2).enumerate().fold(0, |lanes, (part, pair)| {
            let [low, high] = [pair[0], pair[1]].map(|four| Vec4::from_array(four).cmpge(Vec4::ZERO));
            lanes | bits(low, high) << (8 * part)
        })
    }

    #[inline(always)]
    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32 {
        let mut behind = [0, 4, 8, 12].map(|at| Self::far(&planes[0], boxes, at));
        let all = |b: &[BVec4A; 4]| bits(b[0], b[1]) | bits(b[2], b[3]) << 8;
        for (i, plane) in planes.iter().enumerate().skip(1) {
            for (quarter, at) in behind.iter_mut().zip([0, 4, 8, 12]) {
                *quarter |= Self::far(plane, boxes, at);
            }
            // The result is read after every second plane only, because reading it costs as much as testing a plane.
            if i % 2 == 1 && all(&behind) == 0xFFFF {
                return 0xFFFF;
            }
        }
        all(&behind)
    }

    #[inline(always)]
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>) -> (u32, u32) {
        let (mut behind, mut inside) = (0, 0);
        for at in (0..N).step_by(8) {
            behind |= bits(Self::far(plane, boxes, at), Self::far(plane, boxes, at + 4)) << at;
            inside |= bits(Self::near(plane, boxes, at), Self::near(plane, boxes, at + 4)) << at;
        }
        (behind, inside)
    }

    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [std::mem::MaybeUninit<u32>; 16]) -> usize {
        if mask == 0xFFFF {
            self.write_sixteen(first, out);
            return 16;
        }
        wasm_simd128::write_ids(first, mask, out)
    }

    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    #[inline(always)]
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [std::mem::MaybeUninit<u32>; 16]) -> usize {
        wasm_simd128::pack(numbers, mask, out)
    }
}
