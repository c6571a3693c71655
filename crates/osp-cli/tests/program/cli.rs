//! The program as a user meets it: arguments, exit codes, tables, JSON, CSV, charts, fingerprints.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use crate::{OSP, cli_outputs::strokes_text};
use osp_testkit::{stderr, stdout, temp};

/// A small session with a bit of everything.
fn small_session(folder: &Path) -> PathBuf {
    let text = strokes_text(6, 40, 0.0)
        + "Erase(t: 7.0, stroke: 2)\nUndo(t: 7.1)\nRedo(t: 7.2)\nMove(t: 7.3, strokes: [1, 3], by: (0.0, 0.5, 0.0))\n";
    let path = folder.join("small.ron");
    fs::write(&path, text).expect("a temporary folder can be written");
    path
}

#[test]
fn replay_json_has_the_documented_keys_and_equal_fingerprints() {
    let folder = temp();
    let report = OSP.json(["replay", small_session(folder.path()).to_str().expect("utf-8"), "--json"]);
    assert_eq!(report["recording"], "small.ron");
    assert_eq!((&report["strokes"], &report["points"]), (&6.into(), &240.into()));
    let runs = report["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 4);
    for run in runs {
        for key in ["insert_ns_per_polygon", "cull_us", "visible_mean", "bytes", "allocations_steady"] {
            assert!(run[key].is_number(), "{key} in {run}");
        }
        for key in ["p50", "p95", "p99", "max"] {
            assert!(run["frame_us"][key].is_number(), "{key} in {run}");
        }
        assert_eq!(run["fingerprint"], runs[0]["fingerprint"]);
    }
    let info = OSP.json(["info", small_session(folder.path()).to_str().expect("utf-8"), "--json"]);
    assert_eq!((&info["strokes"], &info["points"], &info["erased"]), (&6.into(), &240.into(), &1.into()));
    assert_eq!(info["polygons"], report["polygons"]);
    let edits = "Header(format: 1)\nUndo(t: 3)\nUndo(t: 5.5)\nErase(t: 4, stroke: 1)\n";
    fs::write(folder.path().join("edits.ron"), edits).expect("written");
    let info = OSP.json_in(folder.path(), ["info", "edits.ron", "--json"]);
    assert_eq!((&info["erase_events"], &info["undo_redo_events"]), (&1.into(), &2.into()));
    assert_eq!((&info["duration_secs"], &info["backward_time_steps"]), (&2.5.into(), &1.into()));
}

#[test]
fn csv_has_a_line_for_each_index_and_frame_and_charts_are_pictures() {
    let folder = temp();
    small_session(folder.path());
    let args = ["replay", "small.ron", "--pace", "samples:10", "--index", "osp,brute-force"];
    let made = |option, name: &str| {
        OSP.done_in(folder.path(), [&args[..], &[option, name]].concat());
        fs::read(folder.path().join(name)).expect("the file")
    };
    let text = String::from_utf8(made("--csv", "f.csv")).expect("the CSV");
    let columns = text.lines().next().expect("names").split(',').count();
    assert!(text.lines().all(|line| line.split(',').count() == columns));
    // 240 points in tens, and a last frame for the move.
    assert_eq!(text.lines().count(), 1 + 2 * 25);
    if !cfg!(feature = "bench") {
        return;
    }
    assert!(made("--chart", "f.png").starts_with(b"\x89PNG"));
    assert!(made("--chart", "f.svg").windows(4).any(|part| part == b"<svg"));
}

#[test]
fn an_index_out_of_its_budget_is_measured_on_stretches_and_the_table_says_so() {
    let folder = temp();
    let session = small_session(folder.path());
    let args = ["replay", session.to_str().expect("utf-8"), "--pace", "samples:1", "--budget", "0.0000001"];
    let said = OSP.done(args);
    assert!(said.contains("octree-rebuild was slow: measured on"), "{said}");
    assert!(said.contains("All indexes found the same"), "{said}");
    let report = OSP.json([&args[..], &["--json"]].concat());
    let measured = report["runs"][3]["frames_measured"].as_u64().expect("a number");
    assert!((40..100).contains(&measured), "one frame for each of 40 stretches, and few more: {measured}");
}

#[test]
fn a_pinned_fingerprint_is_checked() {
    let folder = temp();
    let session = small_session(folder.path());
    let (session, pins) = (session.to_str().expect("utf-8"), folder.path().join("pins.ron"));
    let pins_path = pins.to_str().expect("utf-8");
    OSP.done(["replay", session, "--pin", pins_path]);
    OSP.done(["replay", session, "--check", pins_path]);
    // Another pace is not pinned.
    let other_pace = ["replay", session, "--pace", "samples:3", "--check", pins_path];
    assert_eq!(OSP.run(other_pace).status.code(), Some(1));
    let text = fs::read_to_string(&pins).expect("the pins");
    let at = text.find("fingerprint: \"").expect("a pin") + 14;
    let digit = if &text[at..=at] == "0" { "1" } else { "0" };
    fs::write(&pins, format!("{}{digit}{}", &text[..at], &text[at + 1..])).expect("written");
    let output = OSP.run(["replay", session, "--check", pins_path]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("pinned"), "{}", stderr(&output));
}

#[test]
fn pins_tell_recordings_of_one_name_in_two_folders_apart() {
    let folder = temp();
    let pins = folder.path().join("all.pins");
    let mut sessions = Vec::new();
    for (name, polygons) in [("a", "60"), ("b", "90")] {
        let session = folder.path().join(name).join("same.ron");
        fs::create_dir(session.parent().expect("a folder")).expect("made");
        let session = session.to_str().expect("utf-8").to_owned();
        OSP.done(["synth", "portrait", "--polygons", polygons, &session]);
        sessions.push(session);
    }
    let pins_path = pins.to_str().expect("utf-8");
    let both = |option| OSP.run(["replay", &sessions[0], &sessions[1], option, pins_path]);
    assert!(both("--pin").status.success());
    assert!(both("--check").status.success(), "{}", stderr(&both("--check")));
    let text = fs::read_to_string(&pins).expect("the pins");
    assert!(text.contains("\"a/same.ron\"") && text.contains("\"b/same.ron\""), "{text}");
}

#[cfg(feature = "window")]
#[test]
fn a_file_in_the_place_of_a_command_is_opened_in_the_window() {
    let folder = temp();
    let junk = folder.path().join("junk.ron");
    fs::write(&junk, "no session").expect("written");
    let junk = junk.to_str().expect("utf-8");
    let said = OSP.refused([junk]);
    assert_eq!(said, OSP.refused(["sketch", junk]));
    assert!(said.contains("junk.ron"), "{said}");
}

#[cfg(not(feature = "window"))]
#[test]
fn a_file_in_the_place_of_a_command_gets_a_hint() {
    let folder = temp();
    let session = small_session(folder.path());
    let odd = folder.path().join("it's mine.ron");
    fs::copy(&session, &odd).expect("copied");
    let odd = odd.to_str().expect("utf-8");
    for (path, quoted) in [
        (session.to_str().expect("utf-8"), session.display().to_string()),
        (odd, format!("'{}'", odd.replace('\'', "'\\''"))),
    ] {
        let said = OSP.refused([path]);
        let hint = format!("to replay it: osp replay {quoted}\n");
        assert!(said.ends_with(&hint), "{said}");
    }
    for missing in ["no-such-file.ron", "no/such/folder"] {
        let said = OSP.refused([missing]);
        assert!(
            said.starts_with(&format!("error: {missing}: there is no such file, and no such command")),
            "{said}"
        );
    }
    assert!(OSP.refused(["replya"]).contains("a similar subcommand exists"));
}

#[test]
fn info_counts_strokes_in_one_way() {
    for name in ["room", "grow", "portrait", "class"] {
        let path = format!("recordings/{name}.ron");
        let info = OSP.json(["info", &path, "--json"]);
        let of_brushes = info["brushes"].as_array().expect("rows").iter().map(|row| &row["strokes"]);
        let sum: u64 = of_brushes.map(|strokes| strokes.as_u64().expect("a number")).sum();
        let count = |key: &str| info[key].as_u64().expect("a number");
        assert_eq!(sum, count("strokes_at_end"), "{name}");
        let undone = count("strokes") - count("erased") - sum;
        let text = stdout(&OSP.run(["info", &path]));
        let line = format!(" {sum} in the model at the end, {} erased, {undone} undone)", count("erased"));
        assert!(text.contains(&line.replacen(' ', "(", 1)), "{line}: {text}");
    }
}

#[test]
fn a_session_cut_off_replays_up_to_the_cut_with_one_warning() {
    let folder = temp();
    let session = small_session(folder.path());
    let text = fs::read_to_string(&session).expect("the session");
    let cut = text.rfind("Point(").expect("points") + 20;
    fs::write(&session, &text[..cut]).expect("written");
    let output = OSP.run(["replay", session.to_str().expect("utf-8")]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(stderr(&output).lines().count(), 1, "{}", stderr(&output));
    assert!(stdout(&output).contains("239 points"), "{}", stdout(&output));
}

#[test]
fn synth_writes_what_replay_reads_and_guards_what_is_there() {
    let folder = temp();
    let path = |name: &str| folder.path().join(name).to_str().expect("utf-8").to_owned();
    let synth = |name: &str, more: &[&str]| {
        OSP.run([&["synth", "scribble", "--polygons", "300", "--seed", "9", &path(name)], more].concat())
    };
    for name in ["a.ron", "a.ron.zst"] {
        let output = synth(name, &[]);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stdout(&output).contains("strokes"), "{}", stdout(&output));
        let info = OSP.json(["info", &path(name), "--json"]);
        assert_eq!(info["source"], "osp synth scribble --polygons 300 --seed 9");
        assert!(info["polygons"].as_u64().is_some_and(|n| (297..600).contains(&n)), "{info}");
        assert_eq!(info["warnings"].as_array().map(Vec::len), Some(0));
    }
    let before = fs::read(path("a.ron")).expect("written");
    let again = synth("a.ron", &[]);
    assert_eq!(again.status.code(), Some(2));
    assert!(stderr(&again).contains("--force"), "{}", stderr(&again));
    assert_eq!(fs::read(path("a.ron")).expect("still there"), before);
    assert!(synth("a.ron", &["--force"]).status.success());
    assert_eq!(fs::read(path("a.ron")).expect("written again"), before, "the same bytes");
    assert!(stderr(&synth("a.txt", &[])).contains(".ron or .ron.zst"));
}

#[test]
fn a_reader_that_has_seen_enough_does_not_hide_a_failed_check() {
    let folder = temp();
    let session = small_session(folder.path());
    let pins = folder.path().join("pins.ron");
    fs::write(&pins, "(pins: [])").expect("written");
    let mut child = OSP
        .command(["replay".as_ref(), session.as_os_str(), "--check".as_ref(), pins.as_os_str()])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    assert_eq!(child.wait().expect("ends").code(), Some(1));
}

#[test]
fn an_empty_session_among_others_stops_nothing() {
    let folder = temp();
    let empty = folder.path().join("empty.ron");
    fs::write(&empty, "Header(format: 1)\n").expect("written");
    let session = small_session(folder.path());
    let path = |p: &Path| p.to_str().expect("utf-8").to_owned();
    let chart = path(&folder.path().join("c.svg"));
    let charts = if cfg!(feature = "bench") { &["--chart", &chart][..] } else { &[] };
    let said = OSP.done([&["replay", &path(&empty), &path(&session)], charts].concat());
    assert!(said.contains("240 points"));
    assert_eq!(folder.path().join("c-2.svg").exists(), cfg!(feature = "bench"));
}

/// Runs `osp` while a command of the shell writes into its standard input (`-`) or the file `pipe`.
fn of_pipe(folder: &Path, command: &str, pipe: &str, args: impl IntoIterator<Item = String>) -> Output {
    let to = if pipe == "-" { "" } else { "> pipe" };
    let mut shell = Command::new("sh");
    shell.current_dir(folder).args(["-c", &format!("{command} {to}")]);
    let mut shell = shell.stdout(Stdio::piped()).spawn().expect("a shell");
    let mut osp = OSP.command_in(folder, args);
    let output = osp.stdin(shell.stdout.take().expect("a pipe")).output().expect("the program starts");
    assert!(output.status.success(), "{command} of {pipe}: {}", stderr(&output));
    assert!(shell.wait().expect("it ends").success());
    output
}

/// A second reading would wait for ever.
#[cfg(unix)]
#[test]
fn a_pipe_is_read_once_wherever_a_file_is_read() {
    let folder = temp();
    small_session(folder.path());
    let has = crate::cli_outputs::built::has::<&str>;
    if !osp_testkit::make_pipe(&folder.path().join("pipe")) {
        eprintln!("skipped: no mkfifo");
        return;
    }
    for (command, of) in [
        ("info @ --json", "polygons"),
        ("replay @ --index osp --json", "fingerprint"),
        ("replay @ --index osp --occlusion msvbsp --json", "fingerprint"),
        ("export @ @.glb", "polygons, "),
        ("export @ @.glb --frame 3 --force", "polygons, "),
        ("convert @ @.tilt", " strokes, "),
        ("import @ @.zst.ron", " strokes, "),
        ("bake @ @.pvs --cells 1 --samples 1 --pixels 16", " polygons; "),
        ("verify @ --views 2 --pixels 64x64 --repeats 1", "visible"),
        ("verify @ --views 2 --pixels 64x64 --repeats 1 --whole --json", "visible"),
        ("query @ --sphere 0,0,0 9", " polygons"),
        ("query @ --at 0.5,0.5", " tested "),
        ("race @", "osp"),
        ("bench @ --quick --no-growth --no-rays --index osp --json", "session"),
        ("draw-index @ @.svg", " nodes"),
        ("draw-insertion @ @.gif --polygons 1 --levels 1", " planes"),
        ("draw-occlusion @ @.svg --force", " planes"),
    ]
    .into_iter()
    .filter(|(command, _)| has(&command.split(' ').collect::<Vec<_>>()))
    {
        for pipe in ["pipe", "-"] {
            let args = command.split(' ').map(|word| word.replace('@', pipe));
            let args =
                args.map(|word| word.strip_prefix("-.").map_or(word.clone(), |end| format!("o.{end}")));
            let said = stdout(&of_pipe(folder.path(), "cat small.ron", pipe, args));
            assert!(said.contains(of), "{command} of {pipe}: {said}");
        }
    }
    // The contents alone tell the format.
    let triangle = r#"{"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"asset":{"version":"2.0"},
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"buffers":[{"byteLength":36,
        "uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    let poses = "# up: y\n\n0 0 0 0 1 0 0 0\n0.1 0 0 0.1 1 0 0 0\n";
    let obj = "# a triangle\nmtllib x.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    for (text, pack, format) in [
        (triangle, "cat", "gltf"),
        (poses, "cat", "poses"),
        (poses, "gzip -c", "poses"),
        (obj, "cat", "obj"),
        (obj, "gzip -c", "obj"),
    ] {
        fs::write(folder.path().join("text"), text).expect("written");
        for pipe in ["pipe", "-"] {
            let args = ["info", pipe, "--json"].map(str::to_owned);
            let info = osp_testkit::json(&of_pipe(folder.path(), &format!("{pack} text"), pipe, args));
            assert_eq!((&info["format"], &info["polygons"]), (&format.into(), &1.into()), "{pack} of {pipe}");
        }
    }
    for (name, text) in
        [("script", "#!/bin/sh\necho v\n"), ("list", "v\nno vertex\n"), ("text", "of 1 2 3\n")]
    {
        fs::write(folder.path().join(name), text).expect("written");
        let said = OSP.refused_in(folder.path(), ["info", name]);
        assert!(said.contains("one of the formats"), "{said}");
    }
    for device in ["/dev/null", "/dev/zero"] {
        let said = OSP.refused(["info", device]);
        assert!(said.contains("one of the formats"), "{said}");
    }
}

#[test]
fn a_build_that_lacks_something_names_it_and_the_command_that_builds_it() {
    let folder = temp();
    let session = small_session(folder.path());
    let session = session.to_str().expect("utf-8");
    let (bench, live) = (cfg!(feature = "bench"), cfg!(feature = "live"));
    let (render, window) = (cfg!(feature = "render"), cfg!(feature = "window"));
    for (args, what, feature, is_built) in [
        (&["replay", session, "--window"][..], "osp replay --window", "window", window),
        (&["replay", session, "--draw"], "osp replay --draw", "render", render),
        (&["replay", session, "--occlusion", "hzb"], "--occlusion hzb", "render", render),
        (&["verify", session, "--occlusion", "queries"], "--occlusion queries", "render", render),
        (&["bench", session, "--index", "obvhs"], "'obvhs'", "peers", cfg!(feature = "peers")),
        (&["bench", session], "osp bench", "bench", bench),
        (&["draw-index", session, "x.svg"], "osp draw-index", "bench", bench),
        (&["draw-insertion", session, "x.gif"], "osp draw-insertion", "bench", bench),
        (&["draw-occlusion", session, "x.svg"], "osp draw-occlusion", "bench", bench),
        (&["race", session], "osp race", "bench", bench),
        (&["replay", session, "--chart", "x.svg"], "osp replay --chart", "bench", bench),
        (&["rig", "monitors"], "osp rig monitors", "window", window),
        (&["sketch", "a.ron"], "osp sketch", "window", window),
        (&["send", session, "--to", "127.0.0.1:1"], "osp send", "window", window),
        (&["render", session, "a.png"], "osp render", "render", render),
        (&["film", session, "a.gif"], "osp film", "render", render),
        (&["thumbs", session], "osp thumbs", "render", render),
        (&["join", "nats://127.0.0.1/a"], "osp join", "live", live),
    ] {
        if is_built {
            eprintln!("not looked at here: what a build without `{feature}` says of {what}");
            continue;
        }
        let said = OSP.refused(args);
        for expected in [what, &format!("feature `{feature}`")] {
            assert!(said.contains(expected), "{args:?}: expected {expected} in {said}");
        }
        // The command also names the features of this build, so that none of them is lost.
        let command =
            said.split("cargo install --path crates/osp-cli --features ").nth(1).expect("a command");
        let named: Vec<&str> =
            command.split(['`', ' ', '\n']).next().unwrap_or_default().split(',').collect();
        let built = [("bench", bench), ("live", live), ("render", render), ("window", window)];
        for (expected, is_built) in built.into_iter().chain([(feature, true)]) {
            // The window brings the pictures.
            let is_part = expected == "render" && (window || feature == "window");
            let is_named = is_part || named.contains(&expected);
            assert!(is_named || !is_built, "{args:?}: expected {expected} in {said}");
        }
    }
    let said = OSP.refused(["sketch", "a.ron", "--unheard-of"]);
    assert!(said.contains("unexpected argument '--unheard-of'"), "{said}");
    assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 1, "nothing was made");
}
