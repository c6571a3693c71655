use glam::DVec3;

use super::artist::{Artist, Mirrored, RibbonStyle, Subject};
use super::path::{Course, in_space};
use super::vector::{perpendicular, turned};

/// How far the tip of the plant goes on with every stroke, metres.
const ADVANCE_M: f64 = 0.10;

/// A plant without end: stems, tendrils and leaves around a tip that leaves the root cube and never comes back.
#[derive(Debug)]
pub(super) struct Grow {
    tip: DVec3,
    /// Its direction in the long run.
    aim: DVec3,
    heading: DVec3,
    season: f64,
}

impl Grow {
    pub(super) fn new(artist: &mut Artist) -> Self {
        let angle = artist.rng.between(0.0, std::f64::consts::TAU);
        let aim = DVec3::new(libm::cos(angle), 0.18, libm::sin(angle)).normalize();
        let tip = DVec3::new(0.0, 1.1, 0.0);
        artist.stand(tip + DVec3::new(0.3, 0.5, 0.5), DVec3::NEG_Z, 1.5);
        Self { tip, aim, heading: aim, season: artist.rng.unit() }
    }
}

impl Subject for Grow {
    fn work(&mut self, artist: &mut Artist) {
        let rng = &mut artist.rng;
        let wander = perpendicular(rng.direction(), self.heading) * 0.35;
        self.heading = (self.heading + wander + self.aim * 0.15).normalize_or(self.aim);
        // Never back towards the root.
        let forward = self.heading.dot(self.aim);
        if forward < 0.4 {
            self.heading = (self.heading + self.aim * (0.4 - forward)).normalize_or(self.aim);
        }
        self.tip += self.heading * ADVANCE_M;
        self.season += 0.002;
        let around = perpendicular(rng.direction(), self.heading);
        let kind = rng.unit();
        let (offset_m, heading, length_m, bend, winding, width_m, color) = if kind < 0.35 {
            let heading = self.heading + around * rng.between(-0.2, 0.2);
            let length_m = rng.log_normal(0.45, 0.35).clamp(0.1, 1.5);
            (
                rng.between(0.01, 0.06),
                heading,
                length_m,
                1.0,
                2.0,
                rng.between(0.012, 0.025),
                (0.35, 0.28, 0.18),
            )
        } else if kind < 0.7 {
            let heading = turned(self.heading, perpendicular(around, self.heading), rng.between(0.4, 1.4));
            let length_m = rng.log_normal(0.35, 0.5).clamp(0.06, 1.2);
            (0.05, heading, length_m, 8.0, 8.0, rng.between(0.005, 0.010), (0.30, 0.50, 0.20))
        } else {
            let green = 0.45 + 0.25 * libm::sin(self.season);
            let length_m = rng.log_normal(0.11, 0.35).clamp(0.04, 0.35);
            (
                rng.between(0.1, 0.45),
                around + self.heading * 0.5,
                length_m,
                2.0,
                1.0,
                rng.between(0.025, 0.04),
                (0.75 - green, green, 0.15),
            )
        };
        let start = self.tip + around * offset_m;
        let mut course = Course::new(rng, start, heading, length_m);
        course.bend *= bend;
        let winding = rng.normal() * winding;
        let color = rng.color_near(color, 0.12);
        let style = RibbonStyle { width_m, color, pace: 1.2, mirrored: Mirrored::No };
        let stance = artist.floating(start);
        let nodes = in_space(&mut artist.rng, &course, winding, stance.eye - start, |_| DVec3::ZERO);
        artist.ribbon(nodes, style, stance);
    }
}
