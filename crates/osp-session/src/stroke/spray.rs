use glam::Vec3;

use super::{
    Drops, MAX_SCATTERED, Pieces, Sample, StrokeSettings, frame,
    knots::{Knots, Spacing, Step},
    particles::{CORNERS, cell},
    random::Random,
};
use crate::{
    brush::{Brush, Effect, Surface},
    recording::NormalRule,
};

/// Builds squares in the plane of the stroke, at distances proportional to their size.
#[derive(Clone, Debug)]
pub struct SprayBuilder {
    brush: &'static Brush,
    random: Random,
    knots: Knots,
    /// Number of kept samples so far, without the first sample.
    kept: u32,
    is_midpoint: bool,
}

impl SprayBuilder {
    pub fn new(settings: &StrokeSettings, brush: &'static Brush, is_midpoint: bool) -> Self {
        let spacing = Spacing { length_m: 0.0, part_of_size: 1.0 / brush.spray_rate };
        let mut knots = Knots::new(settings, brush, spacing);
        if !is_midpoint {
            knots = knots.without_smoothing();
        }
        Self { brush, random: Random::new(settings.seed), knots, kept: 0, is_midpoint }
    }

    /// Processes a sample and writes the changes to `out`. A sample too near to the last kept sample changes nothing.
    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let Some(step) = self.knots.push(sample, drops).filter(|step| step.is_kept) else { return };
        self.kept = self.kept.wrapping_add(1);
        let interval_m = step.to.size_m / self.brush.spray_rate;
        if interval_m <= 0.0 {
            drops.degenerate += 1;
            return;
        }
        // The casts saturate.
        let all = (step.length_m / interval_m) as u64;
        let count = all.min(MAX_SCATTERED);
        drops.excess_pieces = drops.excess_pieces.saturating_add(all - count);
        // The sign is that of Open Brush, whose z axis has the opposite direction.
        let right = -frame::side(NormalRule::Travel, &sample, step.travel, None);
        for i in 0..count as u32 {
            let middle = step.from.sample.position + step.travel * (interval_m * i as f32);
            self.place(middle, &step, right, i, out, drops);
        }
    }

    fn place(&self, middle: Vec3, step: &Step, right: Vec3, i: u32, out: &mut Pieces, drops: &mut Drops) {
        let (brush, random) = (self.brush, self.random);
        let number = if self.is_midpoint {
            self.kept.wrapping_mul(5).wrapping_add(i)
        } else {
            self.kept.wrapping_mul(12).wrapping_add(i % 12)
        };
        let at = |offset: u32| number.wrapping_mul(10).wrapping_add(offset);
        let size_m = step.to.size_m * (1.0 + brush.size_variance * random.unit(at(0)));
        let turn = random.around_zero(at(1), brush.rotation_variance_degrees.to_radians());
        let (sin, cos) = libm::sincosf(turn);
        let ahead = step.travel;
        let forward = (ahead * cos + right * sin) * (0.5 * size_m * brush.size_ratio.0);
        let right = (right * cos - ahead * sin) * (0.5 * size_m * brush.size_ratio.1);
        let middle = middle + random.in_ball(at(2)) * (size_m * brush.position_variance);
        let alpha = if brush.randomize_alpha { random.unit(at(5)) } else { brush.opacity(step.to.smoothed) };
        let mut corners = CORNERS.map(|corner| middle + forward * corner.x + right * corner.y);
        if brush.effect == Effect::HyperGrid {
            let pitch_m = 2.0 * (forward + right).length();
            corners = corners.map(|corner| on_lattice(corner, pitch_m));
        }
        out.push_quad(corners, Surface::flat(cell(brush, random, at(6)), [alpha; 4]), drops);
    }
}

/// The nearest point of a cubic lattice in the direction of +x, +y and -z.
fn on_lattice(point: Vec3, pitch_m: f32) -> Vec3 {
    let cells = point / pitch_m;
    Vec3::new(cells.x.ceil(), cells.y.ceil(), cells.z.floor()) * pitch_m
}
