#![expect(unsafe_code, reason = "appends sixteen ids at a time without a copy; tested on every kernel")]

use std::mem::MaybeUninit;

use super::{Kernel, lanes_of};
use crate::polygon::PolygonId;

/// The runs of a page. Run `i` holds the ids `first[i] + bit` for the set bits of `masks[i]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PageRuns<'a> {
    pub(crate) first: &'a [u32; 16],
    pub(crate) masks: &'a [u16; 16],
    /// The lanes of runs with gaps: the mask is not `2^k - 1`.
    pub(crate) gaps: u32,
    /// The lanes of runs with one polygon: the mask is 1.
    pub(crate) single: u32,
}

/// Appends ids to a list, up to sixteen with one store. [`IdWriter::finish`] sets the list's new length.
#[derive(Debug)]
pub struct IdWriter<'a> {
    list: &'a mut Vec<PolygonId>,
    start: *mut MaybeUninit<u32>,
    len: usize,
    capacity: usize,
}

/// Largest number of entries that a page overwrites. The writer keeps this many unused entries after the ids of a list,
/// because each store writes sixteen entries even if it appends fewer ids.
pub const ROOM_BEHIND: usize = 16 * 17;

impl<'a> IdWriter<'a> {
    /// A writer that appends to `list`.
    pub fn new(list: &'a mut Vec<PolygonId>) -> Self {
        let (start, len, capacity) = (list.as_mut_ptr().cast(), list.len(), list.capacity());
        Self { list, start, len, capacity }
    }

    /// Calls `write` with a writer that appends to `list`, then sets the list's length.
    pub fn append<R>(list: &'a mut Vec<PolygonId>, write: impl FnOnce(&mut Self) -> R) -> R {
        let mut writer = Self::new(list);
        let result = write(&mut writer);
        writer.finish();
        result
    }

    /// Length of the list with the ids written so far.
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Sets the length of the complete list.
    #[inline(always)]
    pub fn finish(self) {
        // SAFETY: the first `len` entries were filled, each within the capacity.
        unsafe { self.list.set_len(self.len) };
    }

    /// Makes room for `more` ids, and for the entries that a page overwrites after them ([`ROOM_BEHIND`]).
    #[inline(always)]
    fn make_room(&mut self, more: usize) {
        if self.capacity - self.len < more + ROOM_BEHIND {
            (self.start, self.capacity) = grow(self.list, self.len, more);
        }
    }

    /// The sixteen entries that begin `ahead` entries after the last id.
    ///
    /// # Safety
    /// The list has room for `ahead + 16` more ids.
    #[inline(always)]
    unsafe fn entries(&mut self, ahead: usize) -> &mut [MaybeUninit<u32>; 16] {
        // SAFETY: the caller guarantees that the entries belong to the list; `PolygonId` is a transparent `u32`.
        unsafe { &mut *self.start.add(self.len + ahead).cast() }
    }

    /// Appends `first + bit` for the bits of `mask`.
    #[inline(always)]
    pub(crate) fn push<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        self.make_room(0);
        // SAFETY: there is room now.
        self.len += kernel.write_ids(first, mask, unsafe { self.entries(0) });
    }

    /// Largest number of blocks in a call of [`IdWriter::push_blocks`].
    pub(crate) const BLOCKS: usize = 16;

    /// Appends the ids in the masks of consecutive blocks; `first` is the first id of the first block.
    #[inline(always)]
    pub(crate) fn push_blocks<K: Kernel>(&mut self, kernel: K, first: u32, masks: &[u16]) {
        self.make_room(0);
        for (block, &mask) in masks.iter().take(Self::BLOCKS).enumerate() {
            let first = first.wrapping_add(block as u32 * 16);
            // SAFETY: sixteen blocks take at most 256 entries, so sixteen are left for each.
            self.len += kernel.write_ids(first, u32::from(mask), unsafe { self.entries(0) });
        }
    }

    /// Appends `count` consecutive ids from `first` on, at least sixteen.
    #[inline(always)]
    pub(crate) fn push_span<K: Kernel>(&mut self, kernel: K, first: u32, count: usize) {
        self.make_room(count);
        // SAFETY: there is room for `count` and sixteen more.
        kernel.write_sixteen(first, unsafe { self.entries(0) });
        // The first store may be unaligned. The next stores fill whole cache lines, which is twice as fast; the
        // position of an entry determines its id.
        let address = self.start.wrapping_add(self.len).addr() / size_of::<u32>();
        let mut skip = 16 - address % 16;
        while skip < count {
            // SAFETY: there is room for `count` and sixteen more.
            kernel.write_sixteen(first.wrapping_add(skip as u32), unsafe { self.entries(skip) });
            skip += 16;
        }
        self.len += count;
    }

    /// Appends the first `count` of `ids`, at most sixteen.
    #[inline(always)]
    pub(crate) fn push_copy(&mut self, ids: &[u32; 16], count: u32) {
        self.make_room(0);
        // SAFETY: there is room now.
        copy(ids, unsafe { self.entries(0) });
        self.len += (count as usize).min(16);
    }

    /// Appends ids.
    #[inline]
    pub fn push_slice(&mut self, ids: &[PolygonId]) {
        self.make_room(ids.len());
        // SAFETY: there is room for `ids` now, and `ids` does not belong to the list.
        unsafe {
            self.start.add(self.len).cast::<PolygonId>().copy_from_nonoverlapping(ids.as_ptr(), ids.len())
        };
        self.len += ids.len();
    }

    /// Appends the ids whose lanes are set in `lanes`.
    #[inline(always)]
    pub fn push_packed<K: Kernel>(&mut self, kernel: K, ids: &[u32; 16], lanes: u32) {
        self.make_room(0);
        // SAFETY: there is room now.
        let entries = unsafe { self.entries(0) };
        self.len += if lanes == 0xFFFF {
            copy(ids, entries);
            16
        } else {
            kernel.pack(ids, lanes, entries)
        };
    }

    /// Appends the first `runs` runs of a page.
    #[inline(always)]
    pub(crate) fn push_page<K: Kernel>(&mut self, kernel: K, page: PageRuns<'_>, runs: u32) {
        self.make_room(0);
        let all = (1u32 << (runs & 31)) - 1;
        let mut at = 0;
        if page.single == all {
            // SAFETY: the list has room for sixteen entries of each run, i.e. for 256 entries of a page.
            copy(page.first, unsafe { self.entries(0) });
            at = runs as usize;
        } else if page.gaps == 0 {
            for (&first, &mask) in page.first.iter().zip(page.masks).take(runs as usize) {
                // SAFETY: the list has room for sixteen entries of each run, i.e. for 256 entries of a page.
                kernel.write_sixteen(first, unsafe { self.entries(at) });
                at += mask.count_ones() as usize;
            }
        } else {
            for (&first, &mask) in page.first.iter().zip(page.masks).take(runs as usize) {
                // SAFETY: the list has room for sixteen entries of each run, i.e. for 256 entries of a page.
                at += kernel.write_ids(first, u32::from(mask), unsafe { self.entries(at) });
            }
        }
        self.len += at;
    }

    /// Appends the runs of a page whose lanes are set in `lanes`.
    #[inline(always)]
    pub(crate) fn push_lanes<K: Kernel>(&mut self, kernel: K, page: PageRuns<'_>, lanes: u32) {
        self.make_room(0);
        let mut at = 0;
        for lane in lanes_of(lanes & !page.single & !page.gaps & 0xFFFF) {
            let lane = lane % 16;
            // SAFETY: the list has room for sixteen entries of each run, i.e. for 256 entries of a page.
            kernel.write_sixteen(page.first[lane], unsafe { self.entries(at) });
            at += page.masks[lane].count_ones() as usize;
        }
        for lane in lanes_of(lanes & page.gaps & 0xFFFF) {
            let lane = lane % 16;
            // SAFETY: the list has room for sixteen entries of each run, i.e. for 256 entries of a page.
            at +=
                kernel.write_ids(page.first[lane], u32::from(page.masks[lane]), unsafe { self.entries(at) });
        }
        let single = lanes & page.single & 0xFFFF;
        if single != 0 {
            // SAFETY: the list has room for sixteen entries of each run, i.e. for 256 entries of a page.
            at += kernel.pack(page.first, single, unsafe { self.entries(at) });
        }
        self.len += at;
    }
}

/// Copies sixteen numbers.
#[inline(always)]
fn copy(numbers: &[u32; 16], out: &mut [MaybeUninit<u32>; 16]) {
    // SAFETY: both have sixteen entries.
    unsafe { out.as_mut_ptr().copy_from_nonoverlapping(numbers.as_ptr().cast(), 16) };
}

/// Sets the list's length to `len`. Then doubles the capacity, or makes room for `more` and [`ROOM_BEHIND`] if that is
/// more.
#[cold]
#[inline(never)]
fn grow(list: &mut Vec<PolygonId>, len: usize, more: usize) -> (*mut MaybeUninit<u32>, usize) {
    // SAFETY: the first `len` entries were filled, each within the capacity.
    unsafe { list.set_len(len) };
    list.reserve(len.max(more + ROOM_BEHIND));
    (list.as_mut_ptr().cast(), list.capacity())
}
