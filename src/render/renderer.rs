use std::sync::Arc;

use super::{
    Blend, Gpu, GpuTimer, Target, ViewSlot,
    gpu_scene::GpuScene,
    shaders,
    target::{COLOR_FORMAT, DEPTH_FORMAT, SAMPLES},
};
use crate::{
    scene::{Change, PolygonId, Scene},
    visibility::View,
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
    /// The polygons, in any order.
    pub ids: &'a [PolygonId],
    /// How they look.
    pub style: Style,
}

impl<'a> Layer<'a> {
    /// Polygons in their own colours.
    pub fn plain(ids: &'a [PolygonId]) -> Self {
        Self { ids, style: Style::PLAIN }
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
        Self { chunk_len: 1 << 17, background: [0.016, 0.019, 0.026] }
    }
}

/// Every polygon of a scene on the GPU, and the pipelines that draw them.
#[derive(Debug)]
pub struct Renderer {
    gpu: Arc<Gpu>,
    scene: GpuScene,
    view_layout: wgpu::BindGroupLayout,
    opaque: wgpu::RenderPipeline,
    transparent: wgpu::RenderPipeline,
    background: wgpu::Color,
}

impl Renderer {
    /// A renderer with an empty scene.
    pub fn new(gpu: Arc<Gpu>, config: &RendererConfig) -> Self {
        let scene = GpuScene::new(&gpu, config.chunk_len);
        let view_layout = ViewSlot::layout(&gpu);
        let pipelines = Pipelines::new(&gpu, &view_layout, scene.layout(), scene.chunk_len());
        let [r, g, b] = config.background;
        Self {
            scene,
            view_layout,
            opaque: pipelines.create(Blend::Opaque),
            transparent: pipelines.create(Blend::Transparent),
            background: wgpu::Color { r, g, b, a: 1.0 },
            gpu,
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
        self.scene.note(changes);
    }

    /// Forgets the polygons from number `count` on, because the scene has been taken back to when it had so many (0 for
    /// another scene): they are sent anew when they come again.
    pub fn forget_from(&mut self, count: usize) {
        self.scene.truncate(count);
    }

    /// Sends the polygons that are new or have moved; returns the bytes sent.
    pub fn send(&mut self, scene: &Scene) -> u64 {
        self.scene.flush(&self.gpu, scene)
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
        slot.order.clear();
        for (i, layer) in layers.iter().enumerate() {
            let style = i.min(MAX_STYLES - 1);
            styles[style] = layer.style;
            let blend_of = |id| {
                if layer.style.opacity < 1.0 || self.scene.is_transparent(id) {
                    Blend::Transparent
                } else {
                    Blend::Opaque
                }
            };
            slot.order.add(scene, layer.ids, style as u32, view.eye_in_world, page_len, blend_of);
        }
        slot.order.finish(page_len);
        slot.send(&self.gpu, &self.view_layout, view, &styles)
    }

    /// Encodes the drawing of a prepared view into `target`; `more` draws whatever comes on top.
    pub fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        slot: &ViewSlot,
        timer: &mut GpuTimer,
        more: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let mut pass = target.begin(encoder, self.background, timer.begin());
        pass.set_bind_group(0, slot.bind_group(), &[]);
        let mut bound = None;
        for run in slot.order.runs() {
            let Some(page) = self.scene.page(run.page as usize) else { continue };
            if bound != Some((run.page, run.blend)) {
                pass.set_pipeline(match run.blend {
                    Blend::Opaque => &self.opaque,
                    Blend::Transparent => &self.transparent,
                });
                pass.set_bind_group(1, page, &[]);
                bound = Some((run.page, run.blend));
            }
            pass.draw(run.range.start * 6..run.range.end * 6, run.style..run.style + 1);
        }
        more(&mut pass);
        drop(pass);
        timer.end(encoder);
    }
}

struct Pipelines<'a> {
    gpu: &'a Gpu,
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    chunk_len: f64,
}

impl<'a> Pipelines<'a> {
    fn new(
        gpu: &'a Gpu,
        view: &wgpu::BindGroupLayout,
        page: &wgpu::BindGroupLayout,
        chunk_len: usize,
    ) -> Self {
        let module = gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("polygon"),
            source: wgpu::ShaderSource::Wgsl(shaders::POLYGON.into()),
        });
        let layout = gpu.device().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("polygon"),
            bind_group_layouts: &[Some(view), Some(page)],
            immediate_size: 0,
        });
        Self { gpu, module, layout, chunk_len: chunk_len as f64 }
    }

    fn create(&self, blend: Blend) -> wgpu::RenderPipeline {
        let constants = [("CHUNK_LEN", self.chunk_len)];
        let is_opaque = blend == Blend::Opaque;
        self.gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(if is_opaque { "opaque polygons" } else { "transparent polygons" }),
            layout: Some(&self.layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some("vertex"),
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
                depth_write_enabled: Some(is_opaque),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: COLOR_FORMAT,
                    blend: (!is_opaque).then_some(wgpu::BlendState::ALPHA_BLENDING),
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
