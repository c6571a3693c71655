//! What a function answers, and the message beside it.

use std::{any::Any, cell::Cell, ffi::c_char};

/// What a function answers: OSP_STATUS_OK, or why it has changed nothing. osp_last_error says it in words.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspStatus {
    /// Done.
    Ok = 0,
    /// The answer has more than there is room for: the first of it are in the list. How many there are is in *count.
    BufferTooSmall = 1,
    /// A pointer is NULL that must not be.
    NullPointer = 2,
    /// A pointer is not aligned for what it points to.
    MisalignedPointer = 3,
    /// A count is larger than memory, or than what there can be (OSP_MAX_OBJECTS, OSP_MAX_CAMERAS).
    TooMany = 4,
    /// A matrix has NaN or an infinite number in it, or no inverse.
    InvalidCamera = 5,
    /// A corner is not finite, a quad is not flat and convex, an index names no vertex, or nothing has an area.
    InvalidOccluder = 6,
    /// Another argument is out of its range.
    InvalidArgument = 7,
    /// No object has this key.
    UnknownKey = 8,
    /// Another thread is changing this culler, or, if this call would change it, is using it.
    Busy = 9,
    /// An earlier call that changed this culler has failed inside of osp: only free it.
    Poisoned = 10,
    /// A fault inside of osp, which should be reported; it is also written to standard error.
    Internal = 11,
}

/// Why a call is refused.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) status: OspStatus,
    pub(crate) message: String,
}

impl Failure {
    pub(crate) fn new(status: OspStatus, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    pub(crate) fn panicked(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<&str>().copied();
        let text =
            text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message");
        Self::new(OspStatus::Internal, format!("a fault inside of osp: {text}"))
    }
}

pub(crate) type Outcome<T> = Result<T, Failure>;

/// Bytes of a message at most, its zero byte included; what is longer is cut off.
pub const OSP_MESSAGE_BYTES: u32 = 1024;

thread_local! {
    /// Without a destructor: it is there until the thread's memory goes.
    static LAST: [Cell<u8>; OSP_MESSAGE_BYTES as usize] = const { [const { Cell::new(0) }; _] };
}

/// Keeps the message of a failure for this thread, in the place of the one before.
pub(crate) fn keep_message(message: &str) {
    let ascii = |letter: char| if letter.is_ascii() && letter != '\0' { letter as u8 } else { b'?' };
    LAST.with(|last| {
        let (_, text) = last.split_last().expect("room for more than the end");
        // What was there before may be longer: zeros take the rest. The last byte is never written.
        let bytes = message.chars().map(ascii).chain(std::iter::repeat(0));
        text.iter().zip(bytes).for_each(|(place, byte)| place.set(byte));
    });
}

/// The message of the last call on this thread that did not answer OSP_STATUS_OK; empty if there was none, never NULL. It ends with a
/// zero byte and is plain ASCII, OSP_MESSAGE_BYTES at most. The pointer is the same for every call on one thread and is valid until
/// the thread ends; the next failure on this thread writes its message into the same place. Copy what has to stay.
#[unsafe(no_mangle)]
pub extern "C" fn osp_last_error() -> *const c_char {
    LAST.with(|last| last.as_ptr().cast())
}

/// The version of the library that is loaded: major * 65536 + minor * 256 + patch. Compare it with OSP_VERSION, that of the
/// header: while the major number is 0, the minor numbers have to be equal.
#[unsafe(no_mangle)]
pub extern "C" fn osp_version() -> u32 {
    OSP_VERSION
}

/// The version of this header: major * 65536 + minor * 256 + patch.
pub const OSP_VERSION: u32 = 256;

#[cfg(test)]
mod tests {
    use std::ffi::CStr;

    use super::*;

    #[test]
    fn a_message_stays_where_it_is_and_is_cut_off_at_its_end() {
        let first = osp_last_error();
        // SAFETY: never NULL, ends with a zero byte, and is of this thread.
        let text = || unsafe { CStr::from_ptr(osp_last_error()) }.to_str().expect("plain text").to_owned();
        let most = OSP_MESSAGE_BYTES as usize - 1;
        for length in [most - 1, most, most + 1, 3 * most, 3, 0] {
            let message: String = "an \u{e9} \u{1f600} ".chars().cycle().take(length).collect();
            keep_message(&message);
            let expected: String = "an ? ? ".chars().cycle().take(length.min(most)).collect();
            assert_eq!((text(), osp_last_error()), (expected, first), "{length}");
        }
        let other = std::thread::spawn(|| osp_last_error().addr()).join().expect("no panic");
        assert_ne!(other, first.addr(), "each thread has its own");
    }

    #[test]
    fn the_version_is_that_of_the_package() {
        let numbers: Vec<u32> =
            env!("CARGO_PKG_VERSION").split('.').map(|number| number.parse().expect("a number")).collect();
        assert_eq!(numbers, [OSP_VERSION >> 16, OSP_VERSION >> 8 & 255, OSP_VERSION & 255]);
    }
}
