#![expect(unsafe_code, reason = "SIMD intrinsics; each is tested against the scalar kernel")]

use std::{arch::x86_64::*, mem::MaybeUninit};

use super::{Boxes, EyeBoxes, Kernel, PreparedPlane, x86_avx2::distance};

/// AVX-512 (F and VL) with BMI: one register holds sixteen lanes, and comparisons return masks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx512(());

impl Avx512 {
    /// The token, if the processor has the instructions.
    #[inline]
    pub(crate) fn detect() -> Option<Self> {
        let has = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && super::x86_avx2::Avx2::detect().is_some();
        has.then_some(Self(()))
    }
}

/// Signed distances of one corner of each of sixteen boxes. `rows` selects the corner.
///
/// # Safety
/// AVX-512F is available; the rows are at most 40; `N` is 16.
#[inline(always)]
unsafe fn distance16<const N: usize>(plane: &PreparedPlane, rows: [usize; 3], boxes: &Boxes<N>) -> __m512 {
    // SAFETY: a row times eight is at most 40, so every load lies within `boxes.rows`.
    unsafe {
        let base = boxes.rows.as_ptr().cast::<f32>();
        let x = _mm512_loadu_ps(base.add(rows[0] * 2));
        let y = _mm512_loadu_ps(base.add(rows[1] * 2));
        let z = _mm512_loadu_ps(base.add(rows[2] * 2));
        let nx = _mm512_mul_ps(_mm512_set1_ps(plane.normal[0]), x);
        let ny = _mm512_mul_ps(_mm512_set1_ps(plane.normal[1]), y);
        let nz = _mm512_mul_ps(_mm512_set1_ps(plane.normal[2]), z);
        _mm512_add_ps(_mm512_add_ps(_mm512_add_ps(nx, ny), nz), _mm512_set1_ps(plane.d))
    }
}

impl Kernel for Avx512 {
    #[inline(always)]
    fn behind(self, plane: &PreparedPlane, boxes: &Boxes<16>) -> u32 {
        // SAFETY: the token proves AVX-512F.
        unsafe {
            let distances = distance16(plane, plane.far, boxes);
            u32::from(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(distances, _mm512_setzero_ps()))
        }
    }

    #[inline(always)]
    fn not_negative<const N: usize>(self, numbers: &[f32; N]) -> u32 {
        let mut lanes = 0;
        // A closure would not be compiled for the instruction set.
        for part in 0..N / 8 {
            // SAFETY: the token proves AVX-512VL; the load lies within the N numbers.
            let outcome = unsafe {
                let part = _mm256_loadu_ps(numbers.as_ptr().add(8 * part));
                _mm256_cmp_ps_mask::<_CMP_GE_OQ>(part, _mm256_setzero_ps())
            };
            lanes |= u32::from(outcome) << (8 * part);
        }
        lanes
    }

    #[inline(always)]
    fn select(self, mask: u32, inside: &[f32; 16], outside: &[f32; 16]) -> [f32; 16] {
        // SAFETY: the token proves AVX-512F; sixteen numbers are read twice and written once.
        unsafe {
            let [inside, outside] = [_mm512_loadu_ps(inside.as_ptr()), _mm512_loadu_ps(outside.as_ptr())];
            let mut numbers = [0.0; 16];
            _mm512_storeu_ps(numbers.as_mut_ptr(), _mm512_mask_blend_ps(mask as u16, outside, inside));
            numbers
        }
    }

    #[inline(always)]
    fn half_planes<const N: usize>(self, at: [f32; N], across: [f32; N], up: [f32; N]) -> u64 {
        let mut cells = [0xFFFF_u16; 4];
        for line in 0..N {
            // SAFETY: the token proves AVX-512F.
            unsafe {
                let x = _mm512_setr_ps(0., 1., 2., 3., 4., 5., 6., 7., 0., 1., 2., 3., 4., 5., 6., 7.);
                let y = _mm512_setr_ps(0., 0., 0., 0., 0., 0., 0., 0., 1., 1., 1., 1., 1., 1., 1., 1.);
                let (across, up) = (_mm512_set1_ps(across[line]), _mm512_set1_ps(up[line]));
                let step = _mm512_add_ps(up, up);
                let relative = _mm512_add_ps(_mm512_mul_ps(across, x), _mm512_mul_ps(up, y));
                let mut values = _mm512_add_ps(_mm512_set1_ps(at[line]), relative);
                for cells in &mut cells {
                    let zero = _mm512_setzero_ps();
                    *cells = _mm512_mask_cmp_ps_mask::<_CMP_GE_OQ>(*cells, values, zero);
                    values = _mm512_add_ps(values, step);
                }
            }
        }
        let [a, b, c, d] = cells.map(u64::from);
        a | b << 16 | c << 32 | d << 48
    }

    #[inline(always)]
    fn behind_any<const N: usize>(self, planes: &[PreparedPlane; N], boxes: &Boxes<16>) -> u32 {
        let mut seen = 0xFFFF;
        for pair in planes.chunks(2) {
            for plane in pair {
                // SAFETY: the token proves AVX-512F.
                unsafe {
                    let distances = distance16(plane, plane.far, boxes);
                    // Lanes that are behind an earlier plane stay 0.
                    seen = _mm512_mask_cmp_ps_mask::<_CMP_NLT_UQ>(seen, distances, _mm512_setzero_ps());
                }
            }
            if seen == 0 {
                break;
            }
        }
        u32::from(!seen)
    }

    #[inline(always)]
    fn sides<const N: usize>(self, plane: &PreparedPlane, boxes: &Boxes<N>) -> (u32, u32) {
        // SAFETY: the token proves AVX-512F and VL; N is 8 or 16, and all lanes exist.
        unsafe {
            if N == 16 {
                let (zero, far) = (_mm512_setzero_ps(), distance16(plane, plane.far, boxes));
                let behind = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(far, zero);
                let near = distance16(plane, plane.near, boxes);
                return (u32::from(behind), u32::from(_mm512_cmp_ps_mask::<_CMP_GE_OQ>(near, zero)));
            }
            let zero = _mm256_setzero_ps();
            let behind = _mm256_cmp_ps_mask::<_CMP_LT_OQ>(distance(plane, plane.far, boxes, 0), zero);
            let inside = _mm256_cmp_ps_mask::<_CMP_GE_OQ>(distance(plane, plane.near, boxes, 0), zero);
            (u32::from(behind), u32::from(inside))
        }
    }

    #[inline(always)]
    fn write_ids(self, first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        // SAFETY: the token proves AVX-512F; the store fills `out` exactly.
        unsafe {
            let ids = _mm512_add_epi32(_mm512_set1_epi32(first as i32), lanes());
            let chosen = _mm512_maskz_compress_epi32(mask as u16, ids);
            _mm512_storeu_si512(out.as_mut_ptr().cast(), chosen);
        }
        (mask & 0xFFFF).count_ones() as usize
    }

    #[inline(always)]
    fn write_sixteen(self, first: u32, out: &mut [MaybeUninit<u32>; 16]) {
        // SAFETY: the token proves AVX-512F; the store fills `out` exactly.
        unsafe {
            let ids = _mm512_add_epi32(_mm512_set1_epi32(first as i32), lanes());
            _mm512_storeu_si512(out.as_mut_ptr().cast(), ids);
        }
    }

    #[inline(always)]
    fn pack(self, numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
        // SAFETY: the token proves AVX-512F; both arrays hold sixteen numbers.
        unsafe {
            let all = _mm512_loadu_si512(numbers.as_ptr().cast());
            let chosen = _mm512_maskz_compress_epi32(mask as u16, all);
            _mm512_storeu_si512(out.as_mut_ptr().cast(), chosen);
        }
        (mask & 0xFFFF).count_ones() as usize
    }

    #[inline(always)]
    fn beyond_and_in_front(self, normal: [f64; 3], distance: f64, boxes: &EyeBoxes) -> (u32, u32) {
        // SAFETY: the token proves AVX-512F; eight lanes follow lanes 0 and 8 of a row of sixteen.
        unsafe {
            let (low, high) =
                (far_sides8(normal, distance, boxes, 0), far_sides8(normal, distance, boxes, 8));
            (low.0 | high.0 << 8, low.1 | high.1 << 8)
        }
    }
}

/// Does the work of [`Kernel::beyond_and_in_front`] for the eight lanes from `at` on.
///
/// # Safety
/// AVX-512F is available; `at` is at most 8.
#[inline(always)]
unsafe fn far_sides8(normal: [f64; 3], distance: f64, boxes: &EyeBoxes, at: usize) -> (u32, u32) {
    // SAFETY: each load lies within its row of sixteen.
    unsafe {
        let middle = weighted8(&boxes.center, normal, at);
        let reach = weighted8(&boxes.half, [normal[0].abs(), normal[1].abs(), normal[2].abs()], at);
        let slack = _mm512_loadu_pd(boxes.slack.as_ptr().add(at));
        let distance = _mm512_set1_pd(distance);
        let low = _mm512_sub_pd(_mm512_sub_pd(middle, reach), distance);
        let high = _mm512_sub_pd(_mm512_add_pd(middle, reach), distance);
        let beyond = _mm512_cmp_pd_mask::<_CMP_GE_OQ>(low, slack);
        let before = _mm512_cmp_pd_mask::<_CMP_LE_OQ>(high, _mm512_sub_pd(_mm512_setzero_pd(), slack));
        (u32::from(beyond), u32::from(before))
    }
}

/// The weighted sum of three rows, for eight lanes from `at` on.
///
/// # Safety
/// As for [`far_sides8`].
#[inline(always)]
unsafe fn weighted8(rows: &[[f64; 16]; 3], by: [f64; 3], at: usize) -> __m512d {
    // SAFETY: the caller guarantees the same as for `far_sides8`.
    unsafe {
        let x = _mm512_mul_pd(_mm512_set1_pd(by[0]), _mm512_loadu_pd(rows[0].as_ptr().add(at)));
        let y = _mm512_mul_pd(_mm512_set1_pd(by[1]), _mm512_loadu_pd(rows[1].as_ptr().add(at)));
        let z = _mm512_mul_pd(_mm512_set1_pd(by[2]), _mm512_loadu_pd(rows[2].as_ptr().add(at)));
        _mm512_add_pd(_mm512_add_pd(x, y), z)
    }
}

/// The lane numbers, 0 to 15.
///
/// # Safety
/// AVX-512F is available.
#[inline(always)]
unsafe fn lanes() -> __m512i {
    // SAFETY: the caller provides AVX-512F; the intrinsic accesses no memory.
    unsafe { _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15) }
}
