//! Occlusion culling while drawing, by a hierarchical depth buffer: Ned Greene, Michael Kass, Gavin Miller, "Hierarchical
//! Z-Buffer Visibility", 1993, in the two passes that became usual on GPUs (Sebastian Aaltonen, Ulrich Haar, "GPU-Driven
//! Rendering Pipelines", 2015).
//!
//! A frame of one view:
//! 1. *Recall*: the polygons in view that were visible in the last frame are drawn, for their depth alone.
//! 2. *Pyramid*: the farthest depth of 2 x 2 pixels, of 4 x 4, and so on.
//! 3. *Test*: every polygon in view against the pyramid; what is not proven hidden is remembered for the next frame,
//! 4. and *compacted*: listed in the order of drawing, for an indirect draw call.
//! 5. *Colours*: the list is drawn over the depth of the first pass.
//!
//! In a frame whose view has jumped (its first one, too) few recalled polygons hide anything, and the visible polygons are
//! unknown before all is drawn. So such a frame draws all in view at once. The pyramid and the test come after the colours,
//! only to record the visible polygons. The next frame then recalls these, and not everything.
//!
//! Whatever has just come, moved or come into view is not remembered, is not proven hidden, and is drawn in step 5: no
//! frame lags. The picture is that without culling, to the last bit:
//! * A polygon that wins a sample is never proven hidden: the pyramid holds no nearer depth there than the winner's
//!   own.
//! * A polygon that a driver may clip, at the picture's border or at the near or far plane, is never proven hidden: the depth on
//!   clipped pieces has no bound.
//! * Among several at the same depth the last in the order wins, culled or not; the order does not depend on what is
//!   visible (see [`DrawOrder`](super::DrawOrder)). That is why the first pass draws no colours.
//! * The record of the last frame decides only how much is culled. Any subset of the polygons in view would do.
//!
//! Differences from the papers: the first pass is depth alone; the pyramid is a buffer, not a texture with mip levels, so
//! that every size halves without loss; a polygon is tested triangle by triangle on the texels that it touches, each with
//! the nearest depth of the triangle's plane there, down to pixels and their samples where a texel cannot tell, because real
//! sketches are layers of paint, millimetres apart: seen at a grazing angle, the nearest corner of a polygon lies in front
//! of most of what hides it.

mod bindings;
mod buffers;
mod config;
mod encode;
mod frame;
mod jump;
mod pipelines;
mod pyramid;
mod queries;
mod query_pipelines;
mod samples;
mod show;
mod span;
mod state;
#[cfg(test)]
mod tests;

pub use config::{DrawnCounts, HzbBound, HzbConfig, HzbFine, HzbGroup};
pub(super) use frame::Frame;
pub(super) use pipelines::Hzb;
pub use pyramid::PyramidLevel;
pub use show::PyramidPass;
pub(super) use state::HzbView;
