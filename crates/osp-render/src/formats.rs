//! Formats shared by targets and pipelines.

/// Samples a pixel.
pub const SAMPLES: u32 = 4;
/// Format of the drawn colours: sRGB numbers, as on a screen, but without bounds.
pub(super) const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
/// The finished picture: sRGB numbers from 0 to 1.
pub(super) const PICTURE_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Floating point, for reversed depth.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
