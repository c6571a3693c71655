/// Decides when an unused method is tried again. A least number of frames must pass first. The next try must also take at
/// most a small share of the frames' time since the last try. On average all tries together cost no more than this
/// share.
#[derive(Clone, Copy, Debug, Default)]
pub struct TryBudget {
    frames: u32,
    saved_ns: f64,
}

impl TryBudget {
    /// Counts a frame that saves `ns` nanoseconds for the next try. At most its price, `price_ns`, is saved.
    pub fn save(&mut self, ns: f64, price_ns: f64) {
        self.frames = self.frames.saturating_add(1);
        self.saved_ns = (self.saved_ns + ns).min(price_ns);
    }

    /// Number of frames since the last try.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Whether a try that costs `price_ns` is due. At least `least_frames` frames must lie between two tries.
    pub fn is_due(&self, price_ns: f64, least_frames: u32) -> bool {
        self.frames >= least_frames && self.saved_ns >= price_ns
    }

    /// Drops the saved time, after a try.
    pub fn restart(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tries_cost_no_more_than_the_share_that_is_saved() {
        let (mut budget, mut tries) = (TryBudget::default(), 0);
        for _ in 0..10_000 {
            budget.save(10.0, 1_000.0);
            if budget.is_due(1_000.0, 8) {
                tries += 1;
                budget.restart();
            }
        }
        assert_eq!(tries, 100);
    }

    #[test]
    fn a_cheap_try_waits_its_frames_and_nothing_is_saved_beyond_a_price() {
        let mut budget = TryBudget::default();
        for frame in 1..=8 {
            assert!(!budget.is_due(1.0, 8));
            budget.save(100.0, 1.0);
            assert_eq!(budget.frames(), frame);
        }
        assert!(budget.is_due(1.0, 8));
        assert!(!budget.is_due(2.0, 8), "no more than 1 was saved");
    }
}
