#![expect(
    unsafe_code,
    reason = "SIMD loads and stores; each is tested against the scalar kernel, in tests/simd.test.mjs of web/npm"
)]

//! Packs ids with WebAssembly's 128-bit registers, in builds with the target feature `simd128`, because a module cannot
//! detect them at run time.

use std::{arch::wasm32::*, mem::MaybeUninit};

/// The implementation of [`super::Kernel::pack`].
#[inline(always)]
pub(super) fn pack(numbers: &[u32; 16], mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
    pack_quarters(mask, out, |quarter| {
        // SAFETY: a quarter is 0 to 3, so four numbers follow its first; no alignment is required.
        unsafe { v128_load(numbers.as_ptr().add(quarter * 4).cast()) }
    })
}

/// The implementation of [`super::Kernel::write_ids`].
#[inline(always)]
pub(super) fn write_ids(first: u32, mask: u32, out: &mut [MaybeUninit<u32>; 16]) -> usize {
    let from_first = u32x4_add(u32x4_splat(first), u32x4(0, 1, 2, 3));
    pack_quarters(mask, out, |quarter| u32x4_add(from_first, u32x4_splat(quarter as u32 * 4)))
}

/// Packs the numbers in the lanes of `mask` from four registers to the beginning of `out`; returns how many.
#[inline(always)]
fn pack_quarters(mask: u32, out: &mut [MaybeUninit<u32>; 16], numbers: impl Fn(usize) -> v128) -> usize {
    let mut count = 0;
    for quarter in 0..4 {
        let lanes = (mask >> (4 * quarter) & 15) as usize;
        // SAFETY: the table has sixteen entries of sixteen bytes, and `lanes` is below sixteen.
        let order = unsafe { v128_load(PACKED[lanes].as_ptr().cast()) };
        let packed = u8x16_swizzle(numbers(quarter), order);
        // SAFETY: the quarters before have at most four lanes each, so four entries are left from `count` on.
        unsafe { v128_store(out.as_mut_ptr().add(count).cast(), packed) };
        count += lanes.count_ones() as usize;
    }
    count
}

/// For each mask of four lanes: the byte order that moves its lanes to the beginning. The other bytes become 0.
const PACKED: [[u8; 16]; 16] = {
    let mut table = [[255; 16]; 16];
    let mut mask = 0;
    while mask < 16 {
        let (mut lane, mut at) = (0, 0);
        while lane < 4 {
            if mask >> lane & 1 == 1 {
                let mut byte = 0;
                while byte < 4 {
                    table[mask][at * 4 + byte] = (lane * 4 + byte) as u8;
                    byte += 1;
                }
                at += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};
