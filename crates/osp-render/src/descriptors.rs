//! Constructors of wgpu objects, without the fields that are the same in all of them.

use super::formats::DEPTH_FORMAT;

pub(super) fn module(device: &wgpu::Device, label: &str, wgsl: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(label),
        source: wgpu::ShaderSource::Wgsl(wgsl.into()),
    })
}

pub(super) fn pipeline_layout(
    device: &wgpu::Device,
    label: &str,
    bind_group_layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::PipelineLayout {
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts,
        immediate_size: 0,
    })
}

/// A pipeline that runs a compute shader from its entry point.
pub(super) fn compute_pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    entry: &str,
) -> wgpu::ComputePipeline {
    device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(layout),
        module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        cache: None,
    })
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

/// A pipeline that draws triangles, seen from both sides, with `samples` samples a pixel.
pub(super) fn render_pipeline(
    device: &wgpu::Device,
    label: &str,
    layout: Option<&wgpu::PipelineLayout>,
    vertex: wgpu::VertexState<'_>,
    depth_stencil: Option<wgpu::DepthStencilState>,
    samples: u32,
    fragment: Option<wgpu::FragmentState<'_>>,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
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

/// Begins a pass without colours.
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

/// An uninitialised buffer of this many bytes.
pub(super) fn buffer(
    device: &wgpu::Device,
    label: &str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// An uninitialised texture of this size, without smaller levels.
pub(super) fn new_texture(
    device: &wgpu::Device,
    label: &str,
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
    (width, height): (u32, u32),
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
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

/// A view of the whole of a new texture; see [`new_texture`].
pub(super) fn image(
    device: &wgpu::Device,
    label: &str,
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
    size: (u32, u32),
) -> wgpu::TextureView {
    new_texture(device, label, format, sample_count, usage, size).create_view(&Default::default())
}

pub(super) const DRAWN_AND_READ: wgpu::TextureUsages =
    wgpu::TextureUsages::RENDER_ATTACHMENT.union(wgpu::TextureUsages::TEXTURE_BINDING);

/// Resources bound in the order of their numbers.
pub(super) fn bind_group(
    device: &wgpu::Device,
    label: &str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let resources = (0..).zip(resources.iter().cloned());
    let entries: Vec<_> =
        resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// The layout of a group of bindings, in the order of their numbers.
pub(super) fn bind_layout(
    device: &wgpu::Device,
    label: &str,
    bindings: &[(wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entries: Vec<_> = (0..)
        .zip(bindings)
        .map(|(binding, &(visibility, ty))| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty,
            count: None,
        })
        .collect();
    device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A uniform buffer of at least `bytes` bytes. With 0, the shader determines the size.
pub(super) fn uniform(bytes: u64) -> wgpu::BindingType {
    buffer_binding(wgpu::BufferBindingType::Uniform, bytes)
}

/// A buffer that the shader only reads; `bytes` as in [`uniform`].
pub(super) fn read(bytes: u64) -> wgpu::BindingType {
    buffer_binding(wgpu::BufferBindingType::Storage { read_only: true }, bytes)
}

/// A buffer that the shader reads and writes.
pub(super) fn written() -> wgpu::BindingType {
    buffer_binding(wgpu::BufferBindingType::Storage { read_only: false }, 0)
}

fn buffer_binding(ty: wgpu::BufferBindingType, bytes: u64) -> wgpu::BindingType {
    let min_binding_size = wgpu::BufferSize::new(bytes);
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size }
}

/// A two-dimensional texture with one sample a texel.
pub(super) fn texture(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    let view_dimension = wgpu::TextureViewDimension::D2;
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

/// A two-dimensional texture with several samples a texel.
pub(super) fn samples(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    let view_dimension = wgpu::TextureViewDimension::D2;
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: true }
}
