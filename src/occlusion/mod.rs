//! Occlusion culling: what is hidden behind the polygons nearest to the eye.
//!
//! Large opaque polygons become [`ShadowVolume`]s seen from one eye; an [`OcclusionCuller`] is built from them every
//! frame and answers for a box or a sphere: [`Verdict::Hidden`], [`Verdict::Lit`] or [`Verdict::Mixed`]. Everything is
//! valid for one [`ViewWindow`] only (one eye, one screen) and nothing of it is kept for the next frame.
//!
//! **Soundness.** A culler whose [`OcclusionCuller::soundness`] is [`Soundness::Sound`] says `Hidden` only if every
//! point of the volume that lies in the window and beyond the near plane is behind a drawn polygon. The proof is in
//! [`msvbsp`]; the tests recompute every hidden answer from the polygons.
//!
//! **Space.** All geometry is moved so that the eye is the origin, in `f64`. A plane through the eye is then one normal
//! without a constant term, and "in the shadow" is `normal . x >= 0`.

mod auto;
mod cone;
mod cull;
mod culler;
mod depth;
mod frusta;
mod hull;
mod kind;
mod last_visible;
pub mod msvbsp;
mod msvbsp_paper;
mod none;
pub mod oracle;
mod patch;
mod pool;
mod raster;
pub mod scenes;
mod select;
mod shadow_volume;
mod stage;
mod svbsp;
mod tolerance;
mod tree;
mod view_window;

pub use auto::{AutoConfig, AutoMethod, AutoSwitch, Outcome};
pub use cull::{CullConfig, CullCounts, NodeTest, OcclusionVisitor, PolygonTest, ReuseTable};
pub use culler::{BuildCounts, OcclusionCuller, Soundness, Tested, Verdict};
pub use depth::{Coverage, DepthBuffer, DepthConfig};
pub use frusta::ShadowFrusta;
pub use kind::CullerKind;
pub use last_visible::{LastVisible, LastVisibleCounts};
pub use msvbsp_paper::{MsvbspPaper, PaperCaps};
pub use none::NoOcclusion;
pub use pool::{Grouping, OccluderPool, PoolConfig};
pub use select::{SelectConfig, SelectCounts, Selector};
pub use shadow_volume::{MAX_SIDES, NotAnOccluder, ShadowVolume};
pub use stage::{OcclusionConfig, OcclusionStage, work_ns};
pub use svbsp::Svbsp;
pub use tolerance::{EDGE_ON_SINE, END_ON_SINE, QUERY_SLACK};
pub use view_window::ViewWindow;
