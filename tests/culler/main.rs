//! The culler, module by module. Each thread's allocations are counted.

mod allocations;
mod conformance_cases;
mod engine;
mod index_queries;
mod occlusion;
mod osp_tree;
mod visibility;

#[global_allocator]
static COUNTING: osp_testkit::Counting = osp_testkit::Counting;
