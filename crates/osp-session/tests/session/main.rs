//! Sessions: their files, the scenes that they produce, and the memory of the scenes.

mod brush;
mod memory;
mod recording;
mod rig;
mod scene;

#[global_allocator]
static COUNTING: osp_testkit::Counting = osp_testkit::Counting;
