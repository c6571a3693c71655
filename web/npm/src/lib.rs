//! The WebAssembly inside the npm package `osp-culling`: a culler of objects, and an index of boxes.
//!
//! ```text
//! JavaScript (js/index.js) ─> numbers in memory that Rust owns ─> culler, index ─> osp
//! ```
//!
//! JavaScript requests room, writes its numbers there, calls a function, and copies the result. It gets the addresses
//! again for each call, because they move when memory grows. Every wrong argument causes an exception and changes
//! nothing.

mod culler;
mod index;
mod refusal;
mod room;
mod scratch;
mod views;

pub use culler::Culler;
pub use index::Index;
use osp::index::Backend;
use wasm_bindgen::prelude::*;

/// Returns the instruction set that tests the boxes: `simd128` or `scalar`.
#[wasm_bindgen]
pub fn kernel() -> String {
    Backend::detect().name().to_owned()
}
