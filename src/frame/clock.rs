use crate::platform::time::Instant;

/// The clock of the crate's stages: time, and allocations if the caller counts them.
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
    /// Allocations of this thread; 0 if the clock does not count them.
    pub allocations: u64,
}

impl std::ops::AddAssign for Stage {
    fn add_assign(&mut self, other: Self) {
        self.ns += other.ns;
        self.allocations += other.allocations;
    }
}

impl StageClock {
    /// A clock that reads the number of allocations so far from `allocations` (of the calling thread).
    pub fn counting(allocations: fn() -> u64) -> Self {
        Self { allocations }
    }

    /// Reads the clock.
    pub fn start(&self) -> Reading {
        Reading { allocations: (self.allocations)(), at: Instant::now() }
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
