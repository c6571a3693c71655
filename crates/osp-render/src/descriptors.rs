//! Constructors of wgpu objects, without the fields that are the same in all of them.

use super::{Gpu, formats::DEPTH_FORMAT};

pub(super) const UNIFORM: wgpu::BufferUsages =
    wgpu::BufferUsages::UNIFORM.union(wgpu::BufferUsages::COPY_DST);

pub(super) const STORAGE: wgpu::BufferUsages =
    wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_DST).union(wgpu::BufferUsages::COPY_SRC);

pub(super) const READ_BACK: wgpu::BufferUsages =
    wgpu::BufferUsages::COPY_DST.union(wgpu::BufferUsages::MAP_READ);

pub(super) const DRAWN_AND_READ: wgpu::TextureUsages =
    wgpu::TextureUsages::RENDER_ATTACHMENT.union(wgpu::TextureUsages::TEXTURE_BINDING);

impl Gpu {
    pub(super) fn module(&self, label: &str, wgsl: &str) -> wgpu::ShaderModule {
        self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(label),
            source: wgpu::ShaderSource::Wgsl(wgsl.into()),
        })
    }

    pub(super) fn pipeline_layout(
        &self,
        label: &str,
        bind_group_layouts: &[Option<&wgpu::BindGroupLayout>],
    ) -> wgpu::PipelineLayout {
        self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(label),
            bind_group_layouts,
            immediate_size: 0,
        })
    }

    pub(super) fn compute_pipeline(
        &self,
        wgsl: &str,
        layouts: &[Option<&wgpu::BindGroupLayout>],
        entry: &str,
    ) -> wgpu::ComputePipeline {
        self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(entry),
            layout: Some(&self.pipeline_layout(entry, layouts)),
            module: &self.module(entry, wgsl),
            entry_point: Some(entry),
            compilation_options: Default::default(),
            cache: None,
        })
    }

    pub(super) fn render_pipeline(
        &self,
        label: &str,
        layout: Option<&wgpu::PipelineLayout>,
        vertex: wgpu::VertexState<'_>,
        depth_stencil: Option<wgpu::DepthStencilState>,
        samples: u32,
        fragment: Option<wgpu::FragmentState<'_>>,
    ) -> wgpu::RenderPipeline {
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout,
            vertex,
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil,
            multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
            fragment,
            multiview_mask: None,
            cache: None,
        })
    }

    pub(super) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let label = Some(label);
        self.device.create_buffer(&wgpu::BufferDescriptor { label, size, usage, mapped_at_creation: false })
    }

    /// Replaces a buffer with less than `bytes` bytes by a larger buffer of zeros. Returns whether the buffer was
    /// replaced.
    pub(super) fn grow(&self, buffer: &mut wgpu::Buffer, bytes: u64) -> bool {
        if bytes <= buffer.size() {
            return false;
        }
        *buffer = self.buffer("grown", bytes.next_power_of_two(), buffer.usage());
        true
    }

    /// An uninitialised texture of this size, without smaller levels.
    pub(super) fn texture(
        &self,
        label: &str,
        format: wgpu::TextureFormat,
        sample_count: u32,
        usage: wgpu::TextureUsages,
        (width, height): (u32, u32),
    ) -> wgpu::Texture {
        self.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    pub(super) fn image(
        &self,
        label: &str,
        format: wgpu::TextureFormat,
        sample_count: u32,
        usage: wgpu::TextureUsages,
        size: (u32, u32),
    ) -> wgpu::TextureView {
        self.texture(label, format, sample_count, usage, size).create_view(&Default::default())
    }

    pub(super) fn bind_group(
        &self,
        label: &str,
        layout: &wgpu::BindGroupLayout,
        resources: &[wgpu::BindingResource<'_>],
    ) -> wgpu::BindGroup {
        let resources = (0..).zip(resources.iter().cloned());
        let entries: Vec<_> =
            resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
        let (label, entries) = (Some(label), &entries[..]);
        self.device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries })
    }

    pub(super) fn bind_layout(
        &self,
        label: &str,
        bindings: &[(wgpu::ShaderStages, wgpu::BindingType)],
    ) -> wgpu::BindGroupLayout {
        let entry = |(binding, &(visibility, ty))| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        };
        let entries: Vec<_> = (0..).zip(bindings).map(entry).collect();
        let (label, entries) = (Some(label), &entries[..]);
        self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label, entries })
    }

    pub(super) fn compute_layout(&self, label: &str, types: &[wgpu::BindingType]) -> wgpu::BindGroupLayout {
        let bindings: Vec<_> = types.iter().map(|&ty| (wgpu::ShaderStages::COMPUTE, ty)).collect();
        self.bind_layout(label, &bindings)
    }
}

/// The vertex stage of a shader that reads no vertices from buffers.
pub(super) fn vertex<'a>(module: &'a wgpu::ShaderModule, entry: &'a str) -> wgpu::VertexState<'a> {
    let compilation_options = Default::default();
    wgpu::VertexState { module, entry_point: Some(entry), compilation_options, buffers: &[] }
}

pub(super) fn fragment<'a>(
    module: &'a wgpu::ShaderModule,
    entry: &'a str,
    targets: &'a [Option<wgpu::ColorTargetState>],
) -> wgpu::FragmentState<'a> {
    wgpu::FragmentState { module, entry_point: Some(entry), compilation_options: Default::default(), targets }
}

/// The state of the depth test. `writes` is whether the test writes depth.
pub(super) fn depth(compare: wgpu::CompareFunction, writes: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(writes),
        depth_compare: Some(compare),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

pub(super) fn depth_pass<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    label: &str,
    view: &wgpu::TextureView,
    load: wgpu::LoadOp<f32>,
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites<'_>>,
    occlusion_query_set: Option<&wgpu::QuerySet>,
) -> wgpu::RenderPass<'e> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some(label),
        color_attachments: &[],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes,
        occlusion_query_set,
        multiview_mask: None,
    })
}

/// The constant of the vertex shaders that read polygons: the length of a chunk.
pub(super) fn with_chunk_len<'a>(
    vertex: wgpu::VertexState<'a>,
    constants: &'a [(&'a str, f64)],
) -> wgpu::VertexState<'a> {
    let compilation_options = wgpu::PipelineCompilationOptions { constants, ..Default::default() };
    wgpu::VertexState { compilation_options, ..vertex }
}

/// A uniform buffer of at least `bytes` bytes. With 0, the shader determines the size.
pub(super) fn uniform(bytes: u64) -> wgpu::BindingType {
    buffer_binding(wgpu::BufferBindingType::Uniform, bytes)
}

/// A buffer that the shader only reads; `bytes` as in [`uniform`].
pub(super) fn read(bytes: u64) -> wgpu::BindingType {
    buffer_binding(wgpu::BufferBindingType::Storage { read_only: true }, bytes)
}

pub(super) fn written() -> wgpu::BindingType {
    buffer_binding(wgpu::BufferBindingType::Storage { read_only: false }, 0)
}

fn buffer_binding(ty: wgpu::BufferBindingType, bytes: u64) -> wgpu::BindingType {
    let min_binding_size = wgpu::BufferSize::new(bytes);
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size }
}

pub(super) fn texture(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    let view_dimension = wgpu::TextureViewDimension::D2;
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

pub(super) fn samples(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    let view_dimension = wgpu::TextureViewDimension::D2;
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: true }
}
