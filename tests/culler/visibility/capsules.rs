//! Rays and frusta against spheres and capsules.

use glam::{Quat, Vec3};
use osp::{
    math::{Capsule, Containment, Ray, Sphere, Volume},
    view::{Projection, View},
};
use proptest::{collection::vec, prelude::*};

fn point(reach_m: f32) -> impl Strategy<Value = Vec3> {
    let one = move || -reach_m..reach_m;
    (one(), one(), one()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Distance of a point from what the volume is around.
fn distance(from: Vec3, to: Vec3, p: Vec3) -> f32 {
    let (by, over) = (to - from, (to - from).length_squared());
    let part = if over > 0.0 { ((p - from).dot(by) / over).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(from + by * part)
}

/// The first of many steps along a ray that is inside.
fn march(ray: &Ray, is_inside: impl Fn(Vec3) -> bool) -> Option<f32> {
    (0..4000).map(|i| i as f32 * 0.005).find(|t| is_inside(ray.origin + ray.direction * *t))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_ray_enters_where_steps_along_it_come_inside(
        from in point(2.0), to in point(2.0), radius_m in 0.05f32..1.0,
        origin in point(4.0), at in point(2.5),
    ) {
        let ray = Ray::new(origin, (at - origin).normalize_or(Vec3::X));
        let shapes = [(from, to), (from, from)];
        for (from, to) in shapes {
            let capsule = Capsule { from, to, radius_m };
            let entered = ray.enter_capsule(&capsule, f32::INFINITY);
            let stepped = march(&ray, |p| distance(from, to, p) <= radius_m);
            match (entered, stepped) {
                (Some(entered), Some(stepped)) => {
                    prop_assert!(entered <= stepped + 1.0e-3, "{entered} {stepped}");
                    let p = ray.origin + ray.direction * entered;
                    prop_assert!(distance(from, to, p) <= radius_m + 1.0e-3);
                }
                (None, Some(_)) => prop_assert!(false, "missed"),
                // It may pass between two steps.
                (Some(entered), None) => {
                    let p = ray.origin + ray.direction * entered;
                    prop_assert!(distance(from, to, p) <= radius_m + 1.0e-3);
                }
                (None, None) => {}
            }
            if let Some(entered) = entered.filter(|t| *t > 0.01) {
                prop_assert!(ray.enter_capsule(&capsule, entered * 0.99).is_none());
            }
        }
        // A capsule without length is a sphere.
        let sphere = Sphere { center: from, radius_m };
        prop_assert_eq!(
            ray.enter_sphere(&sphere, 9.0),
            ray.enter_capsule(&Capsule { from, to: from, radius_m }, 9.0)
        );
    }

    #[test]
    fn a_capsule_holds_its_points_and_is_never_outside_with_one_inside(
        points in vec(point(1.0), 2..24), shape in (0.01f32..3.0, 0.01f32..0.5, 0.01f32..0.5),
        (axis, angle) in (point(1.0), -3.0f32..3.0), by in point(4.0),
        eye in point(4.0), target in point(4.0),
    ) {
        let turn = Quat::from_axis_angle(axis.try_normalize().unwrap_or(Vec3::Y), angle);
        let points: Vec<Vec3> =
            points.iter().map(|p| turn * (*p * Vec3::from(shape)) + by).collect();
        let capsule = Capsule::from_points(&points).expect("finite points");
        for p in &points {
            prop_assert!(capsule.contains(*p), "{p} is not in {capsule:?}");
        }
        let view = View::look_at(eye, target, Projection::symmetric(70.0, 1.3, 0.05, 6.0));
        let frustum = view.frustum();
        let is_in = |p: &Vec3| frustum.planes().iter().all(|plane| plane.signed_distance(*p) >= 0.0);
        match frustum.classify_volume(&capsule) {
            Containment::Outside => prop_assert!(!points.iter().any(is_in)),
            Containment::Inside => prop_assert!(points.iter().all(is_in)),
            Containment::Intersects => {}
        }
        let sphere = Sphere::from_points(&points);
        prop_assert!(capsule.radius_m <= sphere.size_m() * (1.0 + 8.0 * f32::EPSILON));
    }
}

#[test]
fn rays_that_start_inside_or_run_along_the_axis() {
    let capsule = Capsule { from: Vec3::ZERO, to: Vec3::X * 4.0, radius_m: 1.0 };
    let entered = |origin: Vec3, direction: Vec3| Ray::new(origin, direction).enter_capsule(&capsule, 100.0);
    assert_eq!(entered(Vec3::X, Vec3::Y), Some(0.0));
    assert_eq!(entered(Vec3::X * -3.0, Vec3::X), Some(2.0));
    assert_eq!(entered(Vec3::new(-3.0, 2.0, 0.0), Vec3::X), None);
    assert_eq!(entered(Vec3::X * 9.0, Vec3::X), None, "behind");
    assert_eq!(entered(Vec3::X * 9.0, Vec3::NEG_X * 2.0), Some(2.0), "in units of the direction");
    assert_eq!(entered(Vec3::new(2.0, 5.0, 0.0), Vec3::NEG_Y), Some(4.0));
}
