/// The images of light at half resolution, and the resources that passes bind.
#[derive(Debug)]
pub(super) struct HalfImages {
    pub(super) samples: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    pub(super) scene_depth: wgpu::BindGroup,
    pub(super) light: wgpu::BindGroup,
}
