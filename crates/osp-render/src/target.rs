use std::sync::OnceLock;

use super::{
    Gpu, Image, RenderError, descriptors,
    finish::Octaves,
    formats::{COLOR_FORMAT, DEPTH_FORMAT, PICTURE_FORMAT, SAMPLES},
    read_back::{ComingImage, begin_read_back},
};

/// The textures of one view: multisampled colours and depth, the resolved colours, which may exceed 1, and the finished
/// picture, which is saved or shown.
#[derive(Debug)]
pub struct Target {
    width: u32,
    height: u32,
    pub(super) samples: wgpu::TextureView,
    pub(super) depth: wgpu::TextureView,
    /// The drawn colours, one value a pixel.
    pub(super) resolved: wgpu::TextureView,
    pub picture: wgpu::Texture,
    /// The finished picture, for a shader that shows it.
    pub picture_view: wgpu::TextureView,
    /// Resources for finishing the picture, created with the first finished picture.
    pub(super) octaves: OnceLock<Octaves>,
}

impl Target {
    /// A target of `width` x `height` pixels.
    ///
    /// # Errors
    /// A side is zero or longer than the adapter allows.
    pub fn new(gpu: &Gpu, width: u32, height: u32) -> Result<Self, RenderError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if width == 0 || height == 0 || width > limit || height > limit {
            return Err(RenderError::Size { width, height, limit });
        }
        let texture = |label, format, sample_count, usage| {
            gpu.texture(label, format, sample_count, usage, (width, height))
        };
        let sampled = descriptors::DRAWN_AND_READ;
        let of_samples = if gpu.reads_samples() { sampled } else { wgpu::TextureUsages::RENDER_ATTACHMENT };
        let samples = texture("samples", COLOR_FORMAT, SAMPLES, of_samples);
        let depth = texture("depth", DEPTH_FORMAT, SAMPLES, of_samples);
        let resolved = texture("resolved", COLOR_FORMAT, 1, sampled);
        let picture = texture("picture", PICTURE_FORMAT, 1, sampled | wgpu::TextureUsages::COPY_SRC);
        gpu.check()?;
        Ok(Self {
            width,
            height,
            samples: samples.create_view(&Default::default()),
            depth: depth.create_view(&Default::default()),
            resolved: resolved.create_view(&Default::default()),
            picture_view: picture.create_view(&Default::default()),
            picture,
            octaves: OnceLock::new(),
        })
    }

    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// Width divided by height.
    pub fn aspect(&self) -> f32 {
        self.width as f32 / self.height as f32
    }

    pub fn image(&self, gpu: &Gpu) -> Result<Image, RenderError> {
        self.image_later(gpu).wait(gpu)
    }

    /// Does the same as [`Target::image`], for a caller that cannot wait. The picture is available later.
    pub fn image_later(&self, gpu: &Gpu) -> ComingImage {
        begin_read_back(gpu, &self.picture)
    }

    /// Begins a pass that clears the target's colours and draws into it.
    pub(super) fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        background: wgpu::Color,
        depth: DepthBefore,
        timestamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'e> {
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.samples,
                depth_slice: None,
                resolve_target: Some(&self.resolved),
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(background), store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: match depth {
                        DepthBefore::Nothing | DepthBefore::NothingAndKept => FARTHEST,
                        DepthBefore::Kept => wgpu::LoadOp::Load,
                    },
                    store: match depth {
                        DepthBefore::NothingAndKept => wgpu::StoreOp::Store,
                        DepthBefore::Nothing | DepthBefore::Kept => wgpu::StoreOp::Discard,
                    },
                }),
                stencil_ops: None,
            }),
            timestamp_writes: timestamps,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }

    /// Begins a pass that clears the target's depth, draws into it alone, and stores it.
    pub(super) fn begin_depth<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        timestamps: Option<wgpu::RenderPassTimestampWrites<'_>>,
    ) -> wgpu::RenderPass<'e> {
        descriptors::depth_pass(encoder, "depth", &self.depth, FARTHEST, timestamps, None)
    }
}

/// Contents of the depth texture before a pass with colours, and whether the pass stores its depth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthBefore {
    /// Depth is cleared, and not stored.
    Nothing,
    /// The depth of a pass without colours is kept, and not stored again.
    Kept,
    /// Depth is cleared, then stored for later passes.
    NothingAndKept,
}

/// Depth is reversed: 0 is the farthest.
pub(super) const FARTHEST: wgpu::LoadOp<f32> = wgpu::LoadOp::Clear(0.0);
