use crate::{Gpu, descriptors};

/// Number of invocations of a workgroup. Each invocation processes one [`Handle`](crate::run::Handle).
pub(super) const LANES: u32 = 256;

pub(super) fn create(gpu: &Gpu, label: &'static str, bytes: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
    descriptors::buffer(&gpu.device, label, bytes, usage)
}

/// Replaces a buffer with less than `bytes` bytes by a larger buffer of zeros. Returns whether the buffer was
/// replaced.
pub(super) fn grow(gpu: &Gpu, buffer: &mut wgpu::Buffer, bytes: u64) -> bool {
    if bytes <= buffer.size() {
        return false;
    }
    *buffer = create(gpu, "grown", bytes.next_power_of_two(), buffer.usage());
    true
}
