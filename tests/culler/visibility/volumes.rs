//! Boxes with axes of their own, spheres and frusta: never outside if a point is inside.

use glam::{Mat4, Quat, Vec3};
use osp::{
    math::{Aabb, Containment, Frustum, Obb, Plane, Sphere, Volume},
    view::{Projection, View},
};
use proptest::{collection::vec, prelude::*};

fn point(reach_m: f32) -> impl Strategy<Value = Vec3> {
    let one = move || -reach_m..reach_m;
    (one(), one(), one()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn turn() -> impl Strategy<Value = Quat> {
    (point(1.0), -3.2f32..3.2)
        .prop_map(|(axis, angle)| Quat::from_axis_angle(axis.try_normalize().unwrap_or(Vec3::Y), angle))
}

/// A long, a flat or a round cloud of points, anywhere.
fn cloud() -> impl Strategy<Value = Vec<Vec3>> {
    let shape = (0.001f32..2.0, 0.001f32..2.0, prop_oneof![Just(0.0f32), 0.001f32..2.0]);
    (vec(point(1.0), 1..24), shape, turn(), point(4.0)).prop_map(|(points, (x, y, z), turn, by)| {
        points.iter().map(|&p| turn * (p * Vec3::new(x, y, z)) + by).collect()
    })
}

fn view() -> impl Strategy<Value = View> {
    (point(4.0), point(4.0), 20.0f32..120.0, 0.5f32..2.0, 0.01f32..0.5).prop_map(
        |(eye, target, degrees, aspect, near_m)| {
            View::look_at(eye, target, Projection::symmetric(degrees, aspect, near_m, near_m + 6.0))
        },
    )
}

fn is_in(frustum: &Frustum, p: Vec3) -> bool {
    frustum.planes().iter().all(|plane| plane.signed_distance(p) >= 0.0)
}

fn check(frustum: &Frustum, volume: &impl Volume, points: &[Vec3]) -> Result<(), TestCaseError> {
    match frustum.classify_volume(volume) {
        Containment::Outside => prop_assert!(points.iter().all(|&p| !is_in(frustum, p))),
        Containment::Inside => prop_assert!(points.iter().all(|&p| is_in(frustum, p))),
        Containment::Intersects => {}
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_volume_with_a_point_inside_is_outside(points in cloud(), view in view()) {
        let frustum = view.frustum();
        let obb = Obb::from_points(&points).expect("finite points");
        let bounds = Aabb::from_points(&points);
        check(&frustum, &obb, &points)?;
        check(&frustum, &obb, &obb.corners())?;
        check(&frustum, &Sphere::from_points(&points), &points)?;
        check(&frustum, &Sphere::around(&bounds), &bounds.corners())?;
        check(&frustum, &bounds, &bounds.corners())?;
        // The wider test decides no more than the exact one of indexes.
        let exact = frustum.classify(&bounds);
        let wider = frustum.classify_volume(&bounds);
        prop_assert!(wider == exact || wider == Containment::Intersects, "{exact:?}, {wider:?}");
    }

    #[test]
    fn boxes_hold_their_points_and_are_no_larger_than_aligned_ones(points in cloud()) {
        let obb = Obb::from_points(&points).expect("finite points");
        for &p in &points {
            prop_assert!(obb.contains(p), "{p} in {obb:?}");
        }
        let area = |half: Vec3| half.x * half.y + half.y * half.z + half.z * half.x;
        let aligned = Aabb::from_points(&points).extent() * 0.5;
        prop_assert!(area(obb.half_sides_m()) <= area(aligned) * 1.0001 + 1.0e-5);
        let [a, b, c] = obb.axes();
        prop_assert!(a.dot(b).abs() < 1.0e-5 && b.dot(c).abs() < 1.0e-5 && c.dot(a).abs() < 1.0e-5);
        let sphere = Sphere::from_points(&points);
        prop_assert!(points.iter().all(|p| p.distance(sphere.center) <= sphere.radius_m));
    }

    #[test]
    fn separating_axes_are_right(a in cloud(), b in cloud(), shared: bool) {
        let mut b = b;
        if shared {
            // Through a point of the other.
            let by = a[0] - b[0];
            b.iter_mut().for_each(|p| *p += by);
            // Exactly: boxes of one point each have nothing but that to share.
            b[0] = a[0];
        }
        let [one, other] = [&a, &b].map(|points| Obb::from_points(points).expect("finite points"));
        let bounds = Aabb::from_points(&b);
        let meets = one.intersects(&other);
        prop_assert_eq!(meets, other.intersects(&one));
        prop_assert!(meets || !shared);
        prop_assert!(one.intersects_aabb(&bounds) || !shared);
        // Points of a grid over one box: if the other holds one, they meet; if they meet, the boxes grown by the
        // distance between grid points share one.
        let steps = 12i32;
        let grid = |n: i32, obb: &Obb| {
            let [x, y, z] = [n % (steps + 1), n / (steps + 1) % (steps + 1), n / (steps + 1).pow(2)]
                .map(|i| i as f32 / steps as f32 * 2.0 - 1.0);
            let [u, v, w] = obb.axes();
            let half = obb.half_sides_m();
            obb.center() + u * (x * half.x) + v * (y * half.y) + w * (z * half.z)
        };
        let nearest = (0..(steps + 1).pow(3)).map(|n| distance_m(&other, grid(n, &one))).fold(f32::MAX, f32::min);
        let step = one.half_sides_m().length() / steps as f32;
        prop_assert!(meets || nearest > 0.0, "they share a point");
        prop_assert!(!meets || nearest <= step * 1.01 + 1.0e-5, "{nearest} m apart, steps of {step} m");
    }
}

fn distance_m(obb: &Obb, p: Vec3) -> f32 {
    let from_center = p - obb.center();
    let [u, v, w] = obb.axes().map(|axis| axis.dot(from_center));
    let half = obb.half_sides_m();
    let along = Vec3::new(u, v, w).abs() - half * 1.00001;
    along.max(Vec3::ZERO).length()
}

#[test]
fn a_diagonal_ribbon_gets_a_slim_box() {
    let along = Vec3::new(1.0, 1.0, 1.0).normalize();
    let across = Vec3::new(1.0, -1.0, 0.0).normalize() * 0.01;
    let points: Vec<Vec3> =
        (0..17).flat_map(|i| [along * i as f32 * 0.02 + across, along * i as f32 * 0.02 - across]).collect();
    let obb = Obb::from_points(&points).expect("finite points");
    let half = obb.half_sides_m();
    assert!((half.max_element() - 0.16).abs() < 1.0e-4 && half.min_element() < 1.0e-5, "{half}");
    let slab = |d: f32| {
        let mut planes = [Plane { normal: Vec3::ZERO, d: 0.0 }; 6];
        planes[3] = Plane { normal: across.normalize(), d };
        Frustum::new(planes)
    };
    // Beside the ribbon, but not beside its axis-aligned box.
    assert_eq!(slab(-0.02).classify_volume(&obb), Containment::Outside);
    assert_eq!(slab(-0.02).classify(&Aabb::from_points(&points)), Containment::Intersects);
    assert_eq!(slab(0.02).classify_volume(&obb), Containment::Inside);
}

#[test]
fn what_is_no_number_is_not_decided() {
    assert_eq!(Obb::from_points(&[]), None);
    assert_eq!(Obb::from_points(&[Vec3::ZERO, Vec3::NAN]), None);
    assert_eq!(Obb::from_points(&[Vec3::INFINITY]), None);
    let view = View::look_at(Vec3::ZERO, Vec3::X, Projection::symmetric(60.0, 1.0, 0.1, 10.0));
    let undecided = |volume: &dyn Fn(&Frustum) -> Containment| {
        assert_eq!(volume(&view.frustum()), Containment::Intersects);
    };
    undecided(&|f| f.classify_volume(&Sphere { center: Vec3::NAN, radius_m: 1.0 }));
    undecided(&|f| f.classify_volume(&Sphere { center: Vec3::X, radius_m: f32::NAN }));
    undecided(&|f| f.classify_volume(&Aabb::new(Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX))));
    let huge = Obb::from_points(&[Vec3::splat(-f32::MAX), Vec3::splat(f32::MAX)]);
    undecided(&|f| huge.map_or(Containment::Outside, |huge| f.classify_volume(&huge)));
    assert!(huge.is_some_and(|huge| huge.intersects(&huge)));
    let point = Obb::from_points(&[Vec3::X * 5.0; 3]).expect("a point");
    assert_eq!(view.frustum().classify_volume(&point), Containment::Inside);
    assert!(point.intersects(&point) && !point.intersects_aabb(&Aabb::cube(Vec3::ZERO, 1.0)));
    // No plane left over at infinity.
    assert_eq!(Frustum::from_matrix(&Mat4::ZERO), Frustum::everything());
}
