//! The commands that draw.

use crate::OSP;
use osp_testkit::{ROOT, stderr};

use super::scenes::{gpu, read_png};

#[test]
fn a_replay_takes_the_time_of_drawing_each_frame() {
    let Some(_) = gpu() else { return };
    let what = ["replay", "recordings/room.ron", "--pace", "samples:200", "--draw=160x90", "--json"];
    let report = OSP.json([&what[..], &["--index", "osp", "--occlusion", "none,msvbsp"]].concat());
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 2);
    for run in runs {
        assert_eq!(run["frames_drawn"], report["frames"]);
        let us = |name: &str| run["draw_us"][name].as_f64().expect("a number");
        assert!(us("p50") > 0.0 && us("p50") <= us("p99") && us("p99") <= us("max"), "{run}");
        assert!(run["send_us"]["p50"].as_f64() > Some(0.0));
    }
}

#[test]
fn a_picture_without_a_desktop_is_drawn_without_an_error() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("room.png");
    let args = ["render", "recordings/room.ron", picture.to_str().expect("utf-8"), "--size", "32x32"];
    let drawn = OSP.without_display_in(ROOT, args).output().expect("the program starts");
    let said = stderr(&drawn);
    assert!(drawn.status.success() && said.lines().all(|line| line.starts_with("drawn by ")), "{said}");
}

#[test]
fn a_picture_with_hzb_is_checked_against_one_without() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("portrait.png");
    let picture = picture.to_str().expect("utf-8");
    let said = OSP.done([
        "render",
        "recordings/portrait.ron",
        picture,
        "--size",
        "640x361",
        "--occlusion",
        "hzb",
        "--check",
    ]);
    assert!(said.contains("groups tested") && said.contains("hidden"), "{said}");
    assert!(!said.contains(" 0 hidden"), "{said}");
}

#[test]
fn a_picture_shows_the_whole_model_unless_asked_otherwise() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let drawn = |camera: &[&str], size: &str| {
        let out = folder.path().join("a.png");
        let out = out.to_str().expect("text");
        let line = OSP
            .done([&["render", "--force", "recordings/room.ron", out, "--size", size][..], camera].concat());
        let numbers: Vec<u64> =
            line.split([':', ' ']).filter_map(|word| word.replace(',', "").parse().ok()).collect();
        (numbers[1], numbers[2])
    };
    // Wide and tall.
    for size in ["160x90", "60x120"] {
        let (seen, all) = drawn(&[], size);
        assert_eq!(seen, all, "{size}");
    }
    let (seen, all) = drawn(&["--camera", "recorded"], "160x90");
    assert!(seen < all / 2, "the head stands in one of the rooms: {seen} of {all}");
}

#[test]
fn a_view_given_is_that_of_a_session_with_the_same_camera() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let view = "(p:(0.5,1.5,1.0),q:(0.0,0.0,0.1,0.99498743),fov_degrees:50.0,near_m:0.1)";
    let polygon = "Polygon(t:0,vertices:[(0,1,-3),(1,1,-3),(0,2,-3)],color:(1,0.5,0.2,1))\n";
    let drawn = |name: &str, header: &str, camera: &[&str]| {
        let path = |ending| folder.path().join(format!("{name}.{ending}")).to_str().expect("text").to_owned();
        std::fs::write(path("ron"), format!("Header(format:2{header})\n{polygon}")).expect("written");
        let (session, picture) = (path("ron"), path("png"));
        OSP.done([&["render", &session, &picture, "--size", "160x90"][..], camera].concat());
        std::fs::read(picture).expect("a picture")
    };
    let own = drawn("own", &format!(",camera:{view}"), &["--camera", "recorded"]);
    assert!(own == drawn("given", "", &["--view", view]), "the same eye, the same picture");
    let elsewhere = view.replace("(0.5,", "(0.4,");
    assert!(own != drawn("elsewhere", "", &["--view", &elsewhere]), "another eye, another picture");
}

#[test]
fn the_portrait_shows_its_face() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("portrait.png");
    OSP.done(["render", "recordings/portrait.ron", out.to_str().expect("text"), "--size", "320x240"]);
    let (width, height, bytes) = read_png(&out);
    let pixels = bytes.chunks_exact(bytes.len() / (width * height) as usize);
    // Bright and reddish; the hair is dark, the clothes are blue, the background is grey. From behind: about 80.
    let skin = pixels.filter(|pixel| pixel[0] > 150 && pixel[0] > pixel[2].saturating_add(30)).count();
    assert!(skin > 220, "{skin} pixels of skin");
}
