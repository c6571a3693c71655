#![expect(unsafe_code, reason = "SIMD intrinsics; each is tested against the scalar kernel")]

use std::arch::x86_64::*;

use super::narrow::{Four, Narrow};

/// The kernel for SSE2, which every x86-64 processor has.
pub(super) type Sse2 = Narrow<__m128>;

impl Four for __m128 {
    type Mask = __m128;

    #[inline(always)]
    fn load(numbers: &[f32; 4]) -> Self {
        // SAFETY: x86-64 has SSE2; the four numbers exist, and no alignment is required.
        unsafe { _mm_loadu_ps(numbers.as_ptr()) }
    }

    #[inline(always)]
    fn splat(number: f32) -> Self {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { _mm_set1_ps(number) }
    }

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { _mm_mul_ps(self, other) }
    }

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { _mm_add_ps(self, other) }
    }

    #[inline(always)]
    fn negative(self) -> __m128 {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { _mm_cmplt_ps(self, _mm_setzero_ps()) }
    }

    #[inline(always)]
    fn not_negative(self) -> __m128 {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { _mm_cmpge_ps(self, _mm_setzero_ps()) }
    }

    #[inline(always)]
    fn or(a: __m128, b: __m128) -> __m128 {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { _mm_or_ps(a, b) }
    }

    #[inline(always)]
    fn bits(low: __m128, high: __m128) -> u32 {
        // SAFETY: x86-64 has SSE2; the intrinsics access no memory.
        unsafe { (_mm_movemask_ps(low) | _mm_movemask_ps(high) << 4) as u32 }
    }
}
