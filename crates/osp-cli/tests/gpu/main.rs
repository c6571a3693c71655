//! Pictures and windows.

mod render;
#[cfg(all(feature = "window", target_os = "linux"))]
mod window;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
