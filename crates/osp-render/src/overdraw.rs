use super::{Gpu, RenderError, Target, descriptors, read_back::read_buffer, shaders};

/// Width and height of the pixels that a workgroup counts.
const SIDE: u32 = 8;

/// Overdraw of opaque polygons. The count of a sample is limited to 2,048.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overdraw {
    /// Number of samples that passed the depth test and were shaded, summed over all polygons. A pixel has four
    /// samples.
    pub shaded: u64,
    /// Number of samples that an opaque polygon covers in the finished picture.
    pub covered: u64,
}

impl Overdraw {
    /// Number of times that a covered sample was shaded on average, at least 1; 0 if nothing was drawn.
    pub fn factor(&self) -> f64 {
        if self.covered == 0 { 0.0 } else { self.shaded as f64 / self.covered as f64 }
    }
}

/// Sums the counts of a pass over the samples of a target.
pub(super) fn add_up(gpu: &Gpu, target: &Target) -> Result<Overdraw, RenderError> {
    if !gpu.reads_samples() {
        let lacks = "shaders that read each sample of a pixel (use Vulkan, not OpenGL)";
        return Err(RenderError::Lacks { adapter: gpu.name(), lacks });
    }
    let samples = descriptors::samples(wgpu::TextureSampleType::Float { filterable: false });
    let layout = gpu.compute_layout("overdraw", &[samples, descriptors::written()]);
    let pipeline = gpu.compute_pipeline(shaders::OVERDRAW, &[Some(&layout)], "add_up");
    let (width, height) = target.size();
    let groups = [width.div_ceil(SIDE), height.div_ceil(SIDE)];
    let bytes = u64::from(groups[0] * groups[1]) * 8;
    let sums = gpu.buffer("overdraw", bytes, descriptors::STORAGE);
    let group = gpu.bind_group(
        "overdraw",
        &layout,
        &[wgpu::BindingResource::TextureView(&target.samples), sums.as_entire_binding()],
    );
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_compute_pass(&Default::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(groups[0], groups[1], 1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    let sums = bytemuck::pod_collect_to_vec::<u8, u32>(&read_buffer(gpu, &sums, bytes)?);
    let total = |part: usize| sums.iter().skip(part).step_by(2).map(|&n| u64::from(n)).sum();
    Ok(Overdraw { shaded: total(0), covered: total(1) })
}
