//! Estimates the cost of drawing a polygon from frame times.

/// Weight of a new frame in the running means.
const WEIGHT: f64 = 0.02;
/// Number of frames before the first estimate.
const FIRST_FRAMES: u32 = 60;
/// Smallest standard deviation of the polygon count that permits an estimate, as a fraction of the mean count.
const LEAST_SPREAD: f64 = 0.05;

/// Number of standard errors that are subtracted from the slope, so that noise does not count as a cost.
const ERRORS_OFF: f64 = 3.0;

/// Linear regression of frame times over numbers of polygons. The slope is the cost of a polygon. The intercept is the
/// time of an empty frame, which culling does not save. The weights of the least squares decrease with a frame's age.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DrawCost {
    frames: u32,
    mean_polygons: f64,
    mean_ns: f64,
    variance: f64,
    variance_ns: f64,
    covariance: f64,
}

impl DrawCost {
    /// Adds the drawing time of a number of polygons. The time may belong to an earlier frame: the number of polygons
    /// changes slowly.
    pub(super) fn note(&mut self, polygons: u64, ns: u64) {
        self.frames = self.frames.saturating_add(1);
        let weight = WEIGHT.max(1.0 / f64::from(self.frames));
        let (by_polygons, by_ns) = (polygons as f64 - self.mean_polygons, ns as f64 - self.mean_ns);
        self.mean_polygons += weight * by_polygons;
        self.mean_ns += weight * by_ns;
        self.variance = (1.0 - weight) * (self.variance + weight * by_polygons * by_polygons);
        self.variance_ns = (1.0 - weight) * (self.variance_ns + weight * by_ns * by_ns);
        self.covariance = (1.0 - weight) * (self.covariance + weight * by_polygons * by_ns);
    }

    pub(super) fn frames(&self) -> u32 {
        self.frames
    }

    /// A lower bound of the cost of a polygon, nanoseconds. `None` until the frame times allow an estimate.
    pub(super) fn polygon_ns(&self) -> Option<f64> {
        let is_clear =
            self.frames >= FIRST_FRAMES && self.variance.sqrt() > LEAST_SPREAD * self.mean_polygons;
        if !is_clear || self.mean_polygons <= 0.0 {
            return None;
        }
        let slope = self.covariance / self.variance;
        let left = (self.variance_ns - slope * self.covariance).max(0.0);
        let frames = f64::from(self.frames).min(2.0 / WEIGHT - 1.0);
        let least_ns = slope - ERRORS_OFF * (left / (self.variance * frames)).sqrt();
        // The cost is at most the mean time per polygon, which assumes that an empty frame takes no time.
        let most_ns = (self.mean_ns / self.mean_polygons).max(1.0);
        (least_ns > 0.0 || left == 0.0).then(|| least_ns.clamp(1.0, most_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame takes 3 ms plus 400 ns per polygon.
    fn after(frames: u32, polygons: impl Fn(u32) -> u64) -> DrawCost {
        let mut cost = DrawCost::default();
        for frame in 0..frames {
            let polygons = polygons(frame);
            cost.note(polygons, 3_000_000 + polygons * 400);
        }
        cost
    }

    #[test]
    fn what_a_frame_costs_without_polygons_is_told_apart() {
        let found =
            after(500, |frame| 5_000 + 20 * u64::from(frame)).polygon_ns().expect("numbers that differ");
        assert!((found - 400.0).abs() < 1.0, "{found}");
        let found = after(500, |frame| if frame % 2 == 0 { 2_000 } else { 4_000 }).polygon_ns().expect("too");
        assert!((found - 400.0).abs() < 1.0, "{found}");
    }

    #[test]
    fn nothing_is_said_of_what_cannot_be_told() {
        assert_eq!(after(20, |frame| 100 * u64::from(frame)).polygon_ns(), None, "too few frames");
        assert_eq!(after(500, |_| 7_000).polygon_ns(), None, "always the same number");
        assert_eq!(
            after(500, |frame| 100_000 + u64::from(frame)).polygon_ns(),
            None,
            "nearly the same number"
        );
        assert_eq!(after(500, |_| 0).polygon_ns(), None, "nothing to draw");
    }

    #[test]
    fn noise_is_not_taken_for_polygons() {
        let mut state = 7u64;
        let mut noise_ns = |most: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % most
        };
        let (mut few, mut many, mut told) = (DrawCost::default(), DrawCost::default(), 0);
        for frame in 0..2000u64 {
            few.note(200 + frame % 100, 40_000_000 + noise_ns(30_000_000));
            told += u32::from(few.polygon_ns().is_some());
            let polygons = 5_000 + 100 * (frame % 100);
            many.note(polygons, 3_000_000 + polygons * 400 + noise_ns(1_000_000));
        }
        assert!(told < 200, "said something of 300 polygons after {told} of 2000 frames");
        let found = many.polygon_ns().expect("clear enough");
        assert!((300.0..=400.0).contains(&found), "{found}");
    }

    #[test]
    fn times_that_have_nothing_to_do_with_polygons_make_them_cheap() {
        let mut cost = DrawCost::default();
        for frame in 0..500u64 {
            cost.note(1_000 + 10 * frame, 16_000_000);
        }
        assert_eq!(cost.polygon_ns(), Some(1.0));
    }
}
