//! The culler of osp as a C library. cbindgen makes `include/osp.h` from the items of `culler_api`, `camera`, `status`
//! and `types`, with their comments. The test `header` compares it and, with `OSP_WRITE=1`, writes it.
//!
//! ```text
//! C ─> culler_api ─> border: pointers and panics ─> handle: threads ─> osp::Culler<u64>
//! ```
//!
//! Only `border` has unsafe code; all code behind it is safe Rust.

#![allow(unsafe_code, reason = "pointers from C; read and written in `border` only")]
#![allow(
    clippy::missing_safety_doc,
    reason = "the header's first comment has the guarantees for all functions"
)]

mod border;
mod camera;
mod culler_api;
mod handle;
mod status;
mod types;

pub use camera::*;
pub use culler_api::*;
pub use status::*;
pub use types::*;
