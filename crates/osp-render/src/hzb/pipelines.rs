use super::{queries::QueryPipelines, samples, span};
use crate::{
    Gpu, RenderError,
    descriptors::{read, samples as texels, uniform, written},
    gpu_scene::GpuScene,
    shaders,
};

/// Largest number of storage buffers of a compute shader. An adapter must support this number.
const STORAGE_BUFFERS: u32 = 8;

#[derive(Debug)]
pub(in super::super) struct Hzb {
    pub(super) recall: wgpu::ComputePipeline,
    pub(super) base: wgpu::ComputePipeline,
    pub(super) reduce: wgpu::ComputePipeline,
    pub(super) test: wgpu::ComputePipeline,
    pub(super) refine: wgpu::ComputePipeline,
    pub(super) remember: wgpu::ComputePipeline,
    pub(super) refine_remembered: wgpu::ComputePipeline,
    pub(super) test_transparent: wgpu::ComputePipeline,
    pub(super) count: wgpu::ComputePipeline,
    pub(super) scan: wgpu::ComputePipeline,
    pub(super) scatter: wgpu::ComputePipeline,
    pub(super) recall_layout: wgpu::BindGroupLayout,
    pub(super) pyramid_layout: wgpu::BindGroupLayout,
    pub(super) test_layout: wgpu::BindGroupLayout,
    pub(super) transparent_layout: wgpu::BindGroupLayout,
    pub(super) compact_layout: wgpu::BindGroupLayout,
    pub(super) queries: QueryPipelines,
    chunk_layout: wgpu::BindGroupLayout,
    chunks: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
}

impl Gpu {
    /// Measures whether samples have their standard positions, which occlusion culling requires. Without this call, the
    /// first call of `Renderer::set_occlusion` waits for the measurement. A page in a browser cannot wait.
    pub async fn learn(&self) -> Result<(), RenderError> {
        let are_in_place = match missing(self) {
            // Occlusion culling is not available, so the value is never read.
            Some(_) => false,
            None => samples::are_in_place_later(self).await?,
        };
        self.samples_in_place.get_or_init(|| are_in_place);
        Ok(())
    }
}

impl Hzb {
    pub(in super::super) fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        let missing = match missing(gpu) {
            None if !gpu.samples_in_place().map_or_else(|| samples::are_in_place(gpu), Ok)? => {
                Some("samples at the usual places of a pixel")
            }
            missing => missing,
        };
        if let Some(lacks) = missing {
            return Err(RenderError::NoOcclusion { adapter: gpu.name(), lacks });
        }
        let (span, params, view) = (span::binding(), uniform(span::PARAMS_BYTES), uniform(80));
        let (read, write, depth) = (read(0), written(), texels(wgpu::TextureSampleType::Depth));
        let layout = |label, types: &[_]| gpu.compute_layout(label, types);
        let recall_layout = layout("recall", &[span, read, read, write, write]);
        let pyramid_layout = layout("depth pyramid", &[span, params, depth, write]);
        let test_layout =
            layout("occlusion test", &[span, params, view, read, write, write, read, write, depth]);
        let transparent_layout = layout("transparent polygons", &[write, write]);
        let compact_layout = layout("compaction", &[span, read, read, write, write, write]);
        let chunk_layout = layout("polygon chunk", &[read]);
        let pyramid = [Some(&pyramid_layout)];
        let test = [Some(&test_layout), Some(&chunk_layout)];
        let transparent = [Some(&test_layout), Some(&chunk_layout), Some(&transparent_layout)];
        let compact = [Some(&compact_layout)];
        let compute = |wgsl, layouts: &[_], entry| gpu.compute_pipeline(wgsl, layouts, entry);
        Ok(Self {
            recall: compute(shaders::HZB_RECALL, &[Some(&recall_layout)], "recall"),
            base: compute(shaders::HZB_PYRAMID, &pyramid, "base"),
            reduce: compute(shaders::HZB_PYRAMID, &pyramid, "reduce"),
            test: compute(shaders::HZB_TEST, &test, "test"),
            refine: compute(shaders::HZB_TEST, &test, "refine"),
            remember: compute(shaders::HZB_TEST, &test, "remember"),
            refine_remembered: compute(shaders::HZB_TEST, &test, "refine_remembered"),
            test_transparent: compute(shaders::HZB_TEST, &transparent, "test_transparent"),
            count: compute(shaders::HZB_COMPACT, &compact, "count"),
            scan: compute(shaders::HZB_COMPACT, &compact, "scan"),
            scatter: compute(shaders::HZB_COMPACT, &compact, "scatter"),
            recall_layout,
            pyramid_layout,
            test_layout,
            transparent_layout,
            compact_layout,
            queries: QueryPipelines::new(gpu),
            chunk_layout,
            chunks: Vec::new(),
        })
    }

    /// Creates bind groups for chunks that are new or were replaced.
    pub(in super::super) fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) {
        for (i, buffer) in scene.chunks.buffers.iter().enumerate() {
            if self.chunks.get(i).is_some_and(|(bound, _)| bound == buffer) {
                continue;
            }
            let group = gpu.bind_group("polygon chunk", &self.chunk_layout, &[buffer.as_entire_binding()]);
            match self.chunks.get_mut(i) {
                Some(chunk) => *chunk = (buffer.clone(), group),
                None => self.chunks.push((buffer.clone(), group)),
            }
        }
    }

    pub(super) fn chunk(&self, number: usize) -> Option<&wgpu::BindGroup> {
        self.chunks.get(number).map(|(_, group)| group)
    }
}

fn missing(gpu: &Gpu) -> Option<&'static str> {
    let flags = gpu.adapter.get_downlevel_capabilities().flags;
    let limits = gpu.device.limits();
    if !flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
        return Some("compute shaders");
    }
    if !flags.contains(wgpu::DownlevelFlags::INDIRECT_EXECUTION) {
        return Some("indirect draw calls");
    }
    if !gpu.reads_samples() {
        return Some("shaders that read the depth of each sample (use Vulkan, not OpenGL)");
    }
    if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
        return Some("eight storage buffers in a compute shader");
    }
    (limits.max_compute_invocations_per_workgroup < 256 || limits.max_compute_workgroup_size_x < 256)
        .then_some("compute workgroups of 256")
}
