//! Rays that run along faces, edges and corners of boxes, flat boxes, and directions that `f32` can hardly hold.

use glam::{DVec3, Vec3};
use osp::math::{Aabb, Capsule, Ray, Sphere};
use osp_testkit::boxes::Rng;

/// Boxes on a grid of eighths of a metre, so that faces and edges of many lie in one plane; many of them flat. Some far
/// out, huge or tiny.
fn on_a_grid(count: usize) -> Vec<Aabb> {
    let mut rng = Rng(41);
    (0..count)
        .map(|i| {
            let corner = Vec3::from_array(std::array::from_fn(|_| rng.below(32) as f32 * 0.125 - 2.0));
            let sides = Vec3::from_array(std::array::from_fn(|_| rng.below(3) as f32 * 0.125));
            match i % 40 {
                0 => Aabb::new(corner * 1.0e4, (corner + sides) * 1.0e4),
                1 => Aabb::new(corner * 1.0e-39, corner * 1.0e-39 + sides * 1.0e-39),
                2 => Aabb::new(Vec3::splat(-2.0e38), corner),
                _ => Aabb::new(corner, corner + sides),
            }
        })
        .collect()
}

/// A point of the box: a corner, in an edge, in a face or inside, which is all the same if the box is flat.
fn point_of(bounds: &Aabb, rng: &mut Rng) -> Vec3 {
    let mut at = |axis: usize| match rng.below(3) {
        0 => bounds.min[axis],
        1 => bounds.max[axis],
        _ => bounds.min[axis] * 0.5 + bounds.max[axis] * 0.5,
    };
    Vec3::new(at(0), at(1), at(2))
}

fn directions() -> Vec<Vec3> {
    let parts = [1.0f32, -1.0, 0.0, -0.0, 0.5, 1.0e-40, -1.0e-45, 3.0e38, -2.0e-30];
    let mut all = Vec::new();
    for x in parts {
        for y in parts {
            for z in parts {
                if [x, y, z] != [0.0; 3] {
                    all.push(Vec3::new(x, y, z));
                }
            }
        }
    }
    all
}

/// Where the ray enters and leaves the box in `f64`, which holds all of these numbers and their differences.
fn crossing(ray: &Ray, bounds: &Aabb) -> Option<(f64, f64)> {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let [min, max, origin, direction] =
            [bounds.min, bounds.max, ray.origin, ray.direction].map(|v| f64::from(v[axis]));
        if direction == 0.0 {
            if origin < min || origin > max {
                return None;
            }
            continue;
        }
        let (a, b) = ((min - origin) / direction, (max - origin) / direction);
        (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
    }
    Some((near, far))
}

fn enters(ray: &Ray, bounds: &Aabb) -> bool {
    crossing(ray, bounds).is_some_and(|(near, far)| near <= far && near <= f64::from(f32::MAX))
}

/// Beyond doubt, whatever is rounded.
fn misses(ray: &Ray, bounds: &Aabb) -> bool {
    let is_far_off =
        |near: f64, far: f64| near > far * (1.0 + 1.0e-5) + 1.0e-37 && near < f64::from(f32::MAX);
    crossing(ray, bounds).is_none_or(|(near, far)| is_far_off(near, far))
}

fn rays(boxes: &[Aabb], each: usize) -> Vec<Ray> {
    let mut rng = Rng(42);
    let mut rays = Vec::new();
    for direction in directions() {
        for _ in 0..each {
            let on = point_of(&boxes[rng.below(boxes.len())], &mut rng);
            // From a border, or towards one.
            let back = [0.0, 1.0, 0.125, 3.0][rng.below(4)];
            let origin = on - direction.clamp(Vec3::NEG_ONE, Vec3::ONE) * back;
            rays.push(Ray::new(origin, direction));
        }
    }
    rays
}

#[test]
fn a_box_is_entered_through_its_faces_edges_and_corners() {
    let boxes = on_a_grid(400);
    let mut entered = 0;
    for ray in rays(&boxes, 3) {
        for bounds in &boxes {
            let t = ray.enter_box(bounds, f32::INFINITY);
            if enters(&ray, bounds) {
                entered += 1;
                let near = crossing(&ray, bounds).expect("it enters").0;
                let t = t.unwrap_or_else(|| panic!("{ray:?} misses {bounds:?}"));
                let error = (f64::from(t) - near).abs();
                assert!(error <= near * 2.0e-6 + 3.0e-38, "{ray:?}, {bounds:?}: {t} instead of {near}");
            } else if misses(&ray, bounds) {
                assert_eq!(t, None, "{ray:?}, {bounds:?}");
            }
        }
    }
    assert!(entered > 10_000, "{entered}");
}

/// What a ray enters it enters through every box around.
#[test]
fn a_ray_enters_every_box_around_one_that_it_enters() {
    let boxes = on_a_grid(150);
    let mut rng = Rng(43);
    for ray in rays(&boxes, 2) {
        for bounds in &boxes {
            let Some(t) = ray.enter_box(bounds, f32::INFINITY) else { continue };
            for _ in 0..3 {
                let around = bounds.union(&boxes[rng.below(boxes.len())]);
                let outer = ray.enter_box(&around, f32::INFINITY);
                assert!(outer.is_some_and(|outer| outer <= t), "{ray:?}, {bounds:?} in {around:?}");
            }
        }
    }
}

/// A ray that touches a box at an edge: it enters the one plane where it leaves the other, and rounding must not tell them
/// apart. Directions short and long, up to where their reciprocals and the places along them lose bits.
#[test]
fn an_edge_that_is_just_touched_is_entered() {
    let mut rng = Rng(45);
    let two_to = |e: i32| f64::exp2(f64::from(e));
    for exponent in [-120, -60, 0, 60, 100, 122, 126, 127] {
        for along in [-149, -145, -140, -100, -20, 0, 20] {
            if !(-126..=120).contains(&(exponent + along)) {
                continue;
            }
            // Of the longest, a few reciprocals lose as much as four units in the last place.
            for i in 0..if exponent == 127 { 20_000 } else { 1000 } {
                // Few bits: the products below are exact.
                let least = if exponent == 127 { 0xE000 } else { 0 };
                let mut bits = || 1.0 + (least + rng.below((1 << 16) - least)) as f64 / f64::from(1 << 16);
                let direction = DVec3::new(bits(), bits(), 0.0);
                let t = [1.0, 1.5, 1.25][i % 3] * two_to(along);
                let edge = (direction * two_to(exponent) * t).as_vec3();
                let ray = Ray::new(Vec3::ZERO, (direction * two_to(exponent)).as_vec3());
                let far = Vec3::splat(edge.max_element() * 2.0);
                let bounds = Aabb::new(Vec3::new(edge.x, -far.y, -1.0), Vec3::new(far.x, edge.y, 1.0));
                assert!(ray.enter_box(&bounds, f32::INFINITY).is_some(), "{ray:?} {bounds:?}");
            }
        }
    }
    // From anywhere, in whole numbers, so that it is known exactly what is touched.
    for _ in 0..200_000 {
        let mut whole = || 1 + rng.below((1 << 24) - 1) as i64;
        let (origin, direction, at_x) = ([-whole(), -whole()], [whole(), whole()], whole());
        let rise = ((at_x - origin[0]) as i128 * direction[1] as i128).div_euclid(direction[0] as i128) + 1;
        let at_y = (i128::from(origin[1]) + rise) as f32;
        if !((1 << 23)..1 << 24).contains(&(i128::from(origin[1]) + rise)) {
            continue;
        }
        let at = |v: [i64; 2]| Vec3::new(v[0] as f32, v[1] as f32, 0.0);
        let ray = Ray::new(at(origin), at(direction));
        let bounds = Aabb::new(Vec3::new(at_x as f32, -1.0e9, 0.0), Vec3::new(1.0e9, at_y, 0.0));
        assert!(ray.enter_box(&bounds, f32::INFINITY).is_some(), "{ray:?} {bounds:?}");
    }
}

/// Boxes so large that their sides overflow: what a ray enters in them it enters in them, and no more.
#[test]
fn boxes_larger_than_any_number_are_entered_like_others() {
    // The ray enters between 2e8 and 5e8 along x, and at 1e9 along y.
    for mirror in [1.0, -1.0] {
        let ray = Ray::new(Vec3::new(2.0e38 * mirror, 0.0, 0.0), Vec3::new(-1.0e30 * mirror, 1.0e-9, 0.0));
        let far =
            |y: f32| Aabb::from_points(&[Vec3::new(-3.0e38 * mirror, y, -1.0), Vec3::new(0.0, 9.0, 1.0)]);
        assert_eq!(ray.enter_box(&far(1.0), f32::INFINITY), None);
        assert!(ray.enter_box(&far(0.3), f32::INFINITY).is_some());
    }
    let mut rng = Rng(46);
    let origin = Vec3::new(-1.0e38, -1.0e38, 0.0);
    let mut touched = 0;
    for _ in 0..50_000 {
        let direction = Vec3::new(rng.range(1.0e37, 2.0e37), rng.range(1.0e37, 2.0e37), 0.0);
        let nearly = 1.0 - rng.range(0.0, 8.0) * f32::EPSILON;
        let edge = origin + direction * Vec3::new(1.0, nearly, 0.0);
        let inner = Aabb::new(Vec3::new(edge.x, -1.1e38, -1.0), Vec3::new(-0.5e38, edge.y, 1.0));
        let ray = Ray::new(origin, direction);
        let Some(t) = ray.enter_box(&inner, f32::INFINITY) else { continue };
        touched += 1;
        let outer = Aabb::new(inner.min.with_y(-3.0e38), inner.max.with_x(3.0e38));
        let outer_t = ray.enter_box(&outer, f32::INFINITY);
        assert!(outer_t.is_some_and(|outer_t| outer_t <= t), "{ray:?}, {inner:?}");
    }
    assert!(touched > 1000, "{touched}");
}

#[test]
fn a_ray_that_is_not_finite_or_has_no_direction_meets_nothing() {
    let boxes = on_a_grid(300);
    let sphere = Sphere { center: Vec3::ZERO, radius_m: 2.0 };
    let capsule = Capsule { from: Vec3::ZERO, to: Vec3::X, radius_m: 2.0 };
    let triangle = [Vec3::new(0.0, -1.0, -1.0), Vec3::new(0.0, 1.0, -1.0), Vec3::Z];
    for (origin, direction) in [
        (Vec3::NAN, Vec3::X),
        (Vec3::new(0.0, f32::NAN, 0.0), Vec3::X),
        (Vec3::NEG_INFINITY, Vec3::X),
        (Vec3::ZERO, Vec3::NAN),
        (Vec3::ZERO, Vec3::INFINITY),
        (Vec3::ZERO, Vec3::new(f32::INFINITY, 1.0, 0.0)),
        (Vec3::ZERO, Vec3::new(1.0, f32::NAN, 0.0)),
        (Vec3::ZERO, Vec3::ZERO),
        (Vec3::ZERO, Vec3::new(-0.0, 0.0, -0.0)),
        (Vec3::NAN, Vec3::NAN),
    ] {
        let ray = Ray::new(origin, direction);
        for bounds in &boxes {
            assert_eq!(ray.enter_box(bounds, f32::INFINITY), None, "{ray:?}, {bounds:?}");
        }
        assert_eq!(ray.meet_triangle(triangle), None, "{ray:?}");
        assert_eq!(ray.enter_sphere(&sphere, f32::INFINITY), None, "{ray:?}");
        assert_eq!(ray.enter_capsule(&capsule, f32::INFINITY), None, "{ray:?}");
    }
}

#[test]
fn triangles_are_met_along_directions_of_any_length() {
    let triangle = [Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(0.0, 1.0, 2.0)];
    for length in [1.0, 1.0e-37, f32::MAX, 2.0e-39] {
        let t = 2.0 / f64::from(length);
        let met = Ray::new(Vec3::ZERO, Vec3::Z * length).meet_triangle(triangle);
        // The last is too far for a number.
        assert_eq!(met.is_some(), f64::from(f32::MAX) > t, "{length}");
        let error = met.map_or(0.0, |met| (f64::from(met) - t).abs());
        assert!(error <= t * 1.0e-5 + 1.0e-44, "{length}: {met:?} instead of {t}");
    }
    // So close that even that direction reaches it.
    let close = triangle.map(|p| p.with_z(1.0e-39));
    let met = Ray::new(Vec3::ZERO, Vec3::Z * 2.0e-39).meet_triangle(close).expect("it is met");
    assert!((met - 0.5).abs() < 1.0e-5, "{met}");
}
