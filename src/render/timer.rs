use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

use super::Gpu;

/// Frames whose times may be on their way at once.
const SLOTS: u32 = 4;
/// A time stamp is 8 bytes; where a query result goes has to be a multiple of this.
const ALIGNMENT: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;

/// How long the GPU took for a pass, by time stamps; says nothing where the adapter has none.
#[derive(Debug)]
pub struct GpuTimer {
    queries: Option<Queries>,
    period_ns: f32,
}

#[derive(Debug)]
struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    slots: Vec<Slot>,
    /// The slot of the frame being encoded.
    current: Option<usize>,
}

#[derive(Debug)]
struct Slot {
    read_back: wgpu::Buffer,
    is_busy: bool,
    is_mapped: Arc<AtomicBool>,
}

impl GpuTimer {
    /// A timer.
    pub fn new(gpu: &Gpu) -> Self {
        let device = gpu.device();
        let queries = device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Queries {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * SLOTS,
            }),
            resolved: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass times"),
                size: u64::from(SLOTS) * ALIGNMENT,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            slots: (0..SLOTS).map(|_| Slot::new(device)).collect(),
            current: None,
        });
        Self { queries, period_ns: gpu.queue().get_timestamp_period() }
    }

    /// Whether the adapter has time stamps.
    pub fn is_available(&self) -> bool {
        self.queries.is_some()
    }

    /// What a pass needs to be timed; `None` where that is not possible now.
    pub(super) fn begin(&mut self) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let queries = self.queries.as_mut()?;
        queries.current = queries.slots.iter().position(|slot| !slot.is_busy);
        let first = queries.current? as u32 * 2;
        Some(wgpu::RenderPassTimestampWrites {
            query_set: &queries.set,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// To be called after the pass, before submission.
    pub(super) fn end(&mut self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(queries) = &self.queries
            && let Some(at) = queries.current
        {
            let offset = at as u64 * ALIGNMENT;
            let first = at as u32 * 2;
            encoder.resolve_query_set(&queries.set, first..first + 2, &queries.resolved, offset);
            encoder.copy_buffer_to_buffer(&queries.resolved, offset, &queries.slots[at].read_back, 0, 16);
        }
    }

    /// To be called after submission.
    pub fn submitted(&mut self) {
        if let Some(queries) = &mut self.queries
            && let Some(at) = queries.current.take()
        {
            let slot = &mut queries.slots[at];
            slot.is_busy = true;
            let is_mapped = Arc::clone(&slot.is_mapped);
            slot.read_back.slice(..).map_async(wgpu::MapMode::Read, move |outcome| {
                is_mapped.store(outcome.is_ok(), Ordering::Release)
            });
        }
    }

    /// The time of a pass that has come back since the last call, nanoseconds; the latest if several have.
    pub fn take_ns(&mut self) -> Option<u64> {
        let period_ns = self.period_ns;
        let slots = self.queries.as_mut()?.slots.iter_mut();
        slots
            .filter_map(|slot| slot.take_ticks())
            .map(|ticks| (ticks as f64 * f64::from(period_ns)) as u64)
            .last()
    }
}

impl Slot {
    fn new(device: &wgpu::Device) -> Self {
        Self {
            read_back: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass time"),
                size: 16,
                usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
                mapped_at_creation: false,
            }),
            is_busy: false,
            is_mapped: Arc::new(AtomicBool::new(false)),
        }
    }

    fn take_ticks(&mut self) -> Option<u64> {
        if !self.is_mapped.swap(false, Ordering::Acquire) {
            return None;
        }
        self.is_busy = false;
        let stamp = |bytes: &[u8]| bytes.try_into().map(u64::from_le_bytes).ok();
        let ticks = self.read_back.slice(..).get_mapped_range().ok().and_then(|bytes| {
            let (start, end) = (stamp(&bytes[..8])?, stamp(&bytes[8..])?);
            end.checked_sub(start)
        });
        self.read_back.unmap();
        ticks
    }
}
