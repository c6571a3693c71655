//! Formats shared by targets and pipelines.

pub const SAMPLES: u32 = 4;
/// Format of the drawn colours: sRGB-encoded values, which may exceed 1.
pub(super) const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// Format of the finished picture: sRGB-encoded values from 0 to 1.
pub(super) const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Format of depth: floating point, for reversed depth.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
