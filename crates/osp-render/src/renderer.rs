mod eyes;

use std::sync::Arc;

use super::{
    Blend, Colors, Gpu, GpuOcclusion, OpaqueOrder, OrderCounts, Overdraw, PaintList, PyramidLevel,
    RenderError, Style, Target, ViewSlot,
    backdrop::srgb_from_linear,
    draw_switch::DrawSwitch,
    finish::{Bloom, Finish},
    gpu_scene::GpuScene,
    hzb::{Hzb, HzbView},
    opaque_order,
    order::Listing,
    overdraw,
    paint::Paint,
    painter::PartPass,
    pipelines::{Pipelines, Shader},
    run::{Handle, Run},
    shaders,
    style::MAX_STYLES,
    target::DepthBefore,
    view_slot::Place,
};
use osp::{
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_session::{recording::Environment, scene::Scene};

pub use eyes::{Eye, EyePicture};

/// Polygons to draw in one style.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    pub polygons: &'a VisibleBlocks,
    pub style: Style,
}

impl<'a> Layer<'a> {
    pub fn plain(polygons: &'a VisibleBlocks) -> Self {
        Self { polygons, style: Style::PLAIN }
    }
}

/// Settings of a renderer. Only the background affects the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererConfig {
    /// Number of polygons in a chunk of GPU memory, 96 bytes each. With larger chunks, large scenes need fewer
    /// dispatches and draw calls. A small scene takes less than a chunk, because the first chunk grows by doubling.
    pub chunk_len: usize,
    /// Largest number of polygons of a draw call. All draw calls share an index buffer with 24 bytes for each polygon.
    pub draw_len: usize,
    /// Background colour: linear red, green, blue.
    pub background: [f64; 3],
}

impl Default for RendererConfig {
    /// Chunks of 48 MiB, an index buffer of 6 MiB, and a dark blue-grey background.
    fn default() -> Self {
        Self { chunk_len: 1 << 19, draw_len: 1 << 18, background: super::backdrop::DARK }
    }
}

/// All polygons of a scene on the GPU, and the pipelines that draw them.
#[derive(Debug)]
pub struct Renderer {
    pub gpu: Arc<Gpu>,
    scene: GpuScene,
    view_layout: wgpu::BindGroupLayout,
    pipelines: Pipelines,
    finish: Finish,
    /// Created for the first polygon that a brush has painted, or for the first environment.
    paint: Option<Paint>,
    environment: Option<Environment>,
    time_s: f32,
    has_changed: bool,
    is_patient: bool,
    /// Whether every polygon is drawn opaque in its plain colour.
    is_solid: bool,
    /// Draws the parts of a painter; created on first use.
    parts: Option<PartPass>,
    /// Created when GPU culling is first selected for a view.
    hzb: Option<Hzb>,
    background: wgpu::Color,
    /// Whether the background replaces the sky of an environment.
    hides_sky: bool,
}

impl Renderer {
    pub fn new(gpu: Arc<Gpu>, config: &RendererConfig) -> Self {
        let scene = GpuScene::new(&gpu, config.chunk_len, config.draw_len);
        let view_layout = ViewSlot::layout(&gpu);
        let pipelines = plain_pipelines(&gpu, &view_layout, &scene);
        let finish = Finish::new(&gpu);
        let mut renderer = Self {
            scene,
            view_layout,
            pipelines,
            finish,
            paint: None,
            environment: None,
            time_s: 0.0,
            has_changed: true,
            is_patient: false,
            is_solid: false,
            parts: None,
            hzb: None,
            background: wgpu::Color::BLACK,
            hides_sky: false,
            gpu,
        };
        renderer.set_background(config.background);
        renderer
    }

    /// Sets the background colour: linear red, green, blue. The sky of an environment covers it.
    pub fn set_background(&mut self, linear: [f64; 3]) {
        let [r, g, b] = linear.map(srgb_from_linear);
        self.background = wgpu::Color { r, g, b, a: 1.0 };
    }

    /// Shows the background in place of the sky of an environment. Its light stays.
    pub fn hide_sky(&mut self) {
        self.hides_sky = true;
        if let Some(paint) = &mut self.paint {
            paint.hide_sky();
        }
    }

    /// Sets light and sky. Without an environment the background is visible, and the default environment of Tilt Brush
    /// lights brush strokes.
    pub fn set_environment(&mut self, environment: Option<&Environment>) {
        self.environment = environment.cloned();
        if let Some(paint) = &mut self.paint {
            paint.set_environment(self.environment.as_ref());
            if self.hides_sky {
                paint.hide_sky();
            }
        }
    }

    /// Sets the time of animated brushes, seconds.
    pub fn set_time(&mut self, time_s: f32) {
        self.time_s = time_s;
    }

    /// Sets the colours of polygons. The next [`Renderer::send`] sends polygons on the GPU again if their colours
    /// change.
    pub fn set_colors(&mut self, colors: Colors) {
        self.has_changed |= self.scene.set_colors(colors);
    }

    /// Sets whether shadows may lag some frames behind the scene. A frame that changes a large scene
    /// then need not draw the whole shadow map.
    pub fn set_patient(&mut self, is_patient: bool) {
        self.is_patient = is_patient;
    }

    /// Sets whether every polygon is drawn opaque and flat-shaded in its plain colour, regardless of its brush.
    /// [`PaintList`] always draws like this.
    pub fn set_solid(&mut self, is_solid: bool) {
        self.is_solid = is_solid;
    }

    /// Whether the picture changes with [`Renderer::set_time`].
    pub fn is_animated(&self) -> bool {
        self.scene.is_animated
    }

    /// Whether frames are drawn with the paint of brushes or with an environment.
    fn is_painted(&self) -> bool {
        !self.is_solid && (self.has_light() || self.scene.has_normals)
    }

    /// Whether brushes or an environment decide the light of the picture.
    fn has_light(&self) -> bool {
        self.scene.has_brushes || self.environment.is_some()
    }

    fn bloom(&self) -> Bloom {
        match &self.environment {
            _ if !self.is_painted() || !self.has_light() => Bloom::Off,
            Some(environment) if environment.has_full_bloom => Bloom::Full,
            _ => Bloom::Reduced,
        }
    }

    fn pipelines(&self) -> &Pipelines {
        match &self.paint {
            Some(paint) if self.is_painted() => &paint.pipelines,
            _ => &self.pipelines,
        }
    }

    pub fn create_view_slot(&self) -> ViewSlot {
        ViewSlot::new(&self.gpu, &self.view_layout)
    }

    /// Records changes of the scene; the next [`Renderer::send`] sends them. Call it with every change, including changes
    /// of frames that are not drawn.
    pub fn follow(&mut self, changes: &[Change]) {
        self.has_changed |= !changes.is_empty();
        self.scene.note(changes);
    }

    /// Drops the polygons from number `count` on. Call it after the scene was reset to its first `count` polygons (0 for
    /// another scene). Polygons that then get these numbers are sent again.
    pub fn forget_from(&mut self, count: usize) {
        self.has_changed = true;
        self.scene.truncate(count);
    }

    /// Sends the polygons that are new or have moved; returns the number of bytes sent.
    pub fn send(&mut self, scene: &Scene) -> u64 {
        let bytes = self.scene.flush(&self.gpu, scene);
        self.has_changed |= bytes > 0;
        if self.is_painted() {
            let Self { paint, gpu, scene: of, view_layout, environment, .. } = self;
            let paint = paint.get_or_insert_with(|| {
                Paint::new(gpu, view_layout, &of.chunks.layout, of.chunk_len(), environment.as_ref())
            });
            if self.hides_sky {
                paint.hide_sky();
            }
            if std::mem::take(&mut self.has_changed) {
                paint.note_change();
            }
            paint.set_patient(self.is_patient);
            paint.send(gpu, self.time_s);
            paint.cast(gpu, view_layout, scene, of);
        }
        if let Some(hzb) = &mut self.hzb {
            hzb.follow(&self.gpu, &self.scene);
        }
        bytes
    }

    /// Selects how a view culls hidden polygons on the GPU. Only frames with a single layer in its own colours are culled.
    ///
    /// # Errors
    /// The adapter lacks a required feature. The view is then drawn as before.
    pub fn set_occlusion(&mut self, slot: &mut ViewSlot, occlusion: GpuOcclusion) -> Result<(), RenderError> {
        slot.switch = None;
        if occlusion == GpuOcclusion::None {
            slot.hzb = None;
            return Ok(());
        }
        if occlusion == GpuOcclusion::Queries && self.gpu.is_in_browser() {
            // wgpu 30 does not pass the query set on to the browser.
            let lacks = "occlusion queries, which no browser gives it";
            return Err(RenderError::NoOcclusion { adapter: self.gpu.name(), lacks });
        }
        if self.hzb.is_none() {
            let mut hzb = match Hzb::new(&self.gpu) {
                // Without a depth pyramid, drawing all polygons is the fastest method.
                Err(_) if occlusion == GpuOcclusion::Auto => {
                    slot.hzb = None;
                    slot.switch = Some(DrawSwitch::default());
                    return Ok(());
                }
                outcome => outcome?,
            };
            hzb.follow(&self.gpu, &self.scene);
            self.hzb = Some(hzb);
        }
        slot.switch = (occlusion == GpuOcclusion::Auto).then(DrawSwitch::default);
        let view = slot.hzb.get_or_insert_with(|| Box::new(HzbView::new(&self.gpu)));
        match occlusion {
            GpuOcclusion::Queries => view.use_queries(&self.gpu),
            _ => view.use_pyramid(),
        }
        Ok(())
    }

    /// Reads back the depth pyramid of a view's last frame; `None` if that frame was not culled on the GPU.
    pub fn read_pyramid(&self, slot: &ViewSlot) -> Result<Option<Vec<PyramidLevel>>, RenderError> {
        let view = slot.hzb.as_ref().filter(|_| slot.order.listing == Listing::Clusters);
        view.map(|view| view.read_pyramid(&self.gpu)).transpose()
    }

    /// Reads back the opaque polygons that a view's last frame drew; `None` if that frame was not culled on the GPU.
    pub fn read_drawn(&self, slot: &ViewSlot) -> Result<Option<Vec<PolygonId>>, RenderError> {
        let Some(view) = slot.hzb.as_ref().filter(|_| slot.order.listing == Listing::Clusters) else {
            return Ok(None);
        };
        let kept = view.read_kept(&self.gpu)?;
        Ok(Some(kept.iter().flat_map(Handle::ids).collect()))
    }

    pub fn polygon_count(&self) -> usize {
        self.scene.uploaded
    }

    /// GPU memory reserved for polygons, bytes.
    pub fn bytes(&self) -> u64 {
        self.scene.bytes()
    }

    /// Sends a view that a painter draws. Call it after [`Renderer::send`].
    pub(super) fn prepare_parts(&mut self, slot: &mut ViewSlot, view: &View) {
        let Self { parts, gpu, view_layout, scene, .. } = self;
        parts.get_or_insert_with(|| PartPass::new(gpu, view_layout, scene));
        slot.order.clear();
        slot.is_second = false;
        slot.send(gpu, view_layout, (view, &[Style::PLAIN; MAX_STYLES]), Place::ALONE);
    }

    /// Encodes the drawing of a prepared view by a painter; returns the number of draw calls.
    pub(super) fn encode_parts(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        slot: &ViewSlot,
        list: &PaintList,
    ) -> u64 {
        let Some(parts) = &self.parts else { return 0 };
        let mut pass = target.begin(encoder, self.background, DepthBefore::Nothing, None);
        pass.set_bind_group(0, &slot.bind_group, &[]);
        let calls = parts.draw(&self.gpu, &mut pass, &self.scene, list);
        drop(pass);
        self.finish.encode(&self.gpu, encoder, target, Bloom::Off, None);
        calls
    }
}

impl Renderer {
    /// Draws a prepared view over another renderer's picture, in its render pass. Call it in the closure `more` of the
    /// other renderer's [`Renderer::encode`]. Both targets must have the same format. The view must not be culled on
    /// the GPU.
    pub fn draw_over(&self, pass: &mut wgpu::RenderPass<'_>, slot: &ViewSlot) {
        let pipelines = self.pipelines();
        pipelines.bind(pass, &slot.bind_group);
        pipelines.draw_runs(pass, &self.scene, &slot.order.runs, 0, slot.all_from);
    }
}

impl Renderer {
    /// For [`OpaqueOrder::ZPrepass`], encodes the depth pass. Returns the depth contents and the time stamps for the
    /// pass with colours.
    fn lay_down_depth<'s>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        slot: &ViewSlot,
        stamps: Option<wgpu::RenderPassTimestampWrites<'s>>,
    ) -> (DepthBefore, Option<wgpu::RenderPassTimestampWrites<'s>>) {
        if slot.order.opaque.0 != OpaqueOrder::ZPrepass {
            return (DepthBefore::Nothing, stamps);
        }
        let mut pass = target.begin_depth(encoder, stamps);
        let pipelines = self.pipelines();
        pipelines.begin_depth(&mut pass, &slot.bind_group);
        pipelines.draw_depth(&mut pass, &self.scene, &slot.order.runs);
        (DepthBefore::Kept, None)
    }

    /// Draws only the opaque polygons of a prepared view again, and counts how often samples are shaded. Overwrites the
    /// target's samples, but not its finished picture.
    pub(super) fn count_overdraw(&self, target: &Target, slot: &ViewSlot) -> Result<Overdraw, RenderError> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let (depth, _) = self.lay_down_depth(&mut encoder, target, slot, None);
        let mut pass = target.begin(&mut encoder, wgpu::Color::TRANSPARENT, depth, None);
        let pipelines = self.pipelines();
        pipelines.bind(&mut pass, &slot.bind_group);
        pipelines.draw_counts(&self.gpu, &mut pass, &self.scene, &slot.order.runs, slot.all_from);
        drop(pass);
        self.gpu.queue.submit([encoder.finish()]);
        overdraw::add_up(&self.gpu, target)
    }

    /// Number of polygons in the draw list of a prepared view. Includes unset bits of bit-mask spans.
    /// `first` is the other eye if that eye has the polygons of both, or the same view.
    pub(super) fn listed(&self, first: &ViewSlot, slot: &ViewSlot) -> u64 {
        runs_of(first, slot).map(|run| run.range.len() as u64).sum()
    }

    /// Number of draw calls of a prepared view; see [`Renderer::listed`].
    pub(super) fn draw_calls(&self, first: &ViewSlot, slot: &ViewSlot) -> u64 {
        let in_list = runs_of(first, slot).map(|run| self.scene.draw_calls(run.range.len()));
        // Culled polygons are drawn twice, for depth and for colours.
        let culled =
            first.order.handle_runs.iter().map(|run| 2 * self.scene.draw_calls(run.polygons as usize));
        in_list.chain(culled).sum()
    }

    pub(super) fn order_counts(&self, slot: &ViewSlot, scene: &Scene) -> OrderCounts {
        let order = &slot.order;
        let runs = &order.runs;
        let opaque = runs.iter().filter(|run| run.blend == Blend::Opaque);
        let of_depth = match order.opaque.0 {
            OpaqueOrder::ZPrepass => opaque.clone().count() as u64,
            _ => 0,
        };
        let binds = runs.chunk_by(|a, b| (a.page, a.blend) == (b.page, b.blend)).count() as u64;
        let ids = opaque.flat_map(|run| order.drawn_by(run));
        OrderCounts {
            draw_calls: runs.len() as u64 + of_depth,
            pipelines: binds + u64::from(of_depth > 0),
            material_runs: opaque_order::material_runs(scene, ids),
        }
    }
}

fn runs_of<'a>(first: &'a ViewSlot, slot: &'a ViewSlot) -> impl Iterator<Item = &'a Run> {
    let common = if slot.is_second { first.order.common_runs() } else { &[] };
    common.iter().chain(&slot.order.runs)
}

/// The pipelines of polygons in their plain colours.
fn plain_pipelines(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout, scene: &GpuScene) -> Pipelines {
    let module = gpu.module("polygon", shaders::POLYGON);
    let layout = gpu.pipeline_layout("polygon", &[Some(view_layout), Some(&scene.chunks.layout)]);
    let shader = Shader {
        module: &module,
        layout: &layout,
        chunk_len: scene.chunk_len(),
        vertex: "vertex",
        fragments: ["fragment"; 3],
        depth: ("vertex_depth", None),
    };
    Pipelines::new(gpu, shader, None)
}
