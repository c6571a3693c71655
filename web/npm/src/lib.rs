//! The WebAssembly inside the npm package `osp-culling`: a culler of objects.
//!
//! ```text
//! JavaScript (js/culler.js) ─> numbers in memory that Rust owns ─> culler ─> osp
//! ```
//!
//! JavaScript requests room, writes its numbers there, calls a function, and copies the result. It gets the addresses
//! again for each call, because they move when memory grows. Every wrong argument causes an exception and changes
//! nothing.

mod culler;
mod refusal;
mod room;

pub use culler::Culler;
use osp::index::Backend;
use wasm_bindgen::prelude::*;

/// Returns the instruction set that tests the boxes: `simd128` or `scalar`.
#[wasm_bindgen]
pub fn kernel() -> String {
    Backend::detect().name().to_owned()
}
