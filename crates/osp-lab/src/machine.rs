use std::{fs, thread};

use serde::Serialize;

use crate::clock::resolution_ns;
use osp::index::Backend;

/// The machine, and the build of osp that measured the results.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Machine {
    /// Name of the processor, as reported by the system.
    pub processor: String,
    /// Number of hardware threads that this process may use.
    pub threads: usize,
    pub system: String,
    /// SIMD instruction set of the box tests.
    pub simd: String,
    pub version: String,
    /// Commit of the build; it ends in `-dirty` if the working tree had changes.
    pub commit: String,
    /// Resolution of the clock, the smallest difference between two readings, nanoseconds.
    pub clock_resolution_ns: u64,
    /// Whether the program was compiled with optimisation.
    pub optimized: bool,
}

impl Machine {
    pub fn here(commit: Option<&str>) -> Self {
        Self {
            processor: processor().unwrap_or_else(|| "unknown".to_owned()),
            threads: thread::available_parallelism().map_or(1, usize::from),
            system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            simd: Backend::detect().name().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            commit: commit.unwrap_or("unknown").to_owned(),
            clock_resolution_ns: resolution_ns(),
            optimized: !cfg!(debug_assertions),
        }
    }

    /// The description in one line.
    pub fn text(&self) -> String {
        format!(
            "{}, {} threads, {}, box tests on {}, clock resolution {} ns; osp {}, commit {}{}",
            self.processor,
            self.threads,
            self.system,
            self.simd,
            self.clock_resolution_ns,
            self.version,
            self.commit,
            if self.optimized { "" } else { ", NOT optimised: build with --release for meaningful times" }
        )
    }
}

/// The processor's name, if the system has it in `/proc/cpuinfo`.
fn processor() -> Option<String> {
    let text = fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name") || line.starts_with("Model"))?;
    line.split_once(':').map(|(_, name)| name.trim().to_owned())
}
