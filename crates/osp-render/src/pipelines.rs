use std::sync::OnceLock;

use super::{
    Blend, Gpu, Run, descriptors,
    formats::{COLOR_FORMAT, SAMPLES},
    gpu_scene::GpuScene,
};

/// The pipelines that draw polygons, and what they need beside a view and a page of polygons.
#[derive(Debug)]
pub(super) struct Pipelines {
    opaque: wgpu::RenderPipeline,
    additive: wgpu::RenderPipeline,
    transparent: wgpu::RenderPipeline,
    /// Opaque polygons, without colours.
    depth: wgpu::RenderPipeline,
    /// Counts opaque polygons in the fourth number of each sample; made when it is first requested.
    count: OnceLock<wgpu::RenderPipeline>,
    /// What `count` is made of.
    opaque_shader: OwnShader,
    /// What brushes need.
    sky: Option<Sky>,
}

/// A shader of opaque polygons that is kept.
#[derive(Debug)]
struct OwnShader {
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    chunk_len: usize,
    vertex: &'static str,
    fragment: &'static str,
}

/// What is seen where no polygon is.
#[derive(Debug)]
pub(super) struct Sky {
    pub(super) pipeline: wgpu::RenderPipeline,
    /// Materials, light and so on: for the polygons, too.
    pub(super) paint: wgpu::BindGroup,
    /// Where the first light does not reach.
    pub(super) shadow: wgpu::BindGroup,
    /// Whether it covers the background.
    pub(super) is_shown: bool,
}

/// A shader and its entry points.
#[derive(Clone, Copy)]
pub(super) struct Shader<'a> {
    pub(super) module: &'a wgpu::ShaderModule,
    pub(super) layout: &'a wgpu::PipelineLayout,
    pub(super) chunk_len: usize,
    pub(super) vertex: &'static str,
    /// For opaque, additive and transparent polygons.
    pub(super) fragments: [&'static str; 3],
    /// For depth alone; without a fragment shader, every pixel of a polygon counts.
    pub(super) depth: (&'static str, Option<&'static str>),
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu, shader: Shader<'_>, sky: Option<Sky>) -> Self {
        let [opaque, additive, transparent] = shader.fragments;
        let colors =
            |blend, fragment| create(gpu, shader, shader.vertex, Some(fragment), Into::Colors(blend));
        let (vertex, fragment) = shader.depth;
        Self {
            opaque: colors(Blend::Opaque, opaque),
            additive: colors(Blend::Additive, additive),
            transparent: colors(Blend::Transparent, transparent),
            depth: create(gpu, shader, vertex, fragment, Into::Depth),
            count: OnceLock::new(),
            opaque_shader: OwnShader {
                module: shader.module.clone(),
                layout: shader.layout.clone(),
                chunk_len: shader.chunk_len,
                vertex: shader.vertex,
                fragment: opaque,
            },
            sky,
        }
    }

    /// Says whether the sky covers the background.
    pub(super) fn show_sky(&mut self, is_shown: bool) {
        if let Some(sky) = &mut self.sky {
            sky.is_shown = is_shown;
        }
    }

    /// Changes where the first light does not reach.
    pub(super) fn set_shadow(&mut self, shadow: &wgpu::BindGroup) {
        if let Some(sky) = &mut self.sky {
            sky.shadow = shadow.clone();
        }
    }

    /// What brushes need of the paint.
    pub(super) fn paint(&self) -> Option<&wgpu::BindGroup> {
        self.sky.as_ref().map(|sky| &sky.paint)
    }

    /// Makes a pass ready for colours, and draws what is seen where no polygon is.
    pub(super) fn begin(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        pass.set_bind_group(0, view, &[]);
        let Some(sky) = &self.sky else { return };
        pass.set_bind_group(2, &sky.paint, &[]);
        pass.set_bind_group(3, &sky.shadow, &[]);
        if sky.is_shown {
            pass.set_pipeline(&sky.pipeline);
            pass.draw(0..3, 0..1);
        }
    }

    /// Makes a pass ready for depth alone.
    pub(super) fn begin_depth(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        self.bind(pass, view);
        pass.set_pipeline(&self.depth);
    }

    /// Binds what all polygons need.
    pub(super) fn bind(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        pass.set_bind_group(0, view, &[]);
        if let Some(sky) = &self.sky {
            pass.set_bind_group(2, &sky.paint, &[]);
            pass.set_bind_group(3, &sky.shadow, &[]);
        }
    }

    /// Draws the listed opaque polygons for depth alone, after [`Pipelines::begin_depth`].
    pub(super) fn draw_depth(&self, pass: &mut wgpu::RenderPass<'_>, scene: &GpuScene, runs: &[Run]) {
        for run in runs.iter().filter(|run| run.blend == Blend::Opaque && run.is_listed) {
            if scene.bind(pass, run.page) {
                scene.draw(pass, run.places(0, 0), run.style);
            }
        }
    }

    /// Draws the opaque polygons so that they are counted in the fourth number of each sample, after [`Pipelines::bind`].
    pub(super) fn draw_counts(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::RenderPass<'_>,
        scene: &GpuScene,
        runs: &[Run],
        all_from: u32,
    ) {
        let pipeline = self.count.get_or_init(|| {
            let OwnShader { module, layout, chunk_len, vertex, fragment } = &self.opaque_shader;
            let (chunk_len, fragments, depth) = (*chunk_len, [*fragment; 3], (*vertex, None));
            let shader = Shader { module, layout, chunk_len, vertex, fragments, depth };
            create(gpu, shader, vertex, Some(fragment), Into::Counts)
        });
        pass.set_pipeline(pipeline);
        for run in runs.iter().filter(|run| run.blend == Blend::Opaque) {
            if scene.bind(pass, run.page) {
                scene.draw(pass, run.places(0, all_from), run.style);
            }
        }
    }

    pub(super) fn with_colors(&self, blend: Blend) -> &wgpu::RenderPipeline {
        match blend {
            Blend::Opaque => &self.opaque,
            Blend::Additive => &self.additive,
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
            if bound != Some((run.page, run.blend)) {
                if !scene.bind(pass, run.page) {
                    continue;
                }
                pass.set_pipeline(self.with_colors(run.blend));
                bound = Some((run.page, run.blend));
            }
            scene.draw(pass, run.places(first, all_from), run.style);
        }
    }
}

/// What a pipeline draws into.
#[derive(Clone, Copy)]
enum Into {
    Depth,
    Colors(Blend),
    /// The fourth number of each sample, which grows by one.
    Counts,
}

fn create(
    gpu: &Gpu,
    shader: Shader<'_>,
    vertex: &'static str,
    fragment: Option<&'static str>,
    into: Into,
) -> wgpu::RenderPipeline {
    let constants = [("CHUNK_LEN", shader.chunk_len as f64)];
    let hides = !matches!(into, Into::Colors(Blend::Additive | Blend::Transparent));
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    let sum = Some(wgpu::BlendState { color: add, alpha: add });
    let (label, state) = match into {
        Into::Depth => ("polygons' depth", None),
        Into::Colors(Blend::Opaque) => ("opaque polygons", Some((None, wgpu::ColorWrites::ALL))),
        Into::Colors(Blend::Additive) => ("additive polygons", Some((sum, wgpu::ColorWrites::ALL))),
        Into::Colors(Blend::Transparent) => {
            ("transparent polygons", Some((Some(wgpu::BlendState::ALPHA_BLENDING), wgpu::ColorWrites::ALL)))
        }
        // What is opaque has a fourth number of one.
        Into::Counts => ("polygons counted", Some((sum, wgpu::ColorWrites::ALPHA))),
    };
    let of_state = |(blend, write_mask)| wgpu::ColorTargetState { format: COLOR_FORMAT, blend, write_mask };
    let targets = [state.map(of_state)];
    gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(label),
        layout: Some(shader.layout),
        vertex: wgpu::VertexState {
            module: shader.module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &constants,
                ..Default::default()
            },
            buffers: &[],
        },
        // Both sides of a polygon are seen: nothing is culled by its winding.
        primitive: wgpu::PrimitiveState::default(),
        // Of two at the same depth the later one is seen: which that is does not depend on what is left out.
        depth_stencil: Some(descriptors::depth(wgpu::CompareFunction::GreaterEqual, hides)),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: fragment.map(|entry_point| {
            descriptors::fragment(shader.module, entry_point, if state.is_some() { &targets } else { &[] })
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A pipeline whose entry point `vertex` draws one triangle over all of a picture.
pub(super) fn of_whole_picture(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    fragment: &'static str,
    target: wgpu::ColorTargetState,
) -> wgpu::RenderPipeline {
    gpu.device().create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(layout),
        vertex: descriptors::vertex(module, "vertex"),
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(descriptors::fragment(module, fragment, &[Some(target)])),
        multiview_mask: None,
        cache: None,
    })
}
