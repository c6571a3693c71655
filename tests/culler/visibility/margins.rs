//! The margins of tests that are not the same bit for bit everywhere: each is needed, and none is larger than it need be.

use glam::Vec3;
use osp::math::{Aabb, Containment, Frustum, Obb, Plane, Sphere};
use osp_testkit::Random;

/// The frustum of one plane.
fn behind(normal: Vec3, d: f32) -> Frustum {
    let mut planes = *Frustum::everything().planes();
    planes[3] = Plane { normal, d };
    Frustum::new(planes)
}

/// How far the points lie in front of the plane through the origin: the least and the most.
fn along(normal: Vec3, points: &[Vec3]) -> (f64, f64) {
    let distances = points.iter().map(|p| normal.as_dvec3().dot(p.as_dvec3()));
    distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// The `f32` next to `v` that is greater, or less.
fn beside(v: f64, up: bool) -> f32 {
    let nearest = v as f32;
    match up {
        true if f64::from(nearest) < v => nearest.next_up(),
        false if f64::from(nearest) >= v => nearest.next_down(),
        _ => nearest,
    }
}

/// Clouds of points and planes that just touch them, from either side, as exactly as `f32` can say it.
#[test]
fn a_volume_that_touches_a_plane_is_neither_outside_nor_inside() {
    let mut random = Random::new(21);
    let mut decided = 0;
    for i in 0..60_000 {
        let place_m = [0.0, 1.0, 100.0, 1.0e4, 1.0e6][i % 5];
        let at = random.in_cube() * place_m;
        let size = random.log_range(1.0e-4, 3.0);
        let shape = random.in_cube() * size;
        let count = 1 + i % 4;
        let points: Vec<Vec3> = (0..count).map(|_| (at + random.in_cube() * shape).as_vec3()).collect();
        let normal = random.in_cube().normalize().as_vec3() * [1.0, 1.0, 7.5, 0.01][i / 5 % 4];
        let bounds = Aabb::from_points(&points);
        let obb = Obb::from_points(&points).expect("finite points");
        let sphere = Sphere::from_points(&points);
        let (low, high) = along(normal, &points);
        let answers = |d: f32| {
            let frustum = behind(normal, d);
            // The wider test decides no more than the exact one of indexes.
            let (exact, wider) = (frustum.classify(&bounds), frustum.classify_volume(&bounds));
            assert!(wider == exact || wider == Containment::Intersects, "{exact:?}, {wider:?}");
            [
                frustum.classify_volume(&bounds),
                frustum.classify_volume(&obb),
                frustum.classify_volume(&sphere),
            ]
        };
        // The farthest point is just inside.
        let touching = answers(beside(-high, true));
        assert!(touching.iter().all(|&a| a != Containment::Outside), "{points:?} {normal}: {touching:?}");
        // The nearest is just outside.
        let touching = answers(beside(-low, false));
        assert!(touching.iter().all(|&a| a != Containment::Inside), "{points:?} {normal}: {touching:?}");
        // So far off that nothing is in doubt, for the volumes that fit: the sphere is larger than its points.
        let coordinates = bounds.min.abs().max(bounds.max.abs()).max_element();
        let clear = f64::from(normal.abs().element_sum() * coordinates) * 1.0e-5;
        let (low, high) = (along(normal, &bounds.corners()).0, along(normal, &bounds.corners()).1);
        let far = [beside(-high - clear, false), beside(-low + clear, true)].map(|d| answers(d)[0]);
        assert_eq!(far, [Containment::Outside, Containment::Inside], "{points:?} {normal}");
        decided += usize::from(clear < 1.0e-2);
    }
    assert!(decided > 30_000, "{decided}");
}

/// In `f32` the sum of the products overflows, and so does the margin.
#[test]
fn a_plane_cuts_a_volume_as_large_as_numbers_go() {
    let frustum = Frustum::new([Plane { normal: Vec3::splat(0.577), d: 0.0 }; 6]);
    for center in [Vec3::new(3.0e38, 3.0e38, -3.3e38), Vec3::new(-3.0e38, -3.0e38, 3.3e38)] {
        let sphere = Sphere { center, radius_m: 2.0e38 };
        assert_eq!(frustum.classify_volume(&sphere), Containment::Intersects);
    }
}

/// The box of its own axes that is fitted to points holds them, corner by corner, wherever they are.
#[test]
fn fitted_boxes_hold_their_points_to_the_last_bit() {
    let mut random = Random::new(22);
    for i in 0..20_000 {
        let at = random.in_cube() * [0.0, 10.0, 1.0e4][i % 3];
        let shape = random.in_cube() * random.log_range(1.0e-4, 10.0);
        let points: Vec<Vec3> = (0..3 + i % 20).map(|_| (at + random.in_cube() * shape).as_vec3()).collect();
        let obb = Obb::from_points(&points).expect("finite points");
        let half = obb.half_sides_m().as_dvec3();
        let center = obb.center().as_dvec3();
        for p in &points {
            let from_center = p.as_dvec3() - center;
            // As a combination of the axes that it has, not of those that it should have.
            let axes = obb.axes().map(Vec3::as_dvec3);
            let [a, b, c] =
                glam::DMat3::from_cols(axes[0], axes[1], axes[2]).inverse().mul_vec3(from_center).to_array();
            let slack = half.max_element() * 1.0e-9;
            assert!(
                a.abs() <= half.x + slack && b.abs() <= half.y + slack && c.abs() <= half.z + slack,
                "{p} {obb:?}"
            );
            assert!(obb.contains(*p));
        }
        // What is a little outside is not held.
        let beyond = obb.axes()[i % 3].as_dvec3() * (half[i % 3] + half.max_element() * 1.0e-5);
        let p = center + beyond;
        let rounding = (p.as_vec3().as_dvec3() - p).length();
        let is_point = half.max_element() == 0.0;
        assert!(is_point || rounding > half.max_element() * 1.0e-6 || !obb.contains(p.as_vec3()), "{obb:?}");
    }
}
