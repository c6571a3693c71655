#![expect(unsafe_code, reason = "SIMD intrinsics; each is tested against the scalar kernel")]

use std::{arch::x86_64::*, mem::MaybeUninit};

use super::{Boxes, Kernel, PreparedPlane};

/// AVX2 with BMI: two registers hold sixteen lanes.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct Avx2(());

impl Avx2 {
    /// The token, if the processor has the instructions.
    #[inline]
    pub(in crate::index) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }
}

/// Signed distances of eight corners, given by their rows from lane `at` on.
///
/// # Safety
/// AVX2 is there; `at + 8 <= N`; the rows are below 6.
#[inline(always)]
unsafe fn distance<const N: usize>(
    plane: &PreparedPlane,
    rows: [u8; 3],
    boxes: &Boxes<N>,
    at: usize,
) -> __m256 {
    // SAFETY: the rows are below 6 and `at + 8 <= N`, so every load lies within `boxes.rows`.
    unsafe {
        let base = boxes.rows.as_ptr().cast::<f32>().add(at);
        let x = _mm256_loadu_ps(base.add(usize::from(rows[0]) * N));
        let y = _mm256_loadu_ps(base.add(usize::from(rows[1]) * N));
        let z = _mm256_loadu_ps(base.add(usize::from(rows[2]) * N));
        let nx = _mm256_mul_ps(_mm256_set1_ps(plane.normal[0]), x);
        let ny = _mm256_mul_ps(_mm256_set1_ps(plane.normal[1]), y);
        let nz = _mm256_mul_ps(_mm256_set1_ps(plane.normal[2]), z);
        _mm256_add_ps(_mm256_add_ps(_mm256_add_ps(nx, ny), nz), _mm256_set1_ps(plane.d))
    }
}

/// # Safety
/// AVX2 is there.
#[inline(always)]
unsafe fn negative(distance: __m256) -> u32 {
    // SAFETY: register arithmetic.
    unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(distance, _mm256_setzero_ps())) as u32 }
}

/// # Safety
/// AVX2 is there.
#[inline(always)]
unsafe fn not_negative(distance: __m256) -> u32 {
    // SAFETY: register arithmetic.
    unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_GE_OQ>(distance, _mm256_setzero_ps())) as u32 }
}

impl Kernel for Avx2 {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        // SAFETY: the token proves AVX2; both halves of sixteen lanes.
        unsafe {
            let low = negative(distance(plane, plane.far, boxes, 0));
            low | negative(distance(plane, plane.far, boxes, 8)) << 8
        }
    }

    #[inline(always)]
    fn sides(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> (u32, u32) {
        // SAFETY: as above.
        unsafe {
            let low = not_negative(distance(plane, plane.near, boxes, 0));
            let inside = low | not_negative(distance(plane, plane.near, boxes, 8)) << 8;
            (self.behind(plane, boxes), inside)
        }
    }

    #[inline(always)]
    fn sides8(self, plane: &PreparedPlane, boxes: &Boxes<8>) -> (u32, u32) {
        // SAFETY: as above, eight lanes.
        unsafe {
            let behind = negative(distance(plane, plane.far, boxes, 0));
            (behind, not_negative(distance(plane, plane.near, boxes, 0)))
        }
    }

    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        // SAFETY: the token proves AVX2 and BMI2. `out` has sixteen places: the second store starts at `low`'s count, at most 8.
        unsafe {
            let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let base = _mm256_set1_epi32(first as i32);
            let to = out.as_mut_ptr();
            if mask == 0xFFFF {
                let ids = _mm256_add_epi32(base, lanes);
                _mm256_storeu_si256(to.cast(), ids);
                _mm256_storeu_si256(to.add(8).cast(), _mm256_add_epi32(ids, _mm256_set1_epi32(8)));
                return 16;
            }
            let low = (mask & 0xFF).count_ones() as usize;
            let low_ids = _mm256_add_epi32(base, chosen_lanes(mask & 0xFF));
            let high_ids =
                _mm256_add_epi32(base, _mm256_add_epi32(chosen_lanes(mask >> 8), _mm256_set1_epi32(8)));
            _mm256_storeu_si256(to.cast(), low_ids);
            _mm256_storeu_si256(to.add(low).cast(), high_ids);
            mask.count_ones() as usize
        }
    }

    #[inline(always)]
    fn prefetch<T>(self, place: &T) {
        // SAFETY: a prefetch has no effect on memory.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(place).cast()) }
    }
}

/// The numbers of the lanes set in `mask` (below 256), packed to the front.
///
/// # Safety
/// AVX2 is there.
#[inline(always)]
unsafe fn chosen_lanes(mask: u32) -> __m256i {
    let packed = LANES_OF[(mask & 0xFF) as usize];
    // SAFETY: register arithmetic.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(packed as i64)) }
}

/// For each set of eight lanes their numbers, one a byte, packed to the low end.
static LANES_OF: [u64; 256] = {
    let mut table = [0; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut n) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask] |= (lane as u64) << (8 * n);
                n += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};
