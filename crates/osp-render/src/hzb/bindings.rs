//! Compute pipelines and their bindings.

use super::span::SPAN_BYTES;
use crate::{Gpu, descriptors};

#[derive(Clone, Copy)]
pub(super) enum Bound {
    /// A uniform buffer of this number of bytes.
    Uniform(u64),
    /// One [`Span`](super::span::Span) in a uniform buffer, selected by a dynamic offset.
    Span,
    Read,
    Write,
    Depth,
}

pub(super) fn layout(gpu: &Gpu, label: &'static str, bounds: &[Bound]) -> wgpu::BindGroupLayout {
    let types = bounds.iter().map(|bound| match *bound {
        Bound::Uniform(bytes) => descriptors::uniform(bytes),
        Bound::Span => wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: true,
            min_binding_size: wgpu::BufferSize::new(SPAN_BYTES),
        },
        Bound::Read => descriptors::read(0),
        Bound::Write => descriptors::written(),
        Bound::Depth => descriptors::samples(wgpu::TextureSampleType::Depth),
    });
    let bindings: Vec<_> = types.map(|ty| (wgpu::ShaderStages::COMPUTE, ty)).collect();
    descriptors::bind_layout(&gpu.device, label, &bindings)
}

pub(super) fn compute(
    gpu: &Gpu,
    source: &'static str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    entry: &'static str,
) -> wgpu::ComputePipeline {
    let module = descriptors::module(&gpu.device, entry, source);
    let layout = descriptors::pipeline_layout(&gpu.device, entry, layouts);
    descriptors::compute_pipeline(&gpu.device, &module, &layout, entry)
}
