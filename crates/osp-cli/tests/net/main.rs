//! What goes over a network: shared sessions.
#![cfg(feature = "live")]

mod live;

const OSP: osp_testkit::Program<'static> = osp_testkit::Program::new(env!("CARGO_BIN_EXE_osp"));
