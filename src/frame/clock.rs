#[cfg(not(target_arch = "wasm32"))]
use std::time::Instant;
#[cfg(target_arch = "wasm32")]
use web_time::Instant;

/// The clock that measures the stages of a frame: time, and allocations if the caller counts them.
#[derive(Clone, Copy, Debug)]
pub struct StageClock {
    allocations: fn() -> u64,
}

/// A reading of the clock.
#[derive(Clone, Copy, Debug)]
pub struct Reading {
    at: Instant,
    allocations: u64,
}

/// Time and allocations of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Stage {
    /// Time, nanoseconds.
    pub ns: u64,
    /// Number of allocations of this thread; 0 if the clock does not count them.
    pub allocations: u64,
}

impl std::ops::AddAssign for Stage {
    fn add_assign(&mut self, other: Self) {
        self.ns += other.ns;
        self.allocations += other.allocations;
    }
}

/// Number of clock steps that [`StageClock::step_ns`] measures.
const STEPS: u32 = 16;
/// Largest number of readings. The measurement ends even if the clock does not advance.
const MOST_READINGS: u32 = 1_000_000;

impl StageClock {
    /// A clock that counts allocations. `allocations` returns the number of allocations of the calling thread so far.
    pub fn counting(allocations: fn() -> u64) -> Self {
        Self { allocations }
    }

    /// Reads the clock.
    pub fn start(&self) -> Reading {
        Reading { allocations: (self.allocations)(), at: Instant::now() }
    }

    /// The resolution of the clock, nanoseconds: the smallest of 16 differences between readings. Browsers round their
    /// clocks to 5 to 1000 µs. Elsewhere the result is about the duration of a reading. 0 if the clock does not
    /// advance.
    pub fn step_ns(&self) -> u64 {
        let start = Instant::now();
        shortest_step_ns(STEPS, || u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX))
    }

    /// Time and allocations since a reading.
    pub fn since(&self, start: Reading) -> Stage {
        let ns = u64::try_from(start.at.elapsed().as_nanos()).unwrap_or(u64::MAX);
        Stage { ns, allocations: (self.allocations)() - start.allocations }
    }
}

impl Default for StageClock {
    /// A clock that does not count allocations.
    fn default() -> Self {
        Self { allocations: || 0 }
    }
}

/// The shortest of the first `most` steps of a clock that `read` reads, nanoseconds; 0 if the clock does not advance.
pub fn shortest_step_ns(most: u32, mut read: impl FnMut() -> u64) -> u64 {
    let (mut last, mut shortest, mut steps) = (read(), u64::MAX, 0);
    for _ in 0..MOST_READINGS {
        let now = read();
        if now > last {
            shortest = shortest.min(now - last);
            steps += 1;
        }
        last = now;
        if steps == most {
            break;
        }
    }
    if steps == 0 { 0 } else { shortest }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock that is read every 40 ns and advances in steps.
    fn coarse(step_ns: u64) -> impl FnMut() -> u64 {
        let mut now = 0;
        move || {
            now += 40;
            now - now % step_ns
        }
    }

    #[test]
    fn the_step_of_a_coarse_clock_is_found() {
        for step_ns in [5_000, 100_000, 1_000_000] {
            assert_eq!(shortest_step_ns(STEPS, coarse(step_ns)), step_ns);
        }
        assert_eq!(shortest_step_ns(STEPS, coarse(1)), 40, "a fine clock advances with every reading");
    }

    #[test]
    fn a_clock_that_stands_still_or_goes_back_ends_the_search() {
        assert_eq!(shortest_step_ns(STEPS, || 7), 0);
        let mut now = 1_000_000_000;
        let backwards = || {
            now -= 1;
            now
        };
        assert_eq!(shortest_step_ns(STEPS, backwards), 0);
    }

    #[test]
    fn this_clock_has_steps() {
        let step_ns = StageClock::default().step_ns();
        assert!((1..20_000_000).contains(&step_ns), "{step_ns} ns");
    }
}
