use glam::Vec3;

use super::{Drops, Sample, StrokeSettings};
use crate::brush::Brush;

/// The smallest distance between two kept samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spacing {
    /// A constant distance, metres at scale 1.
    pub length_m: f32,
    /// An additional distance, as a fraction of the width at the sample.
    pub part_of_size: f32,
}

/// A control point of a stroke with the values that its brush uses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Knot {
    /// The recorded sample with the recorded pressure.
    pub sample: Sample,
    pub smoothed: f32,
    /// Full width at the smoothed pressure, metres.
    pub size_m: f32,
}

/// Movement of the hand from the last kept sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// The last kept sample.
    pub from: Knot,
    pub to: Knot,
    /// Distance between `from` and `to`, metres; finite.
    pub length_m: f32,
    /// Unit direction of the movement; zero if `length_m` is zero.
    pub travel: Vec3,
    /// Whether the new sample is kept. Otherwise it is a provisional end of the stroke, and the next sample replaces
    /// it.
    pub is_kept: bool,
}

/// Classifies the samples of a stroke as kept samples and provisional ends, and smooths their pressure.
///
/// Most brushes keep only samples at a minimum distance. A sample nearer to the last kept sample is drawn as the
/// stroke's provisional end, and the next sample replaces it.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    brush: &'static Brush,
    width_m: f32,
    scale: f32,
    spacing: Spacing,
    last: Option<Knot>,
    /// Whether a sample after the first one was kept.
    is_begun: bool,
    is_smooth: bool,
}

impl Knots {
    pub(super) fn new(settings: &StrokeSettings, brush: &'static Brush, spacing: Spacing) -> Self {
        // At scale 0 the smoothing length would be 0.
        let scale = settings.scale.max(f32::MIN_POSITIVE);
        Self {
            brush,
            width_m: settings.width_m,
            scale,
            spacing,
            last: None,
            is_begun: false,
            is_smooth: true,
        }
    }

    /// Turns off the smoothing, for brushes that use the recorded pressure.
    pub(super) fn without_smoothing(self) -> Self {
        Self { is_smooth: false, ..self }
    }

    pub(super) fn last(&self) -> Option<&Knot> {
        self.last.as_ref()
    }

    /// Smallest distance from the last kept sample at which this knot is kept, metres.
    pub(super) fn spacing_m(&self, knot: &Knot) -> f32 {
        self.spacing.length_m * self.scale + self.spacing.part_of_size * knot.size_m
    }

    /// Processes a sample. Returns `None` for the first sample, which is always kept, and for a sample that is out of
    /// range.
    pub(super) fn push(&mut self, sample: Sample, drops: &mut Drops) -> Option<Step> {
        let Some(mut from) = self.last else {
            self.last = Some(self.knot(sample, self.first_pressure(&sample)));
            return None;
        };
        let step = sample.position - from.sample.position;
        let length_m = step.length();
        if !length_m.is_finite() {
            drops.out_of_range += 1;
            return None;
        }
        if !self.is_begun {
            from = self.knot(from.sample, self.first_pressure(&sample));
        }
        let to = self.knot(sample, self.smoothed(&from, sample.pressure, length_m));
        let is_kept = length_m >= self.spacing_m(&to) && length_m > 0.0;
        if is_kept {
            self.last = Some(to);
            self.is_begun = true;
        }
        Some(Step { from, to, length_m, travel: step.normalize_or_zero(), is_kept })
    }

    fn knot(&self, sample: Sample, smoothed: f32) -> Knot {
        Knot { sample, smoothed, size_m: self.width_m * self.brush.size(smoothed) }
    }

    /// The smoothed pressure at the first sample of a stroke. For brushes with the short pressure window it is 0. For
    /// other brushes it is the newest pressure, until a second sample is kept.
    fn first_pressure(&self, next: &Sample) -> f32 {
        if !self.is_smooth {
            return self.last.map_or(next.pressure, |last| last.sample.pressure);
        }
        if self.brush.has_short_pressure_window { 0.0 } else { next.pressure }
    }

    /// The smoothed pressure: the old pressure fades to a tenth over the brush's smoothing length.
    fn smoothed(&self, from: &Knot, pressure: f32, length_m: f32) -> f32 {
        if !self.is_smooth {
            return pressure;
        }
        let window_m = if self.brush.has_short_pressure_window { 0.1 } else { 0.2 };
        let old = libm::powf(0.1, length_m / (window_m * self.scale));
        old * from.smoothed + (1.0 - old) * pressure
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::{
        brush,
        recording::{NormalRule, Tool},
    };

    fn knots(scale: f32) -> Knots {
        let brush = brush::find("TaperedMarker").expect("a brush of the table");
        let settings = StrokeSettings {
            brush: Some(brush),
            tool: Tool::Ribbon,
            width_m: 0.1,
            thinnest: 0.0,
            normal: NormalRule::Travel,
            seed: 0,
            scale,
        };
        Knots::new(&settings, brush, Spacing { length_m: 0.0015, part_of_size: 0.2 })
    }

    fn at(x: f32, pressure: f32) -> Sample {
        Sample { position: Vec3::X * x, orientation: Quat::IDENTITY, pressure }
    }

    #[test]
    fn a_sample_near_the_last_kept_one_is_replaced_by_the_next() {
        let (mut knots, mut drops) = (knots(1.0), Drops::default());
        assert_eq!(knots.push(at(0.0, 1.0), &mut drops), None);
        // The spacing is 0.0015 m + 0.2 * 0.1 m.
        let kept: Vec<bool> = [0.01, 0.02, 0.022, 0.03, 0.0434, 0.0436]
            .iter()
            .map(|&x| knots.push(at(x, 1.0), &mut drops).expect("in range").is_kept)
            .collect();
        assert_eq!(kept, [false, false, true, false, false, true]);
        let step = knots.push(at(0.0536, 1.0), &mut drops).expect("in range");
        assert_eq!((step.from.sample.position.x, step.travel, step.is_kept), (0.0436, Vec3::X, false));
        assert!((step.length_m - 0.01).abs() < 1.0e-6, "{}", step.length_m);
        assert_eq!(drops, Drops::default());
    }

    #[test]
    fn pressure_follows_over_a_fifth_of_a_metre() {
        for scale in [1.0, 0.25] {
            let (mut knots, mut drops) = (knots(scale), Drops::default());
            knots.push(at(0.0, 1.0), &mut drops);
            // The first sample's pressure is ignored, because few hands press hard at once.
            let step = knots.push(at(0.1, 0.0), &mut drops).expect("in range");
            assert!(step.is_kept && step.from.smoothed == 0.0 && step.to.smoothed == 0.0);
            let step = knots.push(at(0.1 + 0.2 * scale, 1.0), &mut drops).expect("in range");
            assert!((step.to.smoothed - 0.9).abs() < 1.0e-5, "{}", step.to.smoothed);
            assert_eq!(step.to.sample.pressure, 1.0);
            assert_eq!(step.to.size_m, 0.1 * knots.brush.size(step.to.smoothed));
        }
    }

    #[test]
    fn samples_without_a_move_and_beyond_all_bounds_are_no_steps() {
        let (mut knots, mut drops) = (knots(0.0), Drops::default());
        knots.push(at(0.0, 1.0), &mut drops);
        let step = knots.push(at(0.0, 0.5), &mut drops).expect("in range");
        assert!(!step.is_kept && step.travel == Vec3::ZERO && step.to.smoothed == 0.5);
        assert_eq!((knots.push(at(3.0e38, 1.0), &mut drops), drops.out_of_range), (None, 1));
    }
}
