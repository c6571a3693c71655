//! `.apa`, CASSIE, `.poses` and `.obj`: axes, units, times, colours, by value.

use glam::{Quat, Vec3};
use osp::math::rotate;
use osp_session::recording::{Author, Event, NormalRule, OpenOptions, StrokeId, open};
use osp_testkit::events::Begin;

use super::files::{OBJ, POSES, apa, count, gzip, read, read_sound, small_cassie, write, write_cassie};

fn times_of(events: &[Event], stroke: u32) -> Vec<f64> {
    let of = |event: &&Event| matches!(event, Event::Point { stroke: s, .. } if s.0 == stroke);
    events.iter().filter(of).map(Event::time_secs).collect()
}

#[test]
fn a_painter_needs_no_change_of_axes_or_units() {
    let folder = tempfile::tempdir().unwrap();
    let points = vec![
        ([1.0, 2.0, 3.0], [0.6, 0.0, 0.0, 0.8], 0.25, 1500),
        ([1.5, 2.0, 3.0], [0.0, 0.0, 0.0, 1.0], 1.0, 1511),
    ];
    let path = write(folder.path(), "a.apa", &apa(&[([0.5, 0.0, 1.0], 0.04, points)]));
    let (stroke, p, normal) = (StrokeId(0), Vec3::new(1.0, 2.0, 3.0), NormalRule::SideX);
    let begin =
        Begin { width: 0.04, color: (0.5, 0.0, 1.0, 1.0), normal, thinnest: 0.0, ..Begin::of(stroke) };
    let mut begin = begin.event();
    if let Event::Begin { t, .. } = &mut begin {
        *t = 1.5;
    }
    assert_eq!(
        read_sound(&path),
        [
            begin,
            Event::Point { t: 1.5, stroke, p, q: Quat::from_xyzw(0.6, 0.0, 0.0, 0.8), pressure: 0.25 },
            Event::Point { t: 1.511, stroke, p: p + Vec3::X * 0.5, q: Quat::IDENTITY, pressure: 1.0 },
            Event::End { t: 1.511, stroke },
        ]
    );
}

/// Early recordings have pressures to 2; the width at every point must be `size * pressure` all the same.
#[test]
fn a_painter_pressures_above_one_keep_their_width() {
    let folder = tempfile::tempdir().unwrap();
    let stroke = |pressures: [f32; 2]| {
        let points = pressures.map(|pressure| ([pressure, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], pressure, 0));
        ([1.0; 3], 0.03, points.to_vec())
    };
    let path = write(folder.path(), "a.apa", &apa(&[stroke([0.5, 1.0]), stroke([1.5, 2.0])]));
    let mut full_width = 0.0;
    let mut points = 0;
    for event in read_sound(&path) {
        match event {
            Event::Begin { width, .. } => full_width = width,
            Event::Point { p, pressure, .. } => {
                assert!((full_width * pressure - 0.03 * p.x).abs() < 1e-6, "{full_width} {pressure}");
                assert!(pressure <= 1.0);
                points += 1;
            }
            _ => {}
        }
    }
    assert_eq!(points, 4);
}

#[test]
fn cassie_strokes_end_when_they_were_created() {
    let folder = tempfile::tempdir().unwrap();
    let (history, _) = write_cassie(folder.path());
    let read = read(&history, false);
    assert!(read.error.is_none(), "{:?}", read.error);
    let counts = count(&read.events);
    assert_eq!((counts.begins, counts.points, counts.ends, counts.erases, counts.heads), (3, 11, 3, 1, 4));
    assert!(read.notes.warnings[0].contains("1 of 5 states have no tracked head"), "{:?}", read.notes);
    // The first tracked state, at 99 s, is time 0. Three samples 0.1 s apart up to 100.5 s.
    let close = |times: Vec<f64>, expected: &[f64]| {
        let fits =
            times.len() == expected.len() && times.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(fits, "{times:?} instead of {expected:?}");
    };
    close(times_of(&read.events, 0), &[1.3, 1.4, 1.5]);
    // Its mirror twin runs beside it.
    close(times_of(&read.events, 1), &[1.3, 1.4, 1.5]);
    // The third has five samples but only 0.2 s since the hand was free.
    close(times_of(&read.events, 2), &[1.5, 1.55, 1.6, 1.65, 1.7]);
    assert!(read.events.is_sorted_by(|a, b| a.time_secs() <= b.time_secs()));
    let erase = read.events.iter().find(|event| matches!(event, Event::Erase { .. }));
    assert_eq!(erase, Some(&Event::Erase { author: Author::SOLE, t: 4.0, stroke: StrokeId(0) }));
    let begin = read.events.iter().find(|event| matches!(event, Event::Begin { .. })).unwrap();
    assert!(matches!(begin, Event::Begin { width: 0.005, normal: NormalRule::Transport, .. }), "{begin:?}");
    let first =
        read.events.iter().find_map(|event| if let Event::Point { p, .. } = event { Some(*p) } else { None });
    assert_eq!(first, Some(Vec3::new(0.0, 1.0, -0.5)), "z turned round");
}

#[test]
fn cassie_heads_are_brought_into_the_canvas() {
    let folder = tempfile::tempdir().unwrap();
    let (history, _) = write_cassie(folder.path());
    let heads: Vec<(Vec3, Quat)> = read(&history, false)
        .events
        .into_iter()
        .filter_map(|event| if let Event::Head { p, q, .. } = event { Some((p, q)) } else { None })
        .collect();
    // The canvas as it was at first: only the axes change.
    assert_eq!(heads[0].0, Vec3::new(0.0, 1.2, -0.1));
    // Then the canvas stands at (3, 0.6, -0.8), turned half round about y, at scale 2: the head at (3, 2.6, 0.2) is 2
    // above and 1 in front of it in the room, so 1 above and 0.5 behind it in the canvas, where +z is our -z.
    assert!(heads[1].0.abs_diff_eq(Vec3::new(0.0, 1.0, 0.5), 1e-6), "{}", heads[1].0);
    // It looks along the room's +z, the turned canvas' -z, our +z.
    assert!(rotate(heads[1].1, Vec3::NEG_Z).abs_diff_eq(Vec3::Z, 1e-6), "{}", heads[1].1);
}

#[test]
fn cassie_takes_what_there_is() {
    let folder = tempfile::tempdir().unwrap();
    let (history, raw) = write_cassie(folder.path());
    assert_eq!(read(&history, false).events, read(&raw, false).events, "either file finds the other");
    let (history_text, raw_text) = small_cassie();
    let alone = count(&read_sound(&write(folder.path(), "x/history.json", history_text.as_bytes())));
    assert_eq!((alone.begins, alone.points, alone.erases, alone.heads), (3, 11, 1, 0));
    let raw = read(&write(folder.path(), "y/raw.json", raw_text.as_bytes()), false);
    assert!(raw.error.is_none(), "{:?}", raw.error);
    let alone = count(&raw.events);
    // Without the history there is no mirror twin.
    assert_eq!((alone.begins, alone.points, alone.erases, alone.heads), (2, 8, 1, 4));
    let last = times_of(&raw.events, 0).last().copied().unwrap();
    assert!((last - 1.5).abs() < 1e-9, "created by the action at 100.5 s: {last}");
}

#[test]
fn poses_are_turned_to_y_up_and_cut_where_the_tracker_was_lost() {
    let folder = tempfile::tempdir().unwrap();
    let events = read_sound(&write(folder.path(), "a.poses", POSES.as_bytes()));
    assert_eq!(read_sound(&write(folder.path(), "b.poses.gz", &gzip(POSES.as_bytes()))), events);
    // Three poses; a gap of 0.48 s; two poses; a step of 0.8 m; one pose.
    let counts = count(&events);
    assert_eq!((counts.begins, counts.points, counts.ends), (3, 6, 3));
    let lengths: Vec<usize> = (0..3).map(|stroke| times_of(&events, stroke).len()).collect();
    assert_eq!(lengths, [3, 2, 1]);
    let Event::Point { t, p, q, .. } = events[1] else { panic!("{:?}", events[1]) };
    assert_eq!((t, p), (0.0, Vec3::new(0.1, 0.3, -0.2)), "z is up, times start at zero");
    // A tracker that stands upright in the file (its local z up) stands upright in ours.
    assert!(rotate(q, Vec3::Z).abs_diff_eq(Vec3::Y, 1e-6), "{q}");
    let Event::Point { q, .. } = events[3] else { panic!("{:?}", events[3]) };
    // (w, x, y, z) = (0.5, 0.5, -0.5, 0.5) takes x to the file's z, our y.
    assert!(rotate(q, Vec3::X).abs_diff_eq(Vec3::Y, 1e-6), "{q}: the quaternion's w comes first");
    let y_up = format!("# up: y\n{POSES}");
    let Event::Point { p, q, .. } = read_sound(&write(folder.path(), "c.poses", y_up.as_bytes()))[1] else {
        panic!()
    };
    assert_eq!((p, q), (Vec3::new(0.1, 0.2, 0.3), Quat::IDENTITY));
}

#[test]
fn faces_of_every_form_are_polygons() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), "a.obj", OBJ.as_bytes());
    let found = read(&path, false);
    let said = found.notes.warnings.join("\n");
    assert!(found.error.is_none() && said.contains("materials that no file describes: 1"), "{said}");
    let events = found.events;
    let corner = |i: usize| [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y][i];
    let expected: [&[usize]; 4] = [&[0, 1, 2], &[0, 1, 2, 3], &[0, 1, 2], &[0, 1, 2]];
    let faces = events.iter().filter_map(|event| match event {
        Event::Polygon { stroke: Some(stroke), vertices, .. } => Some((stroke.0, vertices.clone())),
        _ => None,
    });
    let corners = |corners: &[usize]| corners.iter().map(|&i| corner(i)).collect::<Vec<_>>();
    let strokes = [0, 0, 1, 1].into_iter().zip(expected.map(corners));
    assert!(faces.eq(strokes), "a stroke of each material: {events:?}");
    let names = events.iter().filter_map(|event| match event {
        Event::Group { name: Some(name), .. } => Some(&**name),
        _ => None,
    });
    assert!(names.eq(["thing"]));
    assert_eq!(read(&write(folder.path(), "b.obj.gz", &gzip(OBJ.as_bytes())), false).events, events);
    let plain = read_sound(&write(folder.path(), "c.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3"));
    assert!(
        matches!(plain[0], Event::Polygon { color: (r, g, b, 1.0), .. } if r > 0.7 && g > 0.7 && b > 0.69),
        "{plain:?}"
    );
}

/// What a file contains decides before its name.
#[test]
fn a_wrong_name_does_not_matter_where_the_content_is_clear() {
    let folder = tempfile::tempdir().unwrap();
    let drawing = super::files::small_apa();
    let path = write(folder.path(), "drawing.obj", &drawing);
    assert_eq!(open(&path, &OpenOptions::default()).unwrap().format, "apa");
    let (history, _) = small_cassie();
    let path = write(folder.path(), "history.txt", history.as_bytes());
    assert_eq!(open(&path, &OpenOptions::default()).unwrap().format, "cassie");
}
