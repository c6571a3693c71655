use super::bindings::{Bound, compute, layout};
use crate::{Gpu, descriptors, formats::SAMPLES, shaders};

/// Shared resources of queries, for all views.
#[derive(Debug)]
pub(super) struct QueryPipelines {
    pub(super) boxes_layout: wgpu::BindGroupLayout,
    pub(super) apply_layout: wgpu::BindGroupLayout,
    pub(super) boxes: wgpu::RenderPipeline,
    pub(super) apply: wgpu::ComputePipeline,
}

impl QueryPipelines {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let [uniform, read] = [descriptors::uniform(0), descriptors::read(0)];
        let bindings = [uniform, uniform, read].map(|ty| (wgpu::ShaderStages::VERTEX, ty));
        let boxes_layout = descriptors::bind_layout(device, "boxes", &bindings);
        let module = descriptors::module(device, "boxes", shaders::QUERY_BOX);
        let pipeline_layout = descriptors::pipeline_layout(device, "boxes", &[Some(&boxes_layout)]);
        let vertex = descriptors::vertex(&module, "vertex");
        let depth = Some(descriptors::depth(wgpu::CompareFunction::GreaterEqual, false));
        let layout_of_boxes = Some(&pipeline_layout);
        let boxes =
            descriptors::render_pipeline(device, "boxes", layout_of_boxes, vertex, depth, SAMPLES, None);
        let apply_layout = {
            use Bound::{Read, Span, Write};
            layout(gpu, "queries", &[Span, Read, Read, Read, Write, Write])
        };
        let apply = compute(gpu, shaders::QUERY_APPLY, &[Some(&apply_layout)], "apply");
        Self { boxes_layout, apply_layout, boxes, apply }
    }
}
