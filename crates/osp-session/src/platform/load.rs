use std::time::Duration;

use super::time::Instant;

/// Below this share of the time, in per cent, a thread was interrupted so often that its times say little.
const UNDISTURBED_PERCENT: u128 = 80;

/// How much of the time of some work the system gave to the thread that did it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Load {
    wall: Duration,
    cpu: Duration,
}

/// The beginning of some work: the time, and the processor time of this thread.
#[derive(Clone, Copy, Debug)]
pub struct Begun(Option<(Instant, Duration)>);

/// Processor time of the calling thread; `None` where the system does not tell it.
fn thread_cpu() -> Option<Duration> {
    #[cfg(unix)]
    return rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime).try_into().ok();
    #[cfg(not(unix))]
    None
}

impl Load {
    pub fn begin() -> Begun {
        Begun(thread_cpu().map(|cpu| (Instant::now(), cpu)))
    }

    /// Adds the work since `begun`, which this thread has done.
    pub fn add(&mut self, begun: Begun) {
        if let (Begun(Some((start, before))), Some(cpu)) = (begun, thread_cpu()) {
            self.wall += start.elapsed();
            self.cpu += cpu.saturating_sub(before);
        }
    }

    /// Time and processor time of all the work; `None` if the system does not tell it.
    pub fn text(&self) -> Option<String> {
        let [wall, cpu] = [self.wall, self.cpu].map(|time| time.as_secs_f64());
        (wall > 0.0).then(|| format!("Measuring took {wall:.1} s, and {cpu:.1} s of processor time."))
    }

    /// A sentence for the reader of the times, if other programs had a large part of the processor.
    pub fn note(&self) -> Option<String> {
        let percent = (100 * self.cpu.as_nanos()).checked_div(self.wall.as_nanos())?;
        (percent < UNDISTURBED_PERCENT).then(|| {
            format!("The machine was busy: osp ran for {percent} % of the measured time, so the times include other programs.")
        })
    }
}

impl std::ops::AddAssign for Load {
    fn add_assign(&mut self, other: Self) {
        self.wall += other.wall;
        self.cpu += other.cpu;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_busy_machine_is_told_by_processor_time_far_below_the_time() {
        let note = |wall_ms, cpu_ms| {
            let [wall, cpu] = [wall_ms, cpu_ms].map(Duration::from_millis);
            let mut load = Load::default();
            load += Load { wall, cpu };
            load.note()
        };
        assert!(note(1000, 125).is_some_and(|note| note.contains("ran for 12 % of the measured time")));
        assert!(note(1000, 799).is_some());
        assert_eq!(Load::default().text(), None);
        for (wall_ms, cpu_ms) in [(1000, 800), (1000, 1000), (1000, 1001), (0, 0)] {
            assert_eq!(note(wall_ms, cpu_ms), None, "{cpu_ms} of {wall_ms} ms");
        }
    }
}
