//! All other methods of culling by a frame's largest polygons, to compare with [`osp::occlusion`].
//!
//! Each method gets the same occluders as [`Msvbsp`](osp::occlusion::msvbsp::Msvbsp). [`RivalOcclusion`] lists all of them.

mod frusta;
mod kind;
mod msvbsp_paper;
mod sorted_planes;
mod svbsp;

pub use frusta::ShadowFrusta;
pub use kind::RivalOcclusion;
pub use msvbsp_paper::{MsvbspPaper, PaperCaps};
pub use svbsp::{Svbsp, SvbspForm};
