//! What people want of a window in their first hour, by the keys that docs/tasks.md tells them: those of its tasks that
//! need a real window, with the same numbers and keys. The tests of `osp-app` do the others by the same keys. The dual
//! wall (task 12) is in walls.rs.
//!
//! `OSP_SCREENSHOTS=DIR cargo test --features window --test gpu window::task` keeps a picture of the end of each.

use std::{fs, path::Path};

use osp::glam::Vec3;
use osp_session::recording::Event;

use super::desk::{Desk, OspWindow};
use osp_testkit::{events::events_in, wait_until};

const SIZE: &str = "1280x800";
/// The middle of the model's part of the window.
const MIDDLE: (i32, i32) = (720, 390);

fn recording(name: &str) -> String {
    format!("{}/recordings/{name}.ron", osp_testkit::ROOT)
}

/// A window on a session of its own, in a file of the desk's.
fn sketch<'d>(desk: &'d Desk, name: &str) -> (OspWindow<'d>, std::path::PathBuf) {
    let file = desk.folder().join(name);
    let window = desk.open(&["sketch", file.to_str().expect("a path"), "--window", SIZE]);
    (window, file)
}

/// Opens a dialog by its key, replaces the path in it, and confirms.
fn name_file(window: &mut OspWindow<'_>, key: &str, path: &Path) {
    window.key(key);
    window.settle();
    window.key("ctrl+a");
    window.write(path.to_str().expect("a path"));
    window.key("Return");
}

/// A task's name and what does it.
type Task = (&'static str, fn(&Desk));

#[test]
fn each_task_is_done_by_its_keys() {
    let Some(desk) = Desk::new() else { return };
    let tasks: [Task; 4] = [
        ("01_open_somebody_elses_sketch", task_01_open_somebody_elses_sketch),
        ("05_draw_straight_and_in_a_mirror", task_05_draw_straight_and_in_a_mirror),
        ("08_make_a_picture_and_a_film", task_08_make_a_picture_and_a_film),
        ("10_see_what_is_culled", task_10_see_what_is_culled),
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

fn task_08_make_a_picture_and_a_film(desk: &Desk) {
    let (mut window, _) = sketch(desk, "picture.ron");
    window.drag(1, &[(520, 390), (620, 400), (720, 390), (920, 390)]);
    window.until_last("a stroke", |frame| frame["strokes"] == 1);
    window.settle();
    let picture = desk.folder().join("picture.png");
    name_file(&mut window, "ctrl+p", &picture);
    wait_until("a picture", || fs::read(&picture).is_ok_and(|bytes| bytes.starts_with(b"\x89PNG")));
    window.settle();
    window.keep_picture("task-08.png");
    assert!(window.close().success());
    let film = desk.folder().join("film.mp4");
    let film = film.to_str().expect("a path");
    let made = desk.osp(&["film", &recording("scribble"), film, "--size", "160x90", "--seconds", "0.5"]);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    assert_eq!(fs::read(film).expect("a film")[4..8], *b"ftyp");
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
