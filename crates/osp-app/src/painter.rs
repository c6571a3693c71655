use std::sync::Arc;

use egui::{ClippedPrimitive, TexturesDelta};
use egui_wgpu::ScreenDescriptor;
use winit::window::Window;

use super::{
    room::RoomView,
    studio::Studio,
    wall_surface::{WallWindow, acquire, begin_black, create_surface, within},
    walls::Wall,
};
use osp::frame::{Reading, StageClock};
use osp_render::{
    Area, Colors, ComingImage, DrawnCounts, Eye, EyePicture, Gpu, GpuOcclusion, GpuTimer, Layer, LinePass,
    PassTimes, PyramidPass, RenderError, Renderer, RendererConfig, ShowPass, Shown, Style, Target, ViewSlot,
    WindowSurface,
};

/// Style of culled polygons outside of the view.
const LEFT_OUT: Style = Style { tint: [0.9, 0.12, 0.1], amount: 0.8, opacity: 0.35, glow: 0.0 };

/// Style of culled polygons that are hidden.
const HIDDEN: Style = Style { tint: [0.65, 0.2, 0.95], amount: 0.85, opacity: 0.5, glow: 0.0 };

/// The user interface's shapes and textures.
#[derive(Debug)]
pub(super) struct Panels {
    pub(super) primitives: Vec<ClippedPrimitive>,
    pub(super) textures: TexturesDelta,
    pub(super) pixels_per_point: f32,
}

/// Times of a frame's painting, nanoseconds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PaintTimes {
    /// Time to upload new polygons, sort, and upload the lists.
    pub(super) send_ns: u64,
    /// GPU time of the model; without timestamps, the time to submit and present the frame.
    pub(super) draw_ns: u64,
    /// Whether the frame was presented.
    pub(super) is_shown: bool,
}

struct Pane {
    slot: ViewSlot,
    target: Target,
    shown: Shown,
    lines: LinePass,
    timer: GpuTimer,
    /// Slot of the overlay: the user's strokes that are drawn over the model.
    over: Option<ViewSlot>,
}

/// Settings of the overlay's renderer. The overlay has few strokes.
#[cfg(feature = "live")]
const OVER: RendererConfig = RendererConfig { chunk_len: 1 << 12, draw_len: 1 << 12, background: [0.0; 3] };

/// Time after which the clock of animated brushes restarts, seconds.
const MOST_TIME_S: f64 = 1000.0;

/// Draws frames onto the window.
pub(super) struct Painter {
    gpu: Arc<Gpu>,
    renderer: Renderer,
    window: Arc<Window>,
    surface: WindowSurface,
    show: ShowPass,
    pyramid: PyramidPass,
    egui: egui_wgpu::Renderer,
    /// Renderer of the user's strokes that the server has not returned yet. Created for the first such stroke.
    over: Option<Renderer>,
    panes: Vec<Pane>,
    walls: Vec<WallWindow>,
    clock: StageClock,
    /// Start time of the brushes' animation.
    opened: Reading,
    /// Whether the animation is stopped.
    is_still: bool,
    draw_ns: u64,
    /// The GPU culling method that the adapter refused last, and the reason.
    cannot_cull: Option<(GpuOcclusion, String)>,
}

impl Painter {
    /// A painter for a window. The scene is uploaded with the first frame.
    pub(super) async fn new(
        window: Arc<Window>,
        display: Box<dyn wgpu::wgt::WgpuHasDisplayHandle>,
    ) -> Result<Self, RenderError> {
        let mut description = wgpu::InstanceDescriptor::new_with_display_handle_from_env(display);
        description.flags = osp_render::instance_flags();
        let instance = wgpu::Instance::new(description);
        let surface = create_surface(&instance, &window)?;
        let gpu = Arc::new(Gpu::open(instance, Some(&surface)).await?);
        if gpu.is_in_browser() {
            gpu.learn().await?;
        }
        let size = window.inner_size();
        let surface = WindowSurface::new(&gpu, surface, size.width, size.height)?;
        let show = ShowPass::new(&gpu, surface.format());
        let pyramid = PyramidPass::new(&gpu, surface.format());
        let egui =
            egui_wgpu::Renderer::new(&gpu.device, surface.format(), egui_wgpu::RendererOptions::default());
        let mut renderer = Renderer::new(Arc::clone(&gpu), &RendererConfig::default());
        renderer.set_patient(true);
        gpu.check()?;
        Ok(Self {
            gpu,
            renderer,
            window,
            surface,
            show,
            pyramid,
            egui,
            over: None,
            panes: Vec::new(),
            walls: Vec::new(),
            clock: StageClock::default(),
            opened: StageClock::default().start(),
            is_still: false,
            draw_ns: 0,
            cannot_cull: None,
        })
    }

    pub(super) fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    pub(super) fn adapter(&self) -> String {
        self.gpu.name()
    }

    /// Whether brushes are animated, so that every frame differs.
    pub(super) fn is_animated(&self) -> bool {
        !self.is_still && self.renderer.is_animated()
    }

    pub(super) fn max_texture_side(&self) -> usize {
        self.gpu.device.limits().max_texture_dimension_2d as usize
    }

    pub(super) fn resize(&mut self, width: u32, height: u32) {
        self.surface.resize(width, height);
    }

    /// Adds a window that shows screens of a rig.
    pub(super) fn add_wall(&mut self, wall: Wall, window: Arc<Window>) -> Result<(), RenderError> {
        self.walls.push(WallWindow::new(&self.gpu, wall, window)?);
        Ok(())
    }

    pub(super) fn resize_wall(&mut self, window: winit::window::WindowId, width: u32, height: u32) {
        for wall in self.walls.iter_mut().filter(|wall| wall.window.id() == window) {
            wall.surface.resize(width, height);
        }
    }

    /// The picture of the model on the first screen in the last frame; on a web page it is available later.
    pub(super) fn picture(&self) -> Result<ComingImage, RenderError> {
        let pane = self.panes.first();
        let pane = pane.ok_or_else(|| RenderError::Device("nothing was drawn yet".to_owned()))?;
        let coming = pane.target.image_later(&self.gpu);
        if !self.gpu.is_in_browser() {
            self.gpu.wait()?;
        }
        Ok(coming)
    }

    /// Draws a frame. `model` is the part of the window that shows the model, pixels.
    #[expect(clippy::iter_over_hash_type, reason = "textures do not depend on each other")]
    pub(super) fn paint(
        &mut self,
        studio: &mut Studio,
        model: Area,
        mut panels: Panels,
    ) -> Result<PaintTimes, RenderError> {
        // The textures are updated first, even if the frame fails, because egui sends each texture once.
        for (id, deltas) in panels.textures.set.drain() {
            for delta in &deltas {
                self.egui.update_texture(&self.gpu.device, &self.gpu.queue, id, delta);
            }
        }
        let freed = std::mem::take(&mut panels.textures.free);
        let outcome = self.paint_frame(studio, model, &panels);
        for id in &freed {
            self.egui.free_texture(id);
        }
        outcome
    }

    fn paint_frame(
        &mut self,
        studio: &mut Studio,
        model: Area,
        panels: &Panels,
    ) -> Result<PaintTimes, RenderError> {
        let start = self.clock.start();
        self.follow(studio);
        let views = studio.views().to_vec();
        let refused = self.cannot_cull.clone();
        for (i, view) in views.iter().enumerate() {
            self.prepare(studio, i, view, model)?;
        }
        let of = |i| {
            let plain = Layer::plain(studio.culling().drawn(i));
            let left_out = Layer { polygons: studio.culled(), style: LEFT_OUT };
            [plain, left_out, Layer { polygons: studio.hidden(), style: HIDDEN }]
        };
        let layers: Vec<[Layer<'_>; 3]> = (0..views.len()).map(of).collect();
        let shown = if studio.room().shows_pattern() { 0 } else { 3 };
        let seen = self.panes.iter_mut().zip(&views).zip(&layers);
        let mut eyes: Vec<_> = seen
            .map(|((pane, view), layers)| {
                let layers = &layers[..shown];
                Eye { slot: &mut pane.slot, view: &view.view, layers }
            })
            .collect();
        self.renderer.prepare_all(studio.scene(), &mut eyes);
        if self.cannot_cull != refused
            && let Some((_, reason)) = &self.cannot_cull
        {
            studio.show_message(reason.clone());
        }
        self.panes.truncate(views.len().max(1));
        let send_ns = self.clock.since(start).ns;
        let is_on_wall = self.paint_walls(studio, &views)?;

        let frame = acquire(&self.gpu, &mut self.surface, &self.window)?;
        let is_shown = frame.is_some();
        if let Some(frame) = frame {
            self.show_frame(frame, studio, &views, model, panels);
        }
        // The poll receives the times of earlier frames; an empty queue is no error.
        let _ = self.gpu.device.poll(wgpu::PollType::Poll);
        self.gpu.check()?;
        let times = self.panes.iter_mut().filter_map(|pane| {
            let times = pane.timer.take()?;
            // The times belong to an earlier frame. Only a frame with culling has a test pass.
            pane.slot.note_time(times.test_ns > 0, times.total_ns);
            Some(times)
        });
        let times = times.reduce(|a, b| a + b);
        if let Some(times) = times {
            self.draw_ns = times.total_ns;
        }
        self.report_counts(studio, times);
        Ok(PaintTimes { send_ns, draw_ns: self.draw_ns, is_shown: is_shown || is_on_wall })
    }

    fn report_counts(&mut self, studio: &mut Studio, times: Option<PassTimes>) {
        if !self.panes.iter().all(|pane| pane.slot.culls()) {
            studio.note_drawn(None);
            return;
        }
        let counts = self.panes.iter_mut().filter_map(|pane| pane.slot.take_counts());
        if let Some(counts) = counts.reduce(|a: DrawnCounts, b| a + b) {
            studio.note_drawn(Some((counts, times)));
        }
    }

    fn follow(&mut self, studio: &mut Studio) {
        let pending = studio.take_pending();
        if pending.is_other_scene {
            self.renderer.forget_from(0);
            self.renderer.set_background(studio.session().background());
            self.renderer.set_environment(studio.session().header().environment.as_deref());
        }
        if let Some(keep) = pending.keep {
            self.renderer.forget_from(keep);
        }
        let is_of_several = studio.scene().authors().next().is_some();
        let by_author = studio.layers().authors && is_of_several;
        self.renderer.set_colors(if by_author { Colors::Authors } else { Colors::Own });
        self.renderer.follow(&pending.changes);
        studio.give_back(pending);
        self.is_still = studio.moment_s().is_some();
        // The time restarts before its precision in the shader becomes too low.
        let time_s = self.clock.since(self.opened).ns as f64 * 1.0e-9 % MOST_TIME_S;
        self.renderer.set_time(studio.moment_s().unwrap_or(time_s as f32));
        self.renderer.send(studio.scene());
        #[cfg(feature = "live")]
        self.follow_overlay(studio);
    }

    fn prepare(
        &mut self,
        studio: &Studio,
        i: usize,
        view: &RoomView,
        model: Area,
    ) -> Result<(), RenderError> {
        // The picture has the size of the view on its wall; this window shows a scaled copy.
        let on_wall = self.walls.iter().find_map(|wall| wall.area_of(studio.room(), view));
        let area = on_wall.map_or_else(|| part_of(model, view), |(area, _)| area);
        let (width, height) = (area.width as u32, area.height as u32);
        let (width, height) = (width.max(1), height.max(1));
        if self.panes.len() <= i {
            let target = Target::new(&self.gpu, width, height)?;
            let shown = self.show.bind(&self.gpu, &target);
            self.panes.push(Pane {
                slot: self.renderer.create_view_slot(),
                target,
                shown,
                lines: LinePass::new(&self.gpu),
                timer: GpuTimer::new(&self.gpu),
                over: None,
            });
        }
        let pane = &mut self.panes[i];
        if pane.target.size() != (width, height) {
            pane.target = Target::new(&self.gpu, width, height)?;
            pane.shown = self.show.bind(&self.gpu, &pane.target);
        }
        let wanted = studio.culling().plan.occlusion.while_drawing();
        let is_refused = self.cannot_cull.as_ref().is_some_and(|(refused, _)| *refused == wanted);
        let wanted = if is_refused { GpuOcclusion::None } else { wanted };
        if pane.slot.occlusion() != wanted
            && let Err(error) = self.renderer.set_occlusion(&mut pane.slot, wanted)
        {
            self.cannot_cull = Some((wanted, error.to_string()));
        }
        pane.lines.prepare(&self.gpu, &view.view, studio.lines_of(i));
        #[cfg(feature = "live")]
        match (&self.over, studio.overlay()) {
            (Some(renderer), Some(over)) => {
                let slot = pane.over.get_or_insert_with(|| renderer.create_view_slot());
                renderer.prepare(slot, &over.scene, &view.view, &[Layer::plain(&over.shown)]);
            }
            _ => pane.over = None,
        }
        Ok(())
    }

    /// Uploads the user's strokes that the server of a shared session has not returned yet.
    #[cfg(feature = "live")]
    fn follow_overlay(&mut self, studio: &mut Studio) {
        let Some(overlay) = studio.overlay_mut() else {
            self.over = None;
            return;
        };
        let mut changes = Vec::new();
        let is_other = overlay.take_changes(&mut changes);
        if self.over.is_none() && overlay.shown.is_empty() {
            return;
        }
        let is_new = self.over.is_none();
        let over = self.over.get_or_insert_with(|| {
            let mut over = Renderer::new(Arc::clone(&self.gpu), &OVER);
            over.set_patient(true);
            over
        });
        if is_other || is_new {
            over.forget_from(0);
        }
        over.follow(&changes);
        over.send(&overlay.scene);
    }

    fn show_frame(
        &mut self,
        frame: wgpu::SurfaceTexture,
        studio: &Studio,
        views: &[RoomView],
        model: Area,
        panels: &Panels,
    ) {
        let gpu = &self.gpu;
        let (width, height) = (frame.texture.width(), frame.texture.height());
        let screen =
            ScreenDescriptor { size_in_pixels: [width, height], pixels_per_point: panels.pixels_per_point };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut commands =
            self.egui.update_buffers(&gpu.device, &gpu.queue, &mut encoder, &panels.primitives, &screen);
        if self.walls.is_empty() {
            encode_panes(&self.renderer, self.over.as_ref(), &mut self.panes, &mut encoder);
        }
        let window = frame.texture.create_view(&Default::default());
        {
            let mut pass = begin_black(&mut encoder, &window, "window").forget_lifetime();
            for (pane, view) in self.panes.iter().zip(views) {
                let area = within(part_of(model, view), width, height);
                let level = studio.layers().pyramid.then_some(studio.layers().pyramid_level);
                let has_pyramid = |level| self.pyramid.draw(gpu, &mut pass, &pane.slot, level, area);
                if !level.is_some_and(has_pyramid) {
                    self.show.draw(&mut pass, &pane.shown, area, view.channels);
                }
            }
            self.egui.render(&mut pass, &panels.primitives, &screen);
        }
        commands.push(encoder.finish());
        let start = self.clock.start();
        gpu.queue.submit(commands);
        if self.walls.is_empty() {
            note_submitted(&mut self.panes);
        }
        gpu.queue.present(frame);
        if self.panes.first().is_some_and(|pane| !pane.timer.is_available()) {
            self.draw_ns = self.clock.since(start).ns;
        }
    }

    /// Draws the windows of a rig's screens. Returns whether at least one window is visible.
    fn paint_walls(&mut self, studio: &Studio, views: &[RoomView]) -> Result<bool, RenderError> {
        if self.walls.is_empty() {
            return Ok(false);
        }
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        encode_panes(&self.renderer, self.over.as_ref(), &mut self.panes, &mut encoder);
        let mut frames = Vec::new();
        for wall in &mut self.walls {
            let Some(frame) = acquire(&self.gpu, &mut wall.surface, &wall.window)? else { continue };
            let shown = self.panes.iter().map(|pane| &pane.shown);
            wall.draw(&mut encoder, &frame, studio.room(), shown.zip(views));
            frames.push(frame);
        }
        self.gpu.queue.submit([encoder.finish()]);
        note_submitted(&mut self.panes);
        // Presenting on the walls waits for their displays. This window must not wait a second time in the same frame.
        let is_shown = !frames.is_empty();
        self.surface.set_waits(!is_shown);
        for frame in frames {
            self.gpu.queue.present(frame);
        }
        Ok(is_shown)
    }
}

/// Records that the pictures of the views were submitted to the GPU.
fn note_submitted(panes: &mut [Pane]) {
    for pane in panes {
        pane.timer.submitted();
        pane.slot.submitted();
        pane.over.iter_mut().for_each(ViewSlot::submitted);
    }
}

fn encode_panes(
    renderer: &Renderer,
    over: Option<&Renderer>,
    panes: &mut [Pane],
    encoder: &mut wgpu::CommandEncoder,
) {
    let parts = panes.iter_mut().map(|Pane { slot, target, lines, timer, over, .. }| {
        (EyePicture { target, slot, timer }, (&*lines, &*over))
    });
    let (mut pictures, above): (Vec<_>, Vec<_>) = parts.unzip();
    renderer.encode_all(encoder, &mut pictures, &mut |i, pass| {
        let (lines, slot) = above[i];
        if let (Some(over), Some(slot)) = (over, slot) {
            over.draw_over(pass, slot);
        }
        lines.draw(pass);
    });
}

/// The view's part of the model's area, in whole pixels.
fn part_of(model: Area, view: &RoomView) -> Area {
    let x = (model.x + view.from.x * model.width).round();
    let right = (model.x + view.to.x * model.width).round();
    let y = (model.y + (1.0 - view.to.y) * model.height).round();
    let bottom = (model.y + (1.0 - view.from.y) * model.height).round();
    Area { x, y, width: right - x, height: bottom - y }
}
