use glam::DVec3;

use super::artist::{Artist, Mirrored, RibbonStyle, Subject};
use super::path::{Course, in_space};

/// Half the edge of the filled volume, metres. The rest of the root cube is a margin for tremor and drift.
const HALF_M: f64 = 1.96;

const CENTER: DVec3 = DVec3::new(0.0, 1.5, 0.0);

/// Long loose strokes through the whole volume. The artist floats, as painting programs allow.
#[derive(Debug)]
pub(super) struct Scribble {
    /// Index of the current work position in the sequence.
    patch: u64,
    strokes_left: u32,
    start: DVec3,
    color: (f64, f64, f64),
}

impl Scribble {
    pub(super) fn new(artist: &mut Artist) -> Self {
        artist.stand(DVec3::new(0.0, 1.6, 0.6), DVec3::NEG_Z, 2.0);
        // Seeds start at different indices of the same low-discrepancy sequence.
        let patch = artist.rng.index(1000) as u64;
        Self { patch, strokes_left: 0, start: CENTER, color: (0.5, 0.5, 0.5) }
    }
}

impl Subject for Scribble {
    fn work(&mut self, artist: &mut Artist) {
        if self.strokes_left == 0 {
            self.patch += 1;
            // J. H. Halton, 1960: points that fill the volume uniformly for any number of points.
            let part = DVec3::new(radical(self.patch, 2), radical(self.patch, 3), radical(self.patch, 5));
            self.start = CENTER + (part * 2.0 - 1.0) * HALF_M;
            self.color = (artist.rng.unit(), artist.rng.unit(), artist.rng.unit());
            self.strokes_left = 2 + artist.rng.index(3) as u32;
        }
        self.strokes_left -= 1;
        let rng = &mut artist.rng;
        let start = (self.start + rng.direction() * rng.between(0.0, 0.3) - CENTER)
            .clamp(DVec3::splat(-HALF_M), DVec3::splat(HALF_M))
            + CENTER;
        let heading = rng.direction();
        let length_m = rng.log_normal(0.6, 0.5).clamp(0.15, 2.5);
        let mut course = Course::new(rng, start, heading, length_m);
        course.bend *= 4.0;
        course.swing *= 3.0;
        let winding = rng.normal() * 3.0;
        let style = RibbonStyle {
            width_m: rng.between(0.008, 0.04),
            color: rng.color_near(self.color, 0.15),
            pace: 1.0,
            mirrored: Mirrored::No,
        };
        let stance = artist.floating(start);
        let facing = stance.eye - start;
        // The pull becomes strong within the last decimetres of the volume.
        let steer = |p: DVec3| {
            let beyond = |c: f64| -c.signum() * ((c.abs() - (HALF_M - 0.25)) / 0.25).max(0.0) * 20.0;
            let off = p - CENTER;
            DVec3::new(beyond(off.x), beyond(off.y), beyond(off.z))
        };
        let nodes = in_space(&mut artist.rng, &course, winding, facing, steer);
        artist.ribbon(nodes, style, stance);
    }
}

/// The radical inverse: the digits of `index` in `base`, mirrored at the decimal point.
fn radical(mut index: u64, base: u64) -> f64 {
    let (mut value, mut place) = (0.0, 1.0);
    while index > 0 {
        place /= base as f64;
        value += place * (index % base) as f64;
        index /= base;
    }
    value
}
