//! One frame: the pipeline updates the index, culls by the frustum of each view, and removes hidden polygons by a [`Pass`].
//!
//! [`Pipeline::frame`] runs all stages and returns their times in a [`FrameRecord`]. Depends on
//! [`polygon`](crate::polygon), [`index`](crate::index), [`view`](crate::view) and [`occlusion`](crate::occlusion).

mod clock;
mod occlusion_pass;
mod pass;
mod pipeline;
mod previous_frame_pass;
mod record;
mod rest;
mod spaces;

pub use clock::{Stage, StageClock};
pub use occlusion_pass::{AutoBasis, PassConfig};
pub use pipeline::{Loading, Pipeline};
pub use record::{FrameRecord, OcclusionRecord};

// For passes and clocks of the other crates of the workspace. They change without notice.
#[doc(hidden)]
pub use self::{
    clock::{Reading, shortest_step_ns},
    occlusion_pass::OcclusionPass,
    pass::{Pass, PassInput},
    previous_frame_pass::PreviousFramePass,
};
