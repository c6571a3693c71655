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

pub use clock::{Reading, Stage, StageClock, shortest_step_ns};
pub use occlusion_pass::{AutoBasis, OcclusionPass, PassConfig};
pub use pass::{Pass, PassInput};
pub use pipeline::{Loading, Pipeline};
pub use previous_frame_pass::PreviousFramePass;
pub use record::{FrameRecord, OcclusionRecord};
