//! Paint of brushes: materials, generated textures, light and sky.

mod material;
mod relief;
mod shadow;
mod surroundings;
mod textures;

use crate::descriptors;
use wgpu::util::DeviceExt as _;

use super::{
    Gpu,
    formats::{COLOR_FORMAT, SAMPLES},
    gpu_scene::GpuScene,
    pipelines::{Pipelines, Shader, Sky},
    shaders,
};
use osp_session::{recording::Environment, scene::Scene};
use shadow::Shadow;
use surroundings::Surroundings;

#[derive(Debug)]
pub(super) struct Paint {
    pub(super) pipelines: Pipelines,
    buffer: wgpu::Buffer,
    /// The current contents of `buffer`. The next [`Paint::send`] replaces them by `wanted`.
    sent: Surroundings,
    wanted: Surroundings,
    shadow: Shadow,
}

impl Paint {
    pub(super) fn new(
        gpu: &Gpu,
        view: &wgpu::BindGroupLayout,
        page: &wgpu::BindGroupLayout,
        chunk_len: usize,
        environment: Option<&Environment>,
    ) -> Self {
        let device = &gpu.device;
        let wanted = Surroundings::of(environment);
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("surroundings"),
            contents: bytemuck::bytes_of(&wanted),
            usage: descriptors::UNIFORM,
        });
        let materials = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("materials"),
            contents: bytemuck::cast_slice(&material::all()),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let bind_layout = layout(gpu);
        let sampler = |label, along| {
            device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some(label),
                address_mode_u: along,
                address_mode_v: wgpu::AddressMode::ClampToEdge,
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            })
        };
        let textures = textures::upload(gpu);
        let resources = [
            materials.as_entire_binding(),
            buffer.as_entire_binding(),
            wgpu::BindingResource::TextureView(&textures),
            wgpu::BindingResource::Sampler(&sampler("repeating", wgpu::AddressMode::Repeat)),
            wgpu::BindingResource::Sampler(&sampler("clamping", wgpu::AddressMode::ClampToEdge)),
            wgpu::BindingResource::TextureView(&textures),
        ];
        let group = gpu.bind_group("paint", &bind_layout, &resources);
        let module = gpu.module("painted", shaders::PAINTED);
        let shadow_layout = Shadow::layout(gpu);
        let pipeline_layout = gpu
            .pipeline_layout("painted", &[Some(view), Some(page), Some(&bind_layout), Some(&shadow_layout)]);
        let shader = Shader {
            module: &module,
            layout: &pipeline_layout,
            chunk_len,
            vertex: "vertex_painted",
            fragments: ["fragment_solid", "fragment_additive", "fragment_transparent"],
            depth: ("vertex_cut", Some("fragment_cut")),
        };
        let sky_layout =
            gpu.pipeline_layout("sky", &[Some(view), None, Some(&bind_layout), Some(&shadow_layout)]);
        let pipeline = create_sky(gpu, &module, &sky_layout);
        let layouts = [view, page, &bind_layout];
        let shadow = Shadow::new(gpu, &module, shadow_layout, layouts, chunk_len);
        let is_shown = environment.is_some();
        let sky = Sky { pipeline, paint: group, shadow: shadow.group.clone(), is_shown };
        let pipelines = Pipelines::new(gpu, shader, Some(sky));
        Self { pipelines, buffer, sent: wanted, wanted, shadow }
    }

    /// Changes light and sky. [`Paint::send`] sends them.
    pub(super) fn set_environment(&mut self, environment: Option<&Environment>) {
        self.wanted = Surroundings::of(environment);
        self.pipelines.show_sky(environment.is_some());
    }

    pub(super) fn hide_sky(&mut self) {
        self.pipelines.show_sky(false);
    }

    /// Records that polygons were added, moved or removed.
    pub(super) fn note_change(&mut self) {
        self.shadow.note_change();
    }

    /// Sets whether shadows may lag some frames behind their casters.
    pub(super) fn set_patient(&mut self, is_patient: bool) {
        self.shadow.set_patient(is_patient);
    }

    /// Draws the shadow map of the first light, if its contents have changed.
    pub(super) fn cast(&mut self, gpu: &Gpu, view: &wgpu::BindGroupLayout, scene: &Scene, on_gpu: &GpuScene) {
        let way = self.wanted.shining();
        if let Some(paint) = self.pipelines.paint()
            && self.shadow.send(gpu, view, paint, scene, on_gpu, way)
        {
            self.pipelines.set_shadow(&self.shadow.group);
        }
    }

    /// Sends light, sky and the time, if they have changed.
    pub(super) fn send(&mut self, gpu: &Gpu, time_s: f32) {
        self.wanted.set_time(time_s);
        if self.sent != self.wanted {
            self.sent = self.wanted;
            gpu.queue.write_buffer(&self.buffer, 0, bytemuck::bytes_of(&self.sent));
        }
    }
}

fn layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let uniform = descriptors::uniform(0);
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2Array,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let bindings = [uniform, uniform, texture, sampler, sampler, texture];
    gpu.bind_layout("paint", &bindings.map(|ty| (wgpu::ShaderStages::VERTEX_FRAGMENT, ty)))
}

fn create_sky(gpu: &Gpu, module: &wgpu::ShaderModule, layout: &wgpu::PipelineLayout) -> wgpu::RenderPipeline {
    // The sky is at the greatest distance, so it is hidden by pixels whose depth a pass without colours has written.
    let depth = Some(descriptors::depth(wgpu::CompareFunction::GreaterEqual, false));
    let vertex = descriptors::vertex(module, "vertex_sky");
    let targets = [Some(COLOR_FORMAT.into())];
    let fragment = Some(descriptors::fragment(module, "fragment_sky", &targets));
    gpu.render_pipeline("sky", Some(layout), vertex, depth, SAMPLES, fragment)
}
