//! The status that a function returns, and its message.

use std::{any::Any, cell::Cell, ffi::c_char};

/// The status that a function returns: OSP_STATUS_OK, or the reason why the function has changed nothing.
/// osp_last_error describes the reason.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspStatus {
    /// Success.
    Ok = 0,
    /// There are more results than room. The list has the first results, and *count is the number of all results.
    BufferTooSmall = 1,
    /// A pointer is NULL, but must not be NULL.
    NullPointer = 2,
    /// A pointer is not aligned for its type.
    MisalignedPointer = 3,
    /// A count is larger than memory, or larger than allowed (OSP_MAX_OBJECTS, OSP_MAX_CAMERAS).
    TooMany = 4,
    /// A matrix contains NaN or an infinite number, or has no inverse.
    InvalidCamera = 5,
    /// A corner is not finite, a quad is not flat and convex, an index has no vertex, or the whole occluder has no
    /// area.
    InvalidOccluder = 6,
    /// Another argument is out of its range.
    InvalidArgument = 7,
    /// No object has this key.
    UnknownKey = 8,
    /// Another thread is changing this culler, or is reading it while this call would change it.
    Busy = 9,
    /// An earlier call that changed this culler has failed inside osp. The culler can only be freed.
    Poisoned = 10,
    /// A fault inside osp, which should be reported. The message is also written to standard error.
    Internal = 11,
}

/// The status and the message of a refused call.
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

/// Largest number of bytes of a message, including its zero byte. Longer messages are cut off.
pub const OSP_MESSAGE_BYTES: u32 = 1024;

thread_local! {
    /// The message of the thread. It has no destructor, so it exists until the thread's memory is freed.
    static LAST: [Cell<u8>; OSP_MESSAGE_BYTES as usize] = const { [const { Cell::new(0) }; _] };
}

/// Stores the message of a failure for this thread, in place of the previous message.
pub(crate) fn keep_message(message: &str) {
    let ascii = |letter: char| if letter.is_ascii() && letter != '\0' { letter as u8 } else { b'?' };
    LAST.with(|last| {
        let (_, text) = last.split_last().expect("room for more than the end");
        // The previous message may be longer, so zeros fill the rest. The last byte is never written.
        let bytes = message.chars().map(ascii).chain(std::iter::repeat(0));
        text.iter().zip(bytes).for_each(|(place, byte)| place.set(byte));
    });
}

/// Returns the message of the last call on this thread that did not return OSP_STATUS_OK. Without such a call it is
/// empty, and it is never NULL. It is plain ASCII, ends with a zero byte, and has at most OSP_MESSAGE_BYTES bytes.
/// Every call on one thread returns the same pointer, which is valid until the thread ends. The next failure on this
/// thread overwrites the message, so copy a message that you need later.
#[unsafe(no_mangle)]
pub extern "C" fn osp_last_error() -> *const c_char {
    LAST.with(|last| last.as_ptr().cast())
}

/// Returns the version of the loaded library: major * 65536 + minor * 256 + patch. Compare it with OSP_VERSION, the
/// version of the header. While the major number is 0, the minor numbers must be equal.
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
        // SAFETY: the pointer is never NULL, the text ends with a zero byte, and it belongs to this thread.
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
