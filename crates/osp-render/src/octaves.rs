/// Heights of the pictures from which bloom is summed, pixels. Each height is about a third of the one before.
pub(super) const HEIGHTS: [u32; 4] = [64, 21, 7, 2];

/// Resources for finishing the picture of one target.
#[derive(Debug)]
pub(super) struct Octaves {
    pub(super) resolved: wgpu::BindGroup,
    pub(super) octaves: [Octave; HEIGHTS.len()],
    pub(super) all: wgpu::BindGroup,
    /// The bind group of the samples; `None` if shaders cannot read samples.
    pub(super) samples: Option<wgpu::BindGroup>,
}

/// A downscaled picture, and a second texture for the first pass of its separable blur.
#[derive(Debug)]
pub(super) struct Octave {
    pub(super) size: (u32, u32),
    pub(super) views: [wgpu::TextureView; 2],
    pub(super) sources: [wgpu::BindGroup; 2],
}
