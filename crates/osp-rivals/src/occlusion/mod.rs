//! Every other way to cull by a frame's largest polygons, to measure [`osp::occlusion`] against.
//!
//! Each takes the same occluders as [`Msvbsp`](osp::occlusion::msvbsp::Msvbsp). [`RivalOcclusion`] names them all.

mod depth_centers;
mod frusta;
mod kind;
mod msvbsp_paper;
mod svbsp;

pub use depth_centers::DepthCenters;
pub use frusta::ShadowFrusta;
pub use kind::RivalOcclusion;
pub use msvbsp_paper::{MsvbspPaper, PaperCaps};
pub use svbsp::Svbsp;
