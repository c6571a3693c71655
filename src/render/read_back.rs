use super::{Gpu, Image, RenderError};

/// Copies a texture of four bytes a pixel to memory.
pub(super) fn read_back(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Image, RenderError> {
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

/// Copies a buffer to memory.
pub(super) fn read_buffer(gpu: &Gpu, from: &wgpu::Buffer, bytes: u64) -> Result<Vec<u8>, RenderError> {
    if bytes == 0 {
        return Ok(Vec::new());
    }
    let buffer = gpu.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: bytes,
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device().create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(from, 0, &buffer, 0, bytes);
    gpu.queue().submit([encoder.finish()]);
    // The outcome shows in `get_mapped_range`.
    buffer.slice(..).map_async(wgpu::MapMode::Read, |_| {});
    gpu.wait()?;
    let bytes =
        buffer.slice(..).get_mapped_range().map_err(|error| RenderError::Device(error.to_string()))?;
    Ok(bytes.to_vec())
}
