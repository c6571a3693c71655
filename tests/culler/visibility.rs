//! Views, frusta, cameras, pacing and fingerprints.

mod artist_side;
mod capsules;
mod everything_asked;
mod far_from_origin;
mod fingerprints;
mod from_matrix;
mod margins;
mod ray_boxes;
mod rays;
mod spaces;
mod volumes;

use glam::{Quat, Vec3};
use osp::{
    frame::Pipeline,
    index::IndexConfig,
    math::{Aabb, Containment, Frustum, PlaneMask},
    polygon::PolygonId,
    view::{Projection, View},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Camera, Event, GroupId, Pace, Pacer, RecordingError, StrokeId, Transform},
    replay::{CameraChoice, CameraPath, Moment, SessionFingerprint, fingerprint_of_frame},
    scene::Scene,
};
use osp_testkit::events::{SOLE, polygon};
use proptest::prelude::*;

fn any_view() -> impl Strategy<Value = View> {
    let vector = || (-5.0f32..5.0, -5.0f32..5.0, -5.0f32..5.0).prop_map(Vec3::from);
    let tangents = (-2.0f32..1.0, 0.1f32..2.0, -2.0f32..1.0, 0.1f32..2.0);
    (vector(), vector(), tangents, 0.01f32..1.0).prop_map(
        |(eye, target, (left, width, bottom, height), near_m)| {
            let projection = Projection {
                left,
                right: left + width,
                bottom,
                top: bottom + height,
                near_m,
                far_m: near_m + 20.0,
            };
            View::look_at(eye, target + Vec3::splat(0.01), projection)
        },
    )
}

fn any_box() -> impl Strategy<Value = Aabb> {
    let vector = || (-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0).prop_map(Vec3::from);
    (vector(), vector(), 0.0f32..1.0)
        .prop_map(|(a, b, size)| Aabb::from_points(&[a, a + (b - a) * size * size]))
}

fn contains(frustum: &Frustum, p: Vec3) -> bool {
    frustum.planes().iter().all(|plane| plane.signed_distance(p) >= 0.0)
}

proptest! {
    /// The planes and the matrix are two roads to the same frustum; points within a millimetre of a border are left out.
    #[test]
    fn planes_and_matrix_agree(view in any_view(), p in (-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0).prop_map(Vec3::from)) {
        let frustum = view.frustum();
        let nearest = frustum.planes().iter().map(|plane| plane.signed_distance(p)).fold(f32::INFINITY, f32::min);
        prop_assume!(nearest.abs() > 1.0e-3);
        let clip = view.clip_from_world() * p.extend(1.0);
        let inside_clip = clip.w > 0.0
            && clip.x.abs() <= clip.w && clip.y.abs() <= clip.w
            && clip.z >= 0.0 && clip.z <= clip.w;
        prop_assert_eq!(nearest >= 0.0, inside_clip, "distance {}, clip {:?}", nearest, clip);
    }

    #[test]
    fn the_window_corners_lie_on_the_borders(view in any_view()) {
        for (i, direction) in view.corner_directions().into_iter().enumerate() {
            let p = view.eye_in_world + direction * 5.0;
            let borders = view.frustum().planes()[..4].iter().filter(|plane| plane.signed_distance(p).abs() < 1.0e-3).count();
            prop_assert!(borders >= 2, "corner {} lies on {} borders", i, borders);
        }
    }

    #[test]
    fn a_box_test_never_hides_a_point_that_is_seen(view in any_view(), bounds in any_box(), at in (0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0)) {
        let frustum = view.frustum();
        let p = bounds.min + bounds.extent() * Vec3::from(at);
        let p = p.clamp(bounds.min, bounds.max);
        match frustum.classify(&bounds) {
            Containment::Outside => prop_assert!(!contains(&frustum, p) && !frustum.may_see(&bounds)),
            Containment::Inside => prop_assert!(contains(&frustum, p) && frustum.may_see(&bounds)),
            Containment::Intersects => prop_assert!(frustum.may_see(&bounds)),
        }
    }

    /// What is decided for a box holds, bit for bit, for every box inside it.
    #[test]
    fn decisions_hold_for_everything_inside(view in any_view(), outer in any_box(), a in (0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0), b in (0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0)) {
        let inner = Aabb::from_points(&[a, b].map(|f| (outer.min + outer.extent() * Vec3::from(f)).clamp(outer.min, outer.max)));
        let frustum = view.frustum();
        let (outcome, left, _) = frustum.classify_masked(&outer, PlaneMask::ALL);
        match outcome {
            Containment::Outside => prop_assert!(!frustum.may_see(&inner)),
            Containment::Inside => prop_assert_eq!(frustum.classify(&inner), Containment::Inside),
            Containment::Intersects => prop_assert_eq!(frustum.classify_masked(&inner, left).0, frustum.classify(&inner)),
        }
    }

    /// Pacing loses nothing, repeats nothing and keeps the order, whatever the time stamps do.
    #[test]
    fn pacing_keeps_every_event_in_order(times in proptest::collection::vec(prop_oneof![Just(0.0f64), 0.0..3.0f64, Just(9.5e6), -5.0..0.0f64, Just(1.0e16), Just(1.0e300), 1.0e13..1.0e18f64, (0..20u32).prop_map(|i| 1.0e15 + f64::from(i) * 0.5)], 0..200), n in 1u32..9, recorded: bool) {
        let events: Vec<Event> = times.iter().map(|&t| sample(t)).collect();
        let pace = if recorded { Pace::Recorded } else { Pace::Samples(n) };
        let frames = frames(events.clone(), pace);
        prop_assert_eq!(frames.concat(), events);
        if !recorded {
            prop_assert_eq!(frames.len(), times.len().div_ceil(n as usize));
            prop_assert!(frames.iter().rev().skip(1).all(|f| f.len() == n as usize));
        }
    }
}

fn sample(t: f64) -> Event {
    Event::Point { t, stroke: StrokeId(0), p: Vec3::ZERO, q: Quat::IDENTITY, pressure: 1.0 }
}

fn frames(events: Vec<Event>, pace: Pace) -> Vec<Vec<Event>> {
    let mut pacer = Pacer::new(events.into_iter().map(Ok), pace);
    let (mut frames, mut frame) = (Vec::new(), Vec::new());
    while pacer.next_frame(&mut frame).expect("no damage") {
        frames.push(frame.clone());
        assert!(frames.len() < 1_000_000, "the session has an end");
    }
    frames
}

#[test]
fn recorded_pace_follows_the_clock_and_cuts_pauses() {
    // Two samples a frame at 90 Hz; then an hour's pause; then one more.
    let mut events: Vec<Event> = (0..180).map(|i| sample(f64::from(i) / 180.0)).collect();
    events.push(sample(3600.0));
    let frames = frames(events, Pace::Recorded);
    let drawing = frames.iter().take_while(|f| !f.is_empty()).count();
    assert!((88..=92).contains(&drawing), "one second of drawing in {drawing} frames");
    let pause = frames.len() - drawing - 1;
    assert!((88..=92).contains(&pause), "the pause is cut to one second: {pause} frames");
}

#[test]
fn damage_ends_the_pacing_after_what_came_before() {
    let damage = || RecordingError::Unknown { path: "x".into(), expected: "a".into(), found: "b".into() };
    let events = vec![Ok(sample(0.0)), Ok(sample(0.1)), Err(damage()), Ok(sample(0.2))];
    let mut pacer = Pacer::new(events.into_iter(), Pace::Samples(8));
    let mut frame = Vec::new();
    assert!(pacer.next_frame(&mut frame).is_err());
    assert_eq!(frame.len(), 2, "what was read before the damage is there");
    assert!(!pacer.next_frame(&mut frame).expect("ended"));
}

#[test]
fn pace_is_parsed_as_documented() {
    assert_eq!("recorded".parse(), Ok(Pace::Recorded));
    assert_eq!("samples:16".parse(), Ok(Pace::Samples(16)));
    for wrong in ["samples:0", "samples:", "samples:-1", "sample:3", "", "samples:99999999999"] {
        let error = wrong.parse::<Pace>().expect_err(wrong);
        assert!(error.to_string().contains("samples:N"), "{error}");
    }
}

#[test]
fn fingerprints_do_not_depend_on_order_but_on_every_id() {
    let ids = |ids: &[u32]| fingerprint_of_frame(ids.iter().map(|&i| PolygonId(i)));
    assert_eq!(ids(&[1, 2, 3]), ids(&[3, 1, 2]));
    for other in [&[][..], &[1, 2], &[1, 2, 4], &[1, 2, 3, 3], &[0, 3, 3], &[6]] {
        assert_ne!(ids(&[1, 2, 3]), ids(other), "{other:?}");
    }
    let session = |frames: &[(u64, u64)]| {
        let mut fingerprint = SessionFingerprint::new();
        frames.iter().for_each(|&(frame, f)| fingerprint.add(frame, f));
        fingerprint.value()
    };
    assert_ne!(session(&[(0, 5), (1, 6)]), session(&[(0, 6), (1, 5)]));
    assert_ne!(session(&[(0, 5)]), session(&[(1, 5)]), "a frame left out is noticed");
}

#[test]
fn cameras_see_what_their_names_say() {
    let bounds = Aabb::new(Vec3::new(-3.0, 0.0, -1.0), Vec3::new(5.0, 2.0, 4.0));
    let moment = |frame| Moment { frame, ..Moment::default() };
    for frame in [0, 100, 359, 1000] {
        let orbit = CameraPath::new(CameraChoice::Orbit, None, &bounds).view(&moment(frame));
        assert!(bounds.corners().iter().all(|&p| orbit.frustum().may_see(&Aabb::new(p, p))), "frame {frame}");
        let inside = CameraPath::new(CameraChoice::Inside, None, &bounds).view(&moment(frame));
        assert_eq!(inside.eye_in_world, bounds.center());
        assert!(
            !bounds.corners().iter().all(|&p| inside.frustum().may_see(&Aabb::new(p, p))),
            "frame {frame}"
        );
        let hand = Vec3::new(4.0, 1.0, 3.0);
        let follow = CameraPath::new(CameraChoice::Follow, None, &bounds)
            .view(&Moment { hand: Some(hand), ..moment(frame) });
        assert!(follow.frustum().may_see(&Aabb::new(hand, hand)), "frame {frame}");
    }
    // The session's own camera stands in for a head that was not recorded.
    let q = View::look_at(Vec3::ZERO, Vec3::X, Projection::symmetric(60.0, 1.0, 0.1, 10.0)).world_from_view;
    let own = Camera { p: Vec3::new(-9.0, 1.0, 0.0), q, fov_degrees: 80.0, near_m: None };
    let auto = CameraPath::new(CameraChoice::Auto, Some(own), &bounds).view(&moment(3));
    assert_eq!(auto.eye_in_world, own.p);
    assert!((auto.projection.top - 40.0f32.to_radians().tan()).abs() < 1.0e-5);
    // A recorded head comes before everything else.
    let head = Moment { head: Some((Vec3::new(7.0, 1.0, 0.0), q)), ..moment(0) };
    let auto = CameraPath::new(CameraChoice::Auto, Some(own), &bounds).view(&head);
    assert_eq!(auto.eye_in_world, Vec3::new(7.0, 1.0, 0.0));
    assert!(auto.forward_in_world().distance(Vec3::X) < 1.0e-5);
}

#[test]
fn a_session_without_extent_still_has_a_view() {
    for bounds in [Aabb::EMPTY, Aabb::new(Vec3::ONE, Vec3::ONE)] {
        for &choice in CameraChoice::ALL {
            let view = CameraPath::new(choice, None, &bounds).view(&Moment::default());
            assert!(
                view.frustum().planes().iter().all(|p| p.normal.is_finite() && p.d.is_finite()),
                "{choice:?}"
            );
        }
    }
}

/// A polygon that is moved beyond all range cannot be drawn; back in range it is seen again, where it is.
#[test]
fn what_was_beyond_all_range_is_seen_again_when_it_comes_back() {
    let square = [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    let place = |s: f32, x: f32| SOLE.placed(GroupId(1), Transform { p: Vec3::X * x, q: Quat::IDENTITY, s });
    let polygon = |stroke| polygon(Some(StrokeId(stroke)), square, (1.0, 1.0, 1.0, 1.0));
    let group = |group, strokes, parent| SOLE.grouped(GroupId(group), strokes, parent);
    let far_group = SOLE.placed(GroupId(2), Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0e15 });
    let chain: Vec<Event> = (3..=4)
        .flat_map(|g| {
            let to = Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0e15 };
            [group(g, vec![], None), SOLE.placed(GroupId(g), to)]
        })
        .collect();
    for &kind in IndexKind::ALL {
        let mut scene = Scene::new();
        let mut pipeline = Pipeline::new(kind.create(&IndexConfig::default()), 16);
        let view = View::look_at(
            Vec3::new(0.5, 0.5, 5.0),
            Vec3::new(0.5, 0.5, 0.0),
            Projection::symmetric(60.0, 1.0, 0.1, 100.0),
        );
        let mut frame = |events: &[Event]| {
            let mut changes = Vec::new();
            events.iter().for_each(|e| scene.apply(e, &mut changes));
            pipeline.frame(&scene, &changes, &view).visible
        };
        let setup =
            [polygon(1), group(1, vec![StrokeId(1)], None), group(2, vec![], None), far_group.clone()];
        assert_eq!(frame(&setup), 1, "{}", kind.name());
        frame(&chain);
        // Nested scales of 1e15 leave what f32 can hold.
        frame(&[group(3, vec![], Some(GroupId(4))), group(2, vec![], Some(GroupId(3))), place(1.0, 0.5)]);
        assert_eq!(frame(&[group(1, vec![], Some(GroupId(2)))]), 0, "{}", kind.name());
        // New ones come while it is out there.
        frame(&[polygon(1)]);
        assert_eq!(frame(&[group(1, vec![], None), place(1.0, 0.0)]), 2, "{}", kind.name());
    }
}
