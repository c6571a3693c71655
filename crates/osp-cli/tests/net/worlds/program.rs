//! `osp pack` and `osp replay --world`.

use std::path::Path;

use glam::Vec3;
use osp_net::world::Flight;
use osp_session::{
    recording::{OpenOptions, open as open_session},
    replay::SessionFingerprint,
    scene::Scene,
};
use serde_json::Value;

use super::{Together, open};
use crate::OSP;
use osp_testkit::{stderr, temp};

pub(crate) fn recording(name: &str) -> String {
    format!("{}/recordings/{name}.ron", osp_testkit::ROOT)
}

fn json(folder: &Path, args: &[&str]) -> Value {
    serde_json::from_str(&OSP.done_in(folder, [args, &["--json"]].concat())).expect("JSON")
}

/// The one line in which a command refuses.
fn refused(folder: &Path, args: &[&str]) -> String {
    let output = OSP.run_in(folder, args);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(output.stdout.is_empty() && said.starts_with("error: "), "{said}");
    said
}

pub(crate) fn finished(file: &str) -> Scene {
    let mut session = open_session(Path::new(file), &OpenOptions::default()).expect("a session");
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    while let Some(event) = session.events.next_event().expect("whole") {
        scene.apply(&event, &mut changes);
        changes.clear();
        scene.free_unreachable();
    }
    scene
}

#[test]
fn the_program_sees_what_memory_shows() {
    let folder = temp();
    let (room, nested) = (recording("room"), recording("nested"));
    let said = OSP.done_in(
        folder.path(),
        ["pack", &room, &nested, "--out", "w", "--repeat", "3x1x2", "--spacing", "9"],
    );
    // Places of the grid are filled in turn, along x first.
    let places = |first: usize| -> Vec<Vec3> {
        (first..6)
            .step_by(2)
            .map(|cell| Vec3::new((cell % 3) as f32 * 9.0, 0.0, (cell / 3) as f32 * 9.0))
            .collect()
    };
    let scenes = [finished(&room), finished(&nested)];
    let (of_room, of_nested) = (places(0), places(1));
    let parts = [(&scenes[0], &of_room[..]), (&scenes[1], &of_nested[..])];
    let together = Together::new(&parts);
    let world = open(&folder.path().join("w"));
    assert!(said.starts_with("w: ") && said.contains(" blocks, "), "{said}");
    assert_eq!(world.bounds, together.bounds());
    let mut expected = SessionFingerprint::new();
    let views: Vec<_> = Flight::new(&world.bounds, 3, None, None).take(60).collect();
    let frames = together.seen(&views);
    frames.iter().enumerate().for_each(|(i, (_, fingerprint))| expected.add(i as u64, *fingerprint));
    let flight = ["replay", "--world", "w", "--wait", "--seed", "3", "--frames", "60"];
    for memory in ["5M", "64M"] {
        for loaders in ["1", "2"] {
            let report =
                json(folder.path(), &[&flight[..], &["--memory", memory, "--loaders", loaders]].concat());
            assert_eq!(report["fingerprint"], format!("{:016x}", expected.value()), "{report}");
            assert_eq!(report["frames"], 60);
            let limit = report["memory_limit_bytes"].as_u64().expect("a number");
            let most = report["most_resident_bytes"].as_u64().expect("a number");
            assert!(0 < most && most <= limit, "{report}");
            let visible: u64 = frames.iter().map(|(visible, _)| visible).sum();
            assert!(
                (report["visible_mean"].as_f64().expect("a number") - visible as f64 / 60.0).abs() < 1.0e-6
            );
        }
    }
    assert!(OSP.done_in(folder.path(), flight).contains("fingerprint"));
}

#[test]
fn a_flight_along_a_recorded_head_and_its_table() {
    let folder = temp();
    let (room, portrait) = (recording("room"), recording("portrait"));
    OSP.done_in(folder.path(), ["pack", &room, "--out", "w"]);
    let along = ["replay", "--world", "w", "--path", &portrait, "--wait", "--frames", "50", "--csv", "f.csv"];
    let report = json(folder.path(), &along);
    assert_eq!(report["frames"], 50);
    let table = std::fs::read_to_string(folder.path().join("f.csv")).expect("a table");
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines.len() == 51 && lines[0].starts_with("world,frame,blocks,visible,"), "{table}");
    assert!(lines[1].starts_with("w,0,"), "{table}");
    // It may be replaced by its kind.
    json(folder.path(), &along);
    let headless = "Header(format: 1, name: \"a\", source: \"test\")\nErase(t: 0.0, stroke: 1)\n";
    std::fs::write(folder.path().join("a.ron"), headless).expect("written");
    let said = refused(folder.path(), &["replay", "--world", "w", "--path", "a.ron"]);
    assert!(said.contains("expected a session with a recorded head path"), "{said}");
    assert!(refused(folder.path(), &["replay", "--world", "w", "--camera", "follow"]).contains("--path"));
}

#[test]
fn without_waiting_it_says_what_is_not_there_yet() {
    let folder = temp();
    OSP.done_in(folder.path(), ["pack", &recording("room"), "--out", "w", "--repeat", "6x1x6"]);
    let flight = ["replay", "--world", "w", "--frames", "20", "--rate", "0", "--prefetch", "0"];
    let report = json(folder.path(), &flight);
    assert!(report["missing"]["frames"].as_u64().expect("a number") > 0, "{report}");
    assert!(report["missing"]["polygons_max"].as_u64().expect("a number") > 0, "{report}");
    assert_eq!((&report["fingerprint"], &report["waited"]["frames"]), (&Value::Null, &Value::from(0)));
    assert!(OSP.done_in(folder.path(), flight).contains("missing blocks"));
}

#[test]
fn what_cannot_be_is_refused_in_one_line() {
    let folder = temp();
    let room = recording("room");
    OSP.done_in(folder.path(), ["pack", &room, "--out", "w"]);
    let w = ["replay", "--world", "w"];
    let cases: [(&[&str], &str); 12] = [
        (&["pack", &room, "--out", "w"], "--force replaces it"),
        (&["pack", &room, &room, "--out", "x", "--repeat", "1x1x1"], "a place for each of 2 sessions"),
        (&["pack", "none.ron", "--out", "x"], "none.ron"),
        (&["pack", &room, "--out", &room], "expected a folder; found a file"),
        (&["pack", &room, "--out", "ftp://a/b"], "expected a folder"),
        (&["replay", "--world", "none"], "none"),
        (&["replay", "--world", "."], "manifest.osp-world"),
        (&["replay", "--world", "ftp://a/b"], "expected a folder"),
        (&[w[0], w[1], w[2], "--memory", "1k"], "--memory: expected at least"),
        (&[w[0], w[1], w[2], "--memory", "lots"], "such as 500M or 4G"),
        (&[w[0], w[1], w[2], "--occlusion", "msvbsp"], "cannot be used with"),
        (&[w[0], w[1], w[2], "--far", "0"], "metres"),
    ];
    for (args, words) in cases {
        let said = refused(folder.path(), args);
        assert!(said.contains(words), "{args:?}: {said}");
    }
    assert!(refused(folder.path(), &["replay", "--world", "w", &room]).contains("found "));
    assert!(refused(folder.path(), &["replay", &room, "--wait"]).contains("--world"));
    OSP.done_in(folder.path(), ["pack", &room, "--out", "w", "--force"]);
}
