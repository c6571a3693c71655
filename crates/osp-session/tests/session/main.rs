//! Sessions: their files, the scenes that they make, and the memory that those hold.

mod memory;
mod recording;
mod scene;

#[global_allocator]
static COUNTING: osp_testkit::Counting = osp_testkit::Counting;
