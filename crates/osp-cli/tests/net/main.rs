//! What goes over a network or does not fit into memory: shared sessions, `osp serve`, worlds.
#![cfg(any(feature = "live", feature = "serve", feature = "worlds"))]

#[cfg(feature = "live")]
mod live;
#[cfg(feature = "serve")]
mod serve;
#[cfg(feature = "worlds")]
mod worlds;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
