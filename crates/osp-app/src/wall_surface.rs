//! A window that shows screens of a rig, and the positions of their pictures.

use std::sync::Arc;

use winit::window::Window;

use super::{
    room::{Room, RoomView},
    walls::Wall,
};
use osp_render::{Acquired, Area, Channels, Gpu, RenderError, ShowPass, Shown, WindowSurface};
use osp_session::rig::Viewport;

pub(super) struct WallWindow {
    pub(super) wall: Wall,
    pub(super) window: Arc<Window>,
    pub(super) surface: WindowSurface,
    pub(super) show: ShowPass,
}

impl WallWindow {
    /// Prepares a window for drawing.
    pub(super) fn new(gpu: &Gpu, wall: Wall, window: Arc<Window>) -> Result<Self, RenderError> {
        let surface = window_surface(gpu, &window)?;
        let show = ShowPass::new(gpu, surface.format());
        Ok(Self { wall, window, surface, show })
    }

    /// Draws the views of this window on its surface texture.
    pub(super) fn draw<'v>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        frame: &wgpu::SurfaceTexture,
        room: &Room,
        views: impl IntoIterator<Item = (&'v Shown, &'v RoomView)>,
    ) {
        let window = frame.texture.create_view(&Default::default());
        let mut pass = begin_black(encoder, &window, "wall");
        for (shown, view) in views {
            if let Some((area, channels)) = self.area_of(room, view) {
                let area = within(area, frame.texture.width(), frame.texture.height());
                self.show.draw(&mut pass, shown, area, channels);
            }
        }
    }

    /// The pixels and colour channels of a view, if this window shows it.
    pub(super) fn area_of(&self, room: &Room, view: &RoomView) -> Option<(Area, Channels)> {
        let (Viewport(x, y, width, height), channels) = self.wall.place_of(room, view)?;
        let (all_x, all_y) = self.surface.size;
        let pixel = |part: f32, of: u32| (part * of as f32).round();
        let (left, upper) = (pixel(x, all_x), pixel(y, all_y));
        let (right, lower) = (pixel(x + width, all_x), pixel(y + height, all_y));
        let area = Area { x: left, y: upper, width: right - left, height: lower - upper };
        Some((area, channels))
    }
}

pub(super) fn create_surface(
    instance: &wgpu::Instance,
    window: &Arc<Window>,
) -> Result<wgpu::Surface<'static>, RenderError> {
    instance.create_surface(Arc::clone(window)).map_err(|error| {
        // Without a graphics driver this is the first call that fails.
        RenderError::Surface(error.to_string().replace('\n', " "))
    })
}

/// The next texture of a window's surface, if the system has one now. A lost surface is created again.
pub(super) fn acquire(
    gpu: &Gpu,
    surface: &mut WindowSurface,
    window: &Arc<Window>,
) -> Result<Option<wgpu::SurfaceTexture>, RenderError> {
    match surface.acquire(gpu)? {
        Acquired::Frame(frame) => return Ok(Some(frame)),
        Acquired::Nothing => {}
        Acquired::Lost => {
            *surface = window_surface(gpu, window)?;
            window.request_redraw();
        }
    }
    Ok(None)
}

/// A new surface of a window, of the window's size.
fn window_surface(gpu: &Gpu, window: &Arc<Window>) -> Result<WindowSurface, RenderError> {
    let size = window.inner_size();
    WindowSurface::new(gpu, create_surface(&gpu.instance, window)?, size.width, size.height)
}

/// Begins a render pass that clears a window to black.
pub(super) fn begin_black<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    window: &wgpu::TextureView,
    label: &'static str,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: window,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })],
        ..Default::default()
    })
}

/// The area clipped to a window, because a window that has just shrunk may be smaller than the area laid out for it.
pub(super) fn within(area: Area, width: u32, height: u32) -> Area {
    let (width, height) = (width as f32, height as f32);
    let (x, y) = (area.x.clamp(0.0, width), area.y.clamp(0.0, height));
    Area { x, y, width: area.width.min(width - x), height: area.height.min(height - y) }
}
