//! The side from which a picture shows a whole model.

use std::path::Path;

use glam::{Quat, Vec3};
use osp::math::Aabb;
use osp_session::{
    recording::{Author, Camera, Event, OpenOptions, StrokeId, open},
    replay::{ArtistSide, whole_view},
};

fn head(azimuth: f32, bent: f32) -> Event {
    let q = Quat::from_rotation_y(azimuth) * Quat::from_rotation_x(bent);
    Event::Head { author: Author::SOLE, t: 0.0, p: Vec3::ZERO, q }
}

fn point() -> Event {
    Event::Point { t: 0.0, stroke: StrokeId(1), p: Vec3::ZERO, q: Quat::IDENTITY, pressure: 1.0 }
}

fn side_of<'a>(events: impl IntoIterator<Item = &'a Event>) -> Option<Vec3> {
    let mut side = ArtistSide::default();
    events.into_iter().for_each(|event| side.note(event));
    side.direction_to_artist(None)
}

#[test]
fn the_portrait_is_seen_from_its_face() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/portrait.ron");
    let session = open(&path, &OpenOptions::default()).expect("shipped");
    let mut side = ArtistSide::default();
    let mut last = Vec3::ZERO;
    for event in session {
        let event = event.expect("whole");
        if let Event::Head { q, .. } = event {
            last = q * Vec3::Z;
        }
        side.note(&event);
    }
    assert!(last.z < -0.5, "the artist ends behind it");
    let back = side.direction_to_artist(None).expect("a head").normalize();
    // The face looks along +z (the generator of this session: "radians from its face").
    assert!(back.z > 0.8, "{back}");
    let bounds = Aabb::new(Vec3::new(-1.0, 0.5, -1.0), Vec3::new(1.0, 2.5, 1.0));
    let eye = whole_view(&bounds, Some(back), 1.6).eye_in_world;
    assert!(eye.z > 1.0 && eye.y > 1.5, "{eye}");
}

#[test]
fn what_is_drawn_first_decides_not_where_the_head_ends_or_rests() {
    // Looking around before the first stroke and behind the model at its end.
    let mut events = vec![head(3.0, 0.0), head(2.0, 0.0), head(0.2, -0.8)];
    events.extend((0..600).map(|_| point()));
    events.push(head(-0.2, -0.8));
    events.extend((0..400).map(|_| point()));
    events.push(head(3.1, 0.0));
    events.extend((0..5_000).map(|_| point()));
    let back = side_of(&events).expect("a head").normalize();
    assert!(back.z > 0.9 && back.x.abs() < 0.1, "{back}");
    assert!(back.y > 0.2 && back.y < 0.5, "level and a little above: {back}");
}

#[test]
fn without_a_head_there_is_no_side_and_without_samples_the_latest_head_decides() {
    assert_eq!(side_of(&[point(), point()]), None);
    let back = side_of(&[point(), head(0.0, 0.0), head(1.5, 0.0)]).expect("a head");
    assert!(back.x > 0.9, "{back}");
    // What was drawn before the first head was seen by nobody.
    let back = side_of(&[point(), head(1.5, 0.0), point()]).expect("a head");
    assert!(back.x > 0.9, "{back}");
}

#[test]
fn the_sessions_own_camera_comes_before_the_artist() {
    let mut side = ArtistSide::default();
    let camera = Camera { p: Vec3::ONE, q: Quat::from_rotation_y(1.0), fov_degrees: 60.0, near_m: None };
    let back = camera.q * Vec3::Z;
    assert!(side.direction_to_artist(Some(camera)).is_some_and(|found| found.abs_diff_eq(back, 1.0e-6)));
    [head(3.0, 0.0), point()].iter().for_each(|event| side.note(event));
    assert!(side.direction_to_artist(Some(camera)).is_some_and(|found| found.abs_diff_eq(back, 1.0e-6)));
    assert!(side.direction_to_artist(None).is_some_and(|found| !found.normalize().abs_diff_eq(back, 0.1)));
}
