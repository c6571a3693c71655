use std::ops::Add;

use super::{
    Gpu,
    read_ring::{ReadRing, SLOTS},
};

const MAX_PASSES: usize = 3;
/// Number of time stamps of a frame: the beginning and the end of each pass.
const STAMPS: u32 = 2 * MAX_PASSES as u32;
const ALIGNMENT: u64 = wgpu::QUERY_RESOLVE_BUFFER_ALIGNMENT;

/// GPU times of the passes of a frame, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PassTimes {
    /// Time from the beginning of the first pass to the end of the last.
    pub total_ns: u64,
    /// Time of the depth pass, with the polygons that were visible in the last frame; 0 without culling on the GPU.
    pub depth_ns: u64,
    /// Time of the depth pyramid, and of the test of the polygons in view; 0 without culling on the GPU.
    pub test_ns: u64,
    pub color_ns: u64,
}

impl Add for PassTimes {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            total_ns: self.total_ns + other.total_ns,
            depth_ns: self.depth_ns + other.depth_ns,
            test_ns: self.test_ns + other.test_ns,
            color_ns: self.color_ns + other.color_ns,
        }
    }
}

/// Measures the passes of a frame by time stamps of the GPU; returns no times if the adapter has no time stamps.
#[derive(Debug)]
pub struct GpuTimer {
    queries: Option<Queries>,
    period_ns: f32,
}

#[derive(Debug)]
struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    ring: ReadRing,
    current: Option<usize>,
}

pub(super) struct Stamps<'a> {
    set: &'a wgpu::QuerySet,
    begin: Option<u32>,
    end: Option<u32>,
}

impl<'a> Stamps<'a> {
    pub(super) fn of_render(self) -> wgpu::RenderPassTimestampWrites<'a> {
        wgpu::RenderPassTimestampWrites {
            query_set: self.set,
            beginning_of_pass_write_index: self.begin,
            end_of_pass_write_index: self.end,
        }
    }

    pub(super) fn of_compute(self) -> wgpu::ComputePassTimestampWrites<'a> {
        wgpu::ComputePassTimestampWrites {
            query_set: self.set,
            beginning_of_pass_write_index: self.begin,
            end_of_pass_write_index: self.end,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ends {
    Begin,
    End,
    Both,
}

impl GpuTimer {
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let queries = device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Queries {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: STAMPS * SLOTS as u32,
            }),
            resolved: gpu.buffer(
                "pass times",
                SLOTS as u64 * ALIGNMENT,
                wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            ),
            ring: ReadRing::new(gpu, u64::from(STAMPS) * 8),
            current: None,
        });
        Self { queries, period_ns: gpu.queue.get_timestamp_period() }
    }

    pub fn is_available(&self) -> bool {
        self.queries.is_some()
    }

    pub(super) fn begin(&mut self) {
        if let Some(queries) = &mut self.queries {
            queries.current = queries.ring.begin();
        }
    }

    /// The time stamps of a pass of the frame; `None` if none are available now.
    pub(super) fn stamps(&self, pass: u32, ends: Ends) -> Option<Stamps<'_>> {
        let queries = self.queries.as_ref()?;
        let first = queries.current? as u32 * STAMPS + pass * 2;
        Some(Stamps {
            set: &queries.set,
            begin: (ends != Ends::End).then_some(first),
            end: (ends != Ends::Begin).then_some(first + 1),
        })
    }

    /// Copies the time stamps. Call it after the frame's passes, before submission.
    pub(super) fn end(&mut self, encoder: &mut wgpu::CommandEncoder, passes: u32) {
        if let Some(queries) = &mut self.queries
            && let Some(at) = queries.current
        {
            let offset = at as u64 * ALIGNMENT;
            let first = at as u32 * STAMPS;
            encoder.resolve_query_set(&queries.set, first..first + passes * 2, &queries.resolved, offset);
            queries.ring.copy(encoder, &queries.resolved, offset, u64::from(passes) * 16);
        }
    }

    /// Begins the transfer of the time stamps. Call it after submission.
    pub fn submitted(&mut self) {
        if let Some(queries) = &mut self.queries {
            queries.current = None;
            queries.ring.submitted();
        }
    }

    /// The times of the latest frame whose time stamps became available since the last call.
    pub fn take(&mut self) -> Option<PassTimes> {
        let period_ns = f64::from(self.period_ns);
        let mut times = None;
        self.queries.as_mut()?.ring.take(|_, bytes| times = pass_times(bytes, period_ns).or(times));
        times
    }
}

fn pass_times(bytes: &[u8], period_ns: f64) -> Option<PassTimes> {
    let stamp = |i: usize| {
        let bytes = bytes.get(i * 8..i * 8 + 8)?;
        bytes.try_into().map(u64::from_le_bytes).ok()
    };
    let between = |from: usize, to: usize| {
        let ticks = stamp(to)?.checked_sub(stamp(from)?)?;
        Some((ticks as f64 * period_ns) as u64)
    };
    let stamps = bytes.len() / 8;
    // The first pass is always the same. The order of the other passes varies. If the adapter's counter was reset, the
    // frame has no times.
    let end = (1..stamps).step_by(2).max_by_key(|&i| stamp(i))?;
    let total_ns = between(0, end)?;
    let of = |pass: usize| between(pass * 2, pass * 2 + 1);
    Some(match stamps / 2 {
        3.. => PassTimes { total_ns, depth_ns: of(0)?, test_ns: of(1)?, color_ns: of(2)? },
        _ => PassTimes { total_ns, color_ns: total_ns, ..PassTimes::default() },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(stamps: &[u64]) -> Option<PassTimes> {
        let bytes: Vec<u8> = stamps.iter().flat_map(|stamp| stamp.to_le_bytes()).collect();
        pass_times(&bytes, 2.0)
    }

    #[test]
    fn a_frame_takes_from_the_first_pass_to_the_last_whatever_their_order() {
        let depth_first = PassTimes { total_ns: 60, depth_ns: 10, test_ns: 20, color_ns: 20 };
        assert_eq!(times(&[100, 105, 106, 116, 120, 130]), Some(depth_first));
        // After a jump the test comes last.
        let test_last = PassTimes { total_ns: 60, depth_ns: 10, test_ns: 8, color_ns: 20 };
        assert_eq!(times(&[100, 105, 126, 130, 110, 120]), Some(test_last));
        assert_eq!(
            times(&[100, 130]),
            Some(PassTimes { total_ns: 60, color_ns: 60, ..PassTimes::default() })
        );
        // Stamps that go backwards are no time.
        assert_eq!(times(&[100, 0]), None);
        assert_eq!(times(&[100, 105, 106, 3, 4, 9]), None);
        assert_eq!(times(&[]), None);
    }
}
