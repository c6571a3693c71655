//! What a function answers, and the message beside it.

use std::{
    any::Any,
    cell::RefCell,
    ffi::{CString, c_char},
};

/// What a function answers: OSP_STATUS_OK, or why it has changed nothing. osp_last_error says it in words.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OspStatus {
    /// Done.
    Ok = 0,
    /// The answer has more ids than the buffer; nothing is in it. How many there are is in *count.
    BufferTooSmall = 1,
    /// A pointer is NULL that must not be.
    NullPointer = 2,
    /// A pointer is not aligned for what it points to.
    MisalignedPointer = 3,
    /// A count is larger than memory, or than the ids that there are (OSP_MAX_IDS).
    TooMany = 4,
    /// A box has NaN or an infinite number in it, or min > max; or, in a scene, a coordinate beyond 1e15.
    InvalidBox = 5,
    /// A corner has NaN in it or a coordinate beyond 1e15, or an index names no vertex.
    InvalidTriangle = 6,
    /// No box or triangle has this id, or it is of the other kind.
    UnknownId = 7,
    /// A matrix or plane has NaN or an infinite number in it, or the matrix has no inverse or is no view that the function takes.
    InvalidView = 8,
    /// Another argument is out of its range.
    InvalidArgument = 9,
    /// There are changes since the last commit (or frame): commit, then ask.
    NotCommitted = 10,
    /// Another thread is changing this object, or, if this call would change it, is using it.
    Busy = 11,
    /// An earlier call that changed this object has failed inside of osp: only free it.
    Poisoned = 12,
    /// A fault inside of osp, which should be reported; it is also written to standard error.
    Internal = 13,
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

thread_local! {
    static LAST: RefCell<CString> = RefCell::new(CString::default());
}

/// Keeps the message of a failure for this thread.
pub(crate) fn keep_message(message: String) {
    let ascii = |letter: char| if letter.is_ascii() && letter != '\0' { letter as u8 } else { b'?' };
    let bytes: Vec<u8> = message.chars().map(ascii).collect();
    // While the thread ends there may be no place left for it.
    let _ = LAST.try_with(|last| *last.borrow_mut() = CString::new(bytes).unwrap_or_default());
}

/// The message of the last call on this thread that did not answer OSP_STATUS_OK; empty if there was none, never NULL. It ends with a
/// zero byte, is plain ASCII, and stays until another call on this thread fails, or the thread ends.
#[unsafe(no_mangle)]
pub extern "C" fn osp_last_error() -> *const c_char {
    LAST.try_with(|last| last.borrow().as_ptr()).unwrap_or(c"".as_ptr())
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
    use super::*;

    #[test]
    fn the_version_is_that_of_the_package() {
        let numbers: Vec<u32> =
            env!("CARGO_PKG_VERSION").split('.').map(|number| number.parse().expect("a number")).collect();
        assert_eq!(numbers, [OSP_VERSION >> 16, OSP_VERSION >> 8 & 255, OSP_VERSION & 255]);
    }
}
