//! One frame: the pipeline updates the index, culls by the frustum of each view, and removes hidden polygons by a [`Pass`].
//!
//! [`Pipeline::frame`] runs all stages and returns their counts and times in a [`FrameRecord`]. Depends on
//! [`polygon`](crate::polygon), [`index`](crate::index), [`view`](crate::view) and [`occlusion`](crate::occlusion).

mod clock;
mod idle_backoff;
mod occlusion_pass;
mod pass;
mod pipeline;
mod previous_frame_pass;
mod record;
mod spaces;

pub use occlusion_pass::PassConfig;
pub use pipeline::Pipeline;
pub use record::FrameRecord;

// For passes, clocks and measurements of the other crates of the workspace. They change without notice.
#[doc(hidden)]
pub use self::{
    clock::{Reading, Stage, StageClock, shortest_step_ns},
    occlusion_pass::{AutoBasis, OcclusionPass},
    pass::{Pass, PassInput},
    previous_frame_pass::PreviousFramePass,
    record::OcclusionRecord,
};
