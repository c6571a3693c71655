use super::{Gpu, RenderError};

/// The surface of a window, to which frames are presented. It follows the window's size.
#[derive(Debug)]
pub struct WindowSurface {
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    /// Width and height, pixels; zero while the window is minimised.
    pub size: (u32, u32),
    is_stale: bool,
}

#[derive(Debug)]
pub enum Acquired {
    /// A frame: draw into it, then present it.
    Frame(wgpu::SurfaceTexture),
    /// Nothing can be shown now, because the window is minimised, covered or busy. Skip the frame.
    Nothing,
    /// The surface is lost. Make a new surface for the window; pictures drawn so far are not affected.
    Lost,
}

impl WindowSurface {
    /// Makes a window's surface ready for drawing.
    ///
    /// # Errors
    /// The adapter cannot draw on the surface.
    pub fn new(
        gpu: &Gpu,
        surface: wgpu::Surface<'static>,
        width: u32,
        height: u32,
    ) -> Result<Self, RenderError> {
        let capabilities = surface.get_capabilities(&gpu.adapter);
        // The user interface blends encoded values, so a format that encodes as sRGB would make it paler.
        let format = capabilities
            .formats
            .iter()
            .copied()
            .find(|format| {
                matches!(format, wgpu::TextureFormat::Rgba8Unorm | wgpu::TextureFormat::Bgra8Unorm)
            })
            .or_else(|| capabilities.formats.first().copied());
        let config = surface.get_default_config(&gpu.adapter, width.max(1), height.max(1));
        let (Some(format), Some(mut config)) = (format, config) else {
            return Err(RenderError::Surface(format!("{} cannot show anything on it", gpu.name())));
        };
        config.format = format;
        config.present_mode = wgpu::PresentMode::AutoVsync;
        // At most one frame is queued, for low latency.
        config.desired_maximum_frame_latency = 1;
        Ok(Self { surface, config, size: (width, height), is_stale: true })
    }

    pub fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    pub fn resize(&mut self, width: u32, height: u32) {
        if self.size != (width, height) {
            self.size = (width, height);
            self.is_stale = true;
        }
    }

    /// Sets whether a frame waits for the display, so that no frame is torn. Initially frames wait.
    pub fn set_waits(&mut self, waits: bool) {
        let mode = if waits { wgpu::PresentMode::AutoVsync } else { wgpu::PresentMode::AutoNoVsync };
        if self.config.present_mode != mode {
            self.config.present_mode = mode;
            self.is_stale = true;
        }
    }

    /// Gets the next frame to draw into.
    ///
    /// # Errors
    /// The device is lost or refused the surface.
    pub fn acquire(&mut self, gpu: &Gpu) -> Result<Acquired, RenderError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        let (width, height) = self.size;
        if width == 0 || height == 0 {
            return Ok(Acquired::Nothing);
        }
        if self.is_stale {
            (self.config.width, self.config.height) = (width.min(limit), height.min(limit));
            self.surface.configure(&gpu.device, &self.config);
            self.is_stale = false;
            gpu.check()?;
        }
        Ok(match self.surface.get_current_texture() {
            wgpu::CurrentSurfaceTexture::Success(frame) => Acquired::Frame(frame),
            wgpu::CurrentSurfaceTexture::Suboptimal(frame) => {
                self.is_stale = true;
                Acquired::Frame(frame)
            }
            wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => Acquired::Nothing,
            wgpu::CurrentSurfaceTexture::Outdated => {
                self.is_stale = true;
                Acquired::Nothing
            }
            wgpu::CurrentSurfaceTexture::Lost => Acquired::Lost,
            wgpu::CurrentSurfaceTexture::Validation => {
                gpu.check()?;
                return Err(RenderError::Surface("it does not fit the device".to_owned()));
            }
        })
    }
}
