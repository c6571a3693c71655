use glam::DVec3;

use super::artist::{Artist, Mirrored, RibbonStyle, Subject};
use super::path::{Course, Node, on_surface};
use super::vector::{level, perpendicular, turned};

/// The bust is larger than life, as most sculptures in VR are.
const SCALE: f64 = 2.4;

const CENTER: DVec3 = DVec3::new(0.0, 1.5, 0.0);

/// A bust: first a sketch of a few long lines, then small strokes that cover it patch by patch, in layers.
#[derive(Debug)]
pub(super) struct Portrait {
    /// Horizontal direction from the bust to the artist, radians from the direction of the bust's face.
    angle: f64,
    height: f64,
    strokes_left: u32,
    region: Region,
}

/// The part of the bust that a patch belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Region {
    Sketch,
    Skin,
    Feature,
    Hair,
    Clothes,
}

impl Portrait {
    pub(super) fn new(artist: &mut Artist) -> Self {
        artist.stand(CENTER + DVec3::new(0.0, 0.15, 1.2), DVec3::NEG_Z, 1.3);
        Self { angle: 0.0, height: 0.0, strokes_left: 12, region: Region::Sketch }
    }

    /// Moves the artist around the bust, and chooses a patch on that side.
    fn next_patch(&mut self, artist: &mut Artist) {
        let rng = &mut artist.rng;
        self.angle += 0.45 + 0.45 * rng.normal();
        self.height = rng.between(-0.36, 0.12);
        let turn = libm::remainder(self.angle, std::f64::consts::TAU).abs();
        self.region = if self.height < -0.22 {
            Region::Clothes
        } else if turn > 1.3 || self.height > 0.07 {
            Region::Hair
        } else if rng.chance(0.3) {
            Region::Feature
        } else {
            Region::Skin
        };
        self.strokes_left = match self.region {
            Region::Hair => 8 + rng.index(12) as u32,
            Region::Feature => 4 + rng.index(6) as u32,
            _ => 6 + rng.index(10) as u32,
        };
    }
}

impl Subject for Portrait {
    fn work(&mut self, artist: &mut Artist) {
        if self.strokes_left == 0 {
            self.next_patch(artist);
        }
        self.strokes_left -= 1;
        let region = self.region;
        let rng = &mut artist.rng;
        if region == Region::Sketch {
            self.angle = rng.between(-0.6, 0.6);
            self.height = rng.between(-0.1, 0.08);
        }
        let angle = self.angle + 0.25 * rng.normal();
        let height = self.height + 0.02 * rng.normal();
        let side = DVec3::new(libm::sin(angle), 0.0, libm::cos(angle));
        // Strokes have different heights above the surface, so that no stroke lies exactly on another.
        let (low_mm, high_mm) = match region {
            Region::Sketch => (-4.0, 2.0),
            Region::Skin => (0.0, 10.0),
            Region::Feature => (9.0, 14.0),
            Region::Hair => (12.0, 45.0),
            Region::Clothes => (2.0, 25.0),
        };
        let layer_m = rng.between(low_mm, high_mm) / 1000.0;
        // Hair may start anywhere up to the crown.
        let (reach, height) = match region {
            Region::Hair if rng.chance(0.6) => (rng.between(0.02, 0.09), 0.12),
            _ => (0.16, height),
        };
        let start = nearest(CENTER + (side * reach + DVec3::Y * height) * SCALE, layer_m);
        let across = start.n.cross(DVec3::Y).normalize_or(DVec3::X);
        let down = perpendicular(DVec3::NEG_Y, start.n);
        let (heading, length_m, width_m, color) = match region {
            Region::Sketch => {
                let heading = if rng.chance(0.5) { across } else { down };
                (heading, rng.between(0.3, 0.6), 0.006, (0.35, 0.35, 0.38))
            }
            Region::Skin => {
                let heading = turned(across, start.n, rng.normal() * 0.6);
                let light = 0.10 * start.n.y + 0.05 * start.n.x;
                let color = (0.82 + light, 0.62 + light, 0.50 + light);
                (heading, rng.log_normal(0.11, 0.4), rng.between(0.012, 0.030), color)
            }
            Region::Feature => {
                let heading = turned(across, start.n, rng.normal() * 0.4);
                let color = rng.pick([(0.55, 0.25, 0.22), (0.30, 0.20, 0.15), (0.95, 0.93, 0.90)]);
                (heading, rng.log_normal(0.06, 0.35), rng.between(0.005, 0.009), color)
            }
            Region::Hair => {
                let heading = turned(down, start.n, rng.normal() * 0.25);
                (heading, rng.log_normal(0.28, 0.35), rng.between(0.008, 0.020), (0.28, 0.17, 0.10))
            }
            Region::Clothes => {
                let heading = turned(down, start.n, rng.normal() * 0.5);
                (heading, rng.log_normal(0.20, 0.35), rng.between(0.025, 0.040), (0.20, 0.28, 0.48))
            }
        };
        let length_m = length_m.clamp(0.03, 0.7);
        let color = rng.color_near(color, 0.08);
        let twofold = match region {
            Region::Feature => 0.6,
            Region::Skin => 0.2,
            _ => 0.0,
        };
        let mirrored = if rng.chance(twofold) { Mirrored::Yes } else { Mirrored::No };
        let course = Course::new(rng, start.p, heading, length_m);
        let nodes = on_surface(rng, &course, |p| nearest(p, layer_m));
        let outward = level(nodes[nodes.len() / 2].p - CENTER, side);
        let stance = artist.standing(nodes[0].p, outward);
        artist.ribbon(nodes, RibbonStyle { width_m, color, pace: 1.4, mirrored }, stance);
    }
}

/// The point nearest to `p` on the bust's surface, raised by `layer_m`.
fn nearest(mut p: DVec3, layer_m: f64) -> Node {
    let mut n = DVec3::Z;
    for _ in 0..4 {
        n = gradient(p);
        p -= n * (distance(p) - layer_m);
    }
    Node { p, n }
}

fn gradient(p: DVec3) -> DVec3 {
    const H: f64 = 1e-4;
    let along = |axis: DVec3| distance(p + axis * H) - distance(p - axis * H);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)).normalize_or(DVec3::Y)
}

/// Approximate signed distance from the bust's surface, metres, positive outside: smoothly blended ellipsoids.
fn distance(world: DVec3) -> f64 {
    let p = (world - CENTER) / SCALE;
    let side = DVec3::new(p.x.abs(), p.y, p.z);
    let skull = ellipsoid(p, DVec3::ZERO, DVec3::new(0.078, 0.105, 0.098));
    let jaw = ellipsoid(p, DVec3::new(0.0, -0.080, 0.030), DVec3::new(0.058, 0.060, 0.062));
    let nose = ellipsoid(p, DVec3::new(0.0, -0.025, 0.100), DVec3::new(0.014, 0.032, 0.024));
    let ear = ellipsoid(side, DVec3::new(0.080, -0.012, -0.005), DVec3::new(0.012, 0.032, 0.020));
    let neck = ellipsoid(p, DVec3::new(0.0, -0.180, -0.015), DVec3::new(0.056, 0.130, 0.060));
    let shoulders = ellipsoid(p, DVec3::new(0.0, -0.320, -0.030), DVec3::new(0.220, 0.085, 0.110));
    let head = melt(melt(skull, jaw, 0.03), melt(nose, ear, 0.01), 0.012);
    melt(melt(head, neck, 0.03), shoulders, 0.05) * SCALE
}

fn ellipsoid(p: DVec3, center: DVec3, radii: DVec3) -> f64 {
    let p = p - center;
    let near = (p / radii).length();
    let steep = (p / (radii * radii)).length();
    if steep > 0.0 { near * (near - 1.0) / steep } else { -radii.min_element() }
}

/// The smaller of two distances, with a smooth transition where they differ by less than `radius`.
fn melt(a: f64, b: f64, radius: f64) -> f64 {
    let h = (radius - (a - b).abs()).max(0.0) / radius;
    a.min(b) - h * h * radius * 0.25
}
