//! The program as a user meets it: commands, what they print and write, the shipped sessions, and what the documents promise.

#[cfg(feature = "bench")]
mod bench;
mod cli;
mod cli_outputs;
mod corpus_replay;
mod csv;
mod dependencies;
mod help;
mod rescue;
mod seeds;
mod shipped;
mod study;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
