//! Numbers without sense, files without end, names that are no text.

use std::fs;

use super::{assert_refused, built::has, write_session};
use crate::OSP;
use osp_testkit::{make_pipe, stderr, stdout, temp};

#[test]
fn numbers_out_of_range_are_refused_by_every_command() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    // A command, an option, and values with a space between them.
    let mut cases = vec![
        ("replay a.ron", "--pace", "samples:0 samples:-1 samples:4294967296 samples:NaN samples: x"),
        ("replay a.ron", "--budget", "0 -1 NaN inf 1e300 x"),
        ("replay a.ron --occlusion msvbsp", "--occluders", "-1 65537 18446744073709551615 NaN 1.5"),
        ("replay a.ron", "--polygon-ns", "0 -1 NaN inf 1e10"),
        ("replay a.ron --occlusion none", "--verify-frames", "-1 1000001 18446744073709551615 NaN"),
        ("replay a.ron", "--depth", "22"),
        ("replay a.ron", "--cube", "0 NaN"),
        ("replay a.ron", "--cut-nodes", "kept"),
        ("replay a.ron", "--buckets", "1 33"),
        ("replay a.ron", "--leaf", "0 4097"),
        ("replay a.ron", "--morton-bits", "22"),
        ("bench a.ron", "--sizes", "0 -1 50000001 NaN 1,,2"),
        ("bench a.ron", "--pace", "samples:0"),
        ("bench --paper", "--depth", "22"),
        ("bench --paper", "--cube", "0 NaN"),
        ("bench --paper", "--draw", "0x5"),
        ("race a.ron", "--runs", "0 101 -1 NaN"),
        ("race", "--synth", "0 -1 10000001 NaN"),
        ("bake a.ron o.pvs", "--cells", "0 257 -1 NaN"),
        ("bake a.ron o.pvs", "--samples", "0 4097 NaN"),
        ("bake a.ron o.pvs", "--pixels", "0 15 8193 NaN"),
        ("synth scribble o.ron", "--polygons", "-1 4294967296 NaN 1.5"),
        ("synth scribble o.ron", "--seed", "-1 18446744073709551616 NaN"),
        ("verify a.ron", "--views", "0 10001 -1 NaN"),
        ("verify a.ron", "--occluders", "65537 18446744073709551615 -1 4,,4 4,99999 some"),
        ("verify a.ron", "--repeats", "0 1001 NaN"),
        ("verify a.ron", "--pixels", "0x0 15x100 16385x100 NaNxNaN 100 18446744073709551616x100"),
        ("query a.ron", "--at", "NaN,0 0,inf -0.1,0 1.1,1 0.5 0.5,0.5,0.5"),
        ("query a.ron --at 0,0", "--frame", "-1 NaN 18446744073709551616 18446744073709551615"),
        ("draw-index a.ron o.svg", "--frame", "-1 NaN 18446744073709551615"),
        ("draw-insertion a.ron o.gif", "--polygons", "0 65 -1 NaN"),
        ("draw-insertion a.ron o.gif", "--levels", "0 8 NaN"),
        ("draw-occlusion a.ron o.svg", "--frame", "-1 NaN 18446744073709551615"),
        ("draw-occlusion a.ron o.gif", "--every", "0 -1 NaN 4294967296"),
        ("draw-occlusion a.ron o.svg", "--occluders", "-1 NaN 18446744073709551616"),
    ];
    if cfg!(feature = "render") {
        cases.extend([
            ("render a.ron o.png", "--size", "0x1 1x0 16385x1 4294967295x4294967295 NaNxNaN 5"),
            ("render a.ron o.png", "--view", " whole (p:(0,0,0),q:(0,0,0,1),fov_degrees:180)"),
            ("render a.ron o.png", "--view", "(p:(0,NaN,0),q:(0,0,0,1),fov_degrees:60)"),
            ("film a.ron o.gif", "--seconds", "0 -1 601 NaN"),
            ("film a.ron o.gif", "--fps", "0 51 -1 NaN"),
            ("film a.ron o.mp4", "--fps", "0 61 -1 NaN"),
            ("film a.ron o.mp4", "--size", "0x1 14x100 3841x100 2161x2161 x"),
            ("render a.ron --to d", "--every", "0 -1 NaN 18446744073709551616"),
            ("replay a.ron", "--draw", "0x1 99999x99999 x"),
            ("verify a.ron", "--size", "0x1 99999x99999 x"),
            ("verify a.ron", "--frames", "0 10001 NaN"),
            ("verify a.ron", "--settle", "0 10001 NaN"),
        ]);
    }
    if cfg!(feature = "window") {
        cases.push(("send a.ron --to 127.0.0.1:9", "--speed", "0 -1 NaN inf 1001"));
        cases.push(("sketch", "--window", "0x1 16385x1 NaNxNaN 5"));
    }
    for (command, option, values) in cases {
        for value in values.split(' ') {
            let value = format!("{option}={value}");
            let said = OSP.refused_in(folder.path(), command.split(' ').chain([&*value]));
            assert!(said.starts_with("error: ") && !said.contains("panicked"), "{command} {value}: {said}");
        }
    }
    assert_eq!(super::names(folder.path()), ["a.ron"]);
}

/// The program prints one error and writes nothing. `old.ron` and `old` are no sessions: the program names a wrong argument
/// before it reads them.
#[test]
fn what_cannot_be_meant_is_one_clear_error() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    for name in ["old.ron", "old"] {
        fs::write(at(name), "no session").expect("written");
    }
    ["in", "none"].iter().for_each(|name| fs::create_dir(at(name)).expect("made"));
    write_session(folder.path(), "a.ron");
    write_session(&at("in"), "b.ron");
    let mut cases = vec![
        ("frobnicate", "frobnicate"),
        ("replay", "required"),
        ("replay no-such-file.ron", "no-such-file.ron"),
        ("replay a.ron --index no-such", "invalid value 'no-such'"),
        ("replay a.ron --camera upside-down", "invalid value 'upside-down'"),
        ("replay a.ron --occlusion guess", "invalid value 'guess'"),
        ("replay a.ron --polygon-ns 0", "expected nanoseconds"),
        ("replay a.ron --verify-frames 3", "--occlusion"),
        ("replay a.ron --node-test sphere", "--node-test is about occlusion culling"),
        ("replay a.ron --occlusion msvbsp --node-test corners-apart", "corners"),
        ("replay old.ron --chart c.pdf", ".svg or .png"),
        ("replay old.ron --chart c", ".svg or .png"),
        ("verify scene:cellar", "no scene is called cellar: expected rooms, panels"),
        ("verify no-such-file.ron", "no-such-file.ron"),
        ("verify a.ron --occlusion guess", "invalid value 'guess'"),
        ("verify a.ron --pixels big", "expected WIDTHxHEIGHT"),
        ("verify --all none", "expected sessions; found none in none"),
        ("verify --all in nowhere", "error: nowhere: "),
        ("verify --all in --part 3/2", "expected K/N"),
        ("verify --part 1/2 in", "--all"),
        ("verify in", "a folder that is no unpacked sketch (open one of its files)"),
        ("study --out r.ndjson", "<FILES_OR_FOLDERS>"),
        ("study none --out r.ndjson", "expected sessions; found none in none"),
        ("study gone --out r.ndjson", "gone: "),
        ("study in --out r.csv", "expected a name that ends in .ndjson"),
        ("study in --out no/r.ndjson", "there is no such folder"),
        ("study in --out r.ndjson --occlusion hzb", "expected methods that run on the CPU"),
        ("bench --no-growth", ""),
        ("bench --sizes 5 --html no-such-folder/bench.html", "no-such-folder"),
        ("bench --sizes 5 --index no-such", "invalid value 'no-such'"),
        ("bench no-such-file.ron", "no-such-file.ron"),
        ("bench --draw", "--draw"),
        ("bench --depth 3", "--depth"),
        ("bench --cube 1", "--cube"),
        ("bench --occluders 3", "--occluders"),
        ("bench --paper=never", "--paper"),
        ("bench --paper --node-test corners-apart", "corners"),
        ("race", "required"),
        ("race no-such-file.ron", "no-such-file.ron"),
        ("race a.ron --index osp", "--index: expected two to four structures; found 1"),
        ("race a.ron --index osp,bsp,lbvh,hlbvh,kd-tree", "expected two to four structures; found 5"),
        ("race a.ron --index osp,lbvh,osp", "--index: expected each structure once; found osp twice"),
        ("race a.ron --index osp,oktree", "invalid value 'oktree'"),
        ("race a.ron --synth 9", "cannot be used with"),
        ("race old.ron --film c.mp4", ".gif"),
        ("draw-index old.ron c.jpg", ".svg or .png or .dot"),
        ("draw-insertion old.ron c.png", ".gif"),
        ("draw-occlusion old.ron c.jpg", ".svg or .png or .gif or .dot"),
        ("draw-occlusion a.ron c.dot --form both", "one tree"),
        ("draw-occlusion a.ron c.png --every 2", ".gif"),
        ("bake old.ron c.ron", ".pvs"),
        ("import old.ron c.obj", ".ron or .ron.zst"),
        ("synth scribble c.json", ".ron or .ron.zst"),
        ("synth vase c.ron", "portrait"),
    ];
    if cfg!(feature = "render") {
        cases.extend([("render old.ron x.jpg", ".png"), ("render old.ron x", ".png")]);
        cases.extend([("film old.ron x.avi", ".mp4 or .gif"), ("film old.ron x", ".mp4 or .gif")]);
    }
    if cfg!(feature = "window") {
        cases.push(("replay old.ron --window --trace old.ron", "an input"));
        cases.push(("sketch old.ron --trace old", "old: exists already"));
        cases.push(("sketch new.ron --trace new.ron", "an input"));
    }
    for (command, words) in cases {
        let args: Vec<&str> = command.split(' ').collect();
        if !has(&args) {
            continue;
        }
        let output = OSP.run_in(folder.path(), args);
        let said = stderr(&output);
        assert_eq!((output.status.code(), stdout(&output).as_str()), (Some(2), ""), "{command}: {said}");
        assert!(said.matches("error: ").count() == 1 && said.contains(words), "{command}: {said}");
    }
    assert!(!OSP.refused::<&str>([]).is_empty());
    assert_eq!(super::names(folder.path()), ["a.ron", "in", "none", "old", "old.ron"]);
}

#[test]
fn the_ends_of_the_ranges_work() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    for args in [
        &["replay", "a.ron", "--occlusion", "msvbsp", "--occluders", "65536"][..],
        &["replay", "a.ron", "--occlusion", "msvbsp", "--occluders", "0"],
        &["replay", "a.ron", "--occlusion", "none", "--verify-frames", "1000000", "--pace", "samples:30"],
        &["replay", "a.ron", "--budget", "1e9", "--polygon-ns", "1e9"],
        &["verify", "a.ron", "--views", "1", "--pixels", "16x16", "--repeats", "1", "--occluders", "0,65536"],
        &["synth", "scribble", "o.ron", "--polygons", "0", "--seed", "18446744073709551615"],
        &["bake", "a.ron", "o.pvs", "--cells", "1", "--samples", "1", "--pixels", "16"],
    ] {
        OSP.done_in(folder.path(), args);
    }
}

#[cfg(unix)]
#[test]
fn what_has_no_end_is_refused_wherever_a_file_is_read() {
    let folder = temp();
    let folder = folder.path();
    write_session(folder, "a.ron");
    if !make_pipe(&folder.join("pipe")) {
        eprintln!("skipped: no mkfifo");
        return;
    }
    fs::create_dir(folder.join("sub")).expect("made");
    for file in ["pipe", "/dev/zero", "sub"] {
        let mut cases = vec![
            vec!["replay", "a.ron", "--check", file],
            vec!["replay", "a.ron", "--pin", file],
            vec!["verify", "a.ron", "--whole", "--views", "1", "--pixels", "16x16", "--pvs", file],
        ];
        if file != "pipe" {
            cases.extend([vec!["info", file], vec!["replay", file]]);
        }
        if cfg!(feature = "window") {
            cases.push(vec!["sketch", "--autosave", "autosaves", "--rig", file]);
            cases.push(vec!["sketch", "--autosave", "autosaves", "--tracker", file]);
        }
        for args in cases {
            assert_refused(&OSP.run_in(folder, &args), &[file]);
        }
    }
    let _ = fs::remove_dir_all(folder.join("autosaves"));
}

#[test]
fn files_larger_than_they_can_be_are_not_read_to_their_end() {
    let folder = temp();
    write_session(folder.path(), "a.ron");
    let large = fs::File::create(folder.path().join("large")).expect("made");
    // It takes no room on the disk.
    large.set_len(1 << 36).expect("grown");
    let mut cases = vec![
        vec!["replay", "a.ron", "--check", "large"],
        vec!["verify", "a.ron", "--whole", "--views", "1", "--pixels", "16x16", "--pvs", "large"],
    ];
    if cfg!(feature = "window") {
        cases.push(vec!["sketch", "--autosave", "autosaves", "--rig", "large"]);
    }
    for args in cases {
        assert_refused(&OSP.run_in(folder.path(), &args), &["large"]);
    }
}

#[cfg(all(target_os = "linux", feature = "bench"))]
#[test]
fn a_name_that_is_no_text_is_measured_all_the_same() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
    let folder = temp();
    let name = OsStr::from_bytes(b"a\xff.ron");
    write_session(folder.path(), "a.ron");
    fs::rename(folder.path().join("a.ron"), folder.path().join(name)).expect("renamed");
    let args =
        "--quick --no-growth --index osp --pace samples:16 --html b.html --csv b.csv --json".split(' ');
    let args = [OsStr::new("bench"), name].into_iter().chain(args.map(OsStr::new));
    let report = OSP.json_in(folder.path(), args);
    assert_eq!(report["rows"][0]["recording"], "a\u{fffd}.ron");
    for file in ["b.html", "b.csv"] {
        let text = fs::read_to_string(folder.path().join(file)).expect("text");
        assert!(text.contains("a\u{fffd}.ron"), "{file}");
    }
    for command in ["replay", "info"] {
        OSP.done_in(folder.path(), [OsStr::new(command), name]);
    }
}
