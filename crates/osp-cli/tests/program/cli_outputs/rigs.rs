//! `--rig` and `--stereo`: every screen and eye of a frame.

use std::{fs, path::Path};

use serde_json::Value;

use super::{assert_refused, names, write_session};
use crate::{OSP, csv::Lines};
use osp_testkit::{shipped_session, stderr, stdout, temp};

fn room() -> String {
    shipped_session("room")
}

/// The screens of the shipped rig `dual-wall`.
const LEFT: &str = "(name: \"left\", lower_left: (-1.69706, 0.3, 0.0), lower_right: (0.0, 0.3, -1.69706), upper_left: (-1.69706, 2.1, 0.0))";
const RIGHT: &str = "(name: \"right\", lower_left: (0.0, 0.3, -1.69706), lower_right: (1.69706, 0.3, 0.0), upper_left: (0.0, 2.1, -1.69706))";
/// A screen that the head stands behind.
const BEHIND: &str = "(name: \"behind\", lower_left: (1.0, 0.3, -1.0), lower_right: (-1.0, 0.3, -1.0), upper_left: (1.0, 2.1, -1.0))";

fn write_rig(folder: &Path, name: &str, screens: &[&str]) {
    let text = format!("(name: \"{name}\", head: (0.0, 1.6, 0.0), screens: [{}])", screens.join(","));
    fs::write(folder.join(format!("{name}.rig")), text).expect("a temporary folder can be written");
}

fn replayed(folder: &Path, args: &[&str]) -> Lines {
    let how = ["replay", &room(), "--pace", "samples:400", "--csv", "f.csv", "--force"];
    OSP.done_in(folder, how.iter().chain(args));
    let lines = Lines::read(folder.join("f.csv"));
    assert!(lines.rows.len() > 25, "{} lines", lines.rows.len());
    lines
}

#[test]
fn two_screens_show_what_each_shows_alone() {
    let folder = temp();
    write_rig(folder.path(), "left", &[LEFT]);
    write_rig(folder.path(), "right", &[RIGHT]);
    // Each index, and a method that hides much.
    for more in [&["--index", "osp,brute-force"][..], &["--occlusion", "msvbsp"]] {
        let of = |rig: &[&str]| replayed(folder.path(), &[rig, more].concat());
        let both = of(&["--rig", "dual-wall", "--stereo", "mono"]);
        let [left, right] = ["left.rig", "right.rig"].map(|rig| of(&["--rig", rig]));
        assert_eq!(both.numbers("views"), vec![2; both.rows.len()]);
        for what in ["in view", "drawn"] {
            for (screen, alone) in [("left", &left), ("right", &right)] {
                let column = format!("{screen}: {what}");
                assert_eq!(both.column(&column), alone.column(&column), "{more:?}");
            }
        }
        let [visible, polygons, culled] = ["visible", "polygons", "culled"].map(|name| both.numbers(name));
        let [in_left, in_right] =
            [(&left, "left: in view"), (&right, "right: in view")].map(|(of, name)| of.numbers(name));
        let print = |text: &&str| u64::from_str_radix(text, 16).expect("a number");
        let prints =
            [&both, &left, &right].map(|of| of.column("fingerprint").iter().map(print).collect::<Vec<_>>());
        for frame in 0..visible.len() {
            assert_eq!(visible[frame], in_left[frame] + in_right[frame]);
            assert_eq!(culled[frame], 2 * polygons[frame] - visible[frame]);
            assert_eq!(prints[0][frame], prints[1][frame].rotate_left(1) ^ prints[2][frame]);
        }
        assert!(in_left.iter().max() > Some(&500) && in_left != in_right);
        if more[0] == "--occlusion" {
            let drawn: u64 = both.numbers("left: drawn").iter().sum();
            let in_view: u64 = in_left.iter().sum();
            assert!(drawn * 2 < in_view, "{drawn} of {in_view} drawn");
            let occluded: u64 = both.numbers("occluded").iter().sum();
            let drawn = drawn + both.numbers("right: drawn").iter().sum::<u64>();
            assert_eq!(occluded + drawn, visible.iter().sum::<u64>());
        }
    }
}

fn json(folder: &Path, args: &[&str]) -> Value {
    OSP.json_in(folder, args.iter().chain(&["--json"]))
}

#[test]
fn a_rig_has_two_eyes_if_its_stereo_has_and_nothing_visible_is_culled() {
    let folder = temp();
    let room = room();
    let args = ["replay", &room, "--pace", "samples:400", "--rig", "dual-wall", "--verify-frames", "3"];
    let report = json(folder.path(), &[&args[..], &["--occlusion", "msvbsp,depth-last"]].concat());
    assert_eq!(report["rig"]["name"], "dual-wall");
    assert_eq!(report["rig"]["stereo"], "side-by-side");
    assert_eq!(report["camera"], "auto on dual-wall, side-by-side, room follows");
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 2);
    for run in runs {
        assert_eq!(run["false_culls"], 0);
        let views = run["views"].as_array().expect("views");
        let names: Vec<_> =
            views.iter().map(|view| (view["screen"].as_str(), view["eye"].as_str())).collect();
        let expected =
            [("left", "left eye"), ("left", "right eye"), ("right", "left eye"), ("right", "right eye")];
        assert_eq!(names, expected.map(|(screen, eye)| (Some(screen), Some(eye))));
        let mean = |view: &Value, name: &str| view[name].as_f64().expect("a number");
        let sum = |name: &str| views.iter().map(|view| mean(view, name)).sum::<f64>();
        let [visible, hidden] =
            [&run["visible_mean"], &run["occluded_mean"]].map(|of| of.as_f64().expect("a number"));
        assert!((sum("in_view_mean") - visible).abs() < 0.1, "{run}");
        assert!((sum("drawn_mean") - (visible - hidden)).abs() < 0.1 && hidden > 100.0, "{run}");
        let is_positive = |name: &str| run["against_one_view"][name].as_f64() > Some(0.0);
        assert!(is_positive("all_views_us") && is_positive("ratio"), "{run}");
    }
    let table = stdout(&OSP.run_in(folder.path(), &args[..args.len() - 2]));
    for words in ["left eye", "right eye", "all views", "views x one", "dual-wall, side-by-side"] {
        assert!(table.contains(words), "{words}: {table}");
    }
    let words: Vec<&str> = table.split_whitespace().collect();
    assert!(words.contains(&"view") && words.contains(&"drawn"), "in view and drawn: {table}");
}

#[test]
fn screens_without_a_view_are_named() {
    let folder = temp();
    write_rig(folder.path(), "two", &[LEFT, BEHIND]);
    write_rig(folder.path(), "one", &[BEHIND]);
    let room = room();
    let replay = |more: &[&str]| {
        let args = ["replay", &room, "--pace", "samples:400", "--index", "osp,brute-simd"];
        OSP.done_in(folder.path(), args.iter().chain(more))
    };
    let said = replay(&["--rig", "two.rig"]);
    let words = "behind: no view in 31 of 31 frames: the eye was not in front of the screen.";
    assert!(said.contains(words), "{said}");
    assert!(said.contains("no view") && !said.contains("left: no view"), "{said}");
    let lines = replayed(folder.path(), &["--rig", "two.rig"]);
    assert!(lines.column("behind: in view").iter().all(|cell| cell.is_empty()));
    assert_eq!(lines.numbers("visible"), lines.numbers("left: in view"));
    // With no view at all there is nothing to cull, and that is no error.
    for occlusion in [&[][..], &["--occlusion", "msvbsp,depth-last,auto"]] {
        let said = replay(&[&["--rig", "one.rig"][..], occlusion].concat());
        assert!(said.contains("behind: no view in 31 of 31 frames"), "{said}");
    }
    // A room that stands is walked through: the wall on the right is 1.7 m away, and later behind the head.
    let mut walk = String::from("Header(format: 1, name: \"walk\", source: \"test\")\n");
    for i in 0..8 {
        walk += &format!("Head(t: {i}.0, p: ({:?}, 1.6, 0.0), q: (0.0, 0.0, 0.0, 1.0))\n", i as f32 * 0.4);
        walk += &format!(
            "Polygon(t: {i}.0, vertices: [(0.0,1.0,-3.0),(1.0,1.0,-3.0),(0.0,1.{i},-3.0)], color: (1.0, 0.5, 0.2, 1.0))\n"
        );
    }
    fs::write(folder.path().join("walk.ron"), walk).expect("written");
    let args = ["replay", "walk.ron", "--pace", "samples:1", "--rig", "dual-wall", "--room", "stands"];
    for occlusion in [&[][..], &["--occlusion", "msvbsp,depth-last,auto", "--verify-frames", "4"]] {
        let said = stdout(&OSP.run_in(folder.path(), args.iter().chain(occlusion)));
        for eye in ["left eye", "right eye"] {
            let line =
                format!("right, {eye}: no view in 3 of 8 frames: the {eye} was not in front of the screen.");
            assert!(said.contains(&line) && !said.contains("left, left eye: no view"), "{said}");
        }
    }
    // A room that follows shows every frame on both.
    let said = stdout(&OSP.run_in(folder.path(), &args[..6]));
    assert!(said.contains("8 frames") && !said.contains("no view"), "{said}");
}

#[test]
fn a_pin_on_a_rig_is_another_one() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let replay =
        |more: &[&str]| OSP.run_in(folder.path(), ["replay", "a.ron", "--index", "osp"].iter().chain(more));
    let rig = ["--rig", "dual-wall"];
    assert!(replay(&[&rig[..], &["--pin", "p.pins"]].concat()).status.success());
    assert!(replay(&[&rig[..], &["--check", "p.pins"]].concat()).status.success());
    for other in [&[][..], &["--rig", "cave4"], &["--rig", "dual-wall", "--stereo", "mono"]] {
        let output = replay(&[other, &["--check", "p.pins"]].concat());
        assert_eq!(output.status.code(), Some(1), "{other:?}");
        assert!(stderr(&output).contains("no fingerprint is pinned"), "{}", stderr(&output));
    }
}

#[test]
fn what_is_no_rig_is_answered_with_those_there_are() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    fs::write(folder.path().join("bad.rig"), "(name: \"bad\",\n screens: 7)").expect("written");
    write_rig(folder.path(), "mine", &[LEFT]);
    let mut commands = vec![vec!["replay", "a.ron"]];
    if cfg!(feature = "render") {
        commands.push(vec!["render", "a.ron", "o.png"]);
    }
    if cfg!(feature = "window") {
        commands.push(vec!["replay", "a.ron", "--window"]);
        commands.push(vec!["sketch"]);
    }
    for args in commands {
        let said = |more: &[&str]| {
            let mut command = OSP.without_display_in(folder.path(), args.iter().chain(more));
            command.output().expect("the program starts")
        };
        assert_refused(&said(&["--rig", "dual-wal"]), &["`dual-wal`", "desktop, dual-wall, cave4", "a file"]);
        assert_refused(&said(&["--rig", "bad.rig"]), &["bad.rig, line 2"]);
        if args[0] != "sketch" && args.last() != Some(&"--window") {
            assert_refused(&said(&["--stereo", "mono"]), &["--stereo needs a --rig"]);
        }
    }
    let onto_itself = ["replay", "a.ron", "--csv", "mine.rig", "--rig", "mine.rig", "--force"];
    assert_refused(&OSP.run_in(folder.path(), onto_itself), &["mine.rig", "an input"]);
    assert_eq!(names(folder.path()), ["a.ron", "bad.rig", "mine.rig"]);
}

#[test]
fn a_rig_is_checked_shown_and_drawn() {
    let folder = temp();
    write_rig(folder.path(), "walls", &[LEFT, RIGHT]);
    write_rig(folder.path(), "turned", &[LEFT, BEHIND]);
    fs::write(folder.path().join("broken.rig"), "(name: \"a\",\n screens: 3)").expect("written");
    for shipped in ["dual-wall", "cave4", "desktop"] {
        OSP.done_in(folder.path(), ["rig", "show", shipped]);
    }
    let turned = OSP.run_in(folder.path(), ["rig", "show", "turned.rig"]);
    assert_eq!(turned.status.code(), Some(1));
    let said = stderr(&turned);
    assert!(said.contains("`behind`") && said.contains("turned.rig"), "{said}");
    let broken = OSP.run_in(folder.path(), ["rig", "show", "broken.rig"]);
    assert_refused(&broken, &["broken.rig, line 2"]);

    let plan = cfg!(feature = "bench").then_some("plan.svg");
    let shown = OSP.done_in(folder.path(), ["rig", "show", "walls.rig"].into_iter().chain(plan));
    // Walls of 2.4 m by 1.8 m, and the head 1.2 m from each.
    let rows = shown.lines().filter(|line| line.contains("2.400"));
    let is_right = |row: &str| ["1.800", "1.200", "90.0"].iter().all(|number| row.contains(number));
    assert_eq!(rows.map(is_right).collect::<Vec<_>>(), [true; 2], "{shown}");
    let behind = stdout(&turned);
    assert!(behind.lines().any(|line| line.matches("behind").count() == 3), "{behind}");
    if plan.is_none() {
        let refused = OSP.run_in(folder.path(), ["rig", "show", "walls.rig", "plan.svg"]);
        assert_refused(&refused, &["osp rig show RIG PLAN", "feature `bench`"]);
        return;
    }
    let plan = fs::read_to_string(folder.path().join("plan.svg")).expect("a plan");
    assert!(plan.starts_with("<svg") && plan.contains("left") && plan.contains("head"));
    fs::write(folder.path().join("mine.svg"), "my text").expect("written");
    OSP.refused_in(folder.path(), ["rig", "show", "walls.rig", "mine.svg"]);
    assert_eq!(fs::read(folder.path().join("mine.svg")).expect("a file"), b"my text");
    OSP.done_in(folder.path(), ["rig", "show", "cave4", "plan.png"]);
}
