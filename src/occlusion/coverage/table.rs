//! A hash table of numbers. The caller stores the keys.

/// The value that stands for no number.
pub(super) const NONE: u32 = u32::MAX;

/// Least number of places of a table.
const LEAST: usize = 16;

/// A set of numbers. Each number is found by the hash of its key, and the caller compares the keys. Open
/// addressing with linear probing, at most two thirds full, takes at least 6 bytes a number.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    places: Vec<u32>,
    len: usize,
}

/// A hash of four numbers, by multiplication (Knuth).
#[inline]
pub(super) fn hash_of(words: [u32; 4]) -> u64 {
    let mix =
        |hash: u64, word: u32| (hash ^ u64::from(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
    words.into_iter().fold(0x243f_6a88_85a3_08d3, mix)
}

impl Table {
    /// An empty set with room for this many numbers.
    pub(super) fn with_capacity(numbers: usize) -> Self {
        Self { places: vec![NONE; (numbers * 3 / 2 + 1).next_power_of_two().max(LEAST)], len: 0 }
    }

    fn start(&self, hash: u64) -> usize {
        (hash >> 7) as usize & (self.places.len() - 1)
    }

    /// The number that has this hash and that `is_it` accepts.
    #[inline]
    pub(super) fn find(&self, hash: u64, is_it: impl Fn(u32) -> bool) -> Option<u32> {
        self.place(hash, is_it).map(|at| self.places[at])
    }

    /// Place of the entry with this hash for which `is_it` holds.
    #[inline]
    fn place(&self, hash: u64, is_it: impl Fn(u32) -> bool) -> Option<usize> {
        if self.places.is_empty() {
            return None;
        }
        let mut at = self.start(hash);
        loop {
            match self.places[at] {
                NONE => return None,
                number if is_it(number) => return Some(at),
                _ => at = (at + 1) & (self.places.len() - 1),
            }
        }
    }

    /// Adds a number that the table does not contain.
    pub(super) fn insert(&mut self, number: u32, hash_of: impl Fn(u32) -> u64) {
        if (self.len + 1) * 3 > self.places.len() * 2 {
            let room = (self.places.len() * 2).max(LEAST);
            let old = std::mem::replace(&mut self.places, vec![NONE; room]);
            old.into_iter()
                .filter(|&number| number != NONE)
                .for_each(|number| self.put(number, hash_of(number)));
        }
        self.put(number, hash_of(number));
        self.len += 1;
    }

    fn put(&mut self, number: u32, hash: u64) {
        let mut at = self.start(hash);
        while self.places[at] != NONE {
            at = (at + 1) & (self.places.len() - 1);
        }
        self.places[at] = number;
    }

    /// Replaces a number by another one with the same hash.
    pub(super) fn replace(&mut self, number: u32, by: u32, hash: u64) {
        if let Some(at) = self.place(hash, |there| there == number) {
            self.places[at] = by;
        }
    }

    /// Removes a number. The following numbers move up, so that no search ends early.
    pub(super) fn remove(&mut self, number: u32, hash_of: impl Fn(u32) -> u64) {
        let Some(mut hole) = self.place(hash_of(number), |there| there == number) else { return };
        let last = self.places.len() - 1;
        let mut at = hole;
        loop {
            at = (at + 1) & last;
            let there = self.places[at];
            if there == NONE {
                break;
            }
            // Distances of this number from the start of its search, and from the hole.
            let from_start = at.wrapping_sub(self.start(hash_of(there))) & last;
            if from_start >= (at.wrapping_sub(hole) & last) {
                self.places[hole] = there;
                hole = at;
            }
        }
        self.places[hole] = NONE;
        self.len -= 1;
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn it_is_the_set_of_what_was_put_in() {
        // Few hashes, so that searches run into each other and around the end.
        let hash = |number: u32| u64::from(number % 7) << 7;
        let (mut table, mut plain) = (Table::default(), BTreeSet::new());
        let mut state = 1_u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let number = (state >> 40) as u32 % 60;
            if plain.insert(number) {
                table.insert(number, hash);
            } else {
                plain.remove(&number);
                table.remove(number, hash);
            }
            for number in 0..60 {
                let found = table.find(hash(number), |other| other == number);
                assert_eq!(found.is_some(), plain.contains(&number));
            }
            assert_eq!(table.len, plain.len());
        }
    }
}
