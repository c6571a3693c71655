#![expect(
    unsafe_code,
    reason = "numbers that the tree holds are looked up without a check; it pays in queries"
)]

/// An entry of a [`Pool`].
pub(super) trait Pooled: Copy {
    /// Value of a new entry.
    const BLANK: Self;

    /// Binary logarithm of the number of entries of a chunk.
    const SHIFT: u32 = 8;
}

/// The number that stands for no entry.
pub(super) const NONE: u32 = u32::MAX;

/// Largest number of chunks by which a pool grows beyond its need. If it is larger, growth is rarer and takes longer.
const MOST_CHUNKS: usize = 8;

/// Largest number of chunks whose memory is committed when the pool is made: enough for a model of a million polygons.
const TOUCHED_CHUNKS: usize = 256;

/// A pool of numbered entries. It grows by chunks, so at most the entries of the last chunk are ever copied. Released
/// entries are reused first.
#[derive(Clone, Debug)]
pub(super) struct Pool<T> {
    /// Each chunk but the last has room for [`Pool::CHUNK`] entries.
    chunks: Vec<Vec<T>>,
    /// The released entries. There is room for all entries.
    free: Vec<u32>,
    /// Number of entries ever taken.
    len: u32,
    /// Number of entries in use.
    live: u32,
    /// Number of entries that have been written to, in use or not.
    touched: usize,
}

impl<T: Pooled> Pool<T> {
    /// Number of entries of a chunk.
    pub(super) const CHUNK: usize = 1 << T::SHIFT;

    /// A pool with room for `entries` entries. The first [`TOUCHED_CHUNKS`] chunks are written to here, because the system
    /// commits memory at the first write, which would delay a frame.
    pub(super) fn with_room_for(entries: usize) -> Self {
        let mut pool = Self { chunks: Vec::new(), free: Vec::new(), len: 0, live: 0, touched: 0 };
        pool.reserve(entries);
        pool.free.resize(entries.min(TOUCHED_CHUNKS * Self::CHUNK), NONE);
        std::hint::black_box(&mut pool.free).clear();
        for chunk in pool.chunks.iter_mut().take(TOUCHED_CHUNKS) {
            pool.touched += chunk.capacity();
            chunk.resize(chunk.capacity(), T::BLANK);
            std::hint::black_box(&mut *chunk).clear();
        }
        pool
    }

    /// Extends the room to `entries` entries in total. The additional memory is not written to, because it is rarely
    /// needed.
    pub(super) fn and_room_for(mut self, entries: usize) -> Self {
        self.reserve(entries);
        self
    }

    /// Makes room for at least `more` further entries. A pool that has to grow grows by a further eighth, so that growth is
    /// rare. This eighth is at most [`MOST_CHUNKS`] chunks, so that growth is short.
    pub(super) fn make_room(&mut self, more: usize) {
        let needed = self.live as usize + more;
        if needed > self.room() {
            self.reserve(needed + (needed / 8).min(MOST_CHUNKS * Self::CHUNK));
        }
    }

    /// Number of entries that the chunks have room for.
    fn room(&self) -> usize {
        let last = self.chunks.last().map_or(0, Vec::capacity);
        self.chunks.len().saturating_sub(1) * Self::CHUNK + last
    }

    fn reserve(&mut self, entries: usize) {
        let full = self.chunks.len().saturating_sub(1) * Self::CHUNK;
        if let Some(last) = self.chunks.last_mut()
            && entries > full + last.capacity()
        {
            last.reserve_exact(Self::CHUNK.min(entries - full) - last.len());
        }
        let chunks = entries.div_ceil(Self::CHUNK);
        self.chunks.reserve(chunks.saturating_sub(self.chunks.len()));
        while self.chunks.len() < chunks {
            let left = entries - self.chunks.len() * Self::CHUNK;
            self.chunks.push(Vec::with_capacity(left.min(Self::CHUNK)));
        }
        self.free.reserve(entries.saturating_sub(self.free.len()));
    }

    /// Takes an entry with the value [`Pooled::BLANK`]; returns its number.
    #[inline]
    pub(super) fn take(&mut self) -> u32 {
        self.live += 1;
        if let Some(i) = self.free.pop() {
            self[i] = T::BLANK;
            return i;
        }
        let i = self.len;
        let chunk = i as usize >> T::SHIFT;
        if chunk == self.chunks.len() {
            self.reserve((chunk + 1) * Self::CHUNK);
        }
        self.chunks[chunk].push(T::BLANK);
        self.len += 1;
        i
    }

    /// Releases an entry.
    pub(super) fn give(&mut self, i: u32) {
        self.free.push(i);
        self.live -= 1;
    }

    /// The entry with this number, without a check of the number.
    ///
    /// # Safety
    /// `i` was returned by [`Pool::take`] and not released since.
    #[inline(always)]
    pub(super) unsafe fn known(&self, i: u32) -> &T {
        debug_assert!(i < self.len);
        // SAFETY: `take` has written every entry below `len`.
        unsafe {
            let chunk = self.chunks.get_unchecked((i >> T::SHIFT) as usize);
            chunk.get_unchecked(i as usize & (Self::CHUNK - 1))
        }
    }

    /// The entries from this one on, if they lie in one chunk.
    #[inline]
    pub(super) fn row(&self, i: u32, count: usize) -> Option<&[T]> {
        let at = i as usize & (Self::CHUNK - 1);
        self.chunks.get((i >> T::SHIFT) as usize)?.get(at..at + count)
    }

    /// Address of an entry, for prefetching; null if the number is beyond the pool's room.
    #[inline]
    pub(super) fn place(&self, i: u32) -> *const T {
        let chunk = self.chunks.get((i >> T::SHIFT) as usize);
        chunk.map_or(std::ptr::null(), |chunk| chunk.as_ptr().wrapping_add(i as usize & (Self::CHUNK - 1)))
    }

    /// Number of entries in use.
    pub(super) fn live(&self) -> u32 {
        self.live
    }

    /// Number of entries whose memory was written to.
    fn held(&self) -> usize {
        self.touched.max(self.len as usize)
    }

    pub(super) fn clear(&mut self) {
        self.touched = self.held();
        for chunk in &mut self.chunks {
            chunk.clear();
        }
        self.free.clear();
        (self.len, self.live) = (0, 0);
    }

    /// Memory held, bytes. Room that was never written to does not count, because the system has not committed it.
    pub(super) fn bytes(&self) -> usize {
        self.held() * (size_of::<T>() + size_of::<u32>()) + self.chunks.capacity() * size_of::<Vec<T>>()
    }
}

impl<T: Pooled> std::ops::Index<u32> for Pool<T> {
    type Output = T;

    #[inline]
    fn index(&self, i: u32) -> &T {
        &self.chunks[(i >> T::SHIFT) as usize][i as usize & (Self::CHUNK - 1)]
    }
}

impl<T: Pooled> std::ops::IndexMut<u32> for Pool<T> {
    #[inline]
    fn index_mut(&mut self, i: u32) -> &mut T {
        &mut self.chunks[(i >> T::SHIFT) as usize][i as usize & (Self::CHUNK - 1)]
    }
}
