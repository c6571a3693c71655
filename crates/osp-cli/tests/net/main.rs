//! What goes over a network: shared sessions, `osp serve`.
#![cfg(any(feature = "live", feature = "serve"))]

#[cfg(feature = "live")]
mod live;
#[cfg(feature = "serve")]
mod serve;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
