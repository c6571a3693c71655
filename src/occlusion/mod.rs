//! Occlusion culling: finds polygons that are hidden behind nearer polygons.
//!
//! A caller selects a method, [`Occlusion`], and passes it to a [`Pipeline`](crate::frame::Pipeline). The crate's
//! documentation omits the other items, which change without notice: [`OcclusionStage`] keeps the candidates from frame
//! to frame; [`ViewOcclusion`] culls one view.
//!
//! Large opaque polygons cast [`ShadowVolume`]s from one eye. An [`OcclusionCuller`] is built from them, and returns a
//! verdict for a box or a sphere: [`Verdict::Hidden`], [`Verdict::Unoccluded`] or [`Verdict::PartlyHidden`]. A culler is
//! rebuilt for each [`ViewWindow`](crate::view::ViewWindow) (one eye, one screen) and frame; only candidates for occluders
//! persist.
//!
//! **Soundness.** A culler whose [`OcclusionCuller::soundness`] is [`Soundness::Conservative`] returns `Hidden` only for
//! covered volumes: drawn polygons cover every point of the volume that lies in the window and beyond the near plane. The
//! proof is in [`msvbsp`]; the tests recompute every hidden answer from the polygons.
//!
//! **Space.** The eye is the origin of all geometry here, in `f64`. So a plane through the eye is a normal without a
//! constant term, and "in the shadow" is `normal . x >= 0`.
//!
//! Depends on [`math`](crate::math), [`polygon`](crate::polygon), [`index`](crate::index) and [`view`](crate::view).

mod auto;
mod cone;
mod coverage;
mod cull;
mod culler;
mod explore;
mod hull;
mod kind;
mod layered;
pub mod msvbsp;
mod none;
mod patch;
mod pool;
mod previous_frame;
#[doc(hidden)]
pub mod raster;
mod select;
mod shadow_volume;
mod sketches;
mod stage;
mod tolerance;
mod tree;
mod verdict;
mod view_occlusion;
mod wide;

pub(crate) use auto::{AutoConfig, AutoSwitch, Outcome};
pub use coverage::OcclusionReport;
use coverage::cube_around;
pub(crate) use coverage::{BOX_SIDES, Columns, MeshBuffer, Meshes, OccluderMesh, UNMOVED, moved};
pub use kind::Occlusion;
pub(crate) use layered::Layered;
pub(crate) use stage::work_ns;

// The parts of the methods, which the other crates of the workspace measure, draw and compare. They change without notice.
#[doc(hidden)]
pub use self::{
    coverage::CoverageBuffer,
    cull::{CullConfig, CullCounts, NodeTest, OcclusionVisitor, PolygonTest},
    culler::{BuildCounts, MakeCuller, OcclusionCuller, Soundness},
    explore::TryBudget,
    none::NoOcclusion,
    pool::{Grouping, OccluderPool, PoolConfig},
    previous_frame::{PreviousFrameCounts, PreviousFrameOccluders},
    select::{Score, SelectConfig, SelectCounts, Selector},
    shadow_volume::{MAX_SIDES, NotAnOccluder, ShadowVolume},
    stage::OcclusionStage,
    tolerance::{EDGE_ON_SINE, END_ON_SINE, QUERY_SLACK},
    tree::Cell,
    verdict::{Needed, Tested, TestedBoxes, Verdict},
    view_occlusion::{OcclusionConfig, ViewCounts, ViewInput, ViewOcclusion, remove_hidden},
};

/// Code that other cullers share with these, so that comparisons are fair. Engines should not use it, because it may change
/// at any time.
#[doc(hidden)]
pub mod kernels {
    pub use super::{
        cone::{Span, clip, has_area, reach},
        tolerance::{IMPLIED_SINE, RELEVANT_AREA_SR, RELEVANT_SINE},
        tree::{
            CapRule, Caps, Child, EyeBox, EyeSphere, Link, MAX_DEPTH, Node, ShadowTree, Side, Volume,
            node_budget,
        },
    };
}
