//! What drawing a polygon costs, from what frames took.

/// Weight of a new frame against all before.
const WEIGHT: f64 = 0.02;
/// Frames before anything is said.
const FIRST_FRAMES: u32 = 60;
/// The numbers of polygons must differ by this part of their mean (standard deviation) before anything is said.
const LEAST_SPREAD: f64 = 0.05;

/// The slope of the frames' times over their numbers of polygons: a frame costs something with nothing in it, too, which
/// leaving polygons out does not save. Least squares, the weight of a frame falling with its age.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DrawCost {
    frames: u32,
    mean_polygons: f64,
    mean_ns: f64,
    variance: f64,
    covariance: f64,
}

impl DrawCost {
    /// Takes what drawing so many polygons took. Times may come some frames late: numbers of polygons change slowly.
    pub(super) fn note(&mut self, polygons: usize, ns: u64) {
        self.frames = self.frames.saturating_add(1);
        let weight = WEIGHT.max(1.0 / f64::from(self.frames));
        let (by_polygons, by_ns) = (polygons as f64 - self.mean_polygons, ns as f64 - self.mean_ns);
        self.mean_polygons += weight * by_polygons;
        self.mean_ns += weight * by_ns;
        self.variance = (1.0 - weight) * (self.variance + weight * by_polygons * by_polygons);
        self.covariance = (1.0 - weight) * (self.covariance + weight * by_polygons * by_ns);
    }

    /// What a polygon costs, nanoseconds, as soon as it can be told from what a frame costs without any.
    pub(super) fn polygon_ns(&self) -> Option<f64> {
        let is_clear =
            self.frames >= FIRST_FRAMES && self.variance.sqrt() > LEAST_SPREAD * self.mean_polygons;
        // Never more than if all of the time went into polygons.
        let most_ns = self.mean_ns / self.mean_polygons;
        (is_clear && self.mean_polygons > 0.0)
            .then(|| (self.covariance / self.variance).min(most_ns).max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame takes 3 ms and 400 ns a polygon.
    fn after(frames: u32, polygons: impl Fn(u32) -> usize) -> DrawCost {
        let mut cost = DrawCost::default();
        for frame in 0..frames {
            let polygons = polygons(frame);
            cost.note(polygons, 3_000_000 + polygons as u64 * 400);
        }
        cost
    }

    #[test]
    fn what_a_frame_costs_without_polygons_is_told_apart() {
        let found =
            after(500, |frame| 5_000 + 20 * frame as usize).polygon_ns().expect("numbers that differ");
        assert!((found - 400.0).abs() < 1.0, "{found}");
        let found = after(500, |frame| if frame % 2 == 0 { 2_000 } else { 4_000 }).polygon_ns().expect("too");
        assert!((found - 400.0).abs() < 1.0, "{found}");
    }

    #[test]
    fn nothing_is_said_of_what_cannot_be_told() {
        assert_eq!(after(20, |frame| 100 * frame as usize).polygon_ns(), None, "too few frames");
        assert_eq!(after(500, |_| 7_000).polygon_ns(), None, "always the same number");
        assert_eq!(after(500, |frame| 100_000 + frame as usize).polygon_ns(), None, "nearly the same number");
        assert_eq!(after(500, |_| 0).polygon_ns(), None, "nothing to draw");
    }

    #[test]
    fn times_that_have_nothing_to_do_with_polygons_make_them_cheap() {
        let mut cost = DrawCost::default();
        for frame in 0..500usize {
            cost.note(1_000 + 10 * frame, 16_000_000);
        }
        assert_eq!(cost.polygon_ns(), Some(1.0));
    }
}
