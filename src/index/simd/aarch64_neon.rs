#![expect(unsafe_code, reason = "SIMD intrinsics; each is tested against the scalar kernel")]

use std::arch::aarch64::*;

use super::narrow::{Four, Narrow};

/// The kernel for NEON, which all 64-bit ARM targets of Rust have.
pub(super) type Neon = Narrow<float32x4_t>;

impl Four for float32x4_t {
    type Mask = uint32x4_t;

    #[inline(always)]
    fn load(numbers: &[f32; 4]) -> Self {
        // SAFETY: all targets have NEON; the four numbers exist, and no alignment is required.
        unsafe { vld1q_f32(numbers.as_ptr()) }
    }

    #[inline(always)]
    fn splat(number: f32) -> Self {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe { vdupq_n_f32(number) }
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe { vmulq_f32(self, other) }
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe { vaddq_f32(self, other) }
    }

    #[inline(always)]
    fn negative(self) -> uint32x4_t {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe { vcltzq_f32(self) }
    }

    #[inline(always)]
    fn not_negative(self) -> uint32x4_t {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe { vcgezq_f32(self) }
    }

    #[inline(always)]
    fn or(a: uint32x4_t, b: uint32x4_t) -> uint32x4_t {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe { vorrq_u32(a, b) }
    }

    #[inline(always)]
    fn bits(low: uint32x4_t, high: uint32x4_t) -> u32 {
        // SAFETY: all targets have NEON; the intrinsics access no memory.
        unsafe {
            let bytes = vmovn_u16(vcombine_u16(vmovn_u32(low), vmovn_u32(high)));
            // Lane `i` keeps bit `i`; their sum is the mask.
            let weights = vcreate_u8(0x8040_2010_0804_0201);
            u32::from(vaddv_u8(vand_u8(bytes, weights)))
        }
    }
}
