//! Files: of other programs, damaged, forged, and made of noise. What each thread holds is counted.

mod fuzz;
mod importers;
mod pvs_file;

#[global_allocator]
static COUNTING: osp_testkit::Counting = osp_testkit::Counting;

const OSP: osp_testkit::Program = osp_testkit::Program(env!("CARGO_BIN_EXE_osp"));
