//! The boundary to C. No panic passes it, and every pointer is read or written here.
//!
//! Some things cannot be checked, so the caller must guarantee them, as the header states. A pointer that is not NULL
//! points to as much memory as the function requires, which nobody changes during the call. A handle has not been
//! freed.

use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::status::{Failure, OspStatus, Outcome, keep_message};

/// Runs a call from C.
pub(crate) fn border(call: impl FnOnce() -> Outcome<()>) -> OspStatus {
    // A panic poisons the lock around the data that it leaves in an unfinished state.
    let outcome = catch_unwind(AssertUnwindSafe(call));
    match outcome.unwrap_or_else(|panic| Err(Failure::panicked(&*panic))) {
        Ok(()) => OspStatus::Ok,
        Err(Failure { status, message }) => {
            keep_message(&message);
            status
        }
    }
}

/// Checks that a pointer is not NULL, is aligned, and that `count` values from it on fit into the address space.
fn check<T>(pointer: *const T, count: usize, name: &str) -> Outcome<()> {
    let failure = |status, what: &str| Err(Failure::new(status, format!("{name}: {what}")));
    if pointer.is_null() {
        return failure(OspStatus::NullPointer, "expected a pointer, found NULL");
    }
    if !pointer.is_aligned() {
        let align = align_of::<T>();
        return failure(
            OspStatus::MisalignedPointer,
            &format!("expected an address that {align} divides, found {pointer:p}"),
        );
    }
    let bytes = count.checked_mul(size_of::<T>()).filter(|&bytes| isize::try_from(bytes).is_ok());
    if bytes.and_then(|bytes| pointer.addr().checked_add(bytes)).is_none() {
        return failure(OspStatus::TooMany, &format!("{count} values are more than memory holds"));
    }
    Ok(())
}

/// Returns the object of a handle that C holds.
///
/// # Safety
/// The handle is NULL, misaligned, or of an object that lives for `'a`.
pub(crate) unsafe fn object<'a, T>(handle: *const T, name: &str) -> Outcome<&'a T> {
    check(handle, 1, name)?;
    // SAFETY: this is checked as far as possible; the caller guarantees the rest.
    Ok(unsafe { &*handle })
}

/// Reads a value.
///
/// # Safety
/// The caller keeps the guarantees in the documentation of this module.
pub(crate) unsafe fn value<T: Copy>(pointer: *const T, name: &str) -> Outcome<T> {
    check(pointer, 1, name)?;
    // SAFETY: this is checked as far as possible; the caller guarantees the rest.
    Ok(unsafe { pointer.read() })
}

/// Reads `N` numbers.
///
/// # Safety
/// The caller keeps the guarantees in the documentation of this module.
pub(crate) unsafe fn numbers<T: Copy, const N: usize>(pointer: *const T, name: &str) -> Outcome<[T; N]> {
    check(pointer, N, name)?;
    // SAFETY: this is checked as far as possible; the caller guarantees the rest. An array has the same alignment as
    // its numbers.
    Ok(unsafe { pointer.cast::<[T; N]>().read() })
}

/// Copies a list. Its pointer may be NULL if the list is empty. The list is copied, because the results may be written
/// into the same memory.
///
/// # Safety
/// The caller keeps the guarantees in the documentation of this module.
pub(crate) unsafe fn list<T: Copy>(
    pointer: *const T,
    count: usize,
    most: usize,
    name: &str,
) -> Outcome<Vec<T>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    check(pointer, count, name)?;
    if count > most {
        let message = format!("{name}: expected at most {most} values, found {count}");
        return Err(Failure::new(OspStatus::TooMany, message));
    }
    let mut copy = Vec::new();
    if copy.try_reserve_exact(count).is_err() {
        let message = format!("{name}: no memory for {count} values");
        return Err(Failure::new(OspStatus::TooMany, message));
    }
    // SAFETY: this is checked as far as possible; the caller guarantees the rest.
    copy.extend_from_slice(unsafe { std::slice::from_raw_parts(pointer, count) });
    Ok(copy)
}

/// The caller's memory for one value.
pub(crate) struct Out<T>(*mut T);

impl<T: Copy> Out<T> {
    /// # Safety
    /// The caller keeps the guarantees in the documentation of this module.
    pub(crate) unsafe fn new(pointer: *mut T, name: &str) -> Outcome<Self> {
        check(pointer, 1, name)?;
        Ok(Self(pointer))
    }

    pub(crate) fn set(&self, value: T) {
        // SAFETY: the creator of this value has guaranteed it.
        unsafe { self.0.write(value) }
    }
}

/// The caller's memory for a list of `room` values; `room` is 0 if the caller passes no memory.
pub(crate) struct OutList<T> {
    pointer: *mut T,
    room: usize,
}

impl<T: Copy> OutList<T> {
    /// Checks the memory. `pointer` may be NULL if `room` is 0.
    ///
    /// # Safety
    /// The caller keeps the guarantees in the documentation of this module.
    pub(crate) unsafe fn new(pointer: *mut T, room: usize, name: &str) -> Outcome<Self> {
        if room > 0 {
            check(pointer, room, name)?;
        }
        Ok(Self { pointer, room })
    }

    /// Writes values while there is room. Returns the number of all values.
    pub(crate) fn write(&self, values: impl Iterator<Item = T>) -> usize {
        let mut count = 0;
        for value in values {
            if count < self.room {
                // SAFETY: the creator of this value has guaranteed it, and `count` is less than `room`.
                unsafe { self.pointer.add(count).write(value) }
            }
            count += 1;
        }
        count
    }
}

/// The caller's memory for a result: a list, and the number of values.
pub(crate) struct Answer<T> {
    list: OutList<T>,
    count: Out<usize>,
    name: &'static str,
}

impl<T: Copy> Answer<T> {
    /// # Safety
    /// The caller keeps the guarantees in the documentation of this module.
    pub(crate) unsafe fn new(
        list: *mut T,
        room: usize,
        count: *mut usize,
        name: &'static str,
    ) -> Outcome<Self> {
        // SAFETY: the caller guarantees this.
        let answer =
            unsafe { Self { count: Out::new(count, "count")?, list: OutList::new(list, room, name)?, name } };
        answer.count.set(0);
        Ok(answer)
    }

    /// Writes the values for which there is room, and the number of all values.
    pub(crate) fn write_first(&self, values: impl Iterator<Item = T>) -> usize {
        let count = self.list.write(values);
        self.count.set(count);
        count
    }

    /// Does the same as [`Self::write_first`], but fails if there is not room for all values.
    pub(crate) fn write(&self, values: impl Iterator<Item = T>) -> Outcome<()> {
        let (count, room) = (self.write_first(values), self.list.room);
        if count <= room {
            return Ok(());
        }
        let message = format!("{}: expected room for {count}, found {room}", self.name);
        Err(Failure::new(OspStatus::BufferTooSmall, message))
    }
}

/// Passes an object to C.
pub(crate) fn give<T>(object: T, out: &Out<*mut T>) {
    out.set(Box::into_raw(Box::new(object)));
}

/// Takes an object back and frees it. NULL is ignored.
///
/// # Safety
/// The handle is NULL, misaligned, or of an object from [`give`] that is not used any more.
pub(crate) unsafe fn free<T>(handle: *mut T, name: &str) -> Outcome<()> {
    if handle.is_null() {
        return Ok(());
    }
    check(handle, 1, name)?;
    // SAFETY: the caller guarantees this.
    drop(unsafe { Box::from_raw(handle) });
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;
    use crate::{handle::Guarded, status::osp_last_error};

    fn message() -> String {
        // SAFETY: the pointer is never NULL, and belongs to this thread.
        unsafe { CStr::from_ptr(osp_last_error()) }.to_str().expect("plain text").to_owned()
    }

    #[test]
    fn a_panic_becomes_a_status_and_poisons_what_it_changed() {
        let object = Guarded::new(1);
        let fault = border(|| {
            let mut number = object.change()?;
            *number += 1;
            panic!("a zero\0 and an é");
        });
        assert_eq!(fault, OspStatus::Internal);
        assert_eq!(message(), "a fault inside of osp: a zero? and an ?");
        assert_eq!(border(|| object.read().map(drop)), OspStatus::Poisoned);
        assert_eq!(border(|| object.change().map(drop)), OspStatus::Poisoned);
        assert_eq!(border(|| Ok(())), OspStatus::Ok);
    }

    #[test]
    fn two_threads_are_refused_where_one_of_them_changes() {
        let object = Guarded::new(1);
        let on_another = |is_change: bool| {
            std::thread::scope(|scope| {
                let call =
                    || border(|| if is_change { object.change().map(drop) } else { object.read().map(drop) });
                scope.spawn(call).join().expect("no panic passes the border")
            })
        };
        let reading = object.read().expect("it is free");
        assert_eq!(on_another(false), OspStatus::Ok);
        assert_eq!(on_another(true), OspStatus::Busy);
        drop(reading);
        let changing = object.change().expect("it is free");
        assert_eq!(on_another(false), OspStatus::Busy);
        assert_eq!(on_another(true), OspStatus::Busy);
        drop(changing);
        assert_eq!(on_another(true), OspStatus::Ok);
    }

    #[test]
    fn pointers_and_counts_are_checked() {
        let numbers = [1.0f32; 4];
        let status = |outcome: Outcome<()>| outcome.map_or_else(|failure| failure.status, |()| OspStatus::Ok);
        let at = |bytes: usize| numbers.as_ptr().wrapping_byte_add(bytes);
        assert_eq!(status(check(at(0), 4, "x")), OspStatus::Ok);
        assert_eq!(status(check(std::ptr::null::<f32>(), 0, "x")), OspStatus::NullPointer);
        assert_eq!(status(check(at(1), 1, "x")), OspStatus::MisalignedPointer);
        for count in [usize::MAX, usize::MAX / 4 + 1, isize::MAX as usize / 4 + 1] {
            assert_eq!(status(check(at(0), count, "x")), OspStatus::TooMany, "{count}");
        }
    }
}
