//! Rigs: the views of their screens, their files, the calibration of trackers, and the place of a room in the world.

use glam::{Quat, Vec3, Vec4};
use osp::{
    math::rotate,
    view::{Projection, View},
};
use osp_session::rig::{Eye, Rig, RoomFromTracker, RoomPlace, Screen};

fn to_screen(view: &View, p: Vec3) -> Vec3 {
    let clip: Vec4 = view.clip_from_world() * p.extend(1.0);
    clip.truncate() / clip.w
}

#[test]
fn the_corners_of_a_screen_are_the_corners_of_its_picture() {
    for name in Rig::shipped() {
        let rig = Rig::open(name).expect("a shipped rig");
        for head in [rig.head, rig.head + Vec3::new(0.11, -0.07, 0.05)] {
            for screen in &rig.screens {
                let eye = rig.eye_in_room(Eye::Left, head, Quat::IDENTITY);
                let view = screen.view(eye, 0.01, 100.0).expect("the head stands before every screen");
                let corners = [
                    (screen.lower_left, -1.0, -1.0),
                    (screen.lower_right, 1.0, -1.0),
                    (screen.upper_left, -1.0, 1.0),
                ];
                for (corner, x, y) in corners {
                    let seen = to_screen(&view, corner);
                    assert!((seen.x - x).abs() < 1.0e-4 && (seen.y - y).abs() < 1.0e-4, "{name}: {seen}");
                }
            }
        }
    }
}

#[test]
fn a_straight_look_at_the_middle_is_the_symmetric_projection() {
    let screen = Screen {
        name: String::new(),
        lower_left: Vec3::new(-1.0, -0.5, -2.0),
        lower_right: Vec3::new(1.0, -0.5, -2.0),
        upper_left: Vec3::new(-1.0, 0.5, -2.0),
        outputs: Vec::new(),
    };
    let view = screen.view(Vec3::ZERO, 0.1, 10.0).expect("a view");
    let fov_degrees = 2.0 * (0.25f32).atan().to_degrees();
    let plain = Projection::symmetric(fov_degrees, 2.0, 0.1, 10.0);
    assert!((view.projection.right - plain.right).abs() < 1.0e-6);
    assert!((view.projection.bottom - plain.bottom).abs() < 1.0e-6);
    assert!(view.forward_in_world().distance(Vec3::NEG_Z) < 1.0e-6);
}

#[test]
fn neighbouring_screens_meet_at_their_common_edge() {
    let rig = Rig::open("dual-wall").expect("a shipped rig");
    let [a, b] = &rig.screens[..] else { panic!("two screens") };
    assert!(a.lower_right.distance(b.lower_left) < 1.0e-6, "they share an edge");
    let (a_along, b_along) = (a.lower_right - a.lower_left, b.lower_right - b.lower_left);
    assert!(a_along.dot(b_along).abs() < 1.0e-4, "at a right angle");
    let eye = rig.head;
    let on_edge = a.lower_right + Vec3::Y * 0.7;
    let (in_a, in_b) = (
        to_screen(&a.view(eye, 0.01, 100.0).expect("a view"), on_edge),
        to_screen(&b.view(eye, 0.01, 100.0).expect("a view"), on_edge),
    );
    assert!((in_a.x - 1.0).abs() < 1.0e-4 && (in_b.x + 1.0).abs() < 1.0e-4, "{in_a} {in_b}");
    assert!((in_a.y - in_b.y).abs() < 1.0e-4);
}

#[test]
fn an_eye_behind_or_on_a_screen_sees_nothing() {
    let rig = Rig::open("desktop").expect("a shipped rig");
    let screen = &rig.screens[0];
    assert!(screen.view(screen.lower_left, 0.01, 10.0).is_none());
    assert!(screen.view(screen.lower_left + Vec3::NEG_Z, 0.01, 10.0).is_none());
    assert!(screen.view(Vec3::NAN, 0.01, 10.0).is_none());
}

#[test]
fn wrong_rigs_are_refused_with_a_reason() {
    let screen = "(name: \"a\", lower_left: (0,0,0), lower_right: (1,0,0), upper_left: (0,1,0))";
    let rig = |screens: &str, more: &str| {
        Rig::parse(&format!("(name: \"r\", head: (0,0,1), screens: [{screens}]{more})"), "r.ron")
    };
    let on = |outputs: &str| {
        screen.replace("upper_left: (0,1,0)", &format!("upper_left: (0,1,0), outputs: [{outputs}]"))
    };
    let corner = |x: &str| screen.replace("(1,0,0)", x);
    let halves = "(monitor: \"1\", viewport: (0, 0, 0.5, 1)), (monitor: \"1\", viewport: (0.5, 0, 0.5, 1))";
    for sound in [screen, &on("(monitor: \"1\"), (monitor: \"2\")"), &on(halves)] {
        assert!(rig(sound, "").is_ok(), "{sound}");
    }
    let reasons = [
        rig("", ""),
        rig(&corner("(1,1,0)"), ""),
        rig(&corner("(0,0,0)"), ""),
        rig(&corner("(inf,0,0)"), ""),
        rig(screen, ", eye_separation_m: -1"),
        rig(screen, ",\n\n huh: 1"),
        rig(screen, ", room_from_tracker: (p: (0,0,0), q: (0,0,0,2))"),
        rig(&on("(monitor: \" \")"), ""),
        rig(&on("(monitor: \"1\", viewport: (0.5, 0, 0.6, 1))"), ""),
        rig(&on("(monitor: \"1\", viewport: (0, 0, 0, 1))"), ""),
        rig(&on("(monitor: \"1\", viewport: (0, 0, inf, 1))"), ""),
        rig(&on("(monitor: \"1\", eyes: Left)"), ""),
        rig(&on("(monitor: \"1\")"), ", stereo: Windows"),
        rig(&on("(monitor: \"1\", eyes: Left)"), ", stereo: Windows"),
        rig(&on("(monitor: \"1\", eyes: Right)"), ", stereo: SideBySide"),
        rig(&on("(monitor: \"1\"), (monitor: \"1\", viewport: (0.5, 0.5, 0.5, 0.5))"), ""),
        rig(&format!("{screen}, {screen}"), ""),
    ];
    insta::assert_snapshot!(reasons.map(|outcome| outcome.expect_err("a wrong rig").to_string()).join("\n"));
    assert!(Rig::open("no/such/rig.ron").expect_err("no rig").to_string().contains("no/such/rig.ron"));
}

const PLACES: [Vec3; 3] = [Vec3::new(-1.7, 0.3, 0.0), Vec3::new(0.0, 0.3, -1.7), Vec3::new(-1.7, 2.1, 0.0)];

fn seen_by(tracker: &RoomFromTracker, place: Vec3) -> Vec3 {
    rotate(tracker.q.conjugate(), place - tracker.p)
}

#[test]
fn three_points_give_the_turn_and_the_shift_back() {
    let tracker = RoomFromTracker {
        p: Vec3::new(0.4, 2.5, -3.0),
        q: Quat::from_euler(glam::EulerRot::YXZ, 2.3, -0.4, 0.2),
    };
    let found =
        RoomFromTracker::from_points(PLACES.map(|p| seen_by(&tracker, p)), PLACES).expect("a transform");
    assert!(found.error_m < 1.0e-5 && (found.scale - 1.0).abs() < 1.0e-5, "{found:?}");
    assert!(found.room_from_tracker.p.distance(tracker.p) < 1.0e-5);
    assert!(found.room_from_tracker.q.dot(tracker.q).abs() > 1.0 - 1.0e-6);
    let pose = Quat::from_rotation_x(0.7);
    let turned = found.room_from_tracker.turn(pose);
    assert!(turned.dot(tracker.q * pose).abs() > 1.0 - 1.0e-6);
}

#[test]
fn what_was_measured_badly_is_told() {
    let mut points = PLACES;
    points[2] += Vec3::new(0.0, 0.09, 0.0);
    let found = RoomFromTracker::from_points(points, PLACES).expect("a transform");
    assert!((0.02..0.09).contains(&found.error_m), "{found:?}");
    let in_millimetres =
        RoomFromTracker::from_points(PLACES.map(|p| p * 1000.0), PLACES).expect("a transform");
    assert!((in_millimetres.scale - 1000.0).abs() < 1.0 && in_millimetres.error_m > 1.0);
    for wrong in [[PLACES[0]; 3], [Vec3::ZERO, Vec3::X, Vec3::X * 2.0]] {
        assert!(RoomFromTracker::from_points(wrong, PLACES).is_err());
    }
}

#[test]
fn the_head_of_the_room_is_where_the_eye_is_and_the_front_where_it_looks() {
    let rig = Rig::open("dual-wall").expect("a shipped rig");
    for (yaw, pitch) in
        [(0.0, 0.0), (0.7, -0.4), (-0.7, 0.4), (3.0, 0.2), (-3.1, -1.0), (std::f32::consts::PI, 0.0)]
    {
        let look = Quat::from_rotation_y(yaw) * Quat::from_rotation_x(pitch);
        let eye = Vec3::new(5.0, 2.0, -3.0);
        let place = RoomPlace::around(&rig, eye, look);
        assert_eq!(place.to_world(rig.head), eye);
        let front = place.to_world(rig.head + Vec3::NEG_Z) - eye;
        assert!(front.distance(rotate(Quat::from_rotation_y(yaw), Vec3::NEG_Z)) < 1.0e-5, "{yaw}: {front}");
        let p = Vec3::new(0.3, 1.1, -0.8);
        assert!(place.to_room(place.to_world(p)).distance(p) < 1.0e-5);
        let back_and_forth = place.turn_to_world(place.turn_to_room(look));
        assert!(back_and_forth.dot(look).abs() > 1.0 - 1.0e-5);
        // Only the pitch of the viewing direction remains.
        let seen = rotate(place.turn_to_room(look), Vec3::NEG_Z);
        assert!(seen.distance(rotate(Quat::from_rotation_x(pitch), Vec3::NEG_Z)) < 1.0e-5);
    }
    let down = RoomPlace::around(&rig, Vec3::ZERO, Quat::from_rotation_x(-std::f32::consts::FRAC_PI_2));
    assert!(down.to_world(rig.head + Vec3::Y).distance(Vec3::Y) < 1.0e-5);
}
