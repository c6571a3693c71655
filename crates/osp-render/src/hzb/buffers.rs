use crate::{Gpu, descriptors};

/// Lanes of the workgroups that take a handle each.
pub(super) const LANES: u32 = 256;

pub(super) fn create(gpu: &Gpu, label: &'static str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    descriptors::buffer(gpu.device(), label, bytes, usage)
}

/// Makes a buffer hold this number of bytes; a larger one is empty (all zero). Returns whether it is another.
pub(super) fn grow(gpu: &Gpu, buffer: &mut wgpu::Buffer, bytes: u64) -> bool {
    if bytes <= buffer.size() {
        return false;
    }
    *buffer = create(gpu, "grown", bytes.next_power_of_two(), buffer.usage());
    true
}
