//! Connected meshes of many kinds, next to every limit of a picture of surfaces: what it calls hidden is blocked, in `f64`.

use super::{
    connected::{convex, hides},
    judge::{is_blocked, is_in_window, points_of_ball},
    random::{Polygon, Random, ball, window},
};
use crate::engine::World;
use glam::{DVec3, Vec3};
use osp::{
    index::Backend,
    math::Aabb,
    occlusion::{OcclusionCuller, PreviousFrameOccluders, Verdict},
    view::ViewWindow,
};
use std::{
    f64::consts::TAU,
    hash::{DefaultHasher, Hash, Hasher},
};

/// Scenes of each kind; `OSP_SCENES` names another number.
const SCENES: u64 = if cfg!(debug_assertions) { 300 } else { 1500 };

const KINDS: [&str; 9] =
    ["grid", "room", "ribbon", "boxes", "t-junctions", "cracks", "slivers", "near plane", "specks"];

/// A view in its own axes: right, up and forward.
struct Eye {
    window: ViewWindow,
    half: [f64; 2],
    off: [f64; 2],
    near: f64,
    pixels: [u32; 2],
}

impl Eye {
    fn random(random: &mut Random) -> Self {
        let size = [1.0, 1.0, 1.0, 1.0e-6, 1.0e6][random.below(5)];
        let is_straight = random.chance(0.3);
        let eye = match random.below(4) {
            0 => DVec3::ZERO,
            1 => random.in_cube() * size,
            2 => random.in_cube() * size * 100.0,
            _ => random.in_cube() * 1.0e4 * size,
        };
        let (forward, roll) =
            if is_straight { (DVec3::Z, DVec3::Y) } else { (random.direction(), random.direction()) };
        let height = random.log_range(0.02, 30.0);
        let half = if is_straight { [1.0; 2] } else { [height * random.log_range(0.1, 10.0), height] };
        let off = if is_straight { [0.0; 2] } else { half.map(|half| half * random.range(-2.0, 2.0)) };
        let near = random.log_range(1.0e-4, 0.5) * size;
        let pixels = [[8, 8], [64, 40], [256, 144]][random.below(3)];
        Self { window: window(eye, forward, roll, half, off, near), half, off, near, pixels }
    }

    fn axes(&self) -> [DVec3; 3] {
        let forward = self.window.forward();
        let corners = self.window.corners().map(|corner| corner / corner.dot(forward));
        [(corners[1] - corners[0]).normalize(), (corners[3] - corners[0]).normalize(), forward]
    }

    /// At this place of the window (-1 to 1) and this depth; world space, from the eye.
    fn at(&self, x: f64, y: f64, depth: f64) -> DVec3 {
        let [right, up, forward] = self.axes();
        let across = self.off[0] + self.half[0] * x;
        (right * across + up * (self.off[1] + self.half[1] * y) + forward) * depth
    }

    /// Half a pixel at distance 1.
    fn half_pixel(&self) -> [f64; 2] {
        [0, 1].map(|axis| self.half[axis] / f64::from(self.pixels[axis]))
    }

    fn world(&self, from_eye: DVec3) -> Vec3 {
        (self.window.eye_in_world() + from_eye).as_vec3()
    }
}

/// The corners of so many cells: by their places from -1 to 1, row by row.
fn lattice([columns, rows]: [usize; 2], mut at: impl FnMut(f64, f64) -> Vec3) -> Vec<Vec3> {
    let place = |i: usize, of: usize| 2.0 * i as f64 / of as f64 - 1.0;
    let places = (0..=rows).flat_map(|row| (0..=columns).map(move |column| (column, row)));
    places.map(|(column, row)| at(place(column, columns), place(row, rows))).collect()
}

/// A mesh of quads and triangles over a grid of corners; the last column is the first again if it is closed.
fn push_grid(corners: &[Vec3], columns: usize, random: &mut Random, holes: f64, out: &mut Vec<Polygon>) {
    let (rows, is_split) = (corners.len() / columns, random.below(3));
    for row in 1..rows {
        for column in 1..columns {
            let at = |r: usize, c: usize| corners[(row - r) * columns + column - c];
            let [a, b, c, d] = [at(1, 1), at(1, 0), at(0, 0), at(0, 1)];
            if random.chance(holes) {
                continue;
            }
            let mut parts = match is_split {
                0 => vec![vec![a, b, c, d]],
                1 => vec![vec![a, b, c], vec![a, c, d]],
                _ => vec![vec![a, b, d], vec![b, c, d]],
            };
            for part in &mut parts {
                let turn = random.below(part.len());
                part.rotate_left(turn);
                if random.chance(0.3) {
                    part.reverse();
                }
            }
            out.append(&mut parts);
        }
    }
}

fn grid(eye: &Eye, random: &mut Random, [columns, rows]: [usize; 2], noise: f64) -> Vec<Vec3> {
    let near = eye.near;
    let depth = near * random.log_range(1.0, 1.0e3);
    let slant = [(); 2].map(|()| random.range(-0.9, 0.9));
    let size = random.range(0.3, 1.6);
    lattice([columns, rows], |x, y| {
        let mut off = |place: f64, of: usize| size * place + random.range(-noise, noise) / of as f64;
        let (x, y) = (off(x, columns), off(y, rows));
        let away = 1.0 / (1.0 + slant[0] * 0.5 * x + slant[1] * 0.5 * y).max(0.05);
        eye.world(eye.at(x, y, depth * away * (1.0 + random.range(-noise, noise) * 0.02)))
    })
}

/// A room around the eye, or a box before it, each wall cut into a grid; corners are the same bit for bit.
fn push_box(eye: &Eye, random: &mut Random, is_room: bool, out: &mut Vec<Polygon>) {
    let size = eye.near * random.log_range(2.0, 1.0e3);
    let centre = if is_room {
        random.in_cube() * size * 0.8
    } else {
        eye.at(random.range(-1.0, 1.0), random.range(-1.0, 1.0), size * random.range(1.0, 6.0))
    };
    let (cells, holes) = (1 + random.below(4), if random.chance(0.5) { 0.1 } else { 0.0 });
    let turned = random.direction();
    let (right, up) = (turned.any_orthonormal_pair(), turned);
    let axes = if is_room && random.chance(0.7) { eye.axes() } else { [right.0, right.1, up] };
    for wall in 0..6 {
        let corners = lattice([cells; 2], |x, y| {
            let mut at = [if wall % 2 == 0 { 1.0 } else { -1.0 }, x, y];
            at.rotate_right(wall / 2);
            eye.world(centre + (axes[0] * at[0] + axes[1] * at[1] + axes[2] * at[2]) * size)
        });
        push_grid(&corners, cells + 1, random, holes, out);
    }
}

fn scene(kind: usize, eye: &Eye, random: &mut Random) -> Vec<Polygon> {
    let mut out = Vec::new();
    let near = eye.near;
    match KINDS[kind] {
        "grid" => {
            for _ in 0..1 + random.below(2) {
                let cells = [1 + random.below(8), 1 + random.below(8)];
                let corners = grid(eye, random, cells, 0.6);
                push_grid(&corners, cells[0] + 1, random, 0.05, &mut out);
            }
        }
        "room" => push_box(eye, random, true, &mut out),
        "boxes" => (0..1 + random.below(4)).for_each(|_| push_box(eye, random, false, &mut out)),
        "ribbon" => {
            for _ in 0..1 + random.below(4) {
                let (mut corners, count) = (Vec::new(), 2 + random.below(12));
                let (width, depth) = (random.log_range(0.01, 0.8), near * random.log_range(1.0, 300.0));
                let (start, turn) = (random.range(0.0, TAU), random.range(-0.8, 0.8));
                for i in 0..=count {
                    let (angle, along) = (start + turn * i as f64, 2.0 * i as f64 / count as f64 - 1.0);
                    for side in [-width, width] {
                        let (x, y) = (along + side * angle.sin(), 0.4 * angle.cos() + side * angle.cos());
                        corners.push(eye.world(eye.at(x, y, depth * (1.2 + 0.5 * angle.sin()))));
                    }
                }
                push_grid(&corners, 2, random, 0.02, &mut out);
            }
        }
        "t-junctions" => {
            for cells in [[2 + random.below(6), 3], [1 + random.below(5), 3]] {
                let corners = grid(eye, random, cells, 0.0);
                push_grid(&corners, cells[0] + 1, random, 0.0, &mut out);
            }
        }
        "cracks" => {
            let cells = [2 + random.below(5), 2 + random.below(5)];
            let corners = grid(eye, random, cells, 0.3);
            push_grid(&corners, cells[0] + 1, random, 0.0, &mut out);
            for corner in out.iter_mut().flatten() {
                if random.chance(0.1) {
                    corner.x = if random.chance(0.5) { corner.x.next_up() } else { corner.x.next_down() };
                }
            }
        }
        "slivers" => {
            let depth = near * random.log_range(1.0, 100.0);
            let hub = eye.world(eye.at(random.range(-1.5, 1.5), random.range(-1.5, 1.5), depth));
            let mut angle = random.range(0.0, TAU);
            let mut rim = || {
                angle += random.log_range(1.0e-4, 0.6);
                let away = depth * random.log_range(1.0, 3.0);
                eye.world(eye.at(3.0 * angle.cos(), 3.0 * angle.sin(), away))
            };
            let mut before = rim();
            for _ in 0..30 {
                let next = rim();
                out.push(vec![hub, before, next]);
                before = next;
            }
        }
        "near plane" => {
            for _ in 0..2 + random.below(4) {
                let cells = [1 + random.below(2), 1 + random.below(2)];
                let (columns, rows) = (cells[0] + 1, cells[1] + 1);
                let away = [(); 2].map(|()| random.range(-3.0, 3.0));
                let mut corners = Vec::new();
                for row in 0..rows {
                    for column in 0..columns {
                        let [x, y] = [column, row].map(|at| 2.0 * at as f64 - 1.0);
                        let depth = near * (1.5 + away[0] * x + away[1] * y + random.range(-0.1, 0.1));
                        // Some end at the near plane, give or take a rounding.
                        let depth = if random.chance(0.15) { near * 1.000_000_1 } else { depth };
                        let size = near * random.log_range(0.5, 3.0);
                        let [right, up, forward] = eye.axes();
                        let (x, y) = (x * size * eye.half[0], y * size * eye.half[1]);
                        let middle = eye.at(0.0, 0.0, near) - forward * near;
                        corners.push(eye.world(middle + right * x + up * y + forward * depth));
                    }
                }
                push_grid(&corners, columns, random, 0.0, &mut out);
            }
        }
        _ => {
            let cells = [20, 12];
            let mut corners = grid(eye, random, cells, 1.5);
            let middle = corners[corners.len() / 2];
            let small = random.log_range(0.02, 1.0) as f32;
            corners.iter_mut().for_each(|corner| *corner = middle + (*corner - middle) * small);
            push_grid(&corners, cells[0] + 1, random, 0.02, &mut out);
        }
    }
    out
}

/// What was hidden, of how many, and a number that stands for all answers.
#[derive(Default)]
struct Answers {
    hidden: [u64; KINDS.len()],
    hasher: DefaultHasher,
}

/// A point next to an edge of an occluder, by up to two pixels in the picture, farther away or nearer.
fn beside_an_edge(eye: &Eye, polygons: &[Polygon], random: &mut Random) -> DVec3 {
    let polygon = &polygons[random.below(polygons.len())];
    let i = random.below(polygon.len());
    let along = if random.chance(0.2) { 0.0 } else { random.unit() };
    let [a, b] = [polygon[i], polygon[(i + 1) % polygon.len()]].map(|p| eye.window.from_eye(p));
    let on = a.lerp(b, along);
    let [right, up, forward] = eye.axes();
    let half_pixel = eye.half_pixel();
    let mut off = |axis: usize| {
        let size = random.log_range(1.0e-5, 4.0) * half_pixel[axis];
        if random.chance(0.5) { size } else { -size }
    };
    let (x, y) = (off(0), off(1));
    let beside = on + (right * x + up * y) * forward.dot(on);
    let away = random.log_range(1.0e-7, 3.0);
    beside * if random.chance(0.2) { 1.0 / (1.0 + away) } else { 1.0 + away }
}

fn attack(scenes: std::ops::Range<u64>, seed: u64, answers: &mut Answers) {
    for n in scenes {
        for (kind, name) in KINDS.iter().enumerate() {
            let mut random = Random::new(seed ^ n << 8 ^ (kind as u64) << 50);
            let eye = Eye::random(&mut random);
            let mut polygons = scene(kind, &eye, &mut random);
            polygons.retain(|polygon| polygon.iter().all(|p| p.is_finite()));
            if polygons.is_empty() {
                continue;
            }
            let last = World::of(polygons.iter().map(|p| convex(p))).picture(&eye.window, eye.pixels);
            for _ in 0..120 {
                let points = hidden_points(&eye, &last, &polygons, &mut random, &mut answers.hasher);
                let seen = points.iter().find(|x| !is_blocked(&eye.window, &polygons, **x));
                assert!(seen.is_none(), "{name} {n}: {seen:?} of {polygons:?}, {:?}", eye.window);
                answers.hidden[kind] += points.len() as u64;
            }
        }
    }
}

/// Points in the window of a random point, box or polygon that is called hidden.
fn hidden_points(
    eye: &Eye,
    last: &PreviousFrameOccluders,
    polygons: &[Polygon],
    random: &mut Random,
    hasher: &mut DefaultHasher,
) -> Vec<DVec3> {
    let p = eye.world(beside_an_edge(eye, polygons, random));
    let mut points = Vec::new();
    let is_hidden = hides(last, &Aabb::new(p, p));
    if is_hidden {
        points.push(eye.window.from_eye(p));
    }
    let away = eye.window.from_eye(p).length();
    let size = away * random.log_range(1.0e-4, 0.5) * eye.half[1].min(1.0);
    let mut near_p = || p + (random.in_cube() * size).as_vec3();
    let corners = [near_p(), near_p(), near_p(), near_p()];
    let bounds = Aabb::from_points(&corners[..2]);
    let is_box_hidden = hides(last, &bounds);
    if is_box_hidden {
        for _ in 0..16 {
            let part = Vec3::from_array([(); 3].map(|()| random.unit() as f32));
            points.push(eye.window.from_eye((bounds.min + bounds.extent() * part).min(bounds.max)));
        }
    }
    let ball = ball(&bounds);
    let is_ball_hidden = last.culler().test_sphere(&ball).verdict == Verdict::Hidden;
    if is_ball_hidden {
        points.extend(points_of_ball(&eye.window, &ball));
    }
    let count = 3 + random.below(2);
    let is_polygon_hidden = last.culler().hides_polygon(&convex(&corners[..count]));
    if is_polygon_hidden {
        for _ in 0..16 {
            let half = if count == 4 && random.chance(0.5) { [0, 2, 3] } else { [0, 1, 2] };
            let [a, b, c] = half.map(|i| eye.window.from_eye(corners[i]));
            points.push(a.lerp(b, random.unit()).lerp(c, random.unit()));
        }
    }
    (is_hidden, is_box_hidden, is_ball_hidden, is_polygon_hidden).hash(hasher);
    points.retain(|x| is_in_window(&eye.window, *x));
    points
}

#[test]
fn what_connected_meshes_hide_is_blocked() {
    let scenes = std::env::var("OSP_SCENES").ok().and_then(|n| n.parse().ok()).unwrap_or(SCENES);
    let seed = std::env::var("OSP_SEED").ok().and_then(|n| n.parse().ok()).unwrap_or(0xA77);
    let mut answers = Answers::default();
    attack(0..scenes, seed, &mut answers);
    println!("answers {:x} {:?}", answers.hasher.finish(), answers.hidden);
    for (kind, hidden) in KINDS.iter().zip(answers.hidden) {
        assert!(hidden > scenes, "{kind}: {hidden}");
    }
}

/// Each back end in a process of its own: it is chosen once.
#[test]
fn every_back_end_gives_the_same_answers() {
    let test = "occlusion::surfaces::what_connected_meshes_hide_is_blocked";
    let mut all = Vec::new();
    for backend in Backend::ALL.iter().filter(|backend| backend.is_available()) {
        let output = std::process::Command::new(std::env::current_exe().expect("its own path"))
            .args(["--exact", test, "--nocapture"])
            .env("OSP_SIMD", backend.name())
            .env("OSP_SCENES", "12")
            .output()
            .expect("a process");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}: {text}", backend.name());
        all.extend(text.lines().find(|line| line.contains("answers ")).map(str::to_owned));
    }
    assert!(!all.is_empty() && all.iter().all(|answers| *answers == all[0]), "{all:?}");
}
