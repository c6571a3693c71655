//! Refusals, in one sentence each.

use js_sys::RangeError;
use wasm_bindgen::JsValue;

/// The result of a call from JavaScript.
pub(crate) type Outcome<T> = Result<T, JsValue>;

/// Returns an exception for invalid numbers.
pub(crate) fn refused<T>(message: &str) -> Outcome<T> {
    Err(RangeError::new(message).into())
}
