use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

/// The system's allocator, counting the allocations of each thread.
#[derive(Clone, Copy, Debug)]
pub struct CountingAllocator;

/// Number of allocations of this thread so far.
pub(super) fn count() -> u64 {
    ALLOCATIONS.try_with(Cell::get).unwrap_or(0)
}

fn note() {
    // Fails only while the thread ends. Allocations at that time do not matter.
    let _ = ALLOCATIONS.try_with(|n| n.set(n.get() + 1));
}

#[expect(
    unsafe_code,
    reason = "an allocator cannot be wrapped otherwise; every call goes to the system's unchanged"
)]
// SAFETY: each method passes its arguments unchanged to `System`, which fulfils the contract of `GlobalAlloc`. Counting
// does not allocate.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note();
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        note();
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}
