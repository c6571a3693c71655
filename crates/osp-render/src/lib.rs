//! Drawing on a GPU with wgpu: a scene that only grows, pictures to a file, frames to a surface.
//!
//! * [`Gpu`] is an adapter and its device. Without an adapter, the error is one line with the reason.
//! * [`Renderer`] keeps every polygon on the GPU. A polygon is uploaded once, when it is made, and again only when it has
//!   moved. A frame sends only the numbers of the polygons to draw ([`DrawOrder`]); the vertex shader fetches the corners.
//! * [`Target`] holds the textures of a view, for a picture file or for a window. [`Offscreen`] makes [`Image`]s and
//!   measures their drawing.
//!
//! * [`Renderer::set_occlusion`] selects culling of hidden polygons on the GPU.
//! * [`PaintList`] is the painter's algorithm, for comparison: back to front by a BSP tree, without a depth test.
//!
//! Both sides of polygons are visible, flat-shaded or with the material of their brush. [`Renderer::set_environment`]
//! sets the light of brushes. Opaque and additive polygons are drawn in the order of their numbers, transparent ones
//! back to front. If two polygons have the same depth, the later one is visible. These orders depend only on the view
//! and the polygons, not on the index that found them, nor on culled polygons. So two pictures of the same visible
//! surface are equal, bit for bit.
//!
//! Depends on [`scene`](osp_session::scene), [`view`](osp::view) and [`frame`](osp::frame). The painter depends on the tree
//! [`Bsp`](osp_rivals::Bsp). Nothing here depends on another index.

#![allow(
    missing_docs,
    reason = "a name without a comment says all: no unit, space, bound or error is to add"
)]

mod backdrop;
mod chunks;
mod descriptors;
mod draw_switch;
mod error;
mod finish;
mod formats;
mod gpu;
mod gpu_occlusion;
mod gpu_scene;
mod hzb;
mod image;
mod lines;
mod listing;
mod offscreen;
mod opaque_order;
mod order;
mod overdraw;
mod paint;
mod painter;
mod pipelines;
mod read_back;
mod read_ring;
mod record;
mod renderer;
mod run;
mod shaders;
mod show;
mod style;
mod surface;
mod target;
#[cfg(test)]
mod test_scene;
mod timer;
mod video;
mod view_slot;

pub use backdrop::{background_for, linear_from_srgb};
pub use error::RenderError;
pub use formats::SAMPLES;
pub use gpu::{Gpu, instance_flags};
pub use gpu_occlusion::GpuOcclusion;
pub use hzb::{DrawnCounts, PyramidLevel, PyramidPass};
pub use image::Image;
pub use lines::{Depth, LineBatch, LineColor, LinePass};
pub use offscreen::{DrawTimes, Offscreen};
pub use opaque_order::{OpaqueOrder, OrderCounts};
pub use order::DrawOrder;
pub use overdraw::Overdraw;
pub use painter::{MOST_POLYGONS, PaintList, PaintStats, Painter, PainterError};
pub use read_back::ComingImage;
pub use record::Colors;
pub use renderer::{Eye, EyePicture, Layer, Renderer, RendererConfig};
pub use run::{Blend, Classes, Run};
pub use shaders::SHADERS;
pub use show::{Area, Channels, ShowPass, Shown};
pub use style::Style;
pub use surface::{Acquired, WindowSurface};
pub use target::Target;
pub use timer::{GpuTimer, PassTimes};
pub use video::{ffmpeg_command, quoted};
pub use view_slot::ViewSlot;
