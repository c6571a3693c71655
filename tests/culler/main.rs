//! The culler, module by module. Each thread's allocations are counted.

mod allocations;
mod bsp;
mod conformance_cases;
mod engine;
mod occlusion;
mod osp_tree;
mod own_index;
mod visibility;

#[global_allocator]
static COUNTING: osp_testkit::Counting = osp_testkit::Counting;
