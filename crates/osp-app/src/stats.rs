use std::collections::VecDeque;

use osp_render::PassTimes;

/// Stages of a frame, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameStage {
    /// Input and tracker samples become polygons.
    Strokes,
    /// The index inserts the new polygons.
    Insert,
    /// The frustum query.
    Cull,
    /// Occluder selection, construction of shadow volumes, and tests of nodes.
    Occlusion,
    /// Upload of new polygons and of the drawing order to the GPU.
    Send,
    /// Drawing on the GPU, from submission to the finished picture.
    Draw,
    /// Layout of the user interface.
    Panel,
}

impl FrameStage {
    /// All stages, in order.
    pub const ALL: [Self; 7] =
        [Self::Strokes, Self::Insert, Self::Cull, Self::Occlusion, Self::Send, Self::Draw, Self::Panel];

    /// The stage's name in the window.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strokes => "strokes",
            Self::Insert => "insert",
            Self::Cull => "cull",
            Self::Occlusion => "occlusion",
            Self::Send => "send",
            Self::Panel => "panel",
            Self::Draw => "draw",
        }
    }
}

/// The time of each stage of a frame, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameTimes([u64; FrameStage::ALL.len()]);

impl FrameTimes {
    pub fn set(&mut self, stage: FrameStage, ns: u64) {
        self.0[stage as usize] = ns;
    }

    /// The time of a stage, nanoseconds.
    pub fn get(&self, stage: FrameStage) -> u64 {
        self.0[stage as usize]
    }

    /// The sum of all stages, nanoseconds.
    pub fn total_ns(&self) -> u64 {
        self.0.iter().sum()
    }
}

/// The times of the last frames.
#[derive(Clone, Debug, Default)]
pub struct History {
    frames: VecDeque<FrameTimes>,
    sorted: Vec<u64>,
}

impl History {
    /// Number of frames that are stored.
    pub const LENGTH: usize = 240;

    /// Number of frames for mean times: about a second. If a stage is shorter than the clock's resolution, its measured
    /// time is zero or a whole step. The mean over so many frames approximates the true time.
    pub const MEAN_OF: usize = 60;

    /// Adds a frame. Above [`History::LENGTH`] frames, drops the oldest frame.
    pub fn push(&mut self, times: FrameTimes) {
        if self.frames.len() == Self::LENGTH {
            self.frames.pop_front();
        }
        self.frames.push_back(times);
        self.sorted.clear();
        self.sorted.extend(self.frames.iter().map(FrameTimes::total_ns));
        self.sorted.sort_unstable();
    }

    /// The frames, oldest first.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &FrameTimes> {
        self.frames.iter()
    }

    /// The mean times of the last [`History::MEAN_OF`] frames.
    pub fn mean(&self) -> FrameTimes {
        let latest = self.frames.iter().rev().take(Self::MEAN_OF);
        let count = latest.len().max(1) as u64;
        let mut sums = [0u64; FrameStage::ALL.len()];
        for times in latest {
            for (sum, ns) in sums.iter_mut().zip(times.0) {
                *sum = sum.saturating_add(ns);
            }
        }
        FrameTimes(sums.map(|sum| sum / count))
    }

    /// A percentile of frame times, `part` from 0 to 1, nanoseconds; 0 without frames.
    pub fn percentile_ns(&self, part: f64) -> u64 {
        let rank = (part.clamp(0.0, 1.0) * self.sorted.len() as f64).ceil() as usize;
        self.sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0)
    }

    /// The slowest frame, nanoseconds.
    pub fn slowest_ns(&self) -> u64 {
        self.sorted.last().copied().unwrap_or(0)
    }

    /// A stage's share of the total time of all frames, 0 to 1.
    pub fn share(&self, stage: FrameStage) -> f64 {
        let total: u64 = self.frames.iter().map(FrameTimes::total_ns).sum();
        let of_stage: u64 = self.frames.iter().map(|times| times.get(stage)).sum();
        if total == 0 { 0.0 } else { of_stage as f64 / total as f64 }
    }
}

/// The GPU's times of the last frames. Means are needed, because browsers round GPU times coarsely.
#[derive(Clone, Debug, Default)]
pub(super) struct PassHistory(VecDeque<PassTimes>);

impl PassHistory {
    /// Adds the times of a frame, and drops the oldest times. A frame without times clears the history, because the
    /// method has changed.
    pub(super) fn push(&mut self, times: Option<PassTimes>) {
        let Some(times) = times else {
            self.0.clear();
            return;
        };
        if self.0.len() == History::MEAN_OF {
            self.0.pop_front();
        }
        self.0.push_back(times);
    }

    /// The mean times of the last [`History::MEAN_OF`] frames; `None` without times.
    pub(super) fn mean(&self) -> Option<PassTimes> {
        let count = self.0.len() as u64;
        let sum = self.0.iter().copied().reduce(|a, b| a + b)?;
        let mean = |ns: u64| ns / count;
        Some(PassTimes {
            total_ns: mean(sum.total_ns),
            depth_ns: mean(sum.depth_ns),
            test_ns: mean(sum.test_ns),
            color_ns: mean(sum.color_ns),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_of_the_last_frames() {
        let mut history = History::default();
        assert_eq!(history.mean(), FrameTimes::default());
        for n in 0..200 {
            let mut times = FrameTimes::default();
            // The frames before the last ones do not count.
            times.set(FrameStage::Cull, if n < 140 { 1_000_000 } else { 30_000 });
            history.push(times);
        }
        assert_eq!(history.mean().get(FrameStage::Cull), 30_000);
        assert_eq!(history.mean().total_ns(), 30_000);
    }

    #[test]
    fn the_mean_of_passes_ends_with_a_frame_without() {
        let of = |ns| PassTimes { total_ns: 3 * ns, depth_ns: ns, test_ns: ns, color_ns: ns };
        let mut passes = PassHistory::default();
        assert_eq!(passes.mean(), None);
        for ns in [0, 100_000, 0, 0] {
            passes.push(Some(of(ns)));
        }
        assert_eq!(passes.mean(), Some(of(25_000)));
        passes.push(None);
        assert_eq!(passes.mean(), None);
    }

    #[test]
    fn percentiles_and_shares_are_of_the_frames_kept() {
        let mut history = History::default();
        assert_eq!(history.percentile_ns(0.5), 0);
        for n in 1..=1000 {
            let mut times = FrameTimes::default();
            times.set(FrameStage::Draw, n);
            times.set(FrameStage::Insert, n);
            history.push(times);
        }
        assert_eq!(history.frames().len(), History::LENGTH);
        assert_eq!(history.slowest_ns(), 2000);
        assert_eq!(history.percentile_ns(0.5), 2 * (1000 - History::LENGTH as u64 / 2));
        assert!((history.share(FrameStage::Insert) - 0.5).abs() < 1.0e-9);
    }
}
