//! Random numbers and adversarial scenes.

use glam::{DVec3, Vec3};
use osp::{
    math::{Aabb, Sphere},
    occlusion::{OcclusionCuller, ShadowVolume},
    view::ViewWindow,
};
use osp_lab::Method;
pub(crate) use osp_testkit::Random;

/// A window like a screen's, possibly off-axis.
pub(crate) fn window(
    eye: DVec3,
    forward: DVec3,
    roll: DVec3,
    half: [f64; 2],
    off: [f64; 2],
    near: f64,
) -> ViewWindow {
    let forward = forward.normalize();
    let right = forward.cross(roll).normalize();
    let up = right.cross(forward);
    let corner = |x: f64, y: f64| forward + right * (off[0] + half[0] * x) + up * (off[1] + half[1] * y);
    let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    ViewWindow::new(eye, forward, corners, near).expect("a pointed cone")
}

/// From the origin along +z; the window reaches this far to each side at distance 1.
pub(crate) fn straight(half: f64, near: f64) -> ViewWindow {
    window(DVec3::ZERO, DVec3::Z, DVec3::Y, [half, half], [0.0, 0.0], near)
}

pub(crate) type Polygon = Vec<Vec3>;

/// The shadow volumes of polygons, in their order.
pub(crate) fn shadows_of(window: &ViewWindow, polygons: &[Polygon]) -> Vec<ShadowVolume> {
    let mut shadows = Vec::new();
    for polygon in polygons {
        ShadowVolume::push_polygon(polygon, window, &mut shadows);
    }
    shadows
}

/// The conservative cullers, built from these shadows.
pub(crate) fn sound_cullers(window: &ViewWindow, shadows: &[ShadowVolume]) -> Vec<Box<dyn OcclusionCuller>> {
    let built = Method::conservative_cullers().into_iter().map(|kind| {
        let mut culler = kind.create(32);
        culler.build(window, shadows);
        culler
    });
    built.collect()
}

/// A window and polygons, the polygons in no order.
pub(crate) struct Scene {
    pub(crate) window: ViewWindow,
    pub(crate) polygons: Vec<Polygon>,
}

/// What [`Scene::random`] puts together.
pub(crate) const FAMILIES: [&str; 6] = ["random", "tiles", "t-junctions", "strips", "boxes", "slivers"];

/// So many scenes of each family, their names, and the numbers that follow.
pub(crate) fn scenes(seed: u64, of_each: u64) -> impl Iterator<Item = (String, Random, Scene)> {
    let all = FAMILIES.iter().enumerate().flat_map(move |family| (0..of_each).map(move |n| (family, n)));
    all.map(move |((family, name), n)| {
        let mut random = Random::new(seed ^ n << 8 ^ (family as u64) << 40);
        let scene = Scene::random(family, &mut random);
        (format!("{name} {n}"), random, scene)
    })
}

impl Scene {
    pub(crate) fn random(family: usize, random: &mut Random) -> Self {
        let eye = random.in_cube() * random.log_range(0.01, 100.0);
        let forward = random.direction();
        let half = random.range(0.2, 1.4);
        let aspect = random.range(0.5, 1.8);
        let off = [random.range(-0.5, 0.5), random.range(-0.3, 0.3)];
        let roll = random.direction();
        let near = random.log_range(1.0e-3, 0.5);
        let window = window(eye, forward, roll, [half * aspect, half], off, near);
        let mut polygons = Vec::new();
        match FAMILIES[family] {
            "random" => {
                for _ in 0..3 + random.below(30) {
                    let size = random.log_range(0.05, 3.0);
                    polygons.extend(random_quad(&window, size, random));
                }
            }
            "tiles" => {
                for _ in 0..1 + random.below(3) {
                    let (columns, rows) = (1 + random.below(5), 1 + random.below(4));
                    tiles(&window, columns, rows, 0.0, random, &mut polygons);
                }
            }
            "t-junctions" => {
                for _ in 0..1 + random.below(3) {
                    let (columns, rows) = (1 + random.below(5), 1 + random.below(4));
                    tiles(&window, columns, rows, 0.5, random, &mut polygons);
                }
            }
            "strips" => {
                for _ in 0..1 + random.below(4) {
                    strip(&window, random, &mut polygons);
                }
            }
            "boxes" => {
                for _ in 0..1 + random.below(4) {
                    closed_box(&window, random, &mut polygons);
                }
            }
            _ => {
                for _ in 0..3 + random.below(25) {
                    sliver(&window, random, &mut polygons);
                }
            }
        }
        Self { window, polygons }
    }

    /// The shadow volumes, best first, and the polygons that cast them, in no order.
    pub(crate) fn occluders(&self) -> (Vec<ShadowVolume>, Vec<Polygon>) {
        let mut cast: Vec<(f64, ShadowVolume)> = Vec::new();
        let (mut shadows, mut polygons) = (Vec::new(), Vec::new());
        for polygon in &self.polygons {
            shadows.clear();
            ShadowVolume::push_polygon(polygon, &self.window, &mut shadows);
            shadows.retain(|s| s.solid_angle_in(&self.window) > 0.0);
            if !shadows.is_empty() {
                polygons.push(polygon.clone());
                cast.extend(shadows.iter().map(|s| (s.solid_angle_in(&self.window), *s)));
            }
        }
        cast.sort_by(|a, b| b.0.total_cmp(&a.0));
        (cast.into_iter().map(|(_, s)| s).collect(), polygons)
    }
}

/// A point in front of the eye, mostly inside the window.
fn ahead(window: &ViewWindow, random: &mut Random) -> DVec3 {
    let corners = window.corners();
    let (a, b) = (random.range(-0.2, 1.2), random.range(-0.2, 1.2));
    let low = corners[0].lerp(corners[1], a);
    let high = corners[3].lerp(corners[2], a);
    let direction = low.lerp(high, b).normalize_or(window.forward());
    window.eye_in_world() + direction * random.log_range(0.3, 20.0)
}

fn random_quad(window: &ViewWindow, size: f64, random: &mut Random) -> Option<Polygon> {
    let center = ahead(window, random);
    let (u, normal) = (random.direction(), random.direction());
    let v = u.cross(normal).normalize_or_zero();
    let (a, b) = (size * random.range(0.2, 1.0), size * random.range(0.2, 1.0));
    let at = |x: f64, y: f64| (center + u * a * x + v * b * y).as_vec3();
    Some(match random.below(3) {
        0 => vec![at(-1.0, -1.0), at(1.0, -1.0), at(0.3, 1.0)],
        1 => vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)],
        // Bent a little, as ribbons are.
        _ => {
            let bend = random.range(-1.0e-3, 1.0e-3) * size;
            vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0) + (normal * bend).as_vec3(), at(-1.0, 1.0)]
        }
    })
}

/// A wall of quads that share corners bit for bit; `shift` moves every second row, so that corners meet edges.
fn tiles(
    window: &ViewWindow,
    columns: usize,
    rows: usize,
    shift: f64,
    random: &mut Random,
    out: &mut Vec<Polygon>,
) {
    let corner = ahead(window, random);
    let size = random.log_range(0.2, 3.0);
    let u = random.direction();
    let v = u.cross(random.direction()).normalize_or_zero() * size;
    let u = u * size;
    for row in 0..rows {
        let shift = if row % 2 == 1 { shift } else { 0.0 };
        for column in 0..columns {
            let at = |x: usize, y: usize| {
                (corner + u * ((column + x) as f64 + shift) + v * (row + y) as f64).as_vec3()
            };
            out.push(vec![at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
        }
    }
}

/// A bending ribbon whose quads share edges bit for bit.
fn strip(window: &ViewWindow, random: &mut Random, out: &mut Vec<Polygon>) {
    let mut at = ahead(window, random);
    let mut travel = random.direction();
    let mut side = travel.cross(random.direction()).normalize_or_zero();
    let (width, step) = (random.log_range(0.05, 2.0), random.log_range(0.05, 1.0));
    let mut border = [(at + side * width).as_vec3(), (at - side * width).as_vec3()];
    for _ in 0..2 + random.below(20) {
        travel = (travel + random.direction() * 0.3).normalize_or(travel);
        side = (side - travel * travel.dot(side)).normalize_or(side);
        at += travel * step;
        let next = [(at + side * width).as_vec3(), (at - side * width).as_vec3()];
        out.push(vec![border[0], border[1], next[1]]);
        out.push(vec![border[0], next[1], next[0]]);
        border = next;
    }
}

fn closed_box(window: &ViewWindow, random: &mut Random, out: &mut Vec<Polygon>) {
    let center = ahead(window, random);
    let (u, w) = (random.direction(), random.direction());
    let v = u.cross(w).normalize_or_zero();
    let w = u.cross(v);
    let size = random.log_range(0.1, 3.0);
    let half = [u * size, v * size * random.range(0.2, 1.0), w * size * random.range(0.2, 1.0)];
    let at = |i: usize| {
        let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        (center + half[0] * sign(0) + half[1] * sign(1) + half[2] * sign(2)).as_vec3()
    };
    for face in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
        out.push(face.map(at).to_vec());
    }
}

fn sliver(window: &ViewWindow, random: &mut Random, out: &mut Vec<Polygon>) {
    let center = ahead(window, random);
    let u = random.direction() * random.log_range(0.1, 10.0);
    let v = u.cross(random.direction()).normalize_or_zero() * random.log_range(1.0e-5, 1.0);
    let at = |x: f64, y: f64| (center + u * x + v * y).as_vec3();
    out.push(if random.chance(0.5) {
        vec![at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]
    } else {
        vec![at(-1.0, 0.0), at(1.0, -0.5), at(1.0, 0.5)]
    });
}

/// A box that is hard to judge: tiny to large, often at an edge or a corner of an occluder, before or behind it.
pub(crate) fn volume(window: &ViewWindow, occluders: &[Polygon], random: &mut Random) -> Aabb {
    let center = if occluders.is_empty() || random.chance(0.15) {
        ahead(window, random)
    } else {
        let polygon = &occluders[random.below(occluders.len())];
        let i = random.below(polygon.len());
        let (a, b) = (polygon[i].as_dvec3(), polygon[(i + 1) % polygon.len()].as_dvec3());
        let on_edge = a.lerp(b, if random.chance(0.3) { 0.0 } else { random.unit() });
        let inside = polygon.iter().fold(DVec3::ZERO, |sum, p| sum + p.as_dvec3()) / polygon.len() as f64;
        let inwards = if random.chance(0.5) { random.log_range(1.0e-9, 1.0) } else { 0.0 };
        let at = on_edge.lerp(inside, inwards) - window.eye_in_world();
        let farther = if random.chance(0.7) { random.range(1.0, 3.0) } else { random.range(0.4, 1.3) };
        window.eye_in_world() + at * farther
    };
    let size = random.log_range(1.0e-6, 1.0);
    let extent = DVec3::new(random.unit(), random.unit(), random.unit()) * size;
    let off = random.in_cube() * extent;
    let (low, high) = (center + off - extent, center + off + extent);
    Aabb::new(low.as_vec3(), high.as_vec3())
}

/// A ball, likewise.
pub(crate) fn ball(bounds: &Aabb) -> Sphere {
    Sphere { center: bounds.center(), radius_m: bounds.extent().max_element() * 0.5 }
}
