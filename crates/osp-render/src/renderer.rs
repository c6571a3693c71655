use std::sync::Arc;

use super::{
    Blend, Classes, Colors, Gpu, GpuOcclusion, GpuTimer, OpaqueOrder, OrderCounts, Overdraw, PaintList,
    PyramidLevel, RenderError, Style, Target, ViewSlot,
    backdrop::srgb_from_linear,
    descriptors,
    draw_switch::DrawSwitch,
    finish::Finish,
    gpu_scene::GpuScene,
    hzb::{Frame, Hzb, HzbConfig, HzbView},
    opaque_order,
    order::Listing,
    overdraw,
    paint::Paint,
    painter::PartPass,
    pipelines::{Pipelines, Shader},
    run::Handle,
    shaders,
    style::MAX_STYLES,
    target::DepthBefore,
    timer::Ends,
};
use osp::{
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_session::{recording::Environment, scene::Scene};

/// Polygons to draw and how.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// The polygons.
    pub polygons: &'a VisibleBlocks,
    /// How they look.
    pub style: Style,
}

impl<'a> Layer<'a> {
    /// Polygons in their own colours.
    pub fn plain(polygons: &'a VisibleBlocks) -> Self {
        Self { polygons, style: Style::PLAIN }
    }
}

/// Settings of a renderer that do not change the picture, but for the background.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RendererConfig {
    /// Polygons of a chunk of GPU memory, 96 bytes each. Larger: fewer dispatches and draw calls for large scenes. The first
    /// chunk grows by doubling, so small scenes do not take more memory.
    pub chunk_len: usize,
    /// Most polygons of a draw call. The index buffer that all calls share takes 24 bytes for each of them.
    pub draw_len: usize,
    /// Red, green, blue where nothing is, linear.
    pub background: [f64; 3],
}

impl Default for RendererConfig {
    /// Chunks of 48 MiB, indices of 6 MiB, a dark blue-grey background.
    fn default() -> Self {
        Self { chunk_len: 1 << 19, draw_len: 1 << 18, background: super::backdrop::DARK }
    }
}

/// Every polygon of a scene on the GPU, and the pipelines that draw them.
#[derive(Debug)]
pub struct Renderer {
    gpu: Arc<Gpu>,
    scene: GpuScene,
    view_layout: wgpu::BindGroupLayout,
    pipelines: Pipelines,
    finish: Finish,
    /// Made when the first polygon comes that a brush has painted, or an environment.
    paint: Option<Paint>,
    environment: Option<Environment>,
    time_s: f32,
    has_changed: bool,
    is_patient: bool,
    /// Whether every polygon is drawn solid in its plain colour.
    is_solid: bool,
    /// Made when a painter first draws.
    parts: Option<PartPass>,
    /// Made when a view first asks for it.
    hzb: Option<Hzb>,
    background: wgpu::Color,
}

impl Renderer {
    /// A renderer with an empty scene.
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
            gpu,
        };
        renderer.set_background(config.background);
        renderer
    }

    /// Changes what is seen where nothing is and there is no environment: linear red, green, blue.
    pub fn set_background(&mut self, linear: [f64; 3]) {
        let [r, g, b] = linear.map(srgb_from_linear);
        self.background = wgpu::Color { r, g, b, a: 1.0 };
    }

    /// Changes the light, and what is seen where nothing is. Without an environment that is the background, and what brushes
    /// have painted stands in the light that their application begins with.
    pub fn set_environment(&mut self, environment: Option<&Environment>) {
        self.environment = environment.cloned();
        if let Some(paint) = &mut self.paint {
            paint.set_environment(self.environment.as_ref());
        }
    }

    /// Changes the moment that what moves by itself is seen at, seconds.
    pub fn set_time(&mut self, time_s: f32) {
        self.time_s = time_s;
    }

    /// Changes the colours that polygons are drawn in; those that are there are sent again.
    pub fn set_colors(&mut self, colors: Colors) {
        self.has_changed |= self.scene.set_colors(colors);
    }

    /// Says whether shadows may be some frames older than what throws them, so that a frame that changes a large scene does
    /// not draw all of it again for its shadows.
    pub fn set_patient(&mut self, is_patient: bool) {
        self.is_patient = is_patient;
    }

    /// Says whether every polygon is drawn solid, flat-shaded in its plain colour, whatever brush has painted it: as a
    /// painter draws it ([`PaintList`]).
    pub fn set_solid(&mut self, is_solid: bool) {
        self.is_solid = is_solid;
    }

    /// Whether something moves by itself with [`Renderer::set_time`].
    pub fn is_animated(&self) -> bool {
        self.scene.is_animated()
    }

    /// Whether brushes or an environment decide how things look.
    fn is_painted(&self) -> bool {
        !self.is_solid && (self.scene.has_brushes() || self.environment.is_some())
    }

    /// The pipelines of the frame at hand.
    fn pipelines(&self) -> &Pipelines {
        match &self.paint {
            Some(paint) if self.is_painted() => paint.pipelines(),
            _ => &self.pipelines,
        }
    }

    /// The adapter and device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// What a view needs of its own.
    pub fn create_view_slot(&self) -> ViewSlot {
        ViewSlot::new(&self.gpu, &self.view_layout)
    }

    /// Notes what has changed in the scene; it is sent with the next [`Renderer::send`]. To be called with every
    /// change, also those of frames that are not drawn.
    pub fn follow(&mut self, changes: &[Change]) {
        self.has_changed |= !changes.is_empty();
        self.scene.note(changes);
    }

    /// Forgets the polygons from number `count` on, because the scene has been taken back to when it had so many (0 for
    /// another scene): they are sent again when they come again.
    pub fn forget_from(&mut self, count: usize) {
        self.has_changed = true;
        self.scene.truncate(count);
    }

    /// Sends the polygons that are new or have moved; returns the bytes sent.
    pub fn send(&mut self, scene: &Scene) -> u64 {
        let bytes = self.scene.flush(&self.gpu, scene);
        self.has_changed |= bytes > 0;
        if self.is_painted() {
            let Self { paint, gpu, scene: of, view_layout, environment, .. } = self;
            let paint = paint.get_or_insert_with(|| {
                Paint::new(gpu, view_layout, of.layout(), of.chunk_len(), environment.as_ref())
            });
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

    /// Chooses how a view culls hidden polygons on the GPU. It does so in frames of which all that is drawn comes in one layer in its own colours; others are drawn without.
    ///
    /// # Errors
    /// The adapter lacks what that needs; the view is drawn as before.
    pub fn set_occlusion(&mut self, slot: &mut ViewSlot, occlusion: GpuOcclusion) -> Result<(), RenderError> {
        self.set_occlusion_with(slot, occlusion, HzbConfig::default())
    }

    /// The same, with settings for [`GpuOcclusion::Hzb`] and [`GpuOcclusion::Auto`].
    ///
    /// # Errors
    /// The adapter lacks what that needs; the view is drawn as before.
    pub fn set_occlusion_with(
        &mut self,
        slot: &mut ViewSlot,
        occlusion: GpuOcclusion,
        config: HzbConfig,
    ) -> Result<(), RenderError> {
        slot.switch = None;
        if occlusion == GpuOcclusion::None {
            slot.hzb = None;
            return Ok(());
        }
        if occlusion == GpuOcclusion::Queries && self.gpu.is_in_browser() {
            // The crate wgpu, version 30, does not hand the set of queries on to the browser.
            let lacks = "occlusion queries, which no browser gives it";
            return Err(RenderError::NoOcclusion { adapter: self.gpu.name(), lacks });
        }
        if self.hzb.is_none() {
            let mut hzb = match Hzb::new(&self.gpu) {
                // Then drawing all is the fastest way that there is.
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
            _ => view.use_pyramid(config),
        }
        Ok(())
    }

    /// The depth pyramid of a view's last frame, to look at; `None` if it was drawn without.
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub fn read_pyramid(&self, slot: &ViewSlot) -> Result<Option<Vec<PyramidLevel>>, RenderError> {
        let view = slot.hzb.as_ref().filter(|_| slot.order.listing() == Listing::Clusters);
        view.map(|view| view.read_pyramid(&self.gpu)).transpose()
    }

    /// The opaque polygons that a view's last frame drew, if it looked for hidden ones while drawing.
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub fn read_drawn(&self, slot: &ViewSlot) -> Result<Option<Vec<PolygonId>>, RenderError> {
        let Some(view) = slot.hzb.as_ref().filter(|_| slot.order.listing() == Listing::Clusters) else {
            return Ok(None);
        };
        let kept = view.read_kept(&self.gpu, slot.order.handles())?;
        Ok(Some(kept.iter().flat_map(Handle::ids).collect()))
    }

    /// Polygons on the GPU.
    pub fn polygon_count(&self) -> usize {
        self.scene.uploaded()
    }

    /// GPU memory reserved for polygons, bytes.
    pub fn bytes(&self) -> u64 {
        self.scene.bytes()
    }

    /// Sorts and sends what a view draws; returns the bytes sent. Polygons that are not on the GPU are left out:
    /// [`Renderer::send`] comes first. Layers beyond the eighth are drawn in the style of the eighth.
    pub fn prepare(&self, slot: &mut ViewSlot, scene: &Scene, view: &View, layers: &[Layer<'_>]) -> u64 {
        let page_len = self.scene.page_len();
        let mut styles = [Style::PLAIN; MAX_STYLES];
        let is_plain = |(i, layer): (usize, &Layer<'_>)| match i {
            0 => layer.style == Style::PLAIN,
            _ => layer.polygons.is_empty(),
        };
        let can_cull = slot.hzb.is_some() && layers.iter().enumerate().all(is_plain);
        let in_view = layers.first().map_or(0, |layer| layer.polygons.len());
        let culls = can_cull && slot.switch.as_mut().is_none_or(|switch| switch.decide(in_view));
        slot.order.clear_for(if culls { Listing::Clusters } else { Listing::Ids });
        for (i, layer) in layers.iter().enumerate() {
            let style = i.min(MAX_STYLES - 1);
            styles[style] = layer.style;
            let is_faint = layer.style.opacity < 1.0;
            let classes_of = |first| match self.scene.classes_of(first) {
                _ if self.is_solid => Classes::default(),
                Classes { additive, .. } if is_faint => Classes { additive, transparent: !additive },
                classes => classes,
            };
            slot.order.add(scene, layer.polygons, style as u32, view.eye_in_world, page_len, classes_of);
        }
        slot.order.sort_opaque(scene, view.eye_in_world, page_len);
        slot.order.finish(page_len);
        let mut bytes = slot.send(&self.gpu, &self.view_layout, view, &styles);
        if let Some(of_view) = slot.hzb.as_mut().filter(|_| culls) {
            bytes += of_view.prepare(&self.gpu, &slot.order, &self.scene, scene, view);
        }
        bytes
    }

    /// Sends a view of which a painter draws what there is; [`Renderer::send`] comes first.
    pub(super) fn prepare_parts(&mut self, slot: &mut ViewSlot, view: &View) {
        let Self { parts, gpu, view_layout, scene, .. } = self;
        parts.get_or_insert_with(|| PartPass::new(gpu, view_layout, scene));
        slot.order.clear();
        slot.send(gpu, view_layout, view, &[Style::PLAIN; MAX_STYLES]);
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
        pass.set_bind_group(0, slot.bind_group(), &[]);
        let calls = parts.draw(&self.gpu, &mut pass, &self.scene, list);
        drop(pass);
        self.finish.encode(&self.gpu, encoder, target, false, None);
        calls
    }

    /// Encodes the drawing of a prepared view into `target`; `more` draws whatever comes on top. After submission both
    /// [`GpuTimer::submitted`] and [`ViewSlot::submitted`] are to be called.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        slot: &mut ViewSlot,
        timer: &mut GpuTimer,
        more: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        if slot.order.listing() == Listing::Clusters
            && let (Some(hzb), Some(mut view)) = (&self.hzb, slot.hzb.take())
        {
            let frame = Frame {
                gpu: &self.gpu,
                hzb,
                scene: &self.scene,
                pipelines: self.pipelines(),
                finish: &self.finish,
                spreads: self.is_painted(),
                view_layout: &self.view_layout,
                target,
                background: self.background,
                uniforms: slot.uniforms(),
                list: slot.list(),
                draw: slot.bind_group(),
                order: &slot.order,
            };
            view.encode(&frame, encoder, timer, more);
            slot.hzb = Some(view);
            return;
        }
        timer.begin();
        let stamps = timer.stamps(0, Ends::Begin).map(|stamps| stamps.of_render());
        let (depth, stamps) = self.lay_down_depth(encoder, target, slot, stamps);
        let mut pass = target.begin(encoder, self.background, depth, stamps);
        let pipelines = self.pipelines();
        pipelines.begin(&mut pass, slot.bind_group());
        pipelines.draw_runs(&mut pass, &self.scene, slot.order.runs(), 0, slot.all_from());
        more(&mut pass);
        drop(pass);
        let stamps = timer.stamps(0, Ends::End).map(|stamps| stamps.of_render());
        self.finish.encode(&self.gpu, encoder, target, self.is_painted(), stamps);
        timer.end(encoder, 1);
    }
}

impl Renderer {
    /// Draws a prepared view into a pass of another renderer, over what that one has drawn: for the `more` of its
    /// [`Renderer::encode`], with a target of the same format. Nothing here may be culled on the GPU.
    pub fn draw_over(&self, pass: &mut wgpu::RenderPass<'_>, slot: &ViewSlot) {
        let pipelines = self.pipelines();
        pipelines.bind(pass, slot.bind_group());
        pipelines.draw_runs(pass, &self.scene, slot.order.runs(), 0, slot.all_from());
    }
}

impl Renderer {
    /// For [`OpaqueOrder::ZPrepass`], encodes the pass that comes first, with the time stamps of the frame's beginning.
    fn lay_down_depth<'s>(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        slot: &ViewSlot,
        stamps: Option<wgpu::RenderPassTimestampWrites<'s>>,
    ) -> (DepthBefore, Option<wgpu::RenderPassTimestampWrites<'s>>) {
        if slot.order.opaque() != OpaqueOrder::ZPrepass {
            return (DepthBefore::Nothing, stamps);
        }
        let mut pass = target.begin_depth(encoder, stamps);
        let pipelines = self.pipelines();
        pipelines.begin_depth(&mut pass, slot.bind_group());
        pipelines.draw_depth(&mut pass, &self.scene, slot.order.runs());
        (DepthBefore::Kept, None)
    }

    /// Draws a prepared view again, its opaque polygons alone, and counts how often a sample is shaded. What the target
    /// shows is lost, but not its picture.
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub(super) fn count_overdraw(&self, target: &Target, slot: &ViewSlot) -> Result<Overdraw, RenderError> {
        let mut encoder = self.gpu.device().create_command_encoder(&Default::default());
        let (depth, _) = self.lay_down_depth(&mut encoder, target, slot, None);
        let mut pass = target.begin(&mut encoder, wgpu::Color::TRANSPARENT, depth, None);
        let pipelines = self.pipelines();
        pipelines.bind(&mut pass, slot.bind_group());
        pipelines.draw_counts(&self.gpu, &mut pass, &self.scene, slot.order.runs(), slot.all_from());
        drop(pass);
        self.gpu.queue().submit([encoder.finish()]);
        overdraw::add_up(&self.gpu, target)
    }

    /// Draw calls of a prepared view.
    pub(super) fn draw_calls(&self, slot: &ViewSlot) -> u64 {
        let in_list = slot.order.runs().iter().map(|run| self.scene.draw_calls(run.range.len()));
        // For depth, then for colours.
        let culled =
            slot.order.handle_runs().iter().map(|run| 2 * self.scene.draw_calls(run.polygons as usize));
        in_list.chain(culled).sum()
    }

    /// What the order of a prepared view costs in calls and changes of state.
    pub(super) fn order_counts(&self, slot: &ViewSlot, scene: &Scene) -> OrderCounts {
        let order = &slot.order;
        let runs = order.runs();
        let opaque = runs.iter().filter(|run| run.blend == Blend::Opaque);
        let of_depth = match order.opaque() {
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

/// The pipelines of what no brush has painted.
fn plain_pipelines(gpu: &Gpu, view_layout: &wgpu::BindGroupLayout, scene: &GpuScene) -> Pipelines {
    let module = descriptors::module(gpu.device(), "polygon", shaders::POLYGON);
    let layout =
        descriptors::pipeline_layout(gpu.device(), "polygon", &[Some(view_layout), Some(scene.layout())]);
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
