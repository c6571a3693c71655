#![expect(
    unsafe_code,
    reason = "numbers that the tree holds are looked up without a check; it pays in queries"
)]

/// Something that a [`Pool`] holds.
pub(super) trait Pooled: Copy {
    /// What a fresh one looks like.
    const BLANK: Self;

    /// The next free entry, kept in a field that is not used while this one is free.
    fn next_free(&self) -> u32;

    /// Sets it.
    fn set_next_free(&mut self, next: u32);
}

/// No entry.
pub(super) const NONE: u32 = u32::MAX;

/// Chunks that a pool grows by at most beyond what it needs. More: rarer growth, longer pauses.
const MOST_CHUNKS: usize = 8;

/// Chunks whose memory is had from the start, if there is room for as many: those of a model of a million polygons.
const TOUCHED_CHUNKS: usize = 256;

/// A pool of entries by number. It grows by whole chunks, so nothing is ever copied, and entries given back are used
/// first.
#[derive(Clone, Debug)]
pub(super) struct Pool<T> {
    /// Every chunk has room for [`Pool::CHUNK`] entries from the start.
    chunks: Vec<Vec<T>>,
    /// First of the entries that were given back.
    free: u32,
    /// Entries ever taken.
    len: u32,
    /// Entries in use.
    live: u32,
    /// Chunks that were written to before they are used.
    touched: usize,
}

impl<T: Pooled> Pool<T> {
    const SHIFT: u32 = 8;
    /// Entries of a chunk.
    pub(super) const CHUNK: usize = 1 << Self::SHIFT;

    /// A pool with room for so many entries. Memory is only had once it is written to, and a frame should not have to wait
    /// for it, so that of the first [`TOUCHED_CHUNKS`] is written to here.
    pub(super) fn with_room_for(entries: usize) -> Self {
        let mut pool = Self { chunks: Vec::new(), free: NONE, len: 0, live: 0, touched: 0 };
        pool.reserve_chunks(entries.div_ceil(Self::CHUNK));
        for chunk in pool.chunks.iter_mut().take(TOUCHED_CHUNKS) {
            chunk.resize(Self::CHUNK, T::BLANK);
            std::hint::black_box(&mut *chunk).clear();
        }
        pool.touched = pool.chunks.len().min(TOUCHED_CHUNKS);
        pool
    }

    /// The pool with room for so many entries in all. The additional memory is not written to: it is rarely needed.
    pub(super) fn and_room_for(mut self, entries: usize) -> Self {
        self.reserve_chunks(entries.div_ceil(Self::CHUNK));
        self
    }

    /// Makes room for at least this many entries beyond those in use. If there is too little, it becomes more by an
    /// eighth, so that growing stays rare, but by no more than [`MOST_CHUNKS`] at once, so that it stays short.
    pub(super) fn make_room(&mut self, more: usize) {
        let needed = (self.live as usize + more).div_ceil(Self::CHUNK);
        if needed > self.chunks.len() {
            self.reserve_chunks(needed + (needed / 8).min(MOST_CHUNKS));
        }
    }

    /// Gives room back that was never used, as long as there is room for so many entries beyond those in use; no more than
    /// some chunks at once.
    pub(super) fn give_room_back(&mut self, more: usize, most_chunks: usize) {
        let needed = (self.live as usize + more).div_ceil(Self::CHUNK);
        let used = (self.len as usize).div_ceil(Self::CHUNK);
        let least = self.chunks.len().saturating_sub(most_chunks);
        self.chunks.truncate(needed.max(used).max(least));
    }

    fn reserve_chunks(&mut self, chunks: usize) {
        self.chunks.reserve(chunks.saturating_sub(self.chunks.len()));
        while self.chunks.len() < chunks {
            self.chunks.push(Vec::with_capacity(Self::CHUNK));
        }
    }

    /// A blank entry's number.
    #[inline]
    pub(super) fn take(&mut self) -> u32 {
        self.live += 1;
        if self.free != NONE {
            let i = self.free;
            let entry = &mut self[i];
            let next = entry.next_free();
            *entry = T::BLANK;
            self.free = next;
            return i;
        }
        let i = self.len;
        let chunk = i as usize >> Self::SHIFT;
        if chunk == self.chunks.len() {
            self.chunks.push(Vec::with_capacity(Self::CHUNK));
        }
        self.chunks[chunk].push(T::BLANK);
        self.len += 1;
        i
    }

    /// Gives an entry back.
    pub(super) fn give(&mut self, i: u32) {
        let next = self.free;
        self[i].set_next_free(next);
        self.free = i;
        self.live -= 1;
    }

    /// The entry of a number, without a check.
    ///
    /// # Safety
    /// `i` was returned by [`Pool::take`] and not given back since.
    #[inline(always)]
    pub(super) unsafe fn known(&self, i: u32) -> &T {
        debug_assert!(i < self.len);
        // SAFETY: `take` has filled every place below `len`.
        unsafe {
            let chunk = self.chunks.get_unchecked((i >> Self::SHIFT) as usize);
            chunk.get_unchecked(i as usize & (Self::CHUNK - 1))
        }
    }

    /// Where an entry lies, or nowhere if there is none of that number: to be prefetched.
    #[inline]
    pub(super) fn place(&self, i: u32) -> *const T {
        let chunk = self.chunks.get((i >> Self::SHIFT) as usize);
        chunk.map_or(std::ptr::null(), |chunk| chunk.as_ptr().wrapping_add(i as usize & (Self::CHUNK - 1)))
    }

    /// Entries in use.
    pub(super) fn live(&self) -> u32 {
        self.live
    }

    /// Chunks whose memory was written to.
    fn held_chunks(&self) -> usize {
        self.touched.max((self.len as usize).div_ceil(Self::CHUNK)).min(self.chunks.len())
    }

    pub(super) fn clear(&mut self) {
        self.touched = self.held_chunks();
        for chunk in &mut self.chunks {
            chunk.clear();
        }
        (self.free, self.len, self.live) = (NONE, 0, 0);
    }

    /// Memory held, bytes. Room that was never written to does not count: the system has not committed it.
    pub(super) fn bytes(&self) -> usize {
        self.held_chunks() * Self::CHUNK * size_of::<T>() + self.chunks.capacity() * size_of::<Vec<T>>()
    }
}

impl<T: Pooled> std::ops::Index<u32> for Pool<T> {
    type Output = T;

    #[inline]
    fn index(&self, i: u32) -> &T {
        &self.chunks[(i >> Self::SHIFT) as usize][i as usize & (Self::CHUNK - 1)]
    }
}

impl<T: Pooled> std::ops::IndexMut<u32> for Pool<T> {
    #[inline]
    fn index_mut(&mut self, i: u32) -> &mut T {
        &mut self.chunks[(i >> Self::SHIFT) as usize][i as usize & (Self::CHUNK - 1)]
    }
}
