//! An allocator that counts the allocations and the memory of each thread.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static HELD_BYTES: Cell<i64> = const { Cell::new(0) };
    static PEAK_BYTES: Cell<i64> = const { Cell::new(0) };
}

fn note(allocations: u64, bytes: i64) {
    // Fails only while the thread ends.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + allocations));
    let _ = HELD_BYTES.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = PEAK_BYTES.try_with(|peak| peak.set(peak.get().max(held.get())));
    });
}

/// The system's allocator with counts. A test binary declares it as its allocator: `#[global_allocator] static
/// COUNTING: Counting = Counting;`.
#[derive(Debug)]
pub struct Counting;

#[allow(unsafe_code, reason = "a global allocator needs it; this one only counts and passes calls on")]
// SAFETY: every call is passed to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        note(1, layout.size() as i64);
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        note(1, layout.size() as i64);
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        note(0, -(layout.size() as i64));
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.dealloc(ptr, layout) }
    }

    unsafe fn realloc(&self, ptr: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        note(1, new_size as i64 - layout.size() as i64);
        // SAFETY: the caller fulfils the same contract.
        unsafe { System.realloc(ptr, layout, new_size) }
    }
}

/// Returns the number of allocations of this thread so far.
pub fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

/// Returns the bytes that this thread has allocated, minus the bytes that it has freed. The freed bytes may come from
/// other threads.
pub fn held_bytes() -> i64 {
    HELD_BYTES.with(Cell::get)
}

/// Runs a function. Returns its result, and the largest number of bytes that this thread held for it at any time.
pub fn peak_of<T>(run: impl FnOnce() -> T) -> (T, i64) {
    let before = HELD_BYTES.get();
    PEAK_BYTES.set(before);
    let outcome = run();
    (outcome, PEAK_BYTES.get() - before)
}
