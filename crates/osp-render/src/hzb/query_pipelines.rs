use super::bindings::{Bound, compute, layout};
use crate::{
    Gpu,
    formats::{DEPTH_FORMAT, SAMPLES},
    shaders,
};

/// What queries need once, for all views.
#[derive(Debug)]
pub(super) struct QueryPipelines {
    pub(super) boxes_layout: wgpu::BindGroupLayout,
    pub(super) apply_layout: wgpu::BindGroupLayout,
    pub(super) boxes: wgpu::RenderPipeline,
    pub(super) apply: wgpu::ComputePipeline,
}

impl QueryPipelines {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let buffer = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::VERTEX,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let boxes_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("boxes"),
            entries: &[
                buffer(0, wgpu::BufferBindingType::Uniform),
                buffer(1, wgpu::BufferBindingType::Uniform),
                buffer(2, wgpu::BufferBindingType::Storage { read_only: true }),
            ],
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("boxes"),
            source: wgpu::ShaderSource::Wgsl(shaders::QUERY_BOX.into()),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("boxes"),
            bind_group_layouts: &[Some(&boxes_layout)],
            immediate_size: 0,
        });
        let boxes = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("boxes"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(false),
                depth_compare: Some(wgpu::CompareFunction::GreaterEqual),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
            fragment: None,
            multiview_mask: None,
            cache: None,
        });
        let apply_layout = {
            use Bound::{Read, Span, Write};
            layout(gpu, "queries", &[Span, Read, Read, Read, Write, Write])
        };
        let apply = compute(gpu, shaders::QUERY_APPLY, &[Some(&apply_layout)], "apply");
        Self { boxes_layout, apply_layout, boxes, apply }
    }
}
