//! What goes over a network: shared sessions.
#![cfg(feature = "live")]

mod live;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
