use glam::{Vec2, Vec3};

use super::{Drops, MAX_SCATTERED, Pieces, Sample, StrokeSettings, random::Random};
use crate::brush::{Brush, PARTICLE_STEP_M, Surface};
use osp::polygon::ConvexPolygon;

/// Smallest pressure of the particle in a stroke of a single particle.
const LONE_PRESSURE: f32 = 0.8;

/// The corners of a square relative to its centre, in the order of its texture's corners.
pub(super) const CORNERS: [Vec2; 4] =
    [Vec2::new(-1.0, -1.0), Vec2::new(1.0, -1.0), Vec2::new(1.0, 1.0), Vec2::new(-1.0, 1.0)];

/// Builds squares that face the eye, at equal distances along the samples.
#[derive(Clone, Debug)]
pub struct ParticlesBuilder {
    brush: &'static Brush,
    width_m: f32,
    random: Random,
    interval_m: f64,
    /// The last knot, which is a sample, and its number in the stroke.
    last: Option<(Sample, u32)>,
    /// Position of the last sample, and the length of the path to it.
    pointer: Vec3,
    travelled_m: f64,
    /// Length of the stroke from the first knot to the last.
    length_m: f64,
    /// Number of particle positions along the stroke that the knots so far have passed.
    taken: u64,
    /// The stroke's only particle, until a second particle exists.
    lone: Option<Lone>,
}

#[derive(Clone, Copy, Debug)]
struct Lone {
    place: u32,
    position: Vec3,
    /// Pressure of the second knot, once it exists.
    pressure: f32,
}

impl ParticlesBuilder {
    pub fn new(settings: &StrokeSettings, brush: &'static Brush) -> Self {
        let interval_m = f64::from(PARTICLE_STEP_M * settings.scale / brush.particle_rate);
        Self {
            brush,
            width_m: settings.width_m,
            random: Random::new(settings.seed),
            // The lower bound keeps the number of particles finite.
            interval_m: interval_m.max(f64::MIN_POSITIVE),
            last: None,
            pointer: Vec3::ZERO,
            travelled_m: 0.0,
            length_m: 0.0,
            taken: 0,
            lone: None,
        }
    }

    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let Some((last, number)) = self.last else {
            let lone = Lone { place: out.len(), position: sample.position, pressure: sample.pressure };
            self.place_lone(lone, out, drops);
            (self.last, self.pointer, self.taken, self.lone) =
                (Some((sample, 0)), sample.position, 1, Some(lone));
            return;
        };
        let step = sample.position - last.position;
        let step_m = f64::from(step.length());
        let travel = f64::from((sample.position - self.pointer).length());
        if !step_m.is_finite() || !travel.is_finite() {
            drops.out_of_range += 1;
            return;
        }
        self.pointer = sample.position;
        self.travelled_m += travel;
        if let Some(lone) = &mut self.lone {
            out.truncate(lone.place);
            if number == 0 {
                lone.pressure = sample.pressure;
            }
            let lone = *lone;
            // As in Tilt Brush, the second knot follows the pointer until the pointer has travelled an interval.
            if self.travelled_m <= self.interval_m {
                self.place_lone(lone, out, drops);
                return;
            }
            if number == 0 {
                self.taken = 0;
            } else {
                self.lone = None;
                self.place(lone.position, lone.pressure, 1, 0, out, drops);
            }
        }
        let knot = number.wrapping_add(1);
        let start_m = self.length_m;
        self.length_m += step_m;
        // The cast saturates.
        let taken = ((self.length_m / self.interval_m).floor() as u64).saturating_add(1).max(self.taken);
        let first = std::mem::replace(&mut self.taken, taken);
        self.last = Some((sample, knot));
        if let Some(lone) = self.lone.filter(|_| taken == 1) {
            self.place_lone(lone, out, drops);
            return;
        }
        self.lone = None;
        let count = (taken - first).min(MAX_SCATTERED);
        drops.excess_pieces = drops.excess_pieces.saturating_add(taken - first - count);
        for i in 0..count {
            let along_m = (first + i) as f64 * self.interval_m - start_m;
            // A stroke of two knots in one place has a particle there.
            let part = if step_m > 0.0 { along_m / step_m } else { 0.0 };
            let position = last.position + step * (part as f32).clamp(0.0, 1.0);
            self.place(position, sample.pressure, knot, i as u32, out, drops);
        }
    }

    fn place_lone(&self, lone: Lone, out: &mut Pieces, drops: &mut Drops) {
        self.place(lone.position, lone.pressure.max(LONE_PRESSURE), 1, 0, out, drops);
    }

    fn place(&self, position: Vec3, pressure: f32, knot: u32, i: u32, out: &mut Pieces, drops: &mut Drops) {
        let (brush, random) = (self.brush, self.random);
        let salt = knot.wrapping_mul(16).wrapping_add(i).wrapping_mul(16);
        let at = |offset: u32| salt.wrapping_add(offset);
        let size_m = self.width_m * brush.size(pressure) * (1.0 + brush.size_variance * random.unit(at(0)));
        let alpha = if brush.randomize_alpha { random.unit(at(1)) } else { brush.opacity(pressure) };
        let mut middle = position;
        if brush.particle_speed > 0.0 {
            middle += random.on_sphere(at(2)) * (size_m * brush.particle_speed / brush.size_min);
        }
        // The texture is rotated by 90 degrees: its right edge is up.
        let roll = std::f32::consts::FRAC_PI_2
            + random.around_zero(at(7), 0.5 * brush.particle_rotation_range_degrees.to_radians());
        let corners = CORNERS.map(|corner| middle + (corner * (0.5 * size_m)).extend(0.0));
        out.push(
            ConvexPolygon::quad(corners),
            Surface::facing(roll, cell(brush, random, at(8)), alpha),
            drops,
        );
    }
}

/// The texture coordinates of a square at [`CORNERS`]: the whole texture, or a random cell of two by two cells.
pub(super) fn cell(brush: &Brush, random: Random, salt: u32) -> [Vec2; 4] {
    if brush.atlas_rows <= 1 {
        return CORNERS.map(|corner| corner * 0.5 + 0.5);
    }
    let number = (4.0 * random.unit(salt)) as u32;
    let start = Vec2::new((number % 2) as f32, (number / 2) as f32);
    CORNERS.map(|corner| (start + corner * 0.5 + 0.5) * 0.5)
}
