//! Pictures of connected surfaces: what is called hidden by them is blocked, and each margin is needed.

use super::{
    judge::{is_blocked, is_in_window, points_of_ball, points_of_box},
    random::{FAMILIES, Polygon, Random, Scene, ball, straight, volume},
};
use crate::engine::{Thing, World};
use glam::{DVec3, Vec3};
use osp::{
    math::Aabb,
    occlusion::{OcclusionCuller, PreviousFrameOccluders, Verdict},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
    view::ViewWindow,
};

const SCENES: u64 = if cfg!(debug_assertions) { 60 } else { 600 };

impl World {
    fn all(&self) -> VisibleBlocks {
        (0..self.0.len() as u32).map(PolygonId).filter(|&id| self.is_present(id)).collect()
    }

    /// The picture of all of them.
    pub(crate) fn picture(&self, window: &ViewWindow, pixels: [u32; 2]) -> PreviousFrameOccluders {
        let mut last = PreviousFrameOccluders::new(pixels, self.0.len());
        last.build(0, self, window, &self.all());
        last
    }
}

pub(crate) fn convex(polygon: &[Vec3]) -> ConvexPolygon {
    match *polygon {
        [a, b, c] => ConvexPolygon::triangle(a, b, c),
        [a, b, c, d] => ConvexPolygon::quad([a, b, c, d]),
        _ => panic!("three or four corners"),
    }
}

pub(crate) fn hides(last: &PreviousFrameOccluders, bounds: &Aabb) -> bool {
    last.culler().test_box(bounds).verdict == Verdict::Hidden
}

/// A surface of triangles that share corners, bent and with holes, seen from anywhere.
fn sheet(window: &ViewWindow, random: &mut Random, out: &mut Vec<Polygon>) {
    let [a, b, c, d] = window.corners().map(|corner| corner / corner.dot(window.forward()));
    let (columns, rows) = (1 + random.below(7), 1 + random.below(7));
    let (away, depth) = (random.log_range(0.5, 20.0), random.range(0.0, 0.6));
    let size = random.range(0.2, 1.3);
    let mut corners = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            let [x, y] = [(column, columns), (row, rows)].map(|(at, of)| {
                0.5 + (at as f64 / of as f64 - 0.5) * size + random.range(-0.3, 0.3) / of as f64
            });
            let direction = a.lerp(b, x).lerp(d.lerp(c, x), y);
            let p = window.eye_in_world() + direction * away * (1.0 + random.range(-depth, depth));
            corners.push(p.as_vec3());
        }
    }
    for row in 0..rows {
        for column in 0..columns {
            let at = |x: usize, y: usize| corners[(row + y) * (columns + 1) + column + x];
            let halves = [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]];
            for half in halves {
                if !random.chance(0.06) {
                    out.push(half.to_vec());
                }
            }
        }
    }
}

/// Every "hidden" of boxes, balls and polygons is recomputed from the occluders.
fn stress(pixels: [u32; 2], seed: u64) -> u64 {
    let mut hidden = 0;
    for family in 0..=FAMILIES.len() {
        for n in 0..SCENES {
            let mut random = Random::new(seed ^ n << 8 ^ (family as u64) << 40);
            let mut scene = Scene::random(family.min(FAMILIES.len() - 1), &mut random);
            if family == FAMILIES.len() {
                scene.polygons.clear();
                for _ in 0..1 + random.below(3) {
                    sheet(&scene.window, &mut random, &mut scene.polygons);
                }
            }
            scene.polygons.retain(|polygon| (3..=4).contains(&polygon.len()));
            if scene.polygons.is_empty() {
                continue;
            }
            let last = World::of(scene.polygons.iter().map(|p| convex(p))).picture(&scene.window, pixels);
            for _ in 0..60 {
                let bounds = volume(&scene.window, &scene.polygons, &mut random);
                let sphere = ball(&bounds);
                let mut points = Vec::new();
                if hides(&last, &bounds) {
                    points.extend(points_of_box(&scene.window, &bounds));
                }
                if last.culler().test_sphere(&sphere).verdict == Verdict::Hidden {
                    points.extend(points_of_ball(&scene.window, &sphere));
                }
                let mut mix = || {
                    let part = Vec3::from_array([(); 3].map(|()| random.unit() as f32));
                    bounds.min + (bounds.max - bounds.min) * part
                };
                let corners = [mix(), mix(), mix()];
                if last.culler().hides_polygon(&convex(&corners)) {
                    for i in 0..8_u8 {
                        let share = |k: u8| f32::from((i + k) % 5) / 4.0;
                        let along = corners[0].lerp(corners[1], share(0)).lerp(corners[2], share(2));
                        points.push(scene.window.from_eye(along));
                    }
                    points.retain(|x| is_in_window(&scene.window, *x));
                }
                hidden += points.len() as u64;
                let open = points.iter().find(|x| !is_blocked(&scene.window, &scene.polygons, **x));
                assert!(open.is_none(), "{family} {n}: {open:?} of {bounds:?}, {corners:?}");
            }
        }
    }
    hidden
}

#[test]
fn what_surfaces_hide_is_blocked_in_random_scenes() {
    // Coarse pixels are the harder test.
    for pixels in [[16, 8], [64, 40], [256, 144]] {
        let hidden = stress(pixels, 0x5F + u64::from(pixels[0]));
        assert!(hidden > SCENES * 100, "{pixels:?}: {hidden}");
    }
}

/// A picture of 64 x 64 pixels and a wall that ends just before a border of pixels, by less than corners are rounded: the pixels
/// that it does not cover wholly are open. Then one that ends just beyond.
#[test]
fn a_border_next_to_a_pixels_border_leaves_the_pixel_open() {
    let window = straight(1.0, 0.01);
    let (mut open, mut closed) = (0, 0);
    for step in 1..400 {
        let beyond_px = f64::from(step % 20) * 0.0004 - 0.0039;
        let pixel = 4 + step % 40;
        let edge = ((f64::from(pixel) + beyond_px) / 32.0 - 1.0) as f32;
        for turn in 0..4 {
            let turned = |x: f32, y: f32| match turn {
                0 => (x, y),
                1 => (-x, y),
                2 => (y, x),
                _ => (y, -x),
            };
            let at = |x: f32, y: f32, z: f32| {
                let (x, y) = turned(x, y);
                Vec3::new(x * z, y * z, z)
            };
            let wall = [at(-2.0, -2.0, 1.0), at(edge, -2.0, 1.0), at(edge, 2.0, 1.0), at(-2.0, 2.0, 1.0)];
            let last = World::of([convex(&wall)]).picture(&window, [64, 64]);
            let border = (f64::from(pixel) / 32.0 - 1.0) as f32;
            // Between the wall's end and the pixels' border.
            let x = edge + (border - edge) * 0.5;
            let p = at(x, 0.011, 3.0);
            let is_hidden = hides(&last, &Aabb::new(p, p));
            if beyond_px < -1.0e-4 {
                open += 1;
                assert!(!is_hidden, "{turn}: seen beside a wall that ends {beyond_px} pixels off a border");
            }
            // A pixel farther in.
            let p = at(border - 1.5 / 32.0, 0.011, 3.0);
            closed += u32::from(hides(&last, &Aabb::new(p, p)));
        }
    }
    assert!(open > 500 && closed > 1000, "{open} {closed}");
}

/// What lies just before a slanted wall, by a few parts in a million, is seen.
#[test]
fn what_lies_just_before_a_wall_is_seen() {
    let window = straight(1.0, 0.01);
    let (mut asked, mut hidden) = (0, 0);
    for n in 0..SCENES * 4 {
        let mut random = Random::new(0xDE97 + n);
        let mut corner = |x: f64, y: f64| {
            let z = random.range(1.0, 8.0);
            DVec3::new(x * z, y * z, z).as_vec3()
        };
        let [a, b, c] = [corner(-3.0, -2.0), corner(3.0, -2.0), corner(0.0, 3.0)];
        let last = World::of([convex(&[a, b, c])]).picture(&window, [64, 64]);
        for _ in 0..20 {
            let (s, t) = (random.range(0.2, 0.5), random.range(0.2, 0.45));
            let on = a.as_dvec3() + (b - a).as_dvec3() * s + (c - a).as_dvec3() * t;
            let before = (on * (1.0 - random.log_range(3.0e-7, 1.0e-5))).as_vec3();
            let is_before = is_in_window(&window, before.as_dvec3())
                && !is_blocked(&window, &[vec![a, b, c]], before.as_dvec3() * (1.0 + 1.0e-9));
            asked += u32::from(is_before);
            assert!(!is_before || !hides(&last, &Aabb::new(before, before)), "{n}: {before}");
            let small = [before, before + Vec3::new(1.0e-4, 0.0, 0.0), before + Vec3::new(0.0, 1.0e-4, 0.0)];
            assert!(!is_before || !last.culler().hides_polygon(&convex(&small)), "{n}: {before}");
            let behind = (on * 1.3).as_vec3();
            hidden += u32::from(hides(&last, &Aabb::new(behind, behind)));
        }
    }
    assert!(asked > 1000 && hidden > 1000, "{asked} {hidden}");
}

/// Two triangles that share an edge cover the pixels along it; those that fold over it, or only touch, do not.
#[test]
fn only_a_shared_edge_that_is_no_silhouette_is_closed() {
    let window = straight(1.0, 0.01);
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let left = [at(0.0, -2.0, 1.0), at(0.0, 2.0, 1.0), at(-2.0, 0.0, 1.0)];
    let others = [
        // Beside it, beside it with another corner (by the last bit), and folded back behind it.
        ([left[1], left[0], at(2.0, 0.0, 1.0)], true),
        ([left[1], at(0.0, -2.0, 1.0_f32.next_up()), at(2.0, 0.0, 1.0)], false),
        ([left[1], left[0], at(-3.0, 0.0, 1.5)], false),
    ];
    let behind = Aabb::cube(at(0.0, 0.0, 4.0), 0.1);
    for (other, is_closed) in others {
        for [a, b] in [[0, 1], [1, 0]] {
            for turn in 0..6 {
                let mut both = [left, other];
                both[1].rotate_left(turn % 3);
                if turn > 2 {
                    both[1].reverse();
                }
                let polygons = [both[a].to_vec(), both[b].to_vec()];
                let last = World::of(polygons.iter().map(|p| convex(p))).picture(&window, [64, 64]);
                assert_eq!(hides(&last, &behind), is_closed, "{polygons:?}");
            }
        }
    }
}

/// Polygons that come, move and go: the picture is that of the polygons as they are, whatever was there before.
#[test]
fn surfaces_follow_every_change() {
    let window = straight(1.0, 0.01);
    let mut random = Random::new(77);
    let mut polygons = World(vec![None; 60]);
    let mut last = PreviousFrameOccluders::new([64, 64], 8);
    let mut hidden = 0;
    for frame in 0..if cfg!(debug_assertions) { 150 } else { 1500 } {
        let mut changes = Vec::new();
        for _ in 0..1 + random.below(12) {
            let id = PolygonId(random.below(60) as u32);
            // Few places, so that corners and edges are shared by many.
            let mut corner = || {
                let [x, y] = [(); 2].map(|()| random.below(4) as f32 - 1.5);
                Vec3::new(x, y, 2.0 + random.below(2) as f32 * 0.5)
            };
            let [a, b, c] = [corner(), corner(), corner()];
            let change = match (polygons.0[id.index()].is_some(), random.chance(0.4)) {
                (true, true) => Change::Remove(id),
                (true, false) => Change::Update(id),
                (false, _) => Change::Insert(id),
            };
            let is_gone = matches!(change, Change::Remove(_));
            polygons.0[id.index()] = (!is_gone).then(|| Thing::Wall(ConvexPolygon::triangle(a, b, c)));
            changes.push(change);
        }
        last.follow(&changes);
        last.forget(0);
        last.build(0, &polygons, &window, &polygons.all());
        let fresh = polygons.picture(&window, [64, 64]);
        let present: Vec<Polygon> =
            (0..60).filter_map(|i| polygons.polygon(PolygonId(i))).map(|p| p.vertices().to_vec()).collect();
        for _ in 0..40 {
            let [x, y] = [(); 2].map(|()| random.range(-3.0, 3.0) as f32);
            let bounds = Aabb::cube(Vec3::new(x, y, 4.0), random.range(0.01, 1.0) as f32);
            let open =
                points_of_box(&window, &bounds).into_iter().find(|x| !is_blocked(&window, &present, *x));
            assert!(!hides(&last, &bounds) || open.is_none(), "{frame}: {open:?} of {bounds:?}");
            assert!(!hides(&fresh, &bounds) || open.is_none(), "{frame}: {open:?} of {bounds:?}");
            hidden += u32::from(hides(&last, &bounds));
        }
    }
    assert!(hidden > 100, "{hidden}");
}

/// A floor under the eye, cut by the near plane along an edge that two polygons share, hides what is below it.
#[test]
fn surfaces_go_on_across_the_near_plane() {
    let window = straight(1.0, 0.5);
    let at = |x: f32, z: f32| Vec3::new(x, -0.4, z);
    let strips = [[-9.0_f32, 0.0], [0.0, 9.0]];
    let quads: Vec<Polygon> = strips
        .iter()
        .map(|[x0, x1]| vec![at(*x0, -2.0), at(*x1, -2.0), at(*x1, 30.0), at(*x0, 30.0)])
        .collect();
    let last = World::of(quads.iter().map(|p| convex(p))).picture(&window, [64, 64]);
    assert!(hides(&last, &Aabb::cube(Vec3::new(0.0, -2.0, 4.0), 0.3)));
    assert!(!hides(&last, &Aabb::cube(Vec3::new(0.0, 0.2, 4.0), 0.3)), "above it");
    assert!(!hides(&last, &Aabb::cube(Vec3::new(0.0, -0.44, 0.52), 0.01)), "where nothing is drawn");
}

/// A bent quad whose diagonal the near plane cuts ends there where its two triangles end, not on a straight line.
#[test]
fn a_bent_quad_ends_at_the_near_plane_where_its_triangles_do() {
    let window = straight(1.0, 1.0);
    let at = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let quad = vec![at(0.0, -0.5, 0.0), at(-3.0, -0.5, 2.0), at(0.0, 0.0, 3.0), at(3.0, -0.5, 2.0)];
    let [beside, behind] = [at(0.0, -0.42, 1.0) * 5.0, at(0.0, -0.2, 1.0) * 5.0];
    let polygons = [quad];
    assert!(!is_blocked(&window, &polygons, beside.as_dvec3()), "nothing is drawn before it");
    let last = World::of(polygons.iter().map(|p| convex(p))).picture(&window, [64, 64]);
    assert!(!hides(&last, &Aabb::new(beside, beside)), "between the diagonal and the line");
    assert!(hides(&last, &Aabb::new(behind, behind)), "behind both triangles, on the diagonal");
}
