use super::{
    queries::QueryPipelines,
    samples,
    span::{PARAMS_BYTES, SPAN_BYTES},
};
use crate::{Gpu, RenderError, gpu_scene::GpuScene, shaders};

/// Storage buffers that the largest of the compute shaders has; as many as every adapter must offer have it.
const STORAGE_BUFFERS: u32 = 7;

/// What culling by a hierarchical depth buffer needs once, for all views.
#[derive(Debug)]
pub(in super::super) struct Hzb {
    pub(super) recall: wgpu::ComputePipeline,
    pub(super) base: wgpu::ComputePipeline,
    pub(super) reduce: wgpu::ComputePipeline,
    pub(super) test: wgpu::ComputePipeline,
    pub(super) remember: wgpu::ComputePipeline,
    pub(super) test_transparent: wgpu::ComputePipeline,
    pub(super) count: wgpu::ComputePipeline,
    pub(super) scan: wgpu::ComputePipeline,
    pub(super) scatter: wgpu::ComputePipeline,
    pub(super) recall_layout: wgpu::BindGroupLayout,
    pub(super) pyramid_layout: wgpu::BindGroupLayout,
    pub(super) test_layout: wgpu::BindGroupLayout,
    pub(super) compact_layout: wgpu::BindGroupLayout,
    pub(super) queries: QueryPipelines,
    chunk_layout: wgpu::BindGroupLayout,
    /// One for each chunk of the scene, and what it binds.
    chunks: Vec<(wgpu::Buffer, wgpu::BindGroup)>,
}

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

/// Whether the samples of a pixel are at their usual places, for a caller that cannot wait.
///
/// # Errors
/// The device is lost or the driver reported something.
pub(in super::super) async fn samples_are_in_place_later(gpu: &Gpu) -> Result<bool, RenderError> {
    match missing(gpu) {
        // Then nobody asks.
        Some(_) => Ok(false),
        None => samples::are_in_place_later(gpu).await,
    }
}

impl Hzb {
    /// The pipelines.
    ///
    /// # Errors
    /// The adapter lacks something.
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
        use Bound::{Depth, Read, Span, Uniform, Write};
        let view = Uniform(80);
        let params = Uniform(PARAMS_BYTES);
        let recall_layout = layout(gpu, "recall", &[Span, Read, Read, Write, Write]);
        let pyramid_layout = layout(gpu, "depth pyramid", &[Span, params, Depth, Write]);
        let test_layout = layout(
            gpu,
            "occlusion test",
            &[Span, params, view, Read, Write, Write, Read, Write, Write, Depth],
        );
        let compact_layout = layout(gpu, "compaction", &[Span, Read, Write, Write, Write]);
        let chunk_layout = layout(gpu, "polygon chunk", &[Read]);
        let pyramid = [Some(&pyramid_layout)];
        let test = [Some(&test_layout), Some(&chunk_layout)];
        let compact = [Some(&compact_layout)];
        Ok(Self {
            recall: compute(gpu, shaders::HZB_RECALL, &[Some(&recall_layout)], "recall"),
            base: compute(gpu, shaders::HZB_PYRAMID, &pyramid, "base"),
            reduce: compute(gpu, shaders::HZB_PYRAMID, &pyramid, "reduce"),
            test: compute(gpu, shaders::HZB_TEST, &test, "test"),
            remember: compute(gpu, shaders::HZB_TEST, &test, "remember"),
            test_transparent: compute(gpu, shaders::HZB_TEST, &test, "test_transparent"),
            count: compute(gpu, shaders::HZB_COMPACT, &compact, "count"),
            scan: compute(gpu, shaders::HZB_COMPACT, &compact, "scan"),
            scatter: compute(gpu, shaders::HZB_COMPACT, &compact, "scatter"),
            recall_layout,
            pyramid_layout,
            test_layout,
            compact_layout,
            queries: QueryPipelines::new(gpu),
            chunk_layout,
            chunks: Vec::new(),
        })
    }

    /// Follows the scene as it grows, and as it gives memory back.
    pub(in super::super) fn follow(&mut self, gpu: &Gpu, scene: &GpuScene) {
        for (i, buffer) in scene.chunks().iter().enumerate() {
            if self.chunks.get(i).is_some_and(|(bound, _)| bound == buffer) {
                continue;
            }
            let group = bind(gpu, "polygon chunk", &self.chunk_layout, &[buffer.as_entire_binding()]);
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
    let flags = gpu.adapter().get_downlevel_capabilities().flags;
    let limits = gpu.device().limits();
    if !flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS) {
        return Some("compute shaders");
    }
    if !flags.contains(wgpu::DownlevelFlags::INDIRECT_EXECUTION) {
        return Some("indirect draw calls");
    }
    if !gpu.reads_samples() {
        return Some("shaders that read the depth of each sample (drive it by Vulkan, not OpenGL)");
    }
    if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
        return Some("seven storage buffers in a compute shader");
    }
    (limits.max_compute_invocations_per_workgroup < 256 || limits.max_compute_workgroup_size_x < 256)
        .then_some("compute workgroups of 256")
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
