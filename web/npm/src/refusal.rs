//! What is refused, in one sentence.

use js_sys::RangeError;
use wasm_bindgen::JsValue;

/// The outcome of a call from JavaScript.
pub(crate) type Outcome<T> = Result<T, JsValue>;

/// An exception for numbers that cannot be taken.
pub(crate) fn refused<T>(message: &str) -> Outcome<T> {
    Err(RangeError::new(message).into())
}
