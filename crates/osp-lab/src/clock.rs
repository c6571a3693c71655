//! Measures short work (less than 50 steps of the clock) over several runs at once.

use std::sync::OnceLock;

use osp::frame::shortest_step_ns;
use osp_session::platform::time::Instant;

/// Smallest duration of a measurement of repeatable work, in steps of the clock. The error is then at most 2 %.
pub(super) const RESOLUTIONS: f64 = 50.0;
/// Largest number of runs in one measurement.
const MOST_RUNS: f64 = 10_000.0;
/// Number of steps that are measured to find the resolution.
const STEPS: u32 = 1000;

/// Resolution of this machine's clock, nanoseconds: the smallest difference between two readings.
pub(super) fn resolution_ns() -> u64 {
    static FOUND: OnceLock<u64> = OnceLock::new();
    *FOUND.get_or_init(|| {
        let start = Instant::now();
        resolution_of(|| u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX))
    })
}

/// Resolution of a clock, nanoseconds. For a clock that stands still it is one millisecond.
fn resolution_of(now_ns: impl FnMut() -> u64) -> u64 {
    match shortest_step_ns(STEPS, now_ns) {
        0 => 1_000_000,
        step_ns => step_ns,
    }
}

/// Number of runs of work of this duration that together last [`RESOLUTIONS`] steps.
pub(super) fn runs_for(run_ns: f64, resolution_ns: u64) -> u32 {
    let least_ns = RESOLUTIONS * resolution_ns as f64;
    // Work that took less than one step counts as a tenth of a step.
    let run_ns = run_ns.max(resolution_ns as f64 / 10.0);
    (least_ns / run_ns).ceil().clamp(1.0, MOST_RUNS) as u32
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;

    /// Measures work that takes `run_ns`, with a clock that shows only whole steps.
    fn measured_ns(run_ns: f64, step_ns: u64, phase_ns: f64, runs: u32) -> f64 {
        let time_ns = Cell::new(phase_ns);
        let now = || (time_ns.get() as u64) / step_ns * step_ns;
        let start = now();
        (0..runs).for_each(|_| time_ns.set(time_ns.get() + run_ns));
        (now() - start) as f64 / f64::from(runs)
    }

    #[test]
    fn a_coarse_clock_is_read_around_many_runs() {
        for (run_ns, step_ns) in
            [(33.0, 100), (410.0, 100), (4_999.0, 100), (7.0, 1), (260.0, 41), (5_001.0, 100)]
        {
            let runs = runs_for(run_ns, step_ns);
            assert_eq!(runs == 1, run_ns >= 50.0 * step_ns as f64, "{run_ns} ns, steps of {step_ns}");
            for phase in 0..10 {
                let phase_ns = f64::from(phase) * step_ns as f64 / 10.0;
                let off = measured_ns(run_ns, step_ns, phase_ns, runs) / run_ns - 1.0;
                assert!(off.abs() <= 0.021, "{run_ns} ns, steps of {step_ns}: {off}");
            }
        }
        // A single run would give a large error.
        assert!(measured_ns(33.0, 100, 0.0, 1) < 1.0);
        assert_eq!(runs_for(0.0, 100), 500);
    }

    #[test]
    fn the_resolution_is_the_least_step() {
        let time_ns = Cell::new(0u64);
        // Every reading takes 7 ns, and the clock shows only multiples of 100.
        let now = || {
            time_ns.set(time_ns.get() + 7);
            time_ns.get() / 100 * 100
        };
        assert_eq!(resolution_of(now), 100);
        assert_eq!(resolution_of(|| 5), 1_000_000, "a clock that stands still");
        assert!((1..1_000_000).contains(&resolution_ns()), "{}", resolution_ns());
    }
}
