//! What people want of a window in their first hour, by the keys that docs/tasks.md tells them: each of its tasks is a test
//! here, with the same number and the same keys. The dual wall (task 12) is in walls.rs.
//!
//! `OSP_SCREENSHOTS=DIR cargo test --features window --test gpu window::task` keeps a picture of the end of each.

use osp_testkit::events::{events_in, scene_of};
use std::{fs, path::Path};

use osp::glam::Vec3;
use osp_session::{recording::Event, scene::Scene};

use super::desk::{Desk, OspWindow};
use osp_testkit::{stdout, wait_until};

const SIZE: &str = "1280x800";
/// The middle of the model's part of the window.
const MIDDLE: (i32, i32) = (720, 390);

fn recording(name: &str) -> String {
    format!("{}/recordings/{name}.ron", osp_testkit::ROOT)
}

fn scene(path: &Path) -> Scene {
    scene_of(&events_in(path))
}

/// A window on a session of its own, in a file of the desk's.
fn sketch<'d>(desk: &'d Desk, name: &str) -> (OspWindow<'d>, std::path::PathBuf) {
    let file = desk.folder().join(name);
    let window = desk.open(&["sketch", file.to_str().expect("a path"), "--window", SIZE]);
    (window, file)
}

/// A straight drag of `count` steps around the middle.
fn drag_across(window: &OspWindow<'_>, from: (i32, i32), to: (i32, i32)) {
    let count = 16;
    let place = |i: i32| {
        let at = |from: i32, to: i32| from + (to - from) * i / count;
        (MIDDLE.0 + at(from.0, to.0), MIDDLE.1 + at(from.1, to.1))
    };
    window.drag(1, &(0..=count).map(place).collect::<Vec<_>>());
}

/// Draws one stroke and waits for it.
fn stroke(window: &mut OspWindow<'_>, from: (i32, i32), to: (i32, i32)) {
    let before = window.number("strokes");
    drag_across(window, from, to);
    window.until_last("a stroke", |frame| frame["strokes"].as_u64() > Some(before));
    window.settle();
}

/// Opens a dialog by its key, replaces the path in it, and confirms.
fn name_file(window: &mut OspWindow<'_>, key: &str, path: &Path) {
    window.key(key);
    window.settle();
    window.key("ctrl+a");
    window.write(path.to_str().expect("a path"));
    window.key("Return");
}

fn says(window: &mut OspWindow<'_>, beginning: &str) {
    window.until_last(beginning, |frame| frame["message"].as_str().is_some_and(|m| m.contains(beginning)));
}

fn is_there(path: &Path, first_bytes: &[u8]) {
    wait_until("a file", || fs::read(path).is_ok_and(|bytes| bytes.starts_with(first_bytes)));
}

/// A task's name and what does it.
type Task = (&'static str, fn(&Desk));

#[test]
fn each_task_is_done_by_its_keys() {
    let Some(desk) = Desk::new() else { return };
    let tasks: [Task; 11] = [
        ("01_open_somebody_elses_sketch", task_01_open_somebody_elses_sketch),
        ("02_measure_something", task_02_measure_something),
        ("03_recolour_one_stroke", task_03_recolour_one_stroke),
        ("04_mirror_what_is_there", task_04_mirror_what_is_there),
        ("05_draw_straight_and_in_a_mirror", task_05_draw_straight_and_in_a_mirror),
        ("06_save_under_a_name", task_06_save_under_a_name),
        ("07_take_it_to_blender", task_07_take_it_to_blender),
        ("08_make_a_picture_and_a_film", task_08_make_a_picture_and_a_film),
        ("09_watch_how_it_was_drawn", task_09_watch_how_it_was_drawn),
        ("10_see_what_is_culled", task_10_see_what_is_culled),
        ("11_choose_a_structure_for_ones_own_data", task_11_choose_a_structure_for_ones_own_data),
    ];
    for (name, task) in tasks {
        eprintln!("{name}");
        task(&desk);
    }
}

fn task_01_open_somebody_elses_sketch(desk: &Desk) {
    let (mut window, _) = sketch(desk, "own.ron");
    // A Tilt Brush sketch where there is a folder of such.
    let tilt = std::env::var_os("OSP_CORPUS").and_then(|folder| {
        let mut files: Vec<_> = fs::read_dir(Path::new(&folder).join("tilt")).ok()?.flatten().collect();
        files.sort_by_key(|file| file.metadata().map_or(u64::MAX, |data| data.len()));
        files.into_iter().map(|file| file.path()).find(|path| path.extension().is_some_and(|e| e == "tilt"))
    });
    let path = tilt.unwrap_or_else(|| recording("portrait").into());
    name_file(&mut window, "ctrl+o", &path);
    window.until_last("its polygons", |frame| frame["polygons"].as_u64() > Some(5));
    window.until_last("it is seen first", |frame| frame["tool"] == "look");
    window.key("f");
    window.until_last("all of it in view", |frame| frame["visible"] == frame["polygons"]);
    window.keep_picture("task-01.png");
    assert!(window.close().success());
}

fn task_02_measure_something(desk: &Desk) {
    let (mut window, _) = sketch(desk, "measure.ron");
    stroke(&mut window, (-200, 0), (200, 0));
    window.key("m");
    window.until_last("the tool", |frame| frame["tool"] == "distance");
    drag_across(&window, (-150, 0), (150, 0));
    window.until_last("a distance", |frame| frame["measured_m"].as_f64() > Some(0.0));
    window.settle();
    window.keep_picture("task-02.png");
    // Three quarters of the stroke's length.
    let points: Vec<_> = events_in(desk.folder().join("measure.ron"))
        .into_iter()
        .filter_map(|event| match event {
            Event::Point { p, .. } => Some(p),
            _ => None,
        })
        .collect();
    let length_m = f64::from(points[0].distance(points[points.len() - 1]));
    let ratio = window.last()["measured_m"].as_f64().expect("a distance") / length_m;
    assert!((0.6..0.95).contains(&ratio), "{ratio}");
    assert!(window.close().success());
}

fn task_03_recolour_one_stroke(desk: &Desk) {
    let (mut window, file) = sketch(desk, "petal.ron");
    stroke(&mut window, (-200, -60), (200, -60));
    stroke(&mut window, (-200, 60), (200, 60));
    window.key("v");
    window.until_last("the tool", |frame| frame["tool"] == "select");
    window.click(MIDDLE.0, MIDDLE.1 + 60);
    window.until_last("one selected", |frame| frame["selected"] == 1);
    // The second colour of the palette.
    window.click(50, 310);
    window.settle();
    window.keep_picture("task-03.png");
    assert!(window.close().success());
    let scene = scene(&file);
    let colors: Vec<_> =
        scene.strokes().iter().filter(|stroke| stroke.is_visible()).map(|stroke| stroke.color()).collect();
    let [a, b] = colors[..] else { panic!("two strokes are left: {colors:?}") };
    assert_ne!(a, b);
}

fn task_04_mirror_what_is_there(desk: &Desk) {
    let (mut window, file) = sketch(desk, "mirror.ron");
    stroke(&mut window, (40, -80), (200, 60));
    let before = window.number("polygons");
    window.key("ctrl+a");
    window.until_last("all selected", |frame| frame["selected"] == 1);
    window.key("ctrl+m");
    window.settle();
    window.keep_picture("task-04.png");
    assert_eq!(window.number("polygons"), before, "it is mirrored, not doubled");
    window.key("ctrl+z");
    window.settle();
    // Undo brings back what was there.
    window.key("ctrl+y");
    window.settle();
    assert!(window.close().success());
    assert!(events_in(&file).iter().filter(|event| matches!(event, Event::Begin { .. })).count() >= 2);
}

fn task_05_draw_straight_and_in_a_mirror(desk: &Desk) {
    let (mut window, file) = sketch(desk, "aids.ron");
    window.key("u");
    window.key("y");
    // A curve of the hand is one straight line, and there is a second one beyond the mirror.
    window.drag(
        1,
        &[(MIDDLE.0 + 60, 300), (MIDDLE.0 + 120, 360), (MIDDLE.0 + 180, 380), (MIDDLE.0 + 260, 330)],
    );
    window.until_last("two strokes", |frame| frame["strokes"] == 2);
    window.settle();
    window.keep_picture("task-05.png");
    assert!(window.close().success());
    let mut strokes: Vec<Vec<Vec3>> = Vec::new();
    for event in events_in(&file) {
        match event {
            Event::Begin { .. } => strokes.push(Vec::new()),
            Event::Point { stroke, p, .. } => strokes[stroke.0 as usize].push(p),
            _ => {}
        }
    }
    for points in &strokes {
        let (first, last) = (points[0], points[points.len() - 1]);
        let along = (last - first).normalize();
        let beside = points.iter().map(|p| (*p - first).reject_from(along).length()).fold(0.0, f32::max);
        assert!(beside < 1.0e-3, "{beside}");
    }
    assert!((strokes[0][0].x + strokes[1][0].x).abs() < 1.0e-4, "{strokes:?}");
}

fn task_06_save_under_a_name(desk: &Desk) {
    let mut window = desk.open(&["sketch", "--window", SIZE]);
    stroke(&mut window, (-200, 0), (200, 0));
    let (wrong, right) = (desk.folder().join("no/such/folder/a.ron"), desk.folder().join("named.ron"));
    name_file(&mut window, "ctrl+shift+s", &wrong);
    window.settle();
    window.keep_picture("task-06-refused.png");
    // The dialog is still open, with the reason.
    window.key("ctrl+a");
    window.write(right.to_str().expect("a path"));
    window.key("Return");
    says(&mut window, "saved as");
    window.settle();
    window.keep_picture("task-06.png");
    assert!(window.close().success());
    assert_eq!(scene(&right).strokes().len(), 1);
}

fn task_07_take_it_to_blender(desk: &Desk) {
    let (mut window, _) = sketch(desk, "to-blender.ron");
    stroke(&mut window, (-200, 0), (200, 0));
    let model = desk.folder().join("model.glb");
    name_file(&mut window, "ctrl+e", &model);
    is_there(&model, b"glTF");
    window.settle();
    window.keep_picture("task-07.png");
    assert!(window.close().success());
}

fn task_08_make_a_picture_and_a_film(desk: &Desk) {
    let (mut window, _) = sketch(desk, "picture.ron");
    stroke(&mut window, (-200, 0), (200, 0));
    let picture = desk.folder().join("picture.png");
    name_file(&mut window, "ctrl+p", &picture);
    is_there(&picture, b"\x89PNG");
    window.settle();
    window.keep_picture("task-08.png");
    assert!(window.close().success());
    let film = desk.folder().join("film.mp4");
    let film = film.to_str().expect("a path");
    let made = desk.osp(&["film", &recording("scribble"), film, "--size", "160x90", "--seconds", "0.5"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(fs::read(film).expect("a film")[4..8], *b"ftyp");
}

fn task_09_watch_how_it_was_drawn(desk: &Desk) {
    let mut window = desk.open(&["replay", &recording("portrait"), "--window"]);
    window.until_last("it plays on opening", |frame| frame["position"].as_u64() > Some(10));
    window.key("space");
    window.settle();
    let stopped = window.number("position");
    window.key("period");
    window.until_last("a frame on", |frame| frame["position"] == stopped + 1);
    window.keep_picture("task-09.png");
    assert!(window.close().success());
}

fn task_10_see_what_is_culled(desk: &Desk) {
    let copy = ["sketch", &recording("room"), "--window", SIZE];
    let mut window = desk.open(&copy);
    window.key("F2");
    for _ in 0..6 {
        window.hand(&["click", "4"]);
    }
    window.key("c");
    window.until_last("frozen", |frame| frame["frozen"] == true);
    window.drag(3, &[(600, 400), (660, 420), (760, 440)]);
    window.settle();
    window.keep_picture("task-10.png");
    assert!(window.number("visible") <= window.number("polygons"));
    assert!(window.close().success());
}

fn task_11_choose_a_structure_for_ones_own_data(desk: &Desk) {
    let said = desk.osp(&["replay", &recording("scribble"), "--index", "osp,octree-rebuild"]);
    let text = stdout(&said);
    assert!(said.status.success() && text.contains("times as long"), "{text}");
    // In the window the same by a key, while one draws.
    let mut window = desk.open(&["sketch", &recording("scribble"), "--window", SIZE]);
    window.key("F2");
    window.key("i");
    window.until_last("another index", |frame| frame["index"] != "osp");
    window.keep_picture("task-11.png");
    assert!(window.close().success());
}
