//! Motion of a hand along a path.
//!
//! * Speed along a stroke: T. Flash and N. Hogan, "The coordination of arm movements: an experimentally confirmed
//!   mathematical model", 1985 (minimum jerk). A stroke is a part of a longer movement, so the hand already moves when
//!   the stroke begins and still moves when it ends.
//! * Speed in bends is proportional to the curvature to the power of -1/3: F. Lacquaniti, C. Terzuolo and P. Viviani,
//!   "The law relating the kinematic and figural aspects of drawing movements", 1983.
//! * Duration grows slower than length (isochrony).
//! * Physiological tremor of 8 to 12 Hz and a fraction of a millimetre, and slower drift.

use glam::DVec3;

use super::path::Node;
use super::random::Random;
use super::vector::{perpendicular, quaternion, turned};

/// Number of samples of the hand per second.
pub(super) const RATE_HZ: f64 = 90.0;

/// Speed of the hand at the start and end of a stroke, divided by its mean speed.
const SPEED_AT_ENDS: f64 = 0.35;

/// Number of smoothing passes over a path. In each pass a node moves half-way to the midpoint of its neighbours.
const SMOOTHING: usize = 6;

/// Number of sine waves for tremor and for drift along each axis.
const WAVES: usize = 3;

#[derive(Clone, Copy, Debug)]
pub(super) struct HandSample {
    pub(super) p: DVec3,
    /// The tracker's axes. The first axis is the ribbon's normal.
    pub(super) axes: [DVec3; 3],
    pub(super) pressure: f64,
}

impl HandSample {
    pub(super) fn orientation(&self) -> [f64; 4] {
        quaternion(self.axes[0], self.axes[1], self.axes[2])
    }

    /// The sample reflected in the plane x = 0.
    pub(super) fn mirrored(&self) -> Self {
        let flip = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
        let (x, y) = (flip(self.axes[0]), flip(self.axes[1]));
        Self { p: flip(self.p), axes: [x, y, x.cross(y)], pressure: self.pressure }
    }
}

#[derive(Clone, Copy, Debug)]
struct Waves {
    /// Angular frequency, phase, amplitude.
    waves: [(f64, f64, f64); WAVES],
}

impl Waves {
    fn new(rng: &mut Random, low_hz: f64, high_hz: f64, amplitude: f64) -> Self {
        let wave = || {
            let frequency = std::f64::consts::TAU * rng.between(low_hz, high_hz);
            (
                frequency,
                rng.between(0.0, std::f64::consts::TAU),
                amplitude * rng.between(0.5, 1.0) / WAVES as f64,
            )
        };
        let mut make = wave;
        Self { waves: [make(), make(), make()] }
    }

    fn at(&self, time_secs: f64) -> f64 {
        self.waves
            .iter()
            .map(|(frequency, phase, amplitude)| amplitude * libm::sin(frequency * time_secs + phase))
            .sum()
    }
}

#[derive(Debug)]
pub(super) struct Hand {
    tremor_m: [Waves; 3],
    drift_m: [Waves; 3],
    roll: Waves,
    pitch: Waves,
    grip: Waves,
    up: DVec3,
}

impl Hand {
    pub(super) fn new(rng: &mut Random) -> Self {
        Self {
            tremor_m: [(); 3].map(|()| Waves::new(rng, 8.0, 12.0, 0.0004)),
            drift_m: [(); 3].map(|()| Waves::new(rng, 0.5, 2.5, 0.0015)),
            roll: Waves::new(rng, 0.3, 1.5, 0.20),
            pitch: Waves::new(rng, 0.3, 1.5, 0.10),
            grip: Waves::new(rng, 0.7, 3.0, 0.12),
            up: DVec3::Y,
        }
    }

    /// Number of samples of a stroke. A `pace` of 1 is the usual speed.
    pub(super) fn samples_for(rng: &mut Random, way: &HandPath, pace: f64) -> u32 {
        let secs = rng.log_normal(0.30, 0.18) * libm::pow(way.effort_m() / 0.15, 0.45) / pace;
        ((secs * RATE_HZ) as u32).clamp(8, 120)
    }

    pub(super) fn sample(&mut self, path: &HandPath, index: u32, count: u32, time_secs: f64) -> HandSample {
        let part = f64::from(index) / f64::from(count.max(2) - 1);
        let (place, travel) = path.at(progress(part));
        let shake = |waves: &[Waves; 3]| DVec3::from_array([0, 1, 2].map(|i| waves[i].at(time_secs)));
        let p = place.p + shake(&self.tremor_m) + shake(&self.drift_m);
        let across = perpendicular(place.n, travel);
        let tilted = turned(across, travel, self.roll.at(time_secs));
        let x = turned(tilted, travel.cross(tilted), self.pitch.at(time_secs));
        let y = perpendicular(self.up, x);
        // The up vector is transported along the stroke, so that the hand never flips where the normal points up.
        self.up = (y + DVec3::Y * 0.02).normalize_or(y);
        // The pressure rises within the first sixth and falls within the last sixth.
        let ramp = (part.min(1.0 - part) * 6.0).min(1.0);
        let ramp = ramp * ramp * (3.0 - 2.0 * ramp);
        let pressure = (0.25 + 0.55 * ramp + self.grip.at(time_secs)).clamp(0.05, 1.0);
        HandSample { p, axes: [x, y, x.cross(y)], pressure }
    }
}

/// Fraction of the path that is covered after a fraction of the time.
fn progress(part: f64) -> f64 {
    let smooth = part * part * part * (10.0 + part * (6.0 * part - 15.0));
    SPEED_AT_ENDS * part + (1.0 - SPEED_AT_ENDS) * smooth
}

/// A path, parametrised by effort. The hand's time is proportional to the effort.
#[derive(Debug)]
pub(super) struct HandPath {
    nodes: Vec<Node>,
    /// Effort up to each node.
    effort: Vec<f64>,
}

impl HandPath {
    /// The path through two nodes or more.
    pub(super) fn new(mut nodes: Vec<Node>) -> Self {
        // The path is smoothed, because a hand rounds off sharp corners of a surface.
        for _ in 0..SMOOTHING {
            for i in 1..nodes.len() - 1 {
                let mean = (nodes[i - 1].p + nodes[i + 1].p) * 0.5;
                nodes[i].p = (nodes[i].p + mean) * 0.5;
            }
        }
        let step = |i: usize| nodes[i + 1].p - nodes[i].p;
        let last = nodes.len() - 1;
        let bend = |i: usize| {
            if i == 0 || i == last {
                return 1.0;
            }
            let turn = (step(i).normalize_or_zero() - step(i - 1).normalize_or_zero()).length();
            // The speed halves in a bend of 7 cm radius.
            libm::cbrt(1.0 + 0.5 * turn / step(i).length().max(1e-6))
        };
        let mut slowing: Vec<f64> = (0..=last).map(bend).collect();
        for _ in 0..SMOOTHING {
            for i in 1..last {
                slowing[i] = 0.5 * slowing[i] + 0.25 * (slowing[i - 1] + slowing[i + 1]);
            }
        }
        let mut effort = vec![0.0];
        let mut sum = 0.0;
        for i in 0..last {
            sum += step(i).length() * 0.5 * (slowing[i] + slowing[i + 1]);
            effort.push(sum);
        }
        Self { nodes, effort }
    }

    /// Length of the path, weighted by the factor by which bends slow the hand, metres.
    fn effort_m(&self) -> f64 {
        self.effort[self.nodes.len() - 1]
    }

    pub(super) fn first(&self) -> Node {
        self.nodes[0]
    }

    /// Position and unit direction of travel at a fraction of the effort (a spline between the nodes: Catmull and Rom,
    /// 1974).
    fn at(&self, part: f64) -> (Node, DVec3) {
        let last = self.nodes.len() - 1;
        let want = part.clamp(0.0, 1.0) * self.effort[last];
        let i = self.effort.partition_point(|&e| e <= want).clamp(1, last) - 1;
        let span = self.effort[i + 1] - self.effort[i];
        let u = if span > 0.0 { (want - self.effort[i]) / span } else { 0.0 };
        let node = |at: usize| self.nodes[at.min(last)];
        let (b, c) = (node(i), node(i + 1));
        let a = if i > 0 { node(i - 1).p } else { b.p * 2.0 - c.p };
        let d = if i + 2 <= last { node(i + 2).p } else { c.p * 2.0 - b.p };
        let c1 = (c.p - a) * 0.5;
        let c2 = a - b.p * 2.5 + c.p * 2.0 - d * 0.5;
        let c3 = (d - a) * 0.5 + (b.p - c.p) * 1.5;
        let p = b.p + (c1 + (c2 + c3 * u) * u) * u;
        let travel = (c1 + (c2 * 2.0 + c3 * (3.0 * u)) * u).normalize_or(DVec3::X);
        let n = (b.n + (c.n - b.n) * u).normalize_or(b.n);
        (Node { p, n }, travel)
    }
}
