//! Compute pipelines and what they bind.

use super::span::SPAN_BYTES;
use crate::Gpu;

/// What a binding of a compute shader is.
#[derive(Clone, Copy)]
pub(super) enum Bound {
    /// A uniform buffer of so many bytes.
    Uniform(u64),
    /// One of several in a uniform buffer.
    Span,
    Read,
    Write,
    Depth,
}

pub(super) fn layout(gpu: &Gpu, label: &'static str, bounds: &[Bound]) -> wgpu::BindGroupLayout {
    let entry = |(binding, bound): (usize, &Bound)| {
        let buffer = |ty, has_dynamic_offset, bytes| wgpu::BindingType::Buffer {
            ty,
            has_dynamic_offset,
            // Of storage buffers it is what the shader says.
            min_binding_size: wgpu::BufferSize::new(bytes),
        };
        let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
        let ty = match *bound {
            Bound::Uniform(bytes) => buffer(wgpu::BufferBindingType::Uniform, false, bytes),
            Bound::Span => buffer(wgpu::BufferBindingType::Uniform, true, SPAN_BYTES),
            Bound::Read => buffer(storage(true), false, 0),
            Bound::Write => buffer(storage(false), false, 0),
            Bound::Depth => wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Depth,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: true,
            },
        };
        let visibility = wgpu::ShaderStages::COMPUTE;
        wgpu::BindGroupLayoutEntry { binding: binding as u32, visibility, ty, count: None }
    };
    gpu.device().create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some(label),
        entries: &bounds.iter().enumerate().map(entry).collect::<Vec<_>>(),
    })
}

pub(super) fn compute(
    gpu: &Gpu,
    source: &'static str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    entry: &'static str,
) -> wgpu::ComputePipeline {
    let module = gpu.device().create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(entry),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let layout = gpu.device().create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(entry),
        bind_group_layouts: layouts,
        immediate_size: 0,
    });
    gpu.device().create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(entry),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        cache: None,
    })
}

pub(super) fn bind(
    gpu: &Gpu,
    label: &'static str,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let resources = resources.iter().cloned().enumerate();
    let entries: Vec<_> = resources
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource })
        .collect();
    gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some(label),
        layout,
        entries: &entries,
    })
}
