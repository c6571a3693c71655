#![expect(unsafe_code, reason = "SIMD intrinsics; each is tested against the scalar kernel")]

use std::{
    arch::{asm, x86_64::*},
    mem::MaybeUninit,
};

use super::{Boxes, EyeBoxes, Kernel, PreparedPlane};

/// AVX2 with BMI: two registers hold sixteen lanes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2(());

impl Avx2 {
    /// The token, if the processor has the instructions.
    #[inline]
    pub(crate) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Self(()))
    }
}

/// Signed distances of one corner of each of eight boxes, from lane `at` on. `rows` selects the corner.
///
/// # Safety
/// AVX2 is available; `at + 8 <= N`; the rows are at most 40, `N` is 8 or 16.
#[inline(always)]
pub(super) unsafe fn distance<const N: usize>(
    plane: &PreparedPlane,
    rows: [usize; 3],
    boxes: &Boxes<N>,
    at: usize,
) -> __m256 {
    // SAFETY: a row times eight is at most 40 and `at + 8 <= N`, so every load lies within `boxes.rows`.
    unsafe {
        let base = boxes.rows.as_ptr().cast::<f32>().add(at);
        let x = _mm256_loadu_ps(base.add(in_register(rows[0]) * (N / 8)));
        let y = _mm256_loadu_ps(base.add(in_register(rows[1]) * (N / 8)));
        let z = _mm256_loadu_ps(base.add(in_register(rows[2]) * (N / 8)));
        let nx = _mm256_mul_ps(_mm256_set1_ps(plane.normal[0]), x);
        let ny = _mm256_mul_ps(_mm256_set1_ps(plane.normal[1]), y);
        let nz = _mm256_mul_ps(_mm256_set1_ps(plane.normal[2]), z);
        _mm256_add_ps(_mm256_add_ps(_mm256_add_ps(nx, ny), nz), _mm256_set1_ps(plane.d))
    }
}

/// Returns the same number. It prevents the compiler from joining three consecutive loads to a vector of addresses,
/// which it would then split again.
#[inline(always)]
fn in_register(number: usize) -> usize {
    let mut same = number;
    // SAFETY: the assembly contains only a comment.
    unsafe { asm!("/* {same} */", same = inout(reg) same, options(pure, nomem, nostack, preserves_flags)) }
    same
}

/// The sign bits of eight lanes. This is inline assembly, because the compiler rewrites the intrinsic: joining two
/// masks would then cost nine instructions instead of four.
#[inline]
#[target_feature(enable = "avx2")]
fn sign_bits(lanes: __m256) -> u32 {
    let bits: u32;
    // SAFETY: reads a register and writes another.
    unsafe {
        asm!("vmovmskps {bits:e}, {lanes}", bits = lateout(reg) bits, lanes = in(ymm_reg) lanes,
            options(pure, nomem, nostack, preserves_flags));
    }
    bits
}

/// # Safety
/// AVX2 is available.
#[inline(always)]
unsafe fn negative(distance: __m256) -> u32 {
    // SAFETY: the caller provides AVX2; the intrinsics access no memory.
    unsafe { sign_bits(_mm256_cmp_ps::<_CMP_LT_OQ>(distance, _mm256_setzero_ps())) }
}

/// # Safety
/// AVX2 is available.
#[inline(always)]
unsafe fn not_negative(distance: __m256) -> u32 {
    // SAFETY: the caller provides AVX2; the intrinsics access no memory.
    unsafe { sign_bits(_mm256_cmp_ps::<_CMP_GE_OQ>(distance, _mm256_setzero_ps())) }
}

impl Kernel for Avx2 {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        // SAFETY: the token proves AVX2; lanes 0 to 7 and 8 to 15 exist.
        unsafe {
            let low = negative(distance(plane, plane.far, boxes, 0));
            low | negative(distance(plane, plane.far, boxes, 8)) << 8
        }
    }

    #[inline(always)]
    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32 {
        // SAFETY: the token proves AVX2; lanes 0 to 7 and 8 to 15 exist.
        unsafe {
            let zero = _mm256_setzero_ps();
            let (mut low, mut high) = (zero, zero);
            for (i, plane) in planes.iter().enumerate() {
                let below = _mm256_cmp_ps::<_CMP_LT_OQ>(distance(plane, plane.far, boxes, 0), zero);
                low = _mm256_or_ps(low, below);
                let below = _mm256_cmp_ps::<_CMP_LT_OQ>(distance(plane, plane.far, boxes, 8), zero);
                high = _mm256_or_ps(high, below);
                // The result is read after every second plane only, because reading it costs as much as testing a
                // plane.
                if i % 2 == 1 && sign_bits(_mm256_and_ps(low, high)) == 0xFF {
                    return 0xFFFF;
                }
            }
            sign_bits(low) | sign_bits(high) << 8
        }
    }

    #[inline(always)]
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>) -> (u32, u32) {
        let (mut behind, mut inside) = (0, 0);
        for at in (0..N).step_by(8) {
            // SAFETY: the token proves AVX2; the eight lanes exist.
            unsafe {
                behind |= negative(distance(plane, plane.far, boxes, at)) << at;
                inside |= not_negative(distance(plane, plane.near, boxes, at)) << at;
            }
        }
        (behind, inside)
    }

    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        // SAFETY: the token proves AVX2 and BMI2. `out` has sixteen entries: the second store starts at `low`, at most
        // 8.
        unsafe {
            let base = _mm256_set1_epi32(first as i32);
            let to = out.as_mut_ptr();
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
    fn write_sixteen(self, first: u32, out: &mut [MaybeUninit<u32>; 16]) {
        // SAFETY: the token proves AVX2; both stores lie within `out`.
        unsafe {
            let base = _mm256_set1_epi32(first as i32);
            let to = out.as_mut_ptr();
            let low = _mm256_add_epi32(base, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7));
            let high = _mm256_add_epi32(base, _mm256_setr_epi32(8, 9, 10, 11, 12, 13, 14, 15));
            _mm256_storeu_si256(to.cast(), low);
            _mm256_storeu_si256(to.add(8).cast(), high);
        }
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        // SAFETY: the token proves AVX2; both loads lie within `numbers`.
        unsafe {
            let (from, to) = (numbers.as_ptr(), out.as_mut_ptr());
            let low = (mask & 0xFF).count_ones() as usize;
            let low_half = _mm256_loadu_si256(from.cast());
            let high_half = _mm256_loadu_si256(from.add(8).cast());
            _mm256_storeu_si256(to.cast(), _mm256_permutevar8x32_epi32(low_half, chosen_lanes(mask & 0xFF)));
            _mm256_storeu_si256(
                to.add(low).cast(),
                _mm256_permutevar8x32_epi32(high_half, chosen_lanes(mask >> 8)),
            );
            mask.count_ones() as usize
        }
    }

    #[inline(always)]
    fn not_negative<const N: usize>(self, numbers: &[f32; N]) -> u32 {
        let mut lanes = 0;
        // A closure would not be compiled for the instruction set.
        for part in 0..N / 8 {
            // SAFETY: the token proves AVX2; the load lies within the N numbers.
            lanes |= unsafe { not_negative(_mm256_loadu_ps(numbers.as_ptr().add(8 * part))) } << (8 * part);
        }
        lanes
    }

    #[inline(always)]
    fn select(self, mask: u32, inside: &[f32; 16], outside: &[f32; 16]) -> [f32; 16] {
        let mut numbers = [0.0; 16];
        for at in [0, 8] {
            // SAFETY: the token proves AVX2; eight numbers from `at` on are read twice and written once.
            unsafe {
                let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
                let lanes = _mm256_and_si256(_mm256_set1_epi32((mask >> at) as i32), bits);
                let chosen = _mm256_castsi256_ps(_mm256_cmpeq_epi32(lanes, bits));
                let (inside, outside) =
                    (_mm256_loadu_ps(inside.as_ptr().add(at)), _mm256_loadu_ps(outside.as_ptr().add(at)));
                _mm256_storeu_ps(numbers.as_mut_ptr().add(at), _mm256_blendv_ps(outside, inside, chosen));
            }
        }
        numbers
    }

    #[inline(always)]
    fn beyond_and_in_front(self, normal: [f64; 3], distance: f64, boxes: &EyeBoxes) -> (u32, u32) {
        let (mut beyond, mut before) = (0, 0);
        for at in [0, 4, 8, 12] {
            // SAFETY: the token proves AVX2; `at` is at most 12, so each load lies within its row of sixteen.
            unsafe {
                let middle = weighted4(&boxes.center, normal, at);
                let reach = weighted4(&boxes.half, [normal[0].abs(), normal[1].abs(), normal[2].abs()], at);
                let slack = _mm256_loadu_pd(boxes.slack.as_ptr().add(at));
                let distance = _mm256_set1_pd(distance);
                let low = _mm256_sub_pd(_mm256_sub_pd(middle, reach), distance);
                let high = _mm256_sub_pd(_mm256_add_pd(middle, reach), distance);
                let negated = _mm256_sub_pd(_mm256_setzero_pd(), slack);
                beyond |= (_mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(low, slack)) as u32) << at;
                before |= (_mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LE_OQ>(high, negated)) as u32) << at;
            }
        }
        (beyond, before)
    }
}

/// The weighted sum of three rows, for four lanes from `at` on.
///
/// # Safety
/// AVX2 is available; `at` is at most 12.
#[inline(always)]
unsafe fn weighted4(rows: &[[f64; 16]; 3], by: [f64; 3], at: usize) -> __m256d {
    // SAFETY: each load lies within its row of sixteen.
    unsafe {
        let x = _mm256_mul_pd(_mm256_set1_pd(by[0]), _mm256_loadu_pd(rows[0].as_ptr().add(at)));
        let y = _mm256_mul_pd(_mm256_set1_pd(by[1]), _mm256_loadu_pd(rows[1].as_ptr().add(at)));
        let z = _mm256_mul_pd(_mm256_set1_pd(by[2]), _mm256_loadu_pd(rows[2].as_ptr().add(at)));
        _mm256_add_pd(_mm256_add_pd(x, y), z)
    }
}

/// The numbers of the lanes set in `mask` (below 256), packed to the front.
///
/// # Safety
/// AVX2 is available.
#[inline(always)]
unsafe fn chosen_lanes(mask: u32) -> __m256i {
    let packed = LANES_OF[(mask & 0xFF) as usize];
    // SAFETY: the caller provides AVX2; the intrinsics access no memory.
    unsafe { _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(packed as i64)) }
}

/// For each set of eight lanes, the lane numbers, one a byte, packed to the low end.
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
