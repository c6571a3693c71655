//! Every command that writes a file: a file that exists needs `--force`, and an input is never an output.

use std::{
    fs, io,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
    process::{Command, Stdio},
};

use super::{built::has, names, session_text, write_session};
use crate::OSP;
use osp_testkit::{make_pipe, stderr, temp};

/// The commands, each with the name of the file that takes the place of `@`. All but the last read `in.ron`.
fn ways() -> Vec<(&'static str, &'static str)> {
    let ways = [
        ("replay in.ron --index osp --csv @", "o.csv"),
        ("replay in.ron --index osp --chart @", "o.png"),
        ("replay in.ron --index osp --chart @", "o.svg"),
        ("bench in.ron --quick --no-growth --no-rays --index osp --pace samples:99 --csv @", "o.csv"),
        ("bench in.ron --quick --no-growth --no-rays --index osp --pace samples:99 --html @", "o.html"),
        ("race in.ron --csv @", "o.csv"),
        ("race in.ron --film @", "o.gif"),
        ("draw-index in.ron @", "o.svg"),
        ("draw-index in.ron @", "o.png"),
        ("draw-index in.ron --as tree @", "o.dot"),
        ("draw-insertion in.ron @ --polygons 1 --levels 1", "o.gif"),
        ("draw-occlusion in.ron @", "o.svg"),
        ("draw-occlusion in.ron --occluders 0 @", "o.gif"),
        ("draw-occlusion in.ron @", "o.dot"),
        ("bake in.ron @ --cells 1 --samples 1 --pixels 16", "o.pvs"),
        ("export in.ron @", "o.glb"),
        ("convert in.ron @", "o.glb"),
        ("convert in.ron @", "o.tilt"),
        ("import in.ron @", "o.ron"),
        ("import in.ron @", "o.ron.zst"),
        ("render in.ron @ --size 32x32", "o.png"),
        ("film in.ron @ --size 32x32 --seconds 0.2", "o.gif"),
        ("film in.ron @ --size 32x32 --seconds 0.2", "o.mp4"),
        ("synth scribble --polygons 50 @", "o.ron"),
    ];
    let draws = |command: &str| command.starts_with("render") || command.starts_with("film");
    let can_draw = can_draw();
    ways.into_iter()
        .filter(|(command, _)| has(&command.split(' ').collect::<Vec<_>>()) && (can_draw || !draws(command)))
        .collect()
}

fn can_draw() -> bool {
    #[cfg(feature = "render")]
    if let Err(error) = osp_render::Gpu::headless() {
        eprintln!("skipped `osp render` and `osp film`: {error}");
        return false;
    }
    cfg!(feature = "render")
}

fn args(command: &str, out: &str, force: bool) -> Vec<String> {
    let words = command.split(' ').map(|word| if word == "@" { out } else { word }.to_owned());
    words.chain(force.then(|| "--force".to_owned())).collect()
}

/// Runs a command in a folder with `in.ron`. An error is one line that names the output, and changes no file.
fn run(folder: &Path, command: &str, out: &str, force: bool, case: &str) -> bool {
    let contents = || -> Vec<_> {
        let files = names(folder).into_iter().filter(|name| folder.join(name).is_file());
        files.map(|name| (name.clone(), fs::read(folder.join(name)).expect("a file"))).collect()
    };
    let before = contents();
    let output = OSP.run_in(folder, args(command, out, force));
    let said = stderr(&output);
    let is_done = output.status.success();
    if !is_done {
        let lines: Vec<_> = said.lines().filter(|line| !line.starts_with("drawn by ")).collect();
        let is_clear = lines.len() == 1 && lines[0].starts_with("error: ");
        assert!(is_clear && !said.contains("unfinished"), "{command} to {out}, {case}: {said}");
        assert!(said.contains(out) || said.contains("folder"), "{command} to {out}, {case}: {said}");
        assert_eq!(output.status.code(), Some(2), "{command} to {out}, {case}");
        assert!(contents() == before, "{command} to {out}, {case}: a file has changed");
    }
    is_done
}

#[test]
fn a_file_that_exists_needs_force_and_an_input_is_never_an_output() {
    for (command, out) in ways() {
        let folder = temp();
        let folder = folder.path();
        write_session(folder, "in.ron");
        let path = folder.join(out);
        let expect = |name: &str, force: bool, is_done: bool, case: &str| {
            assert_eq!(run(folder, command, name, force, case), is_done, "{command} to {out}: {case}");
        };
        expect(out, false, true, "new");
        expect(out, false, false, "its own");
        for content in [session_text(77.0).as_bytes(), b"Dear A,\n", b"\x89PNG\r\n\x1a\n", b""] {
            fs::write(&path, content).expect("written");
            expect(out, false, false, "another file");
            expect(out, true, true, "another file, --force");
            assert_ne!(fs::read(&path).expect("the output"), content);
        }
        // Links of both kinds. `synth` reads nothing.
        for link in [
            |path: &Path| fs::hard_link(path.with_file_name("in.ron"), path),
            |path: &Path| symlink("in.ron", path),
        ] {
            fs::remove_file(&path).expect("removed");
            link(&path).expect("linked");
            for force in [false, true].into_iter().filter(|force| !force || !command.starts_with("synth")) {
                expect(out, force, false, "a link to the input");
            }
        }
        // The target of a link is replaced, and not the link.
        fs::remove_file(&path).expect("removed");
        fs::write(folder.join("target"), "old").expect("written");
        symlink("target", &path).expect("linked");
        expect(out, true, true, "a link");
        assert!(fs::symlink_metadata(&path).expect("there").is_symlink());
        fs::remove_file(&path).expect("removed");
        fs::create_dir(&path).expect("made");
        expect(out, true, false, "a folder");
        fs::remove_dir(&path).expect("removed");
        fs::write(&path, "old").expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o444)).expect("set");
        expect(out, true, false, "write-protected");
        for name in [format!("none/{out}"), format!("/proc/{out}"), format!("{out}/")] {
            expect(&name, true, false, "no place for a file");
        }
        if Path::new("/dev/full").exists() {
            expect("/dev/full", false, false, "a full device");
        }
    }
}

#[test]
fn the_file_behind_standard_input_is_an_input_too() {
    for (command, out) in ways().into_iter().filter(|(command, _)| command.contains("in.ron")) {
        let folder = temp();
        write_session(folder.path(), out);
        let file = || fs::File::open(folder.path().join(out)).expect("a file");
        let before = io::read_to_string(file()).expect("text");
        let words = args(command, out, true).into_iter();
        let words = words.map(|word| if word == "in.ron" { "-".to_owned() } else { word });
        let output = OSP.command_in(folder.path(), words).stdin(file()).output().expect("the program starts");
        assert_eq!(output.status.code(), Some(2), "{command} to {out}");
        let after = io::read_to_string(file()).expect("text");
        assert_eq!(after, before, "{command} to {out}: {}", stderr(&output));
    }
}

#[test]
fn other_files_of_a_session_are_inputs_too() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("a.tilt")).expect("made");
    fs::write(at("a.tilt/data.sketch"), "").expect("written");
    let corners: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    for name in ["b.ndjson", "b.png"] {
        fs::write(at(name), corners.map(f32::to_le_bytes).concat()).expect("written");
    }
    let triangle = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"bufferViews":[{"buffer":0,"byteLength":36}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "buffers":[{"uri":"b.ndjson","byteLength":36}]}"#;
    fs::write(at("m.gltf"), triangle).expect("written");
    fs::write(at("n.gltf"), triangle.replace("b.ndjson", "b.png")).expect("written");
    write_session(folder.path(), "in.ron");
    OSP.done_in(folder.path(), ["replay", "in.ron", "--pin", "p.pins"]);
    for (command, out) in [
        ("replay a.tilt --csv @", "a.tilt/data.sketch"),
        ("replay m.gltf --csv @", "b.ndjson"),
        ("study m.gltf --out @", "b.ndjson"),
        ("render n.gltf @", "b.png"),
        ("replay in.ron --check p.pins --csv @", "p.pins"),
    ] {
        if has(&command.split(' ').collect::<Vec<_>>()) && (!command.starts_with("render") || can_draw()) {
            for force in [false, true] {
                assert!(!run(folder.path(), command, out, force, "a part of the input"));
            }
        }
    }
    // As a shell does it with `>>`.
    for command in ["import in.ron -", "replay in.ron --csv -"] {
        let onto = fs::File::options().append(true).open(at("in.ron")).expect("the session");
        let output = OSP.command_in(folder.path(), command.split(' ')).stdout(onto).output().expect("osp");
        assert!(stderr(&output).contains("an input, too"), "{command}: {}", stderr(&output));
        assert_eq!(fs::read_to_string(at("in.ron")).expect("there"), session_text(6.0), "{command}");
    }
}

#[test]
fn two_outputs_of_one_command_need_two_files() {
    let folder = temp();
    write_session(folder.path(), "in.ron");
    symlink("there", folder.path().join("link")).expect("linked");
    for (csv, pin) in [("x", "x"), ("x", "./x"), ("there", "link")] {
        let said = OSP.refused_in(folder.path(), ["replay", "in.ron", "--csv", csv, "--pin", pin]);
        assert!(said.contains("cannot both"), "{said}");
    }
}

/// Pins and lines of a study are added to a file of their own; another file stays.
#[test]
fn what_adds_to_a_file_knows_it_by_its_content() {
    let folder = temp();
    let at = |name: &str| folder.path().join(name);
    for name in ["in.ron", "bbb.ron"] {
        write_session(folder.path(), name);
        OSP.done_in(folder.path(), ["replay", name, "--pin", "all.pins"]);
        OSP.done_in(folder.path(), ["study", name, "--out", "all.ndjson"]);
    }
    let pins = fs::read_to_string(at("all.pins")).expect("pins");
    assert!(pins.contains("\"in.ron\"") && pins.contains("\"bbb.ron\""), "{pins}");
    assert_eq!(fs::read_to_string(at("all.ndjson")).expect("lines").lines().count(), 2);
    fs::write(at("letter.ndjson"), "Dear A,\n").expect("written");
    for (command, out) in [
        ("replay in.ron --pin @", "bbb.ron"),
        ("study in.ron --out @", "letter.ndjson"),
        ("study in.ron --out @", "bbb.ron"),
    ] {
        assert!(!run(folder.path(), command, out, false, "another file"));
    }
    // Pins are read before the work, so a pipe or a device cannot hold them.
    assert!(!run(folder.path(), "replay in.ron --pin @", "/dev/null", false, "a device"));
}

#[test]
fn a_pipe_and_standard_output_are_written_to_directly() {
    for (command, out) in ways() {
        let folder = temp();
        let folder = folder.path();
        write_session(folder, "in.ron");
        if !make_pipe(&folder.join(out)) {
            eprintln!("skipped: no mkfifo");
            return;
        }
        if !out.ends_with(".mp4") {
            let reader =
                Command::new("cat").arg(folder.join(out)).stdout(Stdio::piped()).spawn().expect("cat");
            assert!(run(folder, command, out, false, "a pipe"), "{command} to {out}");
            assert!(!reader.wait_with_output().expect("cat").stdout.is_empty(), "{command} to {out}");
        }
        // The name of these outputs tells their format.
        if command.contains("convert") || [".mp4", ".zst"].iter().any(|end| out.ends_with(end)) {
            continue;
        }
        let output = OSP.run_in(folder, args(command, "-", false));
        assert!(output.status.success(), "{command}: {}", stderr(&output));
        let is_drawing =
            ["--chart", "draw-index", "draw-occlusion"].iter().any(|word| command.contains(word));
        let start: &[u8] = match out {
            _ if is_drawing => b"<svg",
            "o.csv" if command.starts_with("replay") => b"recording,index,frame",
            "o.csv" => b"part,recording,index",
            "o.html" => b"<!doctype html>",
            "o.pvs" => b"osp pvs ",
            "o.png" => b"\x89PNG",
            "o.gif" => b"GIF89a",
            "o.glb" => b"glTF",
            _ => b"Header(",
        };
        assert!(output.stdout.starts_with(start), "{command}: {output:?}");
        assert!(!stderr(&output).is_empty(), "the results are there: {command}");
    }
}

/// A file that another program has open to be read is not written through that.
#[cfg(target_os = "linux")]
#[test]
fn a_session_that_somebody_has_open_is_not_written_into() {
    let folder = temp();
    write_session(folder.path(), "in.ron");
    let other = write_session(folder.path(), "b.ron");
    for command in ["replay in.ron --csv @", "import in.ron @", "synth scribble @"] {
        let mut osp = OSP.command_in(folder.path(), args(command, "/dev/fd/0", false));
        let output = osp.stdin(fs::File::open(&other).expect("opened to be read")).output().expect("osp");
        assert_eq!(output.status.code(), Some(2), "{command}");
        assert_eq!(fs::read_to_string(&other).expect("there"), session_text(5.0), "{command}");
    }
}
