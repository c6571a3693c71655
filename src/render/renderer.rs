use std::sync::Arc;

use super::{
    Blend, Gpu, GpuTimer, PyramidLevel, RenderError, Run, Target, ViewSlot,
    draw_switch::DrawSwitch,
    gpu_scene::GpuScene,
    hzb::{Frame, Hzb, HzbConfig, HzbView},
    order::Listing,
    shaders,
    target::{COLOR_FORMAT, DEPTH_FORMAT, DepthBefore, SAMPLES},
    timer::Ends,
};
use crate::{
    occlusion::Occlusion,
    polygon::{BLOCK, Change, PolygonId, VisibleBlocks},
    scene::Scene,
    view::View,
};

/// Styles that a frame can use.
pub(super) const MAX_STYLES: usize = 8;

/// How the polygons of a list look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Style {
    /// Red, green, blue, linear, that replaces the polygon's own colour …
    pub tint: [f32; 3],
    /// … by this much, 0 to 1.
    pub amount: f32,
    /// Factor of the opacity; below 1 the polygons are drawn as transparent.
    pub opacity: f32,
    /// Added to the brightness.
    pub glow: f32,
}

impl Style {
    /// The polygons' own colours.
    pub const PLAIN: Self = Self { tint: [0.0; 3], amount: 0.0, opacity: 1.0, glow: 0.0 };

    pub(super) fn words(self) -> [[f32; 4]; 2] {
        let [r, g, b] = self.tint;
        [[r, g, b, self.amount], [self.opacity, self.glow, 0.0, 0.0]]
    }
}

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
    /// Polygons of a chunk of GPU memory, 64 bytes each. Larger: fewer draw calls for large scenes, more memory for
    /// small ones.
    pub chunk_len: usize,
    /// Red, green, blue where nothing is, linear.
    pub background: [f64; 3],
}

impl Default for RendererConfig {
    /// Chunks of 8 MiB, a dark blue-grey background.
    fn default() -> Self {
        Self { chunk_len: 1 << 17, background: super::backdrop::DARK }
    }
}

/// Every polygon of a scene on the GPU, and the pipelines that draw them.
#[derive(Debug)]
pub struct Renderer {
    gpu: Arc<Gpu>,
    scene: GpuScene,
    view_layout: wgpu::BindGroupLayout,
    pipelines: Pipelines,
    /// Made when a view first asks for it.
    hzb: Option<Hzb>,
    background: wgpu::Color,
}

impl Renderer {
    /// A renderer with an empty scene.
    pub fn new(gpu: Arc<Gpu>, config: &RendererConfig) -> Self {
        let scene = GpuScene::new(&gpu, config.chunk_len);
        let view_layout = ViewSlot::layout(&gpu);
        let pipelines = Pipelines::new(&gpu, &view_layout, scene.layout(), scene.chunk_len());
        let [r, g, b] = config.background;
        Self { scene, view_layout, pipelines, hzb: None, background: wgpu::Color { r, g, b, a: 1.0 }, gpu }
    }

    /// Changes what is seen where nothing is: linear red, green, blue.
    pub fn set_background(&mut self, [r, g, b]: [f64; 3]) {
        self.background = wgpu::Color { r, g, b, a: 1.0 };
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
        self.scene.note(changes);
    }

    /// Forgets the polygons from number `count` on, because the scene has been taken back to when it had so many (0 for
    /// another scene): they are sent anew when they come again.
    pub fn forget_from(&mut self, count: usize) {
        self.scene.truncate(count);
    }

    /// Sends the polygons that are new or have moved; returns the bytes sent.
    pub fn send(&mut self, scene: &Scene) -> u64 {
        let bytes = self.scene.flush(&self.gpu, scene);
        if let Some(hzb) = &mut self.hzb {
            hzb.follow(&self.gpu, &self.scene);
        }
        bytes
    }

    /// Chooses how a view culls hidden polygons on the GPU; a method that culls on the CPU is none here. It does so in
    /// frames of which all that is drawn comes in one layer in its own colours; others are drawn without.
    ///
    /// # Errors
    /// The adapter lacks what that needs; the view is drawn as before.
    pub fn set_occlusion(&mut self, slot: &mut ViewSlot, occlusion: Occlusion) -> Result<(), RenderError> {
        self.set_occlusion_with(slot, occlusion, HzbConfig::default())
    }

    /// The same, with settings for [`Occlusion::Hzb`] and [`Occlusion::Auto`].
    ///
    /// # Errors
    /// The adapter lacks what that needs; the view is drawn as before.
    pub fn set_occlusion_with(
        &mut self,
        slot: &mut ViewSlot,
        occlusion: Occlusion,
        config: HzbConfig,
    ) -> Result<(), RenderError> {
        let occlusion = occlusion.on_gpu();
        slot.switch = None;
        if occlusion == Occlusion::None {
            slot.hzb = None;
            return Ok(());
        }
        if self.hzb.is_none() {
            let mut hzb = match Hzb::new(&self.gpu) {
                // Then drawing all is the fastest way that there is.
                Err(_) if occlusion == Occlusion::Auto => {
                    slot.hzb = None;
                    slot.switch = Some(DrawSwitch::default());
                    return Ok(());
                }
                outcome => outcome?,
            };
            hzb.follow(&self.gpu, &self.scene);
            self.hzb = Some(hzb);
        }
        slot.switch = (occlusion == Occlusion::Auto).then(DrawSwitch::default);
        let view = slot.hzb.get_or_insert_with(|| Box::new(HzbView::new(&self.gpu)));
        match occlusion {
            Occlusion::Queries => view.use_queries(&self.gpu),
            _ => view.use_pyramid(config),
        }
        Ok(())
    }

    /// The depth pyramid of a view's last frame, to look at; `None` if it was drawn without.
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub fn read_pyramid(&self, slot: &ViewSlot) -> Result<Option<Vec<PyramidLevel>>, RenderError> {
        let view = slot.hzb.as_ref().filter(|_| slot.order.listing() == Listing::Blocks);
        view.map(|view| view.read_pyramid(&self.gpu)).transpose()
    }

    /// The opaque polygons that a view's last frame drew, if it looked for hidden ones while drawing.
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub fn read_drawn(&self, slot: &ViewSlot) -> Result<Option<Vec<PolygonId>>, RenderError> {
        let Some(view) = slot.hzb.as_ref().filter(|_| slot.order.listing() == Listing::Blocks) else {
            return Ok(None);
        };
        let mut ids = Vec::new();
        for [block, mask] in view.read_kept(&self.gpu)? {
            let bits = (0..BLOCK as u32).filter(|bit| mask >> bit & 1 == 1);
            ids.extend(bits.map(|bit| PolygonId(block * BLOCK as u32 + bit)));
        }
        Ok(Some(ids))
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
        slot.order.clear_for(if culls { Listing::Blocks } else { Listing::Ids });
        slot.order.list_all(!ViewSlot::can_hold_all(&self.gpu, scene.polygon_count()));
        for (i, layer) in layers.iter().enumerate() {
            let style = i.min(MAX_STYLES - 1);
            styles[style] = layer.style;
            let is_faint = layer.style.opacity < 1.0;
            let transparent_of = |first| if is_faint { u64::MAX } else { self.scene.transparent_of(first) };
            slot.order.add(scene, layer.polygons, style as u32, view.eye_in_world, page_len, transparent_of);
        }
        slot.order.finish(page_len);
        let mut bytes = slot.send(&self.gpu, &self.view_layout, view, &styles);
        if let Some(of_view) = slot.hzb.as_mut().filter(|_| culls) {
            bytes += of_view.prepare(&self.gpu, &slot.order, self.scene.chunk_len(), scene, view);
        }
        bytes
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
        if slot.order.listing() == Listing::Blocks
            && let (Some(hzb), Some(mut view)) = (&self.hzb, slot.hzb.take())
        {
            let frame = Frame {
                gpu: &self.gpu,
                hzb,
                scene: &self.scene,
                pipelines: &self.pipelines,
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
        let stamps = timer.stamps(0, Ends::Both).map(|stamps| stamps.of_render());
        let mut pass = target.begin(encoder, self.background, DepthBefore::Nothing, stamps);
        pass.set_bind_group(0, slot.bind_group(), &[]);
        self.pipelines.draw_runs(&mut pass, &self.scene, slot.order.runs(), 0, slot.all_from());
        more(&mut pass);
        drop(pass);
        timer.end(encoder, 1);
    }
}

/// The pipelines that draw polygons.
#[derive(Debug)]
pub(super) struct Pipelines {
    opaque: wgpu::RenderPipeline,
    transparent: wgpu::RenderPipeline,
    /// Opaque polygons, without colours.
    pub(super) depth: wgpu::RenderPipeline,
}

/// What a pipeline draws.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Drawn {
    Colors(Blend),
    Depth,
}

impl Pipelines {
    fn new(gpu: &Gpu, view: &wgpu::BindGroupLayout, page: &wgpu::BindGroupLayout, chunk_len: usize) -> Self {
        let module = gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("polygon"),
            source: wgpu::ShaderSource::Wgsl(shaders::POLYGON.into()),
        });
        let layout = gpu.device().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("polygon"),
            bind_group_layouts: &[Some(view), Some(page)],
            immediate_size: 0,
        });
        let create = |drawn| create(gpu, &module, &layout, chunk_len as f64, drawn);
        Self {
            opaque: create(Drawn::Colors(Blend::Opaque)),
            transparent: create(Drawn::Colors(Blend::Transparent)),
            depth: create(Drawn::Depth),
        }
    }

    pub(super) fn with_colors(&self, blend: Blend) -> &wgpu::RenderPipeline {
        match blend {
            Blend::Opaque => &self.opaque,
            Blend::Transparent => &self.transparent,
        }
    }

    /// Draws runs of a list; their places count from `first`, and the numbers of those that are not listed from `all_from`.
    pub(super) fn draw_runs(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        scene: &GpuScene,
        runs: &[Run],
        first: u32,
        all_from: u32,
    ) {
        let mut bound = None;
        for run in runs {
            let Some(page) = scene.page(run.page as usize) else { continue };
            if bound != Some((run.page, run.blend)) {
                pass.set_pipeline(self.with_colors(run.blend));
                pass.set_bind_group(1, page, &[]);
                bound = Some((run.page, run.blend));
            }
            let from = if run.is_listed { first } else { all_from };
            let vertices = (from + run.range.start) * 6..(from + run.range.end) * 6;
            pass.draw(vertices, run.style..run.style + 1);
        }
    }
}

fn create(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    chunk_len: f64,
    drawn: Drawn,
) -> wgpu::RenderPipeline {
    let constants = [("CHUNK_LEN", chunk_len)];
    let hides = drawn != Drawn::Colors(Blend::Transparent);
    let target = [Some(wgpu::ColorTargetState {
        format: COLOR_FORMAT,
        blend: (!hides).then_some(wgpu::BlendState::ALPHA_BLENDING),
        write_mask: wgpu::ColorWrites::ALL,
    })];
    gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(match drawn {
            Drawn::Colors(Blend::Opaque) => "opaque polygons",
            Drawn::Colors(Blend::Transparent) => "transparent polygons",
            Drawn::Depth => "polygons' depth",
        }),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(if drawn == Drawn::Depth { "vertex_depth" } else { "vertex" }),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            buffers: &[],
        },
        // Both sides of a polygon are seen: nothing is culled by its winding.
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(hides),
            // Of two at the same depth the later one is seen: which that is does not depend on what is left out.
            depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: (drawn != Drawn::Depth).then(|| wgpu::FragmentState {
            module,
            entry_point: Some("fragment"),
            compilation_options: Default::default(),
            targets: &target,
        }),
        multiview_mask: None,
        cache: None,
    })
}
