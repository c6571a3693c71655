use super::{Gpu, Target, descriptors, pipelines::of_whole_picture, shaders};

/// The colour channels of a window that a picture overwrites.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channels {
    All,
    /// Red, for the left eye of an anaglyph.
    Red,
    /// Green and blue, for the right eye of an anaglyph.
    Cyan,
}

/// A rectangle of a window, pixels from its upper left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    pub x: f32,
    pub y: f32,
    pub width: f32,
    pub height: f32,
}

#[derive(Debug)]
pub struct ShowPass {
    layout: wgpu::BindGroupLayout,
    all: wgpu::RenderPipeline,
    red: wgpu::RenderPipeline,
    cyan: wgpu::RenderPipeline,
}

#[derive(Clone, Debug)]
pub struct Shown(wgpu::BindGroup);

impl ShowPass {
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Self {
        let picture = descriptors::texture(wgpu::TextureSampleType::Float { filterable: false });
        let bindings = [(wgpu::ShaderStages::FRAGMENT, picture)];
        let layout = gpu.bind_layout("picture", &bindings);
        let module = gpu.module("show", shaders::SHOW);
        let pipeline_layout = gpu.pipeline_layout("show", &[Some(&layout)]);
        let pipeline = |channels| {
            let entry = match (format.is_srgb(), channels) {
                (false, Channels::All) => "pass_on",
                (true, Channels::All) => "decode",
                (false, _) => "pass_on_one_eye",
                (true, _) => "decode_one_eye",
            };
            let write_mask = match channels {
                Channels::All => wgpu::ColorWrites::ALL,
                Channels::Red => wgpu::ColorWrites::RED | wgpu::ColorWrites::ALPHA,
                Channels::Cyan => {
                    wgpu::ColorWrites::GREEN | wgpu::ColorWrites::BLUE | wgpu::ColorWrites::ALPHA
                }
            };
            let target = wgpu::ColorTargetState { format, blend: None, write_mask };
            of_whole_picture(gpu, &module, &pipeline_layout, entry, target)
        };
        let [all, red, cyan] = [Channels::All, Channels::Red, Channels::Cyan].map(pipeline);
        Self { layout, all, red, cyan }
    }

    /// Prepares a target's picture for drawing. A new target needs a new call.
    pub fn bind(&self, gpu: &Gpu, target: &Target) -> Shown {
        Shown(gpu.bind_group(
            "picture",
            &self.layout,
            &[wgpu::BindingResource::TextureView(&target.picture_view)],
        ))
    }

    /// Draws a picture in an area of the pass's target. The area must lie within the target.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, shown: &Shown, area: Area, channels: Channels) {
        if !(area.width >= 1.0 && area.height >= 1.0) {
            return;
        }
        pass.set_viewport(area.x, area.y, area.width, area.height, 0.0, 1.0);
        pass.set_pipeline(match channels {
            Channels::All => &self.all,
            Channels::Red => &self.red,
            Channels::Cyan => &self.cyan,
        });
        pass.set_bind_group(0, &shown.0, &[]);
        pass.draw(0..3, 0..1);
    }
}
