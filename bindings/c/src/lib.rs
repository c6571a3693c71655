//! The culling index of osp as a C library. `include/osp.h` is made of the items of `index_api`, `scene_api`, `status` and
//! `types`, with their comments, by cbindgen; the test `header` compares it and, with `OSP_WRITE=1`, writes it.
//!
//! ```text
//! C ─> index_api, scene_api ─> border: pointers and panics ─> handle: threads ─> index, scene ─> osp
//! ```
//!
//! Below `border` everything is safe Rust.

#![allow(unsafe_code, reason = "pointers from C; read and written in `border` only")]
#![allow(clippy::missing_safety_doc, reason = "the header's first comment says it for all functions")]

mod border;
mod handle;
mod index;
mod index_api;
mod scene;
mod scene_api;
mod status;
mod things;
mod types;
mod views;

pub use index_api::*;
pub use scene_api::*;
pub use status::*;
pub use types::*;
