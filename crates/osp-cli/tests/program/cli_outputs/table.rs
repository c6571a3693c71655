//! Every command and every output of it, against everything that may be in its place.

use std::{
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
    process::{Command, Stdio},
};

use super::{built::has, names, session_text, write_session};
use crate::OSP;
use osp_testkit::{make_pipe, stderr, temp};

/// A way to write a file.
struct Way {
    args: &'static [&'static str],
    /// How the file is called; `-` in `args` stands for it.
    file: &'static str,
    /// One of its kind is replaced without a question.
    replaces: bool,
    /// Pipes and devices can take it, too: its kind does not follow from the name.
    streams: bool,
}

const fn way(args: &'static [&'static str], file: &'static str, replaces: bool, streams: bool) -> Way {
    Way { args, file, replaces, streams }
}

const BENCH: [&str; 8] =
    ["bench", "in.ron", "--quick", "--no-growth", "--index", "osp", "--pace", "samples:16"];

fn ways() -> Vec<Way> {
    let ways = vec![
        way(&["replay", "in.ron", "--index", "osp", "--csv", "@"], "o.csv", true, true),
        way(&["replay", "in.ron", "--index", "osp", "--chart", "@"], "o.png", true, false),
        way(&["replay", "in.ron", "--index", "osp", "--chart", "@"], "o.svg", true, false),
        way(&["replay", "in.ron", "--index", "osp", "--pin", "@"], "o.pins", true, false),
        way(&["bench", "@", "--csv"], "o.csv", true, true),
        way(&["bench", "@", "--html"], "o.html", true, true),
        way(&["race", "in.ron", "--csv", "@"], "o.csv", true, true),
        way(&["race", "in.ron", "--film", "@"], "o.gif", true, true),
        way(&["draw-index", "in.ron", "@"], "o.svg", true, false),
        way(&["draw-index", "in.ron", "@"], "o.png", true, false),
        way(&["draw-index", "in.ron", "--as", "tree", "@"], "o.dot", true, false),
        way(&["draw-insertion", "in.ron", "@", "--polygons", "1", "--levels", "1"], "o.gif", true, true),
        way(&["draw-occlusion", "in.ron", "@"], "o.svg", true, false),
        way(&["draw-occlusion", "in.ron", "--occluders", "0", "@"], "o.gif", true, false),
        way(&["draw-occlusion", "in.ron", "@"], "o.dot", true, false),
        way(
            &["bake", "in.ron", "@", "--cells", "1", "--samples", "1", "--pixels", "16"],
            "o.pvs",
            true,
            true,
        ),
        way(&["export", "in.ron", "@"], "o.glb", true, true),
        way(&["import", "in.ron", "@"], "o.ron", false, true),
        way(&["import", "in.ron", "@"], "o.ron.zst", false, true),
        way(&["synth", "scribble", "--polygons", "50", "@"], "o.ron", false, true),
    ];
    ways.into_iter().chain(ways_of_render()).filter(|way| has(way.args)).collect()
}

#[cfg(not(feature = "render"))]
fn ways_of_render() -> Vec<Way> {
    Vec::new()
}

#[cfg(feature = "render")]
fn ways_of_render() -> Vec<Way> {
    if let Err(error) = osp_render::Gpu::headless() {
        eprintln!("skipped `osp render` and `osp film`: {error}");
        return Vec::new();
    }
    vec![
        way(&["render", "in.ron", "@", "--size", "32x32"], "o.png", true, true),
        way(&["film", "in.ron", "@", "--size", "32x32", "--seconds", "0.2"], "o.gif", true, true),
    ]
}

impl Way {
    fn args(&self, out: &str, force: bool) -> Vec<String> {
        let mut args: Vec<String> = match self.args {
            ["bench", "@", option] => {
                BENCH.iter().copied().chain([*option, out]).map(str::to_owned).collect()
            }
            args => args.iter().map(|arg| if *arg == "@" { out } else { arg }.to_owned()).collect(),
        };
        args.extend(force.then(|| "--force".to_owned()));
        args
    }

    /// Runs it in a folder with `in.ron`, and looks whether anything but the output has changed.
    fn run(&self, folder: &Path, out: &str, force: bool, case: &str) -> Option<i32> {
        let before = names(folder);
        let session = fs::read(folder.join("in.ron")).expect("the session");
        let output = OSP.run_in(folder, self.args(out, force));
        let said = stderr(&output);
        let about = format!("{:?}, {case}: {said}", self.args(out, force));
        assert!(!said.contains("panicked"), "{about}");
        assert_eq!(fs::read(folder.join("in.ron")).expect("the session"), session, "{about}");
        let mut after = names(folder);
        after.retain(|name| before.contains(name) || name != out);
        assert_eq!(after, before, "{about}");
        if output.status.code() == Some(2) {
            let said: Vec<_> = said.lines().filter(|line| !line.starts_with("drawn by ")).collect();
            assert!(said.len() == 1 && said[0].starts_with("error: "), "{about}");
            assert!(said[0].contains(out) || said[0].contains("folder"), "{about}");
            assert!(!said[0].contains("unfinished"), "{about}");
        }
        output.status.code()
    }
}

#[test]
fn every_output_against_everything_in_its_place() {
    for way in ways() {
        let folder = temp();
        let folder = folder.path();
        write_session(folder, "in.ron");
        let out = way.file;
        let path = folder.join(out);
        let of = |code: Option<i32>, expected: i32, case: &str| {
            assert_eq!(code, Some(expected), "{:?} to {out}: {case}", way.args);
        };
        // Nothing is there.
        of(way.run(folder, out, false, "new"), 0, "new");
        let made = fs::read(&path).expect("the output");
        assert!(!made.is_empty());
        // Its own kind.
        of(way.run(folder, out, false, "its kind"), if way.replaces { 0 } else { 2 }, "its kind");
        of(way.run(folder, out, true, "its kind, --force"), 0, "its kind, --force");
        // Something else: a session (by what is in it), a letter, a picture of another kind.
        let picture: &[u8] = if out.ends_with(".png") { b"<svg></svg>" } else { b"\x89PNG\r\n\x1a\n" };
        let other = session_text(77.0);
        for (content, case) in
            [(other.as_bytes(), "a session"), (b"Dear A,\n", "a letter"), (picture, "a picture")]
        {
            // A first line with a comma is what a table has.
            if case == "a letter" && out == "o.csv" {
                continue;
            }
            fs::write(&path, content).expect("written");
            of(way.run(folder, out, false, case), 2, case);
            assert_eq!(fs::read(&path).expect("there"), content, "{case}");
            of(way.run(folder, out, true, case), 0, case);
            assert_ne!(fs::read(&path).expect("there"), content, "{case}");
        }
        // The input, by links of both kinds.
        for is_hard in [false, true] {
            fs::remove_file(&path).expect("removed");
            match is_hard {
                true => fs::hard_link(folder.join("in.ron"), &path).expect("linked"),
                false => symlink("in.ron", &path).expect("linked"),
            }
            for force in [false, true] {
                if way.args[0] == "synth" {
                    // It reads nothing; a session is there.
                    if !force {
                        of(way.run(folder, out, force, "a link to a session"), 2, "a link to a session");
                    }
                    continue;
                }
                of(way.run(folder, out, force, "a link to the input"), 2, "a link to the input");
            }
        }
        // A link to its own kind: the link stays.
        fs::remove_file(&path).expect("removed");
        fs::write(folder.join("target"), &made).expect("written");
        symlink("target", &path).expect("linked");
        of(way.run(folder, out, true, "a link"), 0, "a link");
        assert!(fs::symlink_metadata(&path).expect("there").is_symlink());
        fs::remove_file(&path).expect("removed");
        // A folder.
        fs::create_dir(&path).expect("made");
        of(way.run(folder, out, true, "a folder"), 2, "a folder");
        fs::remove_dir(&path).expect("removed");
        // A folder that is not there, and one in which not even an administrator can make a file.
        of(way.run(folder, &format!("none/{out}"), true, "no folder"), 2, "no folder");
        if cfg!(target_os = "linux") {
            of(way.run(folder, &format!("/proc/{out}"), true, "no place"), 2, "no place");
        }
        // A name of another kind.
        of(way.run(folder, "o.tilt", false, "another name"), 2, "another name");
        // Names of folders, and none.
        for name in [format!("{out}/"), String::new()] {
            let output = OSP.run_in(folder, way.args(&name, true));
            of(output.status.code(), 2, "no name of a file");
            assert!(
                !names(folder).iter().any(|name| name == out || name.starts_with('.')),
                "{}",
                stderr(&output)
            );
        }
        // Write-protected.
        fs::write(&path, &made).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).expect("set");
        of(way.run(folder, out, true, "write-protected"), 2, "write-protected");
        assert_eq!(fs::read(&path).expect("there"), made);
        fs::remove_file(&path).expect("removed");
        // Devices.
        if Path::new("/dev/full").exists() {
            of(way.run(folder, "/dev/full", false, "full"), 2, "full");
            of(way.run(folder, "/dev/null", false, "null"), if way.streams { 0 } else { 2 }, "null");
        }
    }
}

#[test]
fn a_folder_that_cannot_be_written_to_is_told_of_before_the_work() {
    let folder = temp();
    write_session(folder.path(), "in.ron");
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).expect("made");
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o555)).expect("set");
    if fs::write(closed.join("probe"), "").is_ok() {
        eprintln!("skipped: whoever may do everything can write to a read-only folder");
        return;
    }
    for way in ways() {
        let out = format!("closed/{}", way.file);
        let code = way.run(folder.path(), &out, true, "a read-only folder");
        assert_eq!(code, Some(2), "{:?}", way.args);
        let said = stderr(&OSP.run_in(folder.path(), way.args(&out, true)));
        assert!(said.contains("ermission denied") && !said.contains(".unfinished"), "{said}");
    }
}

#[test]
fn a_pipe_is_written_to_directly() {
    let folder = temp();
    let folder = folder.path();
    write_session(folder, "in.ron");
    for way in ways() {
        let path = folder.join(way.file);
        let _ = fs::remove_file(&path);
        if !make_pipe(&path) {
            eprintln!("skipped: no mkfifo");
            return;
        }
        if way.file == "o.pins" {
            // Pins are read first.
            assert_eq!(way.run(folder, way.file, false, "a pipe"), Some(2));
            continue;
        }
        let reader = Command::new("cat").arg(&path).stdout(Stdio::piped()).spawn().expect("cat");
        let output = OSP.run_in(folder, way.args(way.file, false));
        assert!(output.status.success(), "{:?}: {}", way.args, stderr(&output));
        let read = reader.wait_with_output().expect("cat").stdout;
        assert!(!read.is_empty(), "{:?}", way.args);
        assert!(!fs::metadata(&path).expect("there").is_file());
    }
}

#[test]
fn a_file_on_standard_output_is_not_mixed_with_results() {
    let folder = temp();
    write_session(folder.path(), "in.ron");
    for out in ["-", "/dev/stdout"] {
        for way in ways().into_iter().filter(|way| way.streams && way.file != "o.ron.zst") {
            let output =
                OSP.command_in(folder.path(), way.args(out, false)).output().expect("the program starts");
            assert!(output.status.success(), "{:?} {out}: {}", way.args, stderr(&output));
            let (start, is_text): (&[u8], bool) = match way.file {
                "o.csv" if way.args[0] == "replay" => (b"recording,index,frame", true),
                "o.csv" => (b"part,recording,index", true),
                "o.html" => (b"<!doctype html>", true),
                "o.pvs" => (b"osp pvs ", false),
                "o.png" => (b"\x89PNG", false),
                "o.gif" => (b"GIF89a", false),
                "o.glb" => (b"glTF", false),
                _ => (b"Header(", true),
            };
            assert!(output.stdout.starts_with(start), "{:?} {out}: {output:?}", way.args);
            assert!(!is_text || std::str::from_utf8(&output.stdout).is_ok());
            assert!(!stderr(&output).is_empty(), "the results are there: {:?}", way.args);
        }
    }
    assert_eq!(names(folder.path()), ["in.ron"]);
}
