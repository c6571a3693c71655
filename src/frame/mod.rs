//! One frame: the index follows the changes, the frustum of each view culls, a [`Pass`] leaves out what is hidden.
//!
//! [`Pipeline::frame`] is the whole frame; it says what each stage took in a [`FrameRecord`]. Knows
//! [`polygon`](crate::polygon), [`index`](crate::index), [`view`](crate::view) and [`occlusion`](crate::occlusion).

mod clock;
mod occlusion_pass;
mod pass;
mod pipeline;
mod previous_frame_pass;
mod record;
mod rest;
mod spaces;

pub use clock::shortest_step_ns;
pub use clock::{Reading, Stage, StageClock};
pub use occlusion_pass::{AutoBasis, OcclusionPass, PassConfig};
pub use pass::{Pass, PassInput};
pub use pipeline::Loading;
pub use pipeline::Pipeline;
pub use previous_frame_pass::PreviousFramePass;
pub use record::{FrameRecord, OcclusionRecord};
