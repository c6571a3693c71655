//! The commands that draw.

use crate::OSP;
use osp_testkit::{stderr, stdout};

use super::scenes::gpu;

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
fn a_replay_tells_what_culling_while_drawing_did() {
    let Some(_) = gpu() else { return };
    let args = ["replay", "recordings/portrait.ron", "--pace", "samples:600", "--occlusion", "none,hzb"];
    let report = OSP.json([&args[..], &["--draw=320x180", "--json"]].concat());
    let runs = report["runs"].as_array().expect("runs");
    let mean = |name: &str| runs[1][name].as_f64().expect("a number");
    assert_eq!(runs[1]["occlusion"], "hzb");
    assert!(runs[0]["hidden_mean"].is_null(), "{}", runs[0]);
    assert!(mean("hidden_mean") > 0.0 && mean("hidden_mean") == mean("occluded_mean"), "{}", runs[1]);
    assert!(
        (mean("visible_mean") - mean("hidden_mean") - mean("second_pass_mean")).abs() < 1.0,
        "{}",
        runs[1]
    );
    assert!(mean("first_pass_mean") > 0.0 && mean("groups_tested_mean") > 0.0);
    assert_eq!(runs[0]["frames_drawn"], runs[1]["frames_drawn"]);
    let table = OSP.run([&args[..], &["--draw=320x180"]].concat());
    let table = stdout(&table);
    assert!(table.contains("hzb") && table.contains("groups"), "{table}");
}

#[test]
fn a_replay_that_does_not_draw_cannot_cull_while_drawing() {
    let said = OSP.refused(["replay", "recordings/room.ron", "--occlusion", "hzb"]);
    assert!(said.contains("--draw") && said.lines().count() == 1, "{said}");
}

#[test]
fn a_picture_without_a_desktop_is_drawn_without_an_error() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("room.png");
    let args = ["render", "recordings/room.ron", picture.to_str().expect("utf-8"), "--size", "32x32"];
    let mut osp = OSP.command(args);
    osp.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
    let drawn = osp.output().expect("the program starts");
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
fn verify_measures_auto_at_rest_without_the_truth() {
    let Some(_) = gpu() else { return };
    let args = [
        "verify",
        "recordings/portrait.ron",
        "--whole",
        "--camera",
        "orbit",
        "--views",
        "1",
        "--size",
        "97x61",
    ];
    let more = ["--occlusion", "hzb,auto", "--settle", "24", "--frames", "2", "--no-truth", "--json"];
    let report = OSP.json([&args[..], &more].concat());
    assert!(report["parts"].to_string().contains("was not determined"), "{report}");
    assert_eq!(report["faults"], serde_json::json!([]));
    let methods = ["none", "hzb", "auto"];
    for method in methods {
        assert_eq!(figure(&report, method, "pixels_that_differ"), 0.0, "{method}");
        for time in ["draw", "draw_mean"] {
            assert!(figure(&report, method, time) > 0.0, "{method}");
        }
    }
    assert!(figure(&report, "hzb", "colour_pass") < figure(&report, "none", "colour_pass"), "{report}");
}

/// A figure of a method that culls while drawing.
fn figure(report: &serde_json::Value, method: &str, figure: &str) -> f64 {
    let rows = report["rows"].as_array().expect("rows").iter();
    let mut found =
        rows.filter(|row| row["part"] == "verify-drawn" && row["index"] == method && row["figure"] == figure);
    found.next().unwrap_or_else(|| panic!("{figure} of {method}"))["value"].as_f64().expect("a number")
}

#[test]
fn verify_tells_what_share_of_the_hidden_is_found_while_drawing() {
    let Some(_) = gpu() else { return };
    let args =
        ["verify", "recordings/portrait.ron", "--views", "1", "--pixels", "640x360", "--size", "641x359"];
    let report = OSP.json([&args[..], &["--occlusion", "hzb,hzb-16,hzb-1-box", "--json"]].concat());
    let methods = ["none", "hzb", "hzb-16", "hzb-1-box"];
    let share = methods.map(|method| figure(&report, method, "hidden"));
    assert!(share[0] == 0.0 && share[1] > 20.0, "{report}");
    assert!(share[1] > share[2] && share[1] > share[3], "the finest finds most: {report}");
    assert!(methods.iter().all(|method| figure(&report, method, "pixels_that_differ") == 0.0), "{report}");
    let is_of_cpu = |row: &serde_json::Value| row["part"] == "verify" && row["index"] != "";
    assert!(!report["rows"].as_array().expect("rows").iter().any(is_of_cpu));
}

#[test]
fn a_picture_shows_the_whole_model_unless_asked_otherwise() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let drawn = |camera: &[&str], size: &str| {
        let out = folder.path().join("a.png");
        let out = out.to_str().expect("text");
        let line = OSP.done([&["render", "recordings/room.ron", out, "--size", size][..], camera].concat());
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
    let file = std::io::BufReader::new(std::fs::File::open(&out).expect("a picture"));
    let mut reader = png::Decoder::new(file).read_info().expect("a PNG");
    let mut bytes = vec![0; reader.output_buffer_size().expect("small")];
    let info = reader.next_frame(&mut bytes).expect("a PNG");
    let pixels = bytes[..info.buffer_size()].chunks_exact(info.color_type.samples());
    // Bright and reddish; the hair is dark, the clothes are blue, the background is grey. From behind: about 80.
    let skin = pixels.filter(|pixel| pixel[0] > 150 && pixel[0] > pixel[2].saturating_add(30)).count();
    assert!(skin > 220, "{skin} pixels of skin");
}

#[test]
fn a_picture_with_less_detail_is_not_compared() {
    let start = ["render", "recordings/room.ron", "room.png", "--detail", "auto"];
    for other in [&["--occlusion", "hzb"][..], &["--painter", "bsp"], &["--order", "all"]] {
        let said = OSP.refused([&start[..], other].concat());
        assert!(
            said.contains("--detail auto") && said.contains(other[0]) && said.lines().count() == 1,
            "{said}"
        );
    }
}

#[test]
fn a_picture_with_less_detail_has_fewer_polygons() {
    let Some(_) = gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("room.png");
    let picture = picture.to_str().expect("utf-8");
    let args = ["render", "recordings/room.ron", picture, "--size", "320x180", "--detail", "auto", "--check"];
    let said = OSP.done(args);
    let number = |before: &str| -> f64 {
        let text = said.split(before).next().and_then(|text| text.split([' ', ';']).next_back());
        text.expect("a number").replace(',', "").parse().expect("a number")
    };
    let (all, fewer) = (number(" of "), number(" after merging"));
    assert!(fewer < 0.5 * all, "{said}");
}
