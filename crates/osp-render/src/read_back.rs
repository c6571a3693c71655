use std::{
    future::poll_fn,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    task::{Poll, Waker},
};

use super::{Gpu, Image, RenderError, descriptors};

/// A picture that is being copied from the GPU.
#[derive(Debug)]
pub struct ComingImage {
    buffer: wgpu::Buffer,
    width: u32,
    height: u32,
    padded_row_bytes: u32,
    is_here: Arc<AtomicBool>,
}

impl ComingImage {
    /// The picture; `None` while it is not available yet.
    pub fn take(&self, gpu: &Gpu) -> Option<Result<Image, RenderError>> {
        if let Err(error) = gpu.check() {
            return Some(Err(error));
        }
        self.is_here.load(Ordering::Acquire).then(|| self.finish())
    }

    pub(super) fn wait(&self, gpu: &Gpu) -> Result<Image, RenderError> {
        gpu.wait()?;
        self.finish()
    }

    fn finish(&self) -> Result<Image, RenderError> {
        let bytes = self.buffer.slice(..).get_mapped_range();
        let bytes = bytes.map_err(|error| RenderError::Device(error.to_string()))?;
        let rows = bytes.chunks_exact(self.padded_row_bytes as usize);
        let rgba = rows.flat_map(|row| &row[..self.width as usize * 4]).copied().collect();
        Ok(Image::new(self.width, self.height, rgba))
    }
}

/// Starts to copy a texture of four bytes a pixel to memory.
pub(super) fn begin_read_back(gpu: &Gpu, texture: &wgpu::Texture) -> ComingImage {
    let (width, height) = (texture.width(), texture.height());
    let row_bytes = width * 4;
    let padded_row_bytes = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer =
        gpu.buffer("read back", u64::from(padded_row_bytes) * u64::from(height), descriptors::READ_BACK);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
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
    gpu.queue.submit([encoder.finish()]);
    let is_here = Arc::new(AtomicBool::new(false));
    let tell = Arc::clone(&is_here);
    // `get_mapped_range` reports a failure.
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |_| tell.store(true, Ordering::Release));
    ComingImage { buffer, width, height, padded_row_bytes, is_here }
}

/// Copies a buffer to memory, and waits for the copy.
pub(super) fn read_buffer(gpu: &Gpu, from: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, RenderError> {
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let buffer = copy_to_read(gpu, from, bytes);
    // `get_mapped_range` reports a failure.
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.wait()?;
    mapped(&buffer)
}

/// Does the same as [`read_buffer`], for a caller that cannot wait.
pub(super) async fn read_buffer_later(
    gpu: &Gpu,
    from: &wgpu::Buffer,
    bytes: u64,
) -> Result<Vec<u8>, RenderError> {
    let buffer = copy_to_read(gpu, from, bytes);
    let is_here = Arc::new(AtomicBool::new(false));
    let waiting = Arc::new(Mutex::new(None::<Waker>));
    let (tell, wake) = (Arc::clone(&is_here), Arc::clone(&waiting));
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |_| {
        tell.store(true, Ordering::Release);
        let waker = wake.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(waker) = waker {
            waker.wake();
        }
    });
    poll_fn(|context| {
        *waiting.lock().unwrap_or_else(PoisonError::into_inner) = Some(context.waker().clone());
        if is_here.load(Ordering::Acquire) { Poll::Ready(()) } else { Poll::Pending }
    })
    .await;
    gpu.check()?;
    mapped(&buffer)
}

fn mapped(buffer: &wgpu::Buffer) -> Result<Vec<u8>, RenderError> {
    let bytes =
        buffer.slice(..).get_mapped_range().map_err(|error| RenderError::Device(error.to_string()))?;
    Ok(bytes.to_vec())
}

fn copy_to_read(gpu: &Gpu, from: &wgpu::Buffer, bytes: u64) -> wgpu::Buffer {
    let buffer = gpu.buffer("read back", bytes, descriptors::READ_BACK);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(from, 0, &buffer, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    buffer
}
