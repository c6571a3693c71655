//! The positions of blocks by number: a hash table with chains.

/// Number of chains.
const CHAINS: usize = 1 << BITS;
const BITS: u32 = 8;

const END: u32 = u32::MAX;

/// The positions of the blocks of a list.
#[derive(Clone, Debug)]
pub(super) struct BlockTable {
    /// For each chain, the position of its first block.
    first: [u32; CHAINS],
    /// For each position, the next position of its chain.
    next: Vec<u32>,
}

impl BlockTable {
    /// An empty table with room for `most` blocks. The memory of the first `blocks` is written to.
    pub(super) fn with_room_for(blocks: usize, most: usize) -> Self {
        let mut next = vec![0; blocks];
        std::hint::black_box(&mut next).clear();
        // In a browser, reserved memory counts as used.
        if !cfg!(target_family = "wasm") {
            next.reserve(most);
        }
        Self { first: [END; CHAINS], next }
    }

    fn chain(number: u32) -> usize {
        (number.wrapping_mul(0x9E37_79B1) >> (u32::BITS - BITS)) as usize
    }

    pub(super) fn clear(&mut self) {
        if !self.next.is_empty() {
            self.first.fill(END);
            self.next.clear();
        }
    }

    /// The position of a block; `numbers` are the numbers of all blocks.
    pub(super) fn find(&self, numbers: &[u32], number: u32) -> Option<usize> {
        let mut at = self.first[Self::chain(number)];
        while at != END {
            if numbers.get(at as usize) == Some(&number) {
                return Some(at as usize);
            }
            at = self.next[at as usize];
        }
        None
    }

    /// Adds a block after the last position.
    pub(super) fn push(&mut self, number: u32) {
        let at = self.next.len() as u32;
        self.next.push(std::mem::replace(&mut self.first[Self::chain(number)], at));
    }

    /// Removes a block; the last block moves to its position. `numbers` are the numbers before.
    pub(super) fn swap_remove(&mut self, numbers: &[u32], at: usize) {
        self.replace(numbers[at], at as u32, self.next[at]);
        let Some(next) = self.next.pop() else { return };
        let last = self.next.len();
        if at != last {
            self.next[at] = next;
            self.replace(numbers[last], last as u32, at as u32);
        }
    }

    /// Replaces a position in the chain of a block.
    fn replace(&mut self, number: u32, from: u32, to: u32) {
        let chain = Self::chain(number);
        if self.first[chain] == from {
            self.first[chain] = to;
            return;
        }
        let mut at = self.first[chain];
        while at != END {
            let next = self.next[at as usize];
            if next == from {
                self.next[at as usize] = to;
                return;
            }
            at = next;
        }
    }

    /// Memory on the heap, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.next.len() * size_of::<u32>()
    }
}
