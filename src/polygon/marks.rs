#![expect(
    unsafe_code,
    reason = "the bounds of all numbers are checked at once: a check for each takes as long as setting its bit"
)]

use super::PolygonId;

/// Length of the parts of a list that are read twice while they are in the nearest cache.
const PART: usize = 256;

/// Number of polygons of a mask.
const BLOCK: usize = u16::BITS as usize;

/// Number of bits of the words that are read and written.
const WORD: u32 = u32::BITS;

/// The lowest and the highest number; `u32::MAX` and 0 for an empty list.
#[inline(always)]
pub(super) fn low_and_high(ids: &[PolygonId]) -> (u32, u32) {
    let (mut low, mut high) = (u32::MAX, 0);
    // There are two loops, because the compiler does not vectorise one loop for both.
    for part in ids.chunks(PART) {
        low = low.min(part.iter().fold(u32::MAX, |low, id| low.min(id.0)));
        high = high.max(part.iter().fold(0, |high, id| high.max(id.0)));
    }
    (low, high)
}

/// Sets the bits of polygons in the masks of blocks. Returns false, and changes nothing, if a polygon has no
/// mask.
#[inline(always)]
pub(super) fn mark(masks: &mut [u16], ids: &[PolygonId]) -> bool {
    let (_, high) = low_and_high(ids);
    // A word contains two masks.
    let words = masks.len() * BLOCK / WORD as usize;
    if high as usize / WORD as usize >= words {
        return ids.is_empty();
    }
    let start = masks.as_mut_ptr();
    for id in ids {
        // SAFETY: no number is greater than `high`, so the two masks of the word exist.
        unsafe {
            if cfg!(target_endian = "little") {
                let word = start.cast::<u32>().add((id.0 / WORD) as usize);
                let there = word.read_unaligned();
                word.write_unaligned(there | 1 << (id.0 % WORD));
            } else {
                let mask = start.add(id.index() / BLOCK);
                *mask |= 1 << (id.0 % BLOCK as u32);
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn marks_are_those_of_single_bits(
            numbers in prop::collection::vec(0u32..700, 0..600),
            before in prop::collection::vec(any::<u16>(), 42),
        ) {
            let ids: Vec<PolygonId> = numbers.iter().map(|&id| PolygonId(id)).collect();
            let (mut set, mut each_set) = (before.clone(), before.clone());
            let is_there = ids.iter().all(|id| id.index() / BLOCK < before.len());
            prop_assert_eq!(mark(&mut set, &ids), is_there);
            for id in ids.iter().filter(|_| is_there) {
                each_set[id.index() / BLOCK] |= 1 << (id.index() % BLOCK);
            }
            prop_assert_eq!(set, each_set);
            let highest = numbers.iter().copied().max().unwrap_or(0);
            let lowest = numbers.iter().copied().min().unwrap_or(u32::MAX);
            prop_assert_eq!(low_and_high(&ids), (lowest, highest));
        }
    }
}
