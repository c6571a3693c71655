const INLINE: usize = 128;

/// The nodes that a traversal has still to visit. The inline array suffices for trees of usual depth. Deeper trees use
/// the heap.
pub(super) struct WalkStack<T> {
    inline: [T; INLINE],
    len: usize,
    spill: Vec<T>,
}

impl<T: Copy> WalkStack<T> {
    /// A stack with one entry.
    pub(super) fn from(first: T) -> Self {
        Self { inline: [first; INLINE], len: 1, spill: Vec::new() }
    }

    #[inline]
    pub(super) fn push(&mut self, entry: T) {
        match self.inline.get_mut(self.len) {
            Some(free) => {
                *free = entry;
                self.len += 1;
            }
            None => self.spill.push(entry),
        }
    }

    #[inline]
    pub(super) fn pop(&mut self) -> Option<T> {
        if self.len == INLINE
            && let Some(entry) = self.spill.pop()
        {
            return Some(entry);
        }
        self.len = self.len.checked_sub(1)?;
        Some(self.inline[self.len])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn last_in_first_out_beyond_the_inline_part() {
        let mut stack = WalkStack::from(0);
        (1..1000).for_each(|i| stack.push(i));
        assert!((0..1000).rev().all(|i| stack.pop() == Some(i)));
        assert_eq!(stack.pop(), None);
        stack.push(7);
        assert_eq!((stack.pop(), stack.pop()), (Some(7), None));
    }
}
