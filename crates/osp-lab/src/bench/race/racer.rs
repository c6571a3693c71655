use crate::report::short;
use osp_session::recording::Pace;

#[derive(Clone, Debug)]
pub struct Racer {
    /// The structure's name on the command line.
    pub name: &'static str,
    /// Time of insertion, commit and culling of each frame, nanoseconds.
    pub times_ns: Vec<u64>,
    /// Number of frames that took longer than [`Racer::MOST_NS`].
    pub missed: u64,
    /// Number of polygons in the model at the first frame that took longer than [`Racer::MOST_NS`].
    pub first_missed: Option<u64>,
    pub longest_ns: u64,
    pub in_view: u64,
    pub(super) bytes: usize,
}

impl Racer {
    /// Frame time at 90 Hz, the rate of common headsets, nanoseconds.
    pub const MOST_NS: u64 = (1.0e9 / Pace::FRAMES_A_SECOND) as u64;

    pub(super) fn new(name: &'static str) -> Self {
        Self {
            name,
            times_ns: Vec::new(),
            missed: 0,
            first_missed: None,
            longest_ns: 0,
            in_view: 0,
            bytes: 0,
        }
    }

    /// Adds the time of a frame; `polygons` is the number of polygons in the model after the frame.
    pub(super) fn add(&mut self, ns: u64, polygons: u64) {
        self.times_ns.push(ns);
        self.longest_ns = self.longest_ns.max(ns);
        if ns > Self::MOST_NS {
            self.missed += 1;
            self.first_missed.get_or_insert(polygons);
        }
    }

    /// Returns for each frame the smaller of the times in this race and in another one. `polygons` are the numbers
    /// of polygons after each frame.
    pub(super) fn least(&self, other: &Self, polygons: &[u64]) -> Self {
        let mut least = Self { in_view: self.in_view, bytes: self.bytes, ..Self::new(self.name) };
        for ((&ns, &other_ns), &polygons) in self.times_ns.iter().zip(&other.times_ns).zip(polygons) {
            least.add(ns.min(other_ns), polygons);
        }
        least
    }

    /// A time as milliseconds, rounded so that most times have the same number of characters.
    pub fn figure_ms(ns: u64) -> String {
        match ns as f64 / 1.0e6 {
            ms if ms < 10.0 => format!("{ms:.3}"),
            ms if ms < 100.0 => format!("{ms:.2}"),
            ms => short(ms),
        }
    }
}
