//! Bitset functions on slices of 64-bit words. The caller owns the memory.

/// Number of bits of a word.
pub const WORD: usize = 64;

/// Number of words for `bits` bits.
pub const fn words_for(bits: usize) -> usize {
    bits.div_ceil(WORD)
}

/// Whether bit `i` is set. Bits beyond the last word count as not set.
#[inline]
pub fn contains(words: &[u64], i: usize) -> bool {
    words.get(i / WORD).is_some_and(|word| word >> (i % WORD) & 1 == 1)
}

/// Sets a bit. Panics beyond the last word.
#[inline]
pub fn insert(words: &mut [u64], i: usize) {
    words[i / WORD] |= 1 << (i % WORD);
}

/// Clears a bit. Panics beyond the last word.
#[inline]
pub fn remove(words: &mut [u64], i: usize) {
    words[i / WORD] &= !(1 << (i % WORD));
}

/// Number of set bits before bit `i` in its word.
#[inline]
pub(crate) fn rank_in_word(words: &[u64], i: usize) -> usize {
    (words[i / WORD] & ((1 << (i % WORD)) - 1)).count_ones() as usize
}

/// The numbers whose bits are set, in order.
pub fn iter(words: &[u64]) -> impl Iterator<Item = usize> + Clone + '_ {
    words.iter().enumerate().flat_map(|(at, word)| bits_of(*word).map(move |bit| at * WORD + bit))
}

/// The bits that are set in a word, in order.
#[inline]
pub fn bits_of(word: u64) -> impl Iterator<Item = usize> + Clone {
    let mut left = word;
    std::iter::from_fn(move || {
        let bit = left.trailing_zeros() as usize;
        left &= left.wrapping_sub(1);
        (bit < WORD).then_some(bit)
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_a_set_of_numbers(
            added in prop::collection::vec(0usize..200, 0..80),
            taken in prop::collection::vec(0usize..200, 0..80),
        ) {
            let mut words = vec![0; words_for(200)];
            let mut plain = BTreeSet::new();
            for i in added {
                insert(&mut words, i);
                plain.insert(i);
            }
            for i in taken {
                remove(&mut words, i);
                plain.remove(&i);
            }
            prop_assert!((0..300).all(|i| contains(&words, i) == plain.contains(&i)));
            prop_assert!(iter(&words).eq(plain.iter().copied()));
            for i in 0..200 {
                prop_assert_eq!(rank_in_word(&words, i), plain.range(i / WORD * WORD..i).count());
            }
        }
    }
}
