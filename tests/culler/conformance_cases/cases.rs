//! Makes the cases, from a seed. Views, balls and rays that graze a box within rounding are drawn again: the answers hold
//! for every index that is conservative and exact otherwise, also one that reads the matrix in its own way.

use osp::{
    glam::{DMat4, DVec3, DVec4, Vec3},
    math::{Aabb, Ray, Sphere},
};

use super::{
    file::{Quad, Step},
    plain::{self, Boxes, Quads},
};
use osp_testkit::boxes::Rng;

/// How often a question is drawn again before it is given up.
const TRIES: usize = 2000;

/// Writes steps and keeps the boxes that are there.
struct Writer {
    steps: Vec<Step>,
    boxes: Boxes,
    quads: Quads,
    rng: Rng,
}

impl Writer {
    fn case(&mut self, name: &str) {
        self.boxes.clear();
        self.quads.clear();
        self.steps.push(Step::Case(name.into()));
    }

    fn put(&mut self, id: u32, min: [f32; 3], max: [f32; 3]) {
        let bounds = Aabb::new(min.into(), max.into());
        assert!(bounds.is_valid(), "{bounds:?}");
        if self.boxes.insert(id, bounds).is_some() {
            self.quads.remove(&id);
        }
        self.steps.push(Step::Box(id, bounds));
    }

    fn put_random(&mut self, id: u32, room_m: f32) {
        let steps = |metres: f32| (metres * 64.0).round() / 64.0;
        let center = self.rng.point(&Aabb::cube(Vec3::ZERO, room_m)).map(steps);
        let (long, thin) = (self.rng.range(0.0, 0.06) * room_m, self.rng.range(0.0, 0.01) * room_m);
        let mut half = Vec3::splat(thin);
        half[self.rng.below(3)] = long;
        let half = half.map(steps);
        self.put(id, (center - half).to_array(), (center + half).to_array());
    }

    fn remove(&mut self, id: u32) {
        assert!(self.boxes.remove(&id).is_some(), "{id}");
        self.quads.remove(&id);
        self.steps.push(Step::Remove(id));
    }

    fn quad(&mut self, id: u32, corners: Quad) {
        self.quads.insert(id, corners);
        self.steps.push(Step::Quad(id, corners));
    }

    /// A view, without and with occlusion.
    fn view_behind(&mut self, clip_from_world: DMat4) {
        self.view(clip_from_world);
        let unhidden = plain::unhidden(&self.boxes, &self.quads, &clip_from_world.as_mat4());
        self.steps.push(Step::Unhidden(unhidden.expect("no box lies at the border of a shadow")));
    }

    /// A view that has to be decided as it is.
    fn view(&mut self, clip_from_world: DMat4) {
        let matrix = clip_from_world.as_mat4();
        let visible = plain::visible(&self.boxes, &matrix).expect("no box lies at a plane within rounding");
        self.steps.extend([Step::View(matrix), Step::Visible(visible)]);
    }

    /// A view from a random place towards the middle, by whatever projection `clip_from_view` makes.
    fn view_around(&mut self, room_m: f32, clip_from_view: DMat4) {
        for _ in 0..TRIES {
            let eye = self.rng.direction() * self.rng.range(0.2, 0.8) * room_m;
            let target = self.rng.point(&Aabb::cube(Vec3::ZERO, room_m * 0.5));
            if (target - eye).normalize_or_zero().y.abs() > 0.95 || target.distance(eye) < 0.1 {
                continue;
            }
            let matrix = (clip_from_view * look_at(eye.as_dvec3(), target.as_dvec3())).as_mat4();
            if let Some(visible) = plain::visible(&self.boxes, &matrix) {
                self.steps.extend([Step::View(matrix), Step::Visible(visible)]);
                return;
            }
        }
        panic!("each of {TRIES} views grazes a box");
    }

    fn box_query(&mut self, bounds: Aabb) {
        let found = plain::box_query(&self.boxes, &bounds).expect("comparisons are exact");
        self.steps.extend([Step::BoxQuery(bounds), Step::Found(found)]);
    }

    fn sphere(&mut self, center: Vec3, radius_m: f32) {
        let sphere = Sphere { center, radius_m };
        let found = plain::sphere(&self.boxes, &sphere).expect("no box lies at the sphere within rounding");
        self.steps.extend([Step::Sphere(sphere), Step::Found(found)]);
    }

    fn ray(&mut self, origin: Vec3, direction: Vec3, t_max: f32) -> bool {
        let ray = Ray::new(origin, direction);
        let hit = plain::ray(&self.boxes, &ray, t_max);
        self.steps.extend(hit.map(|hit| [Step::Ray { ray, t_max }, Step::Hit(hit)]).into_iter().flatten());
        hit.is_some()
    }

    /// One question of each other kind.
    fn test_around(&mut self, room_m: f32) {
        let room = Aabb::cube(Vec3::ZERO, room_m);
        let center = self.rng.point(&room);
        let size_m = self.rng.range(0.05, 0.4) * room_m;
        self.box_query(Aabb::cube(center, size_m));
        let ball = (0..TRIES).find_map(|_| {
            let sphere =
                Sphere { center: self.rng.point(&room), radius_m: self.rng.range(0.05, 0.2) * room_m };
            plain::sphere(&self.boxes, &sphere).map(|_| sphere)
        });
        let Sphere { center, radius_m } = ball.expect("a ball that grazes nothing");
        self.sphere(center, radius_m);
        // Towards a box, and anywhere.
        for is_aimed in [true, true, false] {
            let is_drawn = (0..TRIES).any(|_| {
                let aim = self.rng.below(self.boxes.len());
                let aim = self.boxes.values().nth(aim).filter(|_| is_aimed).map(Aabb::center);
                let (from, to) = (self.rng.point(&room), self.rng.point(&room));
                let t_max = if self.rng.below(4) == 0 { 0.25 } else { 1.0e6 };
                self.ray(from, aim.unwrap_or(to) - from, t_max)
            });
            assert!(is_drawn, "a ray that grazes nothing");
        }
    }
}

fn look_at(eye: DVec3, target: DVec3) -> DMat4 {
    let back = (eye - target).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let up = back.cross(right);
    DMat4::from_cols(right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0)).inverse()
}

/// Perspective, looking along -z: tangents to the four sides, and z of clip space as `z_z * z + z_w`.
fn perspective([left, right, bottom, top]: [f64; 4], z_z: f64, z_w: f64) -> DMat4 {
    DMat4::from_cols(
        DVec4::X * (2.0 / (right - left)),
        DVec4::Y * (2.0 / (top - bottom)),
        DVec4::new((right + left) / (right - left), (top + bottom) / (top - bottom), z_z, -1.0),
        DVec4::Z * z_w,
    )
}

/// Depth 0 at the near and 1 at the far distance.
fn forward(tangents: [f64; 4], near_m: f64, far_m: f64) -> DMat4 {
    perspective(tangents, far_m / (near_m - far_m), near_m * far_m / (near_m - far_m))
}

/// Depth 1 at the near and 0 at the far distance.
fn reversed(tangents: [f64; 4], near_m: f64, far_m: f64) -> DMat4 {
    perspective(tangents, near_m / (far_m - near_m), near_m * far_m / (far_m - near_m))
}

/// Parallel, looking along -z.
fn parallel(half_width_m: f64, half_height_m: f64, near_m: f64, far_m: f64) -> DMat4 {
    let depth = 1.0 / (near_m - far_m);
    DMat4::from_cols(
        DVec4::X / half_width_m,
        DVec4::Y / half_height_m,
        DVec4::Z * depth,
        DVec4::new(0.0, 0.0, near_m * depth, 1.0),
    )
}

const WIDE: [f64; 4] = [-1.0, 1.0, -0.5625, 0.5625];
const SQUARE: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];

/// Every projection that an engine may have, for a room of this size.
fn projections(room_m: f64) -> [DMat4; 7] {
    let (near, far) = (0.01 * room_m, 2.0 * room_m);
    let flip_y = DMat4::from_diagonal(DVec4::new(1.0, -1.0, 1.0, 1.0));
    [
        forward(WIDE, near, far),
        reversed(WIDE, near, far),
        // Reversed, without end.
        perspective(WIDE, 0.0, near),
        // One eye of a headset.
        forward([-1.25, 0.75, -1.0, 1.125], near, far),
        // Narrow, y down, as Vulkan has it.
        flip_y * forward([-0.25, 0.25, -0.25, 0.25], near, 0.75 * room_m),
        parallel(0.3 * room_m, 0.2 * room_m, 0.0, room_m),
        flip_y * parallel(0.1 * room_m, 0.4 * room_m, -0.5 * room_m, 0.5 * room_m),
    ]
}

/// All cases.
pub(crate) fn all() -> Vec<Step> {
    let mut writer = Writer { steps: Vec::new(), boxes: Boxes::new(), quads: Quads::new(), rng: Rng(2026) };
    edges(&mut writer);
    growth(&mut writer, "growth in a room of 8 m", 8.0);
    growth(&mut writer, "growth in a world of 4096 m", 4096.0);
    strokes(&mut writer);
    moves(&mut writer);
    walls(&mut writer);
    writer.steps
}

/// Walls come, move and go; what is behind them is hidden.
fn walls(w: &mut Writer) {
    w.case("what walls hide");
    let wall =
        |[x, y]: [f32; 2], z: f32| [[-x, -y], [x, -y], [x, y], [-x, y]].map(|[x, y]| Vec3::new(x, y, z));
    let views = [forward(SQUARE, 0.1, 100.0), reversed(WIDE, 0.1, 100.0), perspective(SQUARE, 0.0, 0.1)];
    w.put(0, [-3.0, -2.0, -5.0], [3.0, 2.0, -5.0]);
    // Behind the middle, beside, in front, and half behind.
    w.put(1, [-0.5, -0.5, -9.0], [0.5, 0.5, -8.0]);
    w.put(2, [6.0, -0.5, -9.0], [7.0, 0.5, -8.0]);
    w.put(3, [-0.25, -0.25, -3.0], [0.25, 0.25, -2.0]);
    w.put(4, [4.0, -0.5, -9.0], [6.0, 0.5, -8.0]);
    for id in 10..20 {
        let x = (id - 10) as f32 * 0.5 - 2.25;
        w.put(id, [x, -0.25, -30.0], [x + 0.25, 0.25, -29.5]);
    }
    w.view_behind(views[0]);
    w.quad(0, wall([3.0, 2.0], -5.0));
    views.iter().for_each(|view| w.view_behind(*view));
    // Moved, a wall hides nothing before it is given its place.
    w.put(0, [-3.0, -2.0, -20.0], [3.0, 2.0, -20.0]);
    w.view_behind(views[0]);
    w.quad(0, wall([3.0, 2.0], -20.0));
    w.view_behind(views[2]);
    w.remove(0);
    w.view_behind(views[0]);
    // One that is not drawn itself, turned.
    let mut turned = wall([2.0, 2.0], -7.0);
    (turned[0].z, turned[3].z) = (-6.0, -6.0);
    w.quad(7, turned);
    views.iter().for_each(|view| w.view_behind(*view));
}

fn edges(w: &mut Writer) {
    w.case("an empty scene");
    w.view(forward(WIDE, 0.1, 100.0));
    w.view(parallel(4.0, 4.0, 0.0, 8.0));
    w.box_query(Aabb::cube(Vec3::ZERO, 100.0));
    w.sphere(Vec3::ZERO, 100.0);
    w.ray(Vec3::ZERO, Vec3::X, 100.0);

    w.case("one box before the eye, behind it, around it, and gone");
    w.put(0, [-0.5, -0.5, -3.5], [0.5, 0.5, -2.5]);
    w.view(forward(WIDE, 0.1, 100.0));
    w.ray(Vec3::ZERO, Vec3::NEG_Z, 100.0);
    w.ray(Vec3::ZERO, Vec3::NEG_Z, 2.0);
    w.ray(Vec3::ZERO, Vec3::Z, 100.0);
    w.put(0, [-0.5, -0.5, 2.5], [0.5, 0.5, 3.5]);
    w.view(forward(WIDE, 0.1, 100.0));
    w.put(0, [-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]);
    w.view(forward(WIDE, 0.125, 100.0));
    w.ray(Vec3::ZERO, Vec3::new(0.5, 0.25, 1.0), 100.0);
    w.remove(0);
    w.view(forward(WIDE, 0.1, 100.0));
    w.box_query(Aabb::cube(Vec3::ZERO, 100.0));

    w.case("boxes that touch the sides of a parallel view from outside, and boxes a little farther out");
    let outside = |at: f32| {
        [
            ([at, -0.5, -2.0], [at + 0.5, 0.5, -1.0]),
            ([-at - 0.5, -0.5, -2.0], [-at, 0.5, -1.0]),
            ([-0.5, at, -2.0], [0.5, at + 0.5, -1.0]),
            ([-0.5, -at - 0.5, -2.0], [0.5, -at, -1.0]),
            ([-0.5, -0.5, -2.0 * at - 1.0], [0.5, 0.5, -2.0 * at]),
        ]
    };
    for (i, (min, max)) in outside(4.0).into_iter().chain(outside(4.0 + 1.0 / 64.0)).enumerate() {
        w.put(i as u32 * 3 + 1, min, max);
    }
    w.put(40, [-0.5, -0.5, 0.0], [0.5, 0.5, 1.0]);
    w.put(41, [-0.5, -0.5, 1.0 / 64.0], [0.5, 0.5, 1.0]);
    w.view(parallel(4.0, 4.0, 0.0, 8.0));
    w.box_query(Aabb::new(Vec3::new(-4.0, -4.0, -8.0), Vec3::new(4.0, 4.0, 0.0)));
    w.sphere(Vec3::new(0.0, 0.0, -4.0), 4.0);

    w.case("boxes that touch the sides of a view of 90 degrees from outside, and boxes a little farther out");
    w.put(0, [2.0, -0.5, -2.0], [3.0, 0.5, -2.0]);
    w.put(1, [2.0 + 1.0 / 64.0, -0.5, -2.0], [3.0, 0.5, -2.0]);
    w.put(2, [-3.0, -0.5, -2.0], [-2.0, 0.5, -1.0]);
    w.put(3, [-0.5, 4.0, -4.0], [0.5, 4.0, -4.0]);
    w.put(4, [-0.5, 4.0 + 1.0 / 64.0, -4.0], [0.5, 4.5, -4.0]);
    w.put(5, [-1.0, -9.0, -8.0], [1.0, -8.0, -6.0]);
    w.put(6, [-0.25, -0.25, -0.5], [0.25, 0.25, 1.0]);
    w.put(7, [-0.25, -0.25, -0.5 + 1.0 / 64.0], [0.25, 0.25, 1.0]);
    w.view(perspective(SQUARE, 0.0, 0.5));
    w.view(reversed(SQUARE, 0.25, 3.0));

    w.case("flat boxes, needles, points, and many in one place");
    for (i, flat) in [[0.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0]].into_iter().enumerate() {
        let at = i as f32 * 2.0 - 2.0;
        w.put(i as u32, [at, -0.5, -5.0], [at + flat[0], -0.5 + flat[1], -5.0 + flat[2]]);
    }
    w.put(3, [0.0, -2.0, -6.0], [0.0, 2.0, -6.0]);
    w.put(4, [0.25, 0.75, -7.0], [0.25, 0.75, -7.0]);
    w.put(5, [0.25, 0.75, 7.0], [0.25, 0.75, 7.0]);
    for id in 100..140 {
        w.put(id, [1.5, 1.5, -4.5], [1.75, 1.75, -4.25]);
    }
    w.view(forward(WIDE, 0.1, 100.0));
    w.view(forward([-0.25, 0.125, -0.25, 0.125], 0.1, 100.0));
    w.view(parallel(0.3, 3.0, 0.1, 6.5));
    w.box_query(Aabb::new(Vec3::new(0.25, 0.75, -7.0), Vec3::new(0.25, 0.75, -7.0)));
    w.box_query(Aabb::new(Vec3::new(1.75, 1.75, -4.25), Vec3::splat(9.0)));
    w.sphere(Vec3::new(0.25, 0.75, -7.0), 0.0);
    w.remove(120);
    w.view(forward(WIDE, 0.1, 100.0));

    w.case("outside of a view, but behind none of its planes: visible");
    w.put(0, [-40.0, -1.0, -4.0], [-4.5, 1.0, 40.0]);
    w.put(1, [4.5, -1.0, -4.0], [40.0, 1.0, -3.0]);
    w.view(forward(SQUARE, 1.0, 100.0));
    w.put(0, [-40.0, -1.0, -40.0], [-4.5, 40.0, 40.0]);
    w.view(forward(SQUARE, 1.0, 100.0));

    w.case("tiny, huge and far away");
    w.put(7, [-1.0e6, -1.0e6, -1.0e6], [1.0e6, 1.0e6, 1.0e6]);
    w.put(8, [3.0e5, 3.0e5, -1.0e6], [3.1e5, 3.1e5, -0.9e6]);
    w.put(9, [0.0, 0.0, -1.0], [1.0 / 1024.0, 1.0 / 1024.0, -1023.0 / 1024.0]);
    w.put(10, [-2.0e5, -3.0e5, 1.0e5], [-1.0e5, -2.0e5, 2.0e5]);
    w.put(11, [3.0e15, 0.0, 0.0], [4.0e15, 1.0, 1.0]);
    w.view(forward(WIDE, 0.1, 100.0));
    w.view(perspective(SQUARE, 0.0, 0.1));
    w.view(forward(SQUARE, 1000.0, 2.0e6));
    w.ray(Vec3::new(0.0, 2.0e6, 0.0), Vec3::NEG_Y, 1.0e7);
    w.box_query(Aabb::new(Vec3::splat(-1.0e30), Vec3::splat(1.0e30)));

    w.case("numbers with gaps, given up and given again");
    for (i, id) in [99_999, 3, 65_536, 40_000, 15, 16, 17].into_iter().enumerate() {
        let x = i as f32 - 3.0;
        w.put(id, [x, -0.25, -8.0], [x + 0.5, 0.25, -7.5]);
    }
    w.view(forward(WIDE, 0.1, 100.0));
    w.remove(99_999);
    w.remove(16);
    w.view(forward(WIDE, 0.1, 100.0));
    w.put(16, [-0.25, 0.5, -3.0], [0.25, 1.0, -2.5]);
    w.put(99_999, [-0.25, -1.0, 3.0], [0.25, -0.5, 3.5]);
    w.view(forward(WIDE, 0.1, 100.0));
    w.box_query(Aabb::new(Vec3::new(-9.0, -9.0, -9.0), Vec3::new(9.0, 9.0, 2.0)));
}

/// A scene that grows while it is looked at.
fn growth(w: &mut Writer, name: &str, room_m: f32) {
    w.case(name);
    let mut count = 0;
    for (round, batch) in [1, 15, 48, 96, 140].into_iter().enumerate() {
        for id in count..count + batch {
            w.put_random(id, room_m);
        }
        count += batch;
        for (i, projection) in projections(f64::from(room_m)).into_iter().enumerate() {
            if round == 4 || i % 2 == round % 2 {
                w.view_around(room_m, projection);
            }
        }
        w.test_around(room_m);
    }
}

/// Neighbours are drawn one after the other, as a hand does, and some strokes are erased.
fn strokes(w: &mut Writer) {
    w.case("strokes, some of them erased, others drawn under their numbers");
    let stroke = |w: &mut Writer, stroke: u32| {
        let mut at = w.rng.point(&Aabb::cube(Vec3::ZERO, 3.0));
        let step = w.rng.direction() * 0.0625;
        for k in 0..24 {
            let bend = w.rng.direction() * 0.03125;
            let next = (at + step + bend).map(|v| (v * 256.0).round() / 256.0);
            at = at.map(|v| (v * 256.0).round() / 256.0);
            w.put(stroke * 24 + k, at.min(next).to_array(), at.max(next).to_array());
            at = next;
        }
    };
    for i in 0..16 {
        stroke(w, i);
    }
    let projections = projections(4.0);
    for i in [0, 3, 5] {
        w.view_around(4.0, projections[i]);
    }
    w.test_around(4.0);
    for erased in [2, 3, 9] {
        for id in erased * 24..erased * 24 + 24 {
            w.remove(id);
        }
    }
    w.view_around(4.0, projections[1]);
    w.view_around(4.0, projections[6]);
    stroke(w, 9);
    stroke(w, 3);
    w.view_around(4.0, projections[2]);
    w.view_around(4.0, projections[4]);
    w.test_around(4.0);
}

/// Boxes move and go in any order; then all are gone, and some come back.
fn moves(w: &mut Writer) {
    w.case("moves and removals");
    let (room_m, count) = (16.0, 120);
    for id in 0..count {
        w.put_random(id, room_m);
    }
    for round in 0..6 {
        for _ in 0..40 {
            let id = w.rng.below(count as usize) as u32;
            if w.boxes.contains_key(&id) && w.rng.below(3) == 0 {
                w.remove(id);
            } else {
                // Now and then far out of the room.
                let is_far = w.rng.below(10) == 0;
                w.put_random(id, if is_far { room_m * 8.0 } else { room_m });
            }
        }
        w.view_around(room_m, projections(f64::from(room_m))[round]);
        w.test_around(room_m);
    }
    for id in 0..count {
        if w.boxes.contains_key(&id) {
            w.remove(id);
        }
    }
    w.view_around(room_m, projections(f64::from(room_m))[0]);
    for id in (0..count).step_by(7) {
        w.put_random(id, room_m);
    }
    w.view_around(room_m, projections(f64::from(room_m))[2]);
    w.test_around(room_m);
}
