#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "a prefetch is an intrinsic; it reads nothing")
)]

/// Prefetches the cache line in which `place` begins.
#[inline(always)]
pub(crate) fn prefetch<T>(place: *const T) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch of any address is allowed and has no effect but on the cache; SSE is x86-64's baseline.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = place;
}

/// Prefetches `N` cache lines from `place` on.
#[inline(always)]
pub fn prefetch_lines<const N: usize, T>(place: *const T) {
    for line in 0..N {
        prefetch(place.cast::<[u8; 64]>().wrapping_add(line));
    }
}
