use std::collections::VecDeque;

/// Parts of a frame, in the order in which they happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameStage {
    /// Input and tracker samples become polygons.
    Strokes,
    /// The index takes what is new.
    Insert,
    /// The frustum query.
    Cull,
    /// Occluders are chosen, shadow volumes built and nodes tested against them.
    Occlusion,
    /// New polygons and the order of drawing are sent to the GPU.
    Send,
    /// The user interface is laid out.
    Panel,
    /// From submission to the finished picture.
    Draw,
}

impl FrameStage {
    /// All of them, in order.
    pub const ALL: [Self; 7] =
        [Self::Strokes, Self::Insert, Self::Cull, Self::Occlusion, Self::Send, Self::Panel, Self::Draw];

    /// Its name in the window.
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

/// The time of each part of a frame, nanoseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameTimes([u64; FrameStage::ALL.len()]);

impl FrameTimes {
    /// Sets a part.
    pub fn set(&mut self, stage: FrameStage, ns: u64) {
        self.0[stage as usize] = ns;
    }

    /// A part, nanoseconds.
    pub fn get(&self, stage: FrameStage) -> u64 {
        self.0[stage as usize]
    }

    /// All parts, nanoseconds.
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
    /// Frames kept.
    pub const LENGTH: usize = 240;

    /// Adds a frame and drops the oldest one.
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

    /// The latest frame.
    pub fn last(&self) -> FrameTimes {
        self.frames.back().copied().unwrap_or_default()
    }

    /// The time that this part of the frames (0 to 1) did not exceed, nanoseconds; 0 where there is none.
    pub fn percentile_ns(&self, part: f64) -> u64 {
        let rank = (part.clamp(0.0, 1.0) * self.sorted.len() as f64).ceil() as usize;
        self.sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0)
    }

    /// The slowest frame, nanoseconds.
    pub fn slowest_ns(&self) -> u64 {
        self.sorted.last().copied().unwrap_or(0)
    }

    /// A stage's share of the time of all frames, 0 to 1.
    pub fn share(&self, stage: FrameStage) -> f64 {
        let total: u64 = self.frames.iter().map(FrameTimes::total_ns).sum();
        let of_stage: u64 = self.frames.iter().map(|times| times.get(stage)).sum();
        if total == 0 { 0.0 } else { of_stage as f64 / total as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
