use std::sync::OnceLock;

use super::{
    Blend, Gpu, Run, descriptors,
    formats::{COLOR_FORMAT, SAMPLES},
    gpu_scene::GpuScene,
};

/// The pipelines that draw polygons, and the resources that they bind in addition to a view and a page of polygons.
#[derive(Debug)]
pub(super) struct Pipelines {
    opaque: wgpu::RenderPipeline,
    additive: wgpu::RenderPipeline,
    transparent: wgpu::RenderPipeline,
    /// Draws the depth of opaque polygons, without colours.
    depth: wgpu::RenderPipeline,
    /// Counts opaque polygons in the alpha of each sample; created on first use.
    count: OnceLock<wgpu::RenderPipeline>,
    opaque_shader: OwnShader,
    /// Sky and paint; `None` for plain colours.
    sky: Option<Sky>,
}

/// A [`Shader`] of opaque polygons that owns its parts.
#[derive(Debug)]
struct OwnShader {
    module: wgpu::ShaderModule,
    layout: wgpu::PipelineLayout,
    chunk_len: usize,
    vertex: &'static str,
    fragment: &'static str,
}

/// The sky behind the polygons, and the resources that the sky and painted polygons bind.
#[derive(Debug)]
pub(super) struct Sky {
    pub(super) pipeline: wgpu::RenderPipeline,
    pub(super) paint: wgpu::BindGroup,
    pub(super) shadow: wgpu::BindGroup,
    /// Whether the sky covers the background.
    pub(super) is_shown: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Shader<'a> {
    pub(super) module: &'a wgpu::ShaderModule,
    pub(super) layout: &'a wgpu::PipelineLayout,
    pub(super) chunk_len: usize,
    pub(super) vertex: &'static str,
    /// The fragment shaders of opaque, additive and transparent polygons.
    pub(super) fragments: [&'static str; 3],
    /// The vertex and the fragment shader for depth alone. Without a fragment shader, no pixel of a polygon is discarded.
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

    pub(super) fn show_sky(&mut self, is_shown: bool) {
        if let Some(sky) = &mut self.sky {
            sky.is_shown = is_shown;
        }
    }

    pub(super) fn set_shadow(&mut self, shadow: &wgpu::BindGroup) {
        if let Some(sky) = &mut self.sky {
            sky.shadow = shadow.clone();
        }
    }

    pub(super) fn paint(&self) -> Option<&wgpu::BindGroup> {
        self.sky.as_ref().map(|sky| &sky.paint)
    }

    /// Binds the resources of a pass with colours, and draws the sky.
    pub(super) fn begin(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        self.bind(pass, view);
        if let Some(sky) = self.sky.as_ref().filter(|sky| sky.is_shown) {
            pass.set_pipeline(&sky.pipeline);
            pass.draw(0..3, 0..1);
        }
    }

    /// Binds the resources and the pipeline of a pass for depth alone.
    pub(super) fn begin_depth(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        self.bind(pass, view);
        pass.set_pipeline(&self.depth);
    }

    /// Binds the resources that all polygons share.
    pub(super) fn bind(&self, pass: &mut wgpu::RenderPass<'_>, view: &wgpu::BindGroup) {
        pass.set_bind_group(0, view, &[]);
        if let Some(sky) = &self.sky {
            pass.set_bind_group(2, &sky.paint, &[]);
            pass.set_bind_group(3, &sky.shadow, &[]);
        }
    }

    /// Draws the listed opaque polygons for depth alone. Call it after [`Pipelines::begin_depth`].
    pub(super) fn draw_depth(&self, pass: &mut wgpu::RenderPass<'_>, scene: &GpuScene, runs: &[Run]) {
        for run in runs.iter().filter(|run| run.blend == Blend::Opaque && run.is_listed) {
            if scene.bind(pass, run.page) {
                scene.draw(pass, run.places(0, 0), run.style);
            }
        }
    }

    /// Counts the opaque polygons in the alpha of each sample. Call it after [`Pipelines::bind`].
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

    /// Draws runs. `first` is added to the positions of listed runs, and `all_from` to the polygon numbers of other
    /// runs.
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

#[derive(Clone, Copy)]
enum Into {
    Depth,
    Colors(Blend),
    /// The alpha of each sample; every fragment adds one.
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
    let sum = Some(sum());
    let (label, state) = match into {
        Into::Depth => ("polygons' depth", None),
        Into::Colors(Blend::Opaque) => ("opaque polygons", Some((None, wgpu::ColorWrites::ALL))),
        Into::Colors(Blend::Additive) => ("additive polygons", Some((sum, wgpu::ColorWrites::ALL))),
        Into::Colors(Blend::Transparent) => {
            ("transparent polygons", Some((Some(wgpu::BlendState::ALPHA_BLENDING), wgpu::ColorWrites::ALL)))
        }
        // Opaque polygons have an alpha of one.
        Into::Counts => ("polygons counted", Some((sum, wgpu::ColorWrites::ALPHA))),
    };
    let of_state = |(blend, write_mask)| wgpu::ColorTargetState { format: COLOR_FORMAT, blend, write_mask };
    let targets = [state.map(of_state)];
    let targets = if state.is_some() { &targets[..] } else { &[] };
    // Both sides of a polygon are visible, so no back faces are culled. At equal depth the later polygon wins. Culling
    // does not change the order of the remaining polygons.
    gpu.render_pipeline(
        label,
        Some(shader.layout),
        descriptors::with_chunk_len(descriptors::vertex(shader.module, vertex), &constants),
        Some(descriptors::depth(wgpu::CompareFunction::GreaterEqual, hides)),
        SAMPLES,
        fragment.map(|entry| descriptors::fragment(shader.module, entry, targets)),
    )
}

pub(super) fn sum() -> wgpu::BlendState {
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    wgpu::BlendState { color: add, alpha: add }
}

/// A pipeline whose entry point `vertex` draws one triangle over the whole picture.
pub(super) fn of_whole_picture(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    fragment: &'static str,
    target: wgpu::ColorTargetState,
) -> wgpu::RenderPipeline {
    let vertex = descriptors::vertex(module, "vertex");
    let targets = [Some(target)];
    let stage = descriptors::fragment(module, fragment, &targets);
    gpu.render_pipeline(fragment, Some(layout), vertex, None, 1, Some(stage))
}
