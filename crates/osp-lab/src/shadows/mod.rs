//! Occlusion culling of a view by shadow volumes, step by step: the occluders, and the tree as it grows plane by plane.
//!
//! A [`ShadowView`] has the occluders of a view. [`ShadowSteps`] is the whole tree in one form of the method. A
//! [`ShadowStep`] is the same tree with only its first planes. `osp draw-occlusion` and the window both show these
//! steps.

mod steps;
mod structure;
mod view;

pub use steps::{ShadowForm, ShadowStep, ShadowSteps};
pub use structure::{ShadowHolds, ShadowNode, ShadowStructure, occluder_name, occluder_names};
pub use view::ShadowView;
