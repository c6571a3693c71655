//! Occlusion culling on the GPU by a hierarchical depth buffer, in two passes. Ned Greene, Michael Kass, Gavin Miller:
//! "Hierarchical Z-Buffer Visibility", 1993. Two passes: Sebastian Aaltonen, Ulrich Haar, "GPU-Driven Rendering
//! Pipelines", 2015.
//!
//! A frame of one view:
//! 1. *Recall*: the polygons in view that were visible in the last frame are drawn, for their depth alone.
//! 2. *Pyramid*: its levels get the farthest depth of 2 x 2 pixels, of 4 x 4 pixels, and so on.
//! 3. *Test*: every polygon in view is tested against the pyramid, first by a bound, then triangle by triangle. Polygons
//!    that are not proven hidden are recorded for the next frame.
//! 4. *Compaction*: these polygons are listed in drawing order, for indirect draw calls.
//! 5. *Colours*: the list is drawn over the depth of the first pass.
//!
//! Two eyes that see nearly the same share their cluster masks, which contain the polygons in view of either eye. One
//! compute pass recalls the polygons of both eyes, and one pass has steps 2 to 4 of both. Each eye has its own pyramid and
//! record. A polygon outside of an eye's picture is never proven hidden; the adapter clips it.
//!
//! In a view's first frame and after a jump of the view, the visible polygons are unknown, or no longer hide much. Such
//! a frame draws all polygons in view at once. The pyramid and the test come after the colours, only to record the
//! visible polygons for the next frame.
//!
//! A visible polygon that is new, has moved or has come into view is not proven hidden, and is drawn in step 5: no
//! frame lags. The picture is the same as without culling, to the last bit:
//! * A polygon that wins a sample is never proven hidden, because the pyramid has no nearer depth there than the polygon's
//!   own.
//! * A polygon that a driver may clip, at the picture's border or at the near or far plane, is never proven hidden. The
//!   reason is that depth on clipped pieces has no bound.
//! * Among polygons at the same depth the last in the order wins, with and without culling. The order does not depend
//!   on visibility (see [`DrawOrder`](super::DrawOrder)). For this reason the recall draws no colours.
//! * The record of the last frame affects only the number of culled polygons. Any subset of the polygons in view would give
//!   the same picture.
//!
//! Differences from the papers:
//! * The first pass draws depth alone.
//! * The pyramid is a buffer, not a texture with mip levels. Its levels can therefore round sizes up when they halve
//!   them.
//! * Each triangle is tested on the texels that it touches, with the nearest depth of its plane there. If a texel does not
//!   decide, the finer texels do, down to single pixels and their samples. This is necessary for real sketches, which are
//!   layers of paint, millimetres apart: at a grazing angle, the nearest corner of a polygon lies in front of most of the
//!   polygon's occluders.

mod drawn_counts;
mod encode;
mod frame;
mod jump;
mod pipelines;
mod pyramid;
mod queries;
mod samples;
mod show;
mod span;
mod state;
#[cfg(test)]
mod tests;

pub use drawn_counts::DrawnCounts;
pub(super) use frame::Frame;
pub(super) use pipelines::Hzb;
pub use pyramid::PyramidLevel;
pub use show::PyramidPass;
pub(super) use state::HzbView;
