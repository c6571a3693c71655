//! What the near plane and the plane through the eye do to occluders and to what is tested.

use super::{
    guards::{drawn_last, rectangle},
    judge::{hides, is_blocked, is_in_window},
    random::{Random, shadows_of, sound_cullers, straight, window},
    session::{Told, polygon},
};
use glam::{DVec3, Vec3};
use osp::{
    math::{Aabb, Sphere},
    occlusion::{CoverageBuffer, NotAnOccluder, OcclusionCuller, ShadowVolume, Verdict},
};

/// A quad of which the near plane cuts off one corner, exactly at its two neighbours. No new corner comes from that, but
/// the two triangles end at the near plane along a line with a bend, before which nothing is drawn.
#[test]
fn a_bent_quad_cut_exactly_at_two_corners_hides_only_what_is_drawn() {
    let window = straight(1.0, 1.0);
    for bend in [0.1f32, 1.0e-2, 1.0e-3, 1.0e-4, 1.0e-5] {
        // The diagonal from a to c passes the near plane at (0, bend, 1), the line from b to d at (0, 0, 1).
        let c = Vec3::new(0.0, 0.5, 2.0);
        let at_near = Vec3::new(0.0, bend, 1.0);
        let a = at_near + (at_near - c) * 0.5;
        let [b, d] = [Vec3::new(0.75, 0.0, 1.0), Vec3::new(-0.75, 0.0, 1.0)];
        for quad in [[a, b, c, d], [c, d, a, b], [d, c, b, a], [a, d, c, b]] {
            assert_eq!(ShadowVolume::of_polygon(&quad, &window), Err(NotAnOccluder::CutByNear), "{bend}");
            let polygons = [quad.to_vec()];
            let (mut open, mut behind) = (0, 0);
            for culler in sound_cullers(&window, &shadows_of(&window, &polygons)) {
                for i in 1..20 {
                    for x in [-0.5f32, -0.2, 0.0, 0.1, 0.4] {
                        let y = bend * i as f32 * 0.05;
                        let point = Vec3::new(x, y, 1.0) * 8.0;
                        if y >= 0.25 * (1.0 - x.abs() / 0.75) {
                            continue;
                        }
                        let is_hidden = hides(&*culler, &Aabb::new(point, point));
                        if is_blocked(&window, &polygons, point.as_dvec3()) {
                            behind += u32::from(is_hidden);
                        } else {
                            open += 1;
                            assert!(!is_hidden, "{} {bend}: {point}", culler.name());
                        }
                    }
                }
            }
            // Taken round the other two corners, its triangles meet along the near plane.
            let is_bent_there = quad[0] == a || quad[0] == c;
            assert_eq!(open > 0, is_bent_there, "{bend}");
            assert!(behind > 0 || bend < 1.0e-3, "{bend}");
        }
    }
}

/// A triangle with corners exactly on the near plane, and one cut exactly at a corner, still hide: nothing is bent.
#[test]
fn a_triangle_cut_exactly_at_a_corner_hides_what_is_left() {
    let window = straight(1.0, 1.0);
    let at = Vec3::new;
    let cut = [at(-0.5, 0.0, 1.0), at(0.5, 0.5, 2.0), at(0.5, -0.5, 0.5)];
    let shadow = ShadowVolume::of_polygon(&cut, &window).expect("a triangle");
    assert_eq!(shadow.corners().len(), 3);
    assert!(shadow.corners().iter().all(|v| v.z >= 1.0 - 1.0e-12), "{shadow:?}");
    let touching = [at(-0.5, 0.0, 1.0), at(0.5, 0.5, 2.0), at(0.5, -0.5, 1.0)];
    assert_eq!(ShadowVolume::of_polygon(&touching, &window).expect("a triangle").corners().len(), 3);
    // A quad that only touches the near plane is not cut, either.
    let quad = [at(-0.5, -0.5, 1.0), at(0.5, -0.5, 1.0), at(0.5, 0.5, 2.0), at(-0.5, 0.5, 2.0)];
    assert_eq!(ShadowVolume::of_polygon(&quad, &window).expect("a quad").corners().len(), 4);
}

/// Random quads with corners exactly on, just before and just beyond the near plane, bent by anything from rounding to
/// folds: what is called hidden is behind something that is drawn.
#[test]
fn random_quads_at_the_near_plane_hide_only_what_is_drawn() {
    let window = straight(1.0, 1.0);
    let (mut hidden, mut cut) = (0, 0);
    for n in 0..3000 {
        let mut random = Random::new(0x4EA2 + n);
        let turn = random.below(4);
        let mut quad: Vec<Vec3> = (0..4)
            .map(|i| {
                let (x, y) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][(i + turn) % 4];
                let z = match random.below(5) {
                    0 | 1 => 1.0,
                    2 => [1.0f32.next_down(), 1.0f32.next_up(), 0.5, 2.0][random.below(4)],
                    _ => random.range(0.3, 2.5) as f32,
                };
                let at = |v: f64, random: &mut Random| (v * random.range(0.2, 0.9)) as f32;
                Vec3::new(at(x, &mut random), at(y, &mut random), 1.0) * z
            })
            .collect();
        if random.chance(0.3) {
            quad.reverse();
        }
        let polygons = [quad.clone()];
        cut += u32::from(ShadowVolume::of_polygon(&quad, &window) == Err(NotAnOccluder::CutByNear));
        let cullers = sound_cullers(&window, &shadows_of(&window, &polygons));
        for _ in 0..40 {
            let direction = DVec3::new(random.range(-1.0, 1.0), random.range(-1.0, 1.0), 1.0);
            let x = (direction * random.log_range(1.01, 10.0)).as_vec3();
            let blocked = is_blocked(&window, &polygons, x.as_dvec3());
            for culler in &cullers {
                if hides(&**culler, &Aabb::new(x, x)) {
                    hidden += 1;
                    assert!(blocked, "{} {n}: {x} of {quad:?}", culler.name());
                }
            }
        }
    }
    assert!(hidden > 1000 && cut > 500, "{hidden} hidden, {cut} cut");
}

/// A long box that begins just before the eye's plane, and an occluder that ends a few hundred-millionths of a unit above
/// the box's lower edge. In `f64`, half the sum and half the difference of the box's borders are rounded by more than that;
/// the products compared here are exact.
#[test]
fn a_box_that_reaches_the_eyes_plane_is_not_hidden_by_rounding() {
    let window = straight(1.0, 0.01);
    let mut depth = CoverageBuffer::new(1024, 576);
    let (near_m, far_m) = (1.1f32, 1.0e9f32);
    let mut asked = 0;
    for row in 1..16 {
        // The border of a row of pixels, and an occluder that reaches just far enough beyond it to cover the row.
        let border = -f64::from(row) / 288.0;
        let lower = (border - 2.7e-8) as f32;
        let occluder = rectangle(1.0, [-2.0, 2.0], [lower, 2.0]);
        let shadow = ShadowVolume::of_polygon(&occluder, &window).expect("an occluder");
        depth.build(&window, &[shadow]);
        for step in 0..600 {
            let y = ((border - 2.7e-8 - 5.0e-11 * f64::from(step)) * f64::from(near_m)) as f32;
            let bounds = Aabb::new(Vec3::new(-3.0, y, near_m), Vec3::new(3.0, far_m, near_m));
            // Its lower edge shows below the occluder's: y / near < lower / 1.
            if f64::from(y) < f64::from(lower) * f64::from(near_m) {
                asked += 1;
                assert_ne!(depth.test_box(&bounds).verdict, Verdict::Hidden, "{row} {y:e}");
            }
        }
    }
    assert!(asked > 100, "{asked}");
    // Not so near, it is decided.
    let wall = rectangle(1.0, [-2.0, 2.0], [-2.0, 2.0]);
    depth.build(&window, &[ShadowVolume::of_polygon(&wall, &window).expect("a wall")]);
    let behind = Aabb::new(Vec3::new(-3.0, -3.0, 1.1), Vec3::new(3.0, 1.0e4, 2.0));
    assert_eq!(depth.test_box(&behind).verdict, Verdict::Hidden);
}

/// The near plane cuts a floor that begins behind the eye. The floor hides what is below it.
#[test]
fn an_occluder_that_the_near_plane_cuts_hides_in_pixels_too() {
    let window = straight(1.0, 0.01);
    let at = Vec3::new;
    let floor = [at(-50.0, -0.5, -50.0), at(50.0, -0.5, -50.0), at(50.0, -0.5, 50.0), at(-50.0, -0.5, 50.0)];
    let mut depth = CoverageBuffer::new(128, 128);
    let mut parts = Vec::new();
    ShadowVolume::push_polygon(&floor, &window, &mut parts);
    depth.build(&window, &parts);
    let verdict = |y: f32| depth.test_box(&Aabb::cube(at(0.0, y, 3.0), 0.5)).verdict;
    assert_eq!(verdict(-1.5), Verdict::Hidden);
    assert_ne!(verdict(-0.6), Verdict::Hidden);
}

/// A triangle that crosses the plane through the eye: projected, its corner behind the eye lands in the middle of the wall.
#[test]
fn what_crosses_the_eyes_plane_is_drawn() {
    let window = straight(1.0, 0.01);
    let at = Vec3::new;
    let wall = rectangle(1.0, [-1.5, 0.1], [-1.5, 1.5]);
    let across = [at(-1.0, 0.0, 2.0), at(-1.0, 0.1, 2.0), at(1.0, 0.0, -1.2)];
    let hidden = [at(-1.0, 0.0, 2.0), at(-1.0, 0.1, 2.0), at(-0.9, 0.0, 2.0)];
    let told = Told::of(&[polygon(&wall, 1.0), polygon(&across, 1.0), polygon(&hidden, 1.0)]);
    let drawn = drawn_last(&told.scene, &window);
    assert!(drawn.contains(&1), "what passes the eye was culled");
    assert!(!drawn.contains(&2), "and the wall hides");
    for culler in sound_cullers(&window, &[ShadowVolume::of_polygon(&wall, &window).expect("a wall")]) {
        assert!(!hides(&*culler, &Aabb::from_points(&across)), "{}", culler.name());
    }
}

/// What comes too near to the eye's plane for its pixels to be known is drawn, also where it is behind a wall.
#[test]
fn what_all_but_touches_the_eyes_plane_is_drawn() {
    // A narrow window: many pixels to a unit.
    let window = straight(0.01, 0.01);
    let at = Vec3::new;
    let wall = rectangle(1.0, [-1.5, 1.5], [-1.5, 1.5]);
    let far = |x: f32| [at(0.0, -0.9, 2.0), at(0.0, 0.9, 2.0), at(-x, 0.0, 2.0)];
    let told = Told::of(&[polygon(&wall, 1.0), polygon(&far(1.0e3), 1.0), polygon(&far(3.0e4), 1.0)]);
    assert_eq!(drawn_last(&told.scene, &window), [0, 2]);
}

/// A ball just before the eye's plane, whose box reaches back beyond it: the box's corners behind the eye are projected to
/// the wrong side. Most of the window is closed by a wall; the ball shows in what is left.
#[test]
fn a_ball_whose_box_reaches_behind_the_eye_is_not_hidden_by_its_corners() {
    let (mut visible, mut hidden) = (0, 0);
    for n in 0..6000 {
        let mut random = Random::new(0xBA11 + n);
        let (forward, roll) = (random.direction(), random.direction());
        let window = window(DVec3::ZERO, forward, roll, [4.0, 4.0], [0.0, 0.0], 0.01);
        let [a, b, c, d] = window.corners().map(|corner| corner / corner.dot(window.forward()));
        // The wall leaves out a strip at one side of the window.
        let (open, turn) = (random.range(0.0, 0.6), random.below(4));
        let mut wall = [a.lerp(d, open), b.lerp(c, open), c, d];
        if turn % 2 == 1 {
            wall = [a.lerp(b, open), b, c, d.lerp(c, open)];
        }
        if turn > 1 {
            wall = wall.map(|p| window.forward() * 2.0 - p);
        }
        let wall =
            wall.map(|p| ((p - window.forward()) * 1.01 + window.forward()) * 0.02).map(|p| p.as_vec3());
        let Ok(shadow) = ShadowVolume::of_polygon(&wall, &window) else { continue };
        let mut depth = CoverageBuffer::new(128, 128);
        depth.build(&window, &[shadow]);
        let radius = random.range(0.5, 2.0);
        let away = radius * random.range(1.02, 2.2) + 0.03;
        let beside = random.direction() * radius * random.range(0.0, 3.0);
        let center = window.forward() * away + beside - window.forward() * window.forward().dot(beside);
        let ball = Sphere { center: center.as_vec3(), radius_m: radius as f32 };
        if depth.test_sphere(&ball).verdict != Verdict::Hidden {
            visible += 1;
            continue;
        }
        hidden += 1;
        for _ in 0..300 {
            let x = ball.center.as_dvec3() + random.direction() * radius * (1.0 - 1.0e-6);
            let shows = is_in_window(&window, x) && !is_blocked(&window, &[wall.to_vec()], x);
            assert!(!shows, "{n}: {x} of {ball:?}");
        }
    }
    assert!(visible > 500 && hidden > 500, "{visible} {hidden}");
}

/// A ball's radius counts by its size.
#[test]
fn a_ball_of_negative_radius_is_no_smaller() {
    let window = straight(1.0, 0.01);
    let wall = rectangle(1.0, [-0.5, 0.5], [-0.5, 0.5]);
    for culler in sound_cullers(&window, &[ShadowVolume::of_polygon(&wall, &window).expect("a wall")]) {
        for (radius_m, verdict) in [(-0.1, true), (0.1, true), (-2.0, false), (2.0, false)] {
            let ball = Sphere { center: Vec3::new(0.0, 0.0, 4.0), radius_m };
            assert_eq!(
                culler.test_sphere(&ball).verdict == Verdict::Hidden,
                verdict,
                "{} {radius_m}",
                culler.name()
            );
        }
    }
}
