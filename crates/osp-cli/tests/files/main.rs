//! Files: of other programs, damaged, forged, and made of noise.

mod fuzz;
mod importers;
mod pvs_file;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
