//! Occlusion culling: what is called hidden is hidden.

#[path = "occlusion/allocations.rs"]
mod allocations;
#[path = "occlusion/command.rs"]
mod command;
#[path = "occlusion/counterexamples.rs"]
mod counterexamples;
#[path = "occlusion/culling.rs"]
mod culling;
#[path = "occlusion/judge.rs"]
mod judge;
#[path = "occlusion/occluders.rs"]
mod occluders;
#[path = "occlusion/pipeline.rs"]
mod pipeline;
#[path = "occlusion/pool.rs"]
mod pool;
#[path = "occlusion/random.rs"]
mod random;
#[path = "occlusion/session.rs"]
mod session;
#[path = "occlusion/stress.rs"]
mod stress;
#[path = "occlusion/truth.rs"]
mod truth;
