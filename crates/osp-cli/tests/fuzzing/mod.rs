//! The fuzz targets: each takes any bytes, makes of them what one part of osp takes, and panics where that part breaks
//! a promise. `crates/osp-cli/tests/files/fuzz.rs` drives them with bytes from a seeded generator, `crates/osp-cli/tests/fuzz/` with libFuzzer.

pub mod arguments;
pub mod frame_occlusion;
pub mod input;
pub mod pvs;
pub mod read_bytes;
pub mod scratch;
pub mod session;
#[cfg(feature = "window")]
pub mod tracker;
