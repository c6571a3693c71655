//! The path of a stroke: nodes with the surface normal, about a centimetre apart.

use glam::DVec3;

use super::random::Random;
use super::vector::{perpendicular, turned};

/// Distance of the nodes, metres.
const STEP_M: f64 = 0.01;

/// Largest curvature of a stroke within its surface, 1/m.
const MOST_BEND: f64 = 25.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) p: DVec3,
    pub(super) n: DVec3,
}

/// Start, direction, length and curvature of a stroke.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    pub(super) start: DVec3,
    /// Initial direction; it need not be tangent to the surface.
    pub(super) heading: DVec3,
    pub(super) length_m: f64,
    /// Mean curvature, 1/m.
    pub(super) bend: f64,
    /// Amplitude of the curvature's oscillation about the mean, 1/m.
    pub(super) swing: f64,
}

impl Course {
    /// A course with the gentle bends of a hand that pivots at wrist and elbow.
    pub(super) fn new(rng: &mut Random, start: DVec3, heading: DVec3, length_m: f64) -> Self {
        Self {
            start,
            heading,
            length_m,
            bend: rng.normal() * 0.5 / length_m,
            swing: rng.normal() * 0.7 / length_m,
        }
    }

    fn steps(&self) -> usize {
        ((self.length_m / STEP_M) as usize).clamp(6, 2000)
    }

    /// Curvature at a fraction of the path, 1/m.
    fn curvature(&self, part: f64, phase: f64) -> f64 {
        let curvature = self.bend + self.swing * libm::sin(std::f64::consts::TAU * part * 1.3 + phase);
        curvature.clamp(-MOST_BEND, MOST_BEND)
    }
}

/// A path on a surface; `surface` returns the nearest point of the surface and its normal.
pub(super) fn on_surface(rng: &mut Random, course: &Course, surface: impl Fn(DVec3) -> Node) -> Vec<Node> {
    let phase = rng.between(0.0, std::f64::consts::TAU);
    let steps = course.steps();
    let step_m = course.length_m / steps as f64;
    let mut node = surface(course.start);
    let mut heading = perpendicular(course.heading, node.n);
    let mut nodes = vec![node];
    for i in 0..steps {
        heading = turned(heading, node.n, course.curvature(i as f64 / steps as f64, phase) * step_m);
        node = surface(node.p + heading * step_m);
        heading = perpendicular(heading, node.n);
        nodes.push(node);
    }
    nodes
}

pub(super) fn on_plane(rng: &mut Random, course: &Course, normal: DVec3) -> Vec<Node> {
    let start = course.start;
    on_surface(rng, course, |p| Node { p: p - normal * (p - start).dot(normal), n: normal })
}

/// A winding path in free space. Its normal begins near `facing`. `steer` returns the direction that pulls the path at
/// a position, or zero.
pub(super) fn in_space(
    rng: &mut Random,
    course: &Course,
    winding: f64,
    facing: DVec3,
    steer: impl Fn(DVec3) -> DVec3,
) -> Vec<Node> {
    let phase = rng.between(0.0, std::f64::consts::TAU);
    let twist = rng.normal() * 0.6 / course.length_m;
    let steps = course.steps();
    let step_m = course.length_m / steps as f64;
    let mut heading = course.heading.normalize_or(DVec3::X);
    let mut n = perpendicular(facing, heading);
    let mut axis = perpendicular(rng.direction(), heading);
    let mut p = course.start;
    let mut nodes = vec![Node { p, n }];
    for i in 0..steps {
        let part = i as f64 / steps as f64;
        axis = perpendicular(turned(axis, heading, winding * step_m), heading);
        heading = turned(heading, axis, course.curvature(part, phase) * step_m);
        heading = (heading + steer(p) * step_m).normalize_or(heading);
        p += heading * step_m;
        n = perpendicular(turned(n, heading, twist * step_m), heading);
        nodes.push(Node { p, n });
    }
    nodes
}
