use std::sync::Arc;

use super::{Gpu, GpuTimer, Image, Layer, RenderError, Renderer, RendererConfig, Target, ViewSlot};
use crate::{
    metrics::{Stage, StageClock},
    scene::{Change, Scene},
    visibility::View,
};

/// What drawing a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawTimes {
    /// Sending new polygons, sorting the visible ones, sending their numbers.
    pub prepare: Stage,
    /// From submission to completion.
    pub draw: Stage,
    /// What the GPU itself says that it drew; `None` where it cannot tell.
    pub gpu_ns: Option<u64>,
    /// Bytes sent for polygons that are new or have moved.
    pub polygon_bytes: u64,
    /// Bytes sent for the view and the numbers of the polygons to draw.
    pub list_bytes: u64,
    /// Draw calls.
    pub draw_calls: u64,
}

/// Draws without a window, a frame at a time, each one to its end.
#[derive(Debug)]
pub struct Offscreen {
    renderer: Renderer,
    slot: ViewSlot,
    target: Target,
    timer: GpuTimer,
    clock: StageClock,
}

impl Offscreen {
    /// A drawer of pictures of this size on the best adapter there is.
    ///
    /// # Errors
    /// There is no adapter, or the size is not possible.
    pub fn new(width: u32, height: u32) -> Result<Self, RenderError> {
        Self::on(Arc::new(Gpu::headless()?), width, height, &RendererConfig::default())
    }

    /// A drawer on an adapter.
    ///
    /// # Errors
    /// The size is not possible.
    pub fn on(gpu: Arc<Gpu>, width: u32, height: u32, config: &RendererConfig) -> Result<Self, RenderError> {
        let target = Target::new(&gpu, width, height)?;
        let timer = GpuTimer::new(&gpu);
        let renderer = Renderer::new(gpu, config);
        renderer.gpu().check()?;
        let slot = renderer.create_view_slot();
        Ok(Self { renderer, slot, target, timer, clock: StageClock::default() })
    }

    /// The adapter and device.
    pub fn gpu(&self) -> &Gpu {
        self.renderer.gpu()
    }

    /// Width divided by height of the pictures.
    pub fn aspect(&self) -> f32 {
        self.target.aspect()
    }

    /// Notes what has changed; to be called with the changes of every frame, drawn or not.
    pub fn follow(&mut self, changes: &[Change]) {
        self.renderer.follow(changes);
    }

    /// Draws a frame and waits until it is done. The picture is as wide as the view says: see
    /// [`View::with_aspect`].
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub fn draw(
        &mut self,
        scene: &Scene,
        view: &View,
        layers: &[Layer<'_>],
    ) -> Result<DrawTimes, RenderError> {
        let gpu = Arc::clone(self.renderer.gpu());
        let stage = self.clock.start();
        let polygon_bytes = self.renderer.send(scene);
        let list_bytes = self.renderer.prepare(&mut self.slot, scene, view, layers);
        let mut encoder = gpu.device().create_command_encoder(&Default::default());
        self.renderer.encode(&mut encoder, &self.target, &self.slot, &mut self.timer, |_| {});
        let commands = encoder.finish();
        let prepare = self.clock.since(stage);

        let stage = self.clock.start();
        gpu.queue().submit([commands]);
        gpu.wait()?;
        let draw = self.clock.since(stage);

        self.timer.submitted();
        if self.timer.is_available() {
            gpu.wait()?;
        }
        let draw_calls = self.slot.order.runs().len() as u64;
        Ok(DrawTimes { prepare, draw, gpu_ns: self.timer.take_ns(), polygon_bytes, list_bytes, draw_calls })
    }

    /// The picture that was drawn last.
    ///
    /// # Errors
    /// The device is lost or the driver reported something.
    pub fn image(&self) -> Result<Image, RenderError> {
        read_back(self.gpu(), self.target.picture())
    }

    /// The renderer.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }
}

/// Copies a texture of four bytes a pixel to memory.
fn read_back(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Image, RenderError> {
    let (width, height) = (texture.width(), texture.height());
    let row_bytes = width * 4;
    let padded_row_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(padded_row_bytes) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded_row_bytes),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
    gpu.queue().submit([encoder.finish()]);
    // The outcome shows in `get_mapped_range`.
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.wait()?;
    let bytes =
        buffer.slice(..).get_mapped_range().map_err(|error| RenderError::Device(error.to_string()))?;
    let rows = bytes.chunks_exact(padded_row_bytes as usize);
    let rgba = rows.flat_map(|row| &row[..row_bytes as usize]).copied().collect();
    Ok(Image::new(width, height, rgba))
}
