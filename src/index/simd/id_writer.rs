#![expect(unsafe_code, reason = "appends sixteen ids at a time without a copy; tested on every kernel")]

use std::mem::MaybeUninit;

use super::Kernel;
use crate::scene::PolygonId;

/// Appends ids to a list, up to sixteen at a time. Keeps the list's length to itself until it is dropped.
pub(in crate::index) struct IdWriter<'a> {
    list: &'a mut Vec<PolygonId>,
    len: usize,
}

impl<'a> IdWriter<'a> {
    pub(in crate::index) fn new(list: &'a mut Vec<PolygonId>) -> Self {
        let len = list.len();
        Self { list, len }
    }

    /// Appends `first + bit` for the bits of `mask`.
    #[inline(always)]
    pub(in crate::index) fn push<K: Kernel>(&mut self, kernel: K, first: u32, mask: u32) {
        if self.list.capacity() - self.len < 16 {
            self.grow();
        }
        // SAFETY: `len <= capacity - 16`, so sixteen places follow that belong to the list; `PolygonId` is a
        // transparent `u32`.
        let out = unsafe { &mut *self.list.as_mut_ptr().add(self.len).cast::<[MaybeUninit<u32>; 16]>() };
        self.len += kernel.write_ids(first, mask, out);
    }

    #[cold]
    fn grow(&mut self) {
        self.publish();
        self.list.reserve(self.len.max(16));
    }

    fn publish(&mut self) {
        // SAFETY: the first `len` places were filled by `push`, each within the capacity.
        unsafe { self.list.set_len(self.len) };
    }
}

impl Drop for IdWriter<'_> {
    fn drop(&mut self) {
        self.publish();
    }
}
