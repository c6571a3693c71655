//! Occluder input: what is refused, and that nothing breaks on anything.

use super::{
    judge::{is_blocked, points_of_box},
    random::{Polygon, Random, straight, volume, window},
};
use glam::{DVec3, Vec3};
use osp::{
    math::Aabb,
    occlusion::{MAX_SIDES, NotAnOccluder, ShadowVolume, Soundness, Verdict},
    view::ViewWindow,
};
use osp_lab::Method;

fn refused(corners: &[Vec3]) -> NotAnOccluder {
    ShadowVolume::of_polygon(corners, &straight(1.0, 0.1)).expect_err("refused")
}

#[test]
fn bad_occluders_are_refused_for_the_right_reason() {
    let at = Vec3::new;
    let quad = [at(-1.0, -1.0, 5.0), at(1.0, -1.0, 5.0), at(1.0, 1.0, 5.0), at(-1.0, 1.0, 5.0)];
    assert!(ShadowVolume::of_polygon(&quad, &straight(1.0, 0.1)).is_ok());
    assert_eq!(refused(&quad[..2]), NotAnOccluder::CornerCount);
    assert_eq!(refused(&[]), NotAnOccluder::CornerCount);
    assert_eq!(refused(&[quad[0]; MAX_SIDES]), NotAnOccluder::CornerCount);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(refused(&[quad[0], quad[1], at(bad, 1.0, 5.0)]), NotAnOccluder::NotFinite);
    }
    assert_eq!(refused(&quad.map(|p| p - Vec3::Z * 10.0)), NotAnOccluder::TooNear, "behind the eye");
    assert_eq!(refused(&quad.map(|p| p * 0.01)), NotAnOccluder::TooNear, "before the near plane");
    assert_eq!(refused(&[quad[0]; 4]), NotAnOccluder::TooNear, "one point");
    // The eye in its plane.
    assert_eq!(refused(&[at(0.0, -1.0, 2.0), at(0.0, 1.0, 2.0), at(0.0, 0.0, 5.0)]), NotAnOccluder::EdgeOn);
    let needle = [at(0.0, -1.0, 5.0), at(1.0e-7, -1.0, 5.0), at(0.0, 1.0, 5.0)];
    assert_eq!(refused(&needle), NotAnOccluder::IllConditioned);
    // An arrowhead.
    let concave = [at(-1.0, -1.0, 5.0), at(0.0, 0.5, 5.0), at(1.0, -1.0, 5.0), at(0.0, 1.0, 5.0)];
    assert_eq!(refused(&concave), NotAnOccluder::NotConvex);
}

#[test]
fn a_window_that_is_no_pointed_cone_is_refused() {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
    let make = |eye, forward, corners, near| ViewWindow::new(eye, forward, corners, near);
    assert!(make(DVec3::ZERO, DVec3::Z, corners, 0.1).is_some());
    let mut reversed = corners;
    reversed.reverse();
    assert!(make(DVec3::ZERO, DVec3::Z, reversed, 0.1).is_some(), "either way round");
    assert!(make(DVec3::NAN, DVec3::Z, corners, 0.1).is_none());
    assert!(make(DVec3::ZERO, DVec3::ZERO, corners, 0.1).is_none());
    assert!(make(DVec3::ZERO, DVec3::NEG_Z, corners, 0.1).is_none());
    assert!(make(DVec3::ZERO, DVec3::Z, corners, f64::NAN).is_none());
    assert!(make(DVec3::ZERO, DVec3::Z, [corners[0]; 4], 0.1).is_none());
    let crossed = [corners[0], corners[2], corners[1], corners[3]];
    assert!(make(DVec3::ZERO, DVec3::Z, crossed, 0.1).is_none());
}

/// A number that is likely to hurt.
fn nasty(random: &mut Random) -> f32 {
    let special = [0.0, -0.0, 1.0, -1.0, 1.0e-30, 1.0e30, 1.0e15, -1.0e15, f32::MIN_POSITIVE, f32::MAX];
    match random.below(8) {
        0 => special[random.below(special.len())],
        1 if random.chance(0.2) => [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][random.below(3)],
        2 => (random.log_range(1.0e-12, 1.0e12) * if random.chance(0.5) { -1.0 } else { 1.0 }) as f32,
        _ => random.range(-5.0, 5.0) as f32,
    }
}

fn nasty_polygon(random: &mut Random) -> Polygon {
    let point = |random: &mut Random| Vec3::new(nasty(random), nasty(random), nasty(random));
    let mut polygon: Polygon = (0..3 + random.below(6)).map(|_| point(random)).collect();
    match random.below(8) {
        // A needle, a repeated corner, a plane through the eye, all but parallel edges.
        0 => polygon[1] = polygon[0] + Vec3::splat(1.0e-7),
        1 => polygon[2] = polygon[1],
        2 => polygon.iter_mut().for_each(|p| p.x = 0.0),
        3 => polygon = vec![Vec3::new(-1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0e-6, 2.0)],
        4 => {
            let (a, u, v) = (point(random), point(random), point(random));
            polygon = vec![a, a + u, a + u + v, a + v];
        }
        _ => {}
    }
    polygon
}

/// Volumes around the nasty corners themselves, and ordinary ones.
fn nasty_volume(window: &ViewWindow, polygons: &[Polygon], random: &mut Random) -> Aabb {
    if random.chance(0.5) || polygons.is_empty() {
        volume(window, polygons, random)
    } else {
        let polygon = &polygons[random.below(polygons.len())];
        let p = polygon[random.below(polygon.len())] * nasty(random).abs().clamp(1.0, 3.0);
        Aabb::cube(p, nasty(random).abs())
    }
}

#[test]
fn no_occluder_input_panics_or_hides_what_is_visible() {
    let scenes = if cfg!(debug_assertions) { 300 } else { 6000 };
    let mut cullers: Vec<_> =
        Method::CULLERS.iter().filter(|kind| **kind != Method::NONE).map(|kind| kind.create(32)).collect();
    let (mut taken, mut hidden) = (0, 0);
    for n in 0..scenes {
        let mut random = Random::new(0xFADE + n);
        let window = if random.chance(0.5) {
            straight(1.0, 0.1)
        } else {
            let eye = DVec3::new(random.range(-1.0, 1.0), 0.0, 0.0) * random.log_range(1.0, 1.0e6);
            let near = random.log_range(1.0e-9, 10.0);
            window(eye, random.direction(), random.direction(), [1.0, 0.7], [0.0, 0.3], near)
        };
        let polygons: Vec<Polygon> = (0..1 + random.below(20)).map(|_| nasty_polygon(&mut random)).collect();
        let (shadows, cast): (Vec<_>, Vec<_>) = polygons
            .iter()
            .filter_map(|p| ShadowVolume::of_polygon(p, &window).ok().map(|s| (s, p.clone())))
            .unzip();
        taken += shadows.len();
        for shadow in &shadows {
            assert!(shadow.sides().iter().all(|n| (n.length() - 1.0).abs() < 1.0e-9), "{shadow:?}");
            assert!(shadow.cap_distance_m() > 0.0 && shadow.solid_angle_in(&window).is_finite());
        }
        for culler in &mut cullers {
            culler.build(&window, &shadows);
            for _ in 0..10 {
                let bounds = nasty_volume(&window, &cast, &mut random);
                let verdict = culler.test_box(&bounds).verdict;
                let _ = culler.test_sphere(&osp::math::Sphere::around(&bounds));
                if culler.soundness() == Soundness::Conservative && verdict == Verdict::Hidden {
                    hidden += 1;
                    for x in points_of_box(&window, &bounds) {
                        assert!(is_blocked(&window, &cast, x), "{} {n}: {x} of {bounds:?}", culler.name());
                    }
                }
            }
        }
    }
    assert!(taken as u64 * 4 > scenes && hidden > 10, "{taken} occluders, {hidden} hidden");
}
