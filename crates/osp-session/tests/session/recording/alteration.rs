//! Changed copies of strokes.

use glam::{Quat, Vec3};
use osp::math::rotate;
use osp_session::recording::{Alteration, Author, Event, Motion, NormalRule, Paint, StrokeId, Transform};
use osp_testkit::events::{Begin, polygon};

fn close(a: Vec3, b: Vec3) {
    assert!(a.abs_diff_eq(b, 1.0e-4), "{a} {b}");
}

#[test]
fn motions_follow_each_other_and_are_taken_back() {
    let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let motions = [
        Motion::STAY,
        Motion::by(Vec3::new(1.0, -2.0, 0.5)),
        Motion::about(Vec3::new(0.3, 0.2, 0.1), turn, 1.5),
        Motion::mirror_x(0.4),
    ];
    let p = Vec3::new(0.2, 1.1, -0.6);
    for a in &motions {
        close(a.inverse().expect("an inverse").point(a.point(p)), p);
        for b in &motions {
            let both = a.then(b);
            close(both.point(p), b.point(a.point(p)));
            close(both.inverse().expect("an inverse").point(both.point(p)), p);
        }
    }
    close(Motion::mirror_x(0.4).point(p), Vec3::new(0.6, 1.1, -0.6));
    close(motions[2].point(Vec3::new(0.3, 0.2, 0.1)), Vec3::new(0.3, 0.2, 0.1));
    let point = Motion { to: Transform { s: 0.0, ..Motion::STAY.to }, ..Motion::STAY };
    assert_eq!(point.inverse(), None);
}

#[test]
fn a_mirrored_pose_lies_as_the_mirror_image_of_the_hand_but_for_its_x_axis() {
    let q = Quat::from_axis_angle(Vec3::new(-0.3, 0.8, 0.4).normalize(), 1.1);
    let mirror = Motion::mirror_x(0.0);
    let image = mirror.orientation(q);
    close(rotate(image, Vec3::Y), mirror.point(rotate(q, Vec3::Y)));
    close(rotate(image, Vec3::Z), mirror.point(rotate(q, Vec3::Z)));
    close(rotate(image, Vec3::X), -mirror.point(rotate(q, Vec3::X)));
}

#[test]
fn a_copy_has_all_of_a_stroke_and_nothing_of_others() {
    let (of, other, copy) = (StrokeId(3), StrokeId(4), StrokeId(9));
    let begin = |stroke, width| {
        let (color, normal) = ((1.0, 0.0, 0.0, 1.0), NormalRule::LocalX);
        let paint = Some(Box::new(Paint { scale: 0.5, layer: 2, ..Paint::new("Ink", 7) }));
        Begin { width, color, normal, thinnest: 0.1, paint, ..Begin::of(stroke) }.event()
    };
    let point = |stroke, x: f32| Event::Point {
        t: 1.0,
        stroke,
        p: Vec3::new(x, 0.0, 0.0),
        q: Quat::IDENTITY,
        pressure: 0.5,
    };
    let face = |stroke| polygon(Some(stroke), [Vec3::ZERO, Vec3::X, Vec3::Y], (0.0, 1.0, 0.0, 1.0));
    let events = [
        point(of, 7.0),
        begin(of, 0.1),
        begin(other, 0.1),
        begin(of, 9.0),
        point(of, 1.0),
        point(other, 5.0),
        face(of),
        Event::Erase { author: Author::SOLE, t: 2.0, stroke: of },
    ];
    let plain = Alteration::NONE.copy(&events, of, copy, 8.0);
    let at = |event: &Event| {
        let mut event = event.clone();
        match &mut event {
            Event::Begin { t, .. } | Event::Point { t, .. } | Event::Polygon { t, .. } => *t = 8.0,
            _ => {}
        }
        event
    };
    let end = Event::End { t: 8.0, stroke: copy };
    assert_eq!(plain, [at(&begin(copy, 0.1)), at(&point(copy, 1.0)), at(&face(copy)), end]);

    let color = (0.0, 0.0, 1.0, 0.5);
    let motion = Motion::about(Vec3::ZERO, Quat::IDENTITY, 2.0);
    let changed = Alteration { motion, color: Some(color), width_m: None }.copy(&events, of, copy, 8.0);
    let Event::Begin { width, color: c, paint: Some(paint), .. } = &changed[0] else { panic!("a beginning") };
    assert_eq!((*width, *c, paint.scale, paint.seed, paint.layer), (0.2, color, 1.0, 7, 2));
    let Event::Point { p, pressure, .. } = &changed[1] else { panic!("a point") };
    assert_eq!((p.x, *pressure), (2.0, 0.5));
    let Event::Polygon { vertices, color: c, .. } = &changed[2] else { panic!("a polygon") };
    assert_eq!((vertices[1], *c), (Vec3::X * 2.0, color));
    let wide = Alteration { width_m: Some(0.7), ..Alteration::NONE }.copy(&events, of, copy, 8.0);
    assert!(matches!(wide[0], Event::Begin { width: 0.7, .. }));
}
