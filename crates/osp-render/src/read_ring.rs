use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use super::{Gpu, descriptors};

/// Number of frames whose results may be in transfer at the same time.
pub(super) const SLOTS: usize = 4;

/// Small results of frames, in transfer from the GPU. A frame that finds no free slot has no result.
#[derive(Debug)]
pub(super) struct ReadRing {
    slots: Vec<Slot>,
    /// The slot of the frame being encoded.
    current: Option<usize>,
}

#[derive(Debug)]
struct Slot {
    buffer: wgpu::Buffer,
    bytes: u64,
    is_busy: bool,
    is_mapped: Arc<AtomicBool>,
}

impl ReadRing {
    pub(super) fn new(gpu: &Gpu, bytes: u64) -> Self {
        let slot = |_| Slot {
            buffer: gpu.buffer("results", bytes, descriptors::READ_BACK),
            bytes,
            is_busy: false,
            is_mapped: Arc::new(AtomicBool::new(false)),
        };
        Self { slots: (0..SLOTS).map(slot).collect(), current: None }
    }

    pub(super) fn capacity(&self) -> u64 {
        self.slots.first().map_or(0, |slot| slot.buffer.size())
    }

    /// Reserves a free slot for the frame being encoded; returns its number, or `None` if no slot is free.
    pub(super) fn begin(&mut self) -> Option<usize> {
        self.current = self.slots.iter().position(|slot| !slot.is_busy);
        self.current
    }

    pub(super) fn copy(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        from: &wgpu::Buffer,
        offset: u64,
        bytes: u64,
    ) {
        if let Some(at) = self.current {
            let slot = &mut self.slots[at];
            slot.bytes = bytes.min(slot.buffer.size());
            encoder.copy_buffer_to_buffer(from, offset, &slot.buffer, 0, slot.bytes);
        }
    }

    /// Begins the transfer of the frame's result. Call it after submission.
    pub(super) fn submitted(&mut self) {
        if let Some(at) = self.current.take() {
            let slot = &mut self.slots[at];
            slot.is_busy = true;
            let is_mapped = Arc::clone(&slot.is_mapped);
            slot.buffer.slice(..slot.bytes).map_async(wgpu::MapMode::Read, move |outcome| {
                is_mapped.store(outcome.is_ok(), Ordering::Release)
            });
        }
    }

    /// Calls `give` with each result that became available since the last call, and with the number of its slot.
    pub(super) fn take(&mut self, mut give: impl FnMut(usize, &[u8])) {
        for (number, slot) in self.slots.iter_mut().enumerate() {
            if !slot.is_mapped.swap(false, Ordering::Acquire) {
                continue;
            }
            slot.is_busy = false;
            if let Ok(bytes) = slot.buffer.slice(..slot.bytes).get_mapped_range() {
                give(number, &bytes);
            }
            slot.buffer.unmap();
        }
    }
}
