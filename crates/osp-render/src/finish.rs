use super::{
    Gpu, Target, descriptors,
    formats::{COLOR_FORMAT, PICTURE_FORMAT},
    pipelines::of_whole_picture,
    shaders,
};

/// Heights of the pictures from which bloom is summed, pixels. Each height is about a third of the one before.
pub(super) const HEIGHTS: [u32; 4] = [64, 21, 7, 2];

/// Resources for finishing the picture of one target.
#[derive(Debug)]
pub(super) struct Octaves {
    pub(super) resolved: wgpu::BindGroup,
    pub(super) octaves: [Octave; HEIGHTS.len()],
    pub(super) all: wgpu::BindGroup,
    /// The bind group of the samples; `None` if shaders cannot read samples.
    pub(super) samples: Option<wgpu::BindGroup>,
}

/// A downscaled picture, and a second texture for the first pass of its separable blur.
#[derive(Debug)]
pub(super) struct Octave {
    pub(super) size: (u32, u32),
    pub(super) views: [wgpu::TextureView; 2],
    pub(super) sources: [wgpu::BindGroup; 2],
}

/// Strength of bloom, the spread of bright light over the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Bloom {
    Off,
    /// The light loses a quarter of its brightness.
    Reduced,
    /// The light gains a quarter of its brightness.
    Full,
}

/// The last passes of a frame, which make the finished picture from the drawn colours.
#[derive(Debug)]
pub(super) struct Finish {
    source_layout: wgpu::BindGroupLayout,
    octaves_layout: wgpu::BindGroupLayout,
    samples_layout: wgpu::BindGroupLayout,
    sampler: wgpu::Sampler,
    shrink: wgpu::RenderPipeline,
    blur_across: wgpu::RenderPipeline,
    blur_down: wgpu::RenderPipeline,
    cut_off: wgpu::RenderPipeline,
    spread: wgpu::RenderPipeline,
}

impl Finish {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let module = gpu.module("finish", shaders::FINISH);
        let stage = wgpu::ShaderStages::FRAGMENT;
        let texture = (stage, descriptors::texture(wgpu::TextureSampleType::Float { filterable: true }));
        let sampler = (stage, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering));
        let samples = (stage, descriptors::samples(wgpu::TextureSampleType::Float { filterable: false }));
        let source_layout = gpu.bind_layout("source", &[texture, sampler]);
        let octaves_layout = gpu.bind_layout("octaves", &[texture; 4]);
        let samples_layout = gpu.bind_layout("samples", &[samples]);
        let layout = |label, layouts: &[Option<&wgpu::BindGroupLayout>]| gpu.pipeline_layout(label, layouts);
        let of_source = layout("one picture", &[Some(&source_layout)]);
        let (spread, of_samples) =
            if gpu.reads_samples() { ("spread", Some(&samples_layout)) } else { ("spread_mean", None) };
        let of_octaves = layout("finish", &[Some(&source_layout), Some(&octaves_layout), of_samples]);
        let pipeline = |entry, layout: &wgpu::PipelineLayout, format: wgpu::TextureFormat| {
            of_whole_picture(gpu, &module, layout, entry, format.into())
        };
        Self {
            shrink: pipeline("shrink", &of_source, COLOR_FORMAT),
            blur_across: pipeline("blur_across", &of_source, COLOR_FORMAT),
            blur_down: pipeline("blur_down", &of_source, COLOR_FORMAT),
            cut_off: pipeline("cut_off", &of_source, PICTURE_FORMAT),
            spread: pipeline(spread, &of_octaves, PICTURE_FORMAT),
            sampler: gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("octaves"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..Default::default()
            }),
            source_layout,
            octaves_layout,
            samples_layout,
        }
    }

    pub(super) fn encode(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        target: &Target,
        bloom: Bloom,
        stamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) {
        let of_target = target.octaves.get_or_init(|| self.bind(gpu, target));
        let spreads = bloom != Bloom::Off;
        if spreads {
            let mut from = &of_target.resolved;
            for (i, octave) in of_target.octaves.iter().enumerate() {
                let [view, half] = &octave.views;
                let [source, source_of_half] = &octave.sources;
                draw(encoder, &self.shrink, from, view, octave.size);
                for _ in 0..=usize::from(i > 0) {
                    draw(encoder, &self.blur_across, source, half, octave.size);
                    draw(encoder, &self.blur_down, source_of_half, view, octave.size);
                }
                from = source;
            }
        }
        let mut pass = begin(encoder, &target.picture_view, stamps);
        pass.set_pipeline(if spreads { &self.spread } else { &self.cut_off });
        pass.set_bind_group(0, &of_target.resolved, &[]);
        if spreads {
            pass.set_bind_group(1, &of_target.all, &[]);
            if let Some(samples) = &of_target.samples {
                pass.set_bind_group(2, samples, &[]);
            }
        }
        // The shader reads the kind of bloom from the number of the only instance.
        let kind = u32::from(bloom == Bloom::Full);
        pass.draw(0..3, kind..kind + 1);
    }

    fn bind(&self, gpu: &Gpu, target: &Target) -> Octaves {
        let source = |view: &wgpu::TextureView| {
            gpu.bind_group(
                "source",
                &self.source_layout,
                &[wgpu::BindingResource::TextureView(view), wgpu::BindingResource::Sampler(&self.sampler)],
            )
        };
        let octaves = HEIGHTS.map(|height| {
            let width = (height as f32 * target.aspect()).round() as u32;
            let size = (width.clamp(1, 1 << 12), height);
            let usage = descriptors::DRAWN_AND_READ;
            let view = |()| gpu.image("octave", COLOR_FORMAT, 1, usage, size);
            let views = [(); 2].map(view);
            let sources = [source(&views[0]), source(&views[1])];
            Octave { size, views, sources }
        });
        let resources: Vec<_> =
            octaves.iter().map(|octave| wgpu::BindingResource::TextureView(&octave.views[0])).collect();
        let all = gpu.bind_group("octaves", &self.octaves_layout, &resources);
        let samples = || {
            gpu.bind_group(
                "samples",
                &self.samples_layout,
                &[wgpu::BindingResource::TextureView(&target.samples)],
            )
        };
        let samples = gpu.reads_samples().then(samples);
        Octaves { resolved: source(&target.resolved), octaves, all, samples }
    }
}

fn begin<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("finish"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        })],
        depth_stencil_attachment: None,
        timestamp_writes,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

fn draw(
    encoder: &mut wgpu::CommandEncoder,
    pipeline: &wgpu::RenderPipeline,
    source: &wgpu::BindGroup,
    view: &wgpu::TextureView,
    (width, height): (u32, u32),
) {
    let mut pass = begin(encoder, view, None);
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, source, &[]);
    // The shader reads the size of its target from the number of the only instance.
    let size = width | height << 16;
    pass.draw(0..3, size..size + 1);
}
