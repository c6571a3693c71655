//! The shipped recordings and the README: fingerprints stay pinned, commands work.

use std::{ffi::OsStr, fs, path::Path};

use crate::OSP;
use osp_testkit::at;

fn shipped() -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(at("recordings"))
        .expect("recordings/")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| [".ron", ".ron.zst", ".apa", ".tilt"].iter().any(|ending| name.ends_with(ending)))
        .collect();
    names.sort();
    names
}

#[test]
fn every_shipped_recording_replays_with_its_pinned_fingerprint_in_every_index() {
    let names = shipped();
    assert_eq!(names.len(), 9, "{names:?}");
    for name in names {
        let path = format!("recordings/{name}");
        assert!(fs::metadata(at(&path)).expect("there").len() < 3 << 20, "{name} is over 3 MB");
        OSP.done(["replay", &path, "--check", "recordings/fingerprints.pins"]);
    }
}

#[test]
fn indexes_that_grow_in_place_allocate_nothing_once_a_session_runs() {
    let in_place = "brute-force,brute-simd,time-order,osp,dynamic-bvh,loose-octree";
    for name in shipped() {
        let path = format!("recordings/{name}");
        // A rebuilt index shows that somebody counts.
        let kinds = format!("{in_place},octree-rebuild");
        let report = OSP.json(["replay", &path, "--json", "--index", &kinds]);
        for run in report["runs"].as_array().expect("runs") {
            let allocations = run["allocations_steady"].as_u64().expect("a number");
            let rebuilds = run["index"] == "octree-rebuild";
            assert_eq!(allocations > 0, rebuilds, "{name}, {}: {allocations} allocations", run["index"]);
        }
    }
}

#[test]
fn recordings_are_what_their_commands_make() {
    let readme = fs::read_to_string(at("recordings/README.md")).expect("recordings/README.md");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut made = 0;
    for line in readme.lines() {
        let Some(command) = line.split('`').find(|part| part.starts_with("osp synth ")) else { continue };
        let words: Vec<&str> = command.split_whitespace().skip(1).collect();
        let (name, words) = words.split_last().expect("a file name");
        let name = Path::new(name).file_name().expect("a file name");
        let out = folder.path().join(name);
        OSP.done(words.iter().map(OsStr::new).chain([out.as_os_str()]));
        let (made_bytes, shipped_bytes) =
            (fs::read(&out).expect("made"), fs::read(at("recordings").join(name)));
        assert!(made_bytes == shipped_bytes.expect("shipped"), "{command} makes other bytes");
        made += 1;
    }
    assert_eq!(made, 3, "recordings/README.md names the commands of portrait, room and scribble");
}

#[test]
fn the_commands_of_the_readme_work() {
    let readme = fs::read_to_string(at("README.md")).expect("README.md");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let starts = ["cargo run --release -- ", "cargo run --release --features bench -- "];
    let starts = if cfg!(feature = "bench") { &starts[..] } else { &starts[..1] };
    let commands: Vec<&str> =
        readme.lines().filter_map(|line| starts.iter().find_map(|start| line.strip_prefix(start))).collect();
    assert!(commands.len() >= 2, "{commands:?}");
    for command in commands {
        let mut args = Vec::new();
        for word in command.split_whitespace() {
            match word {
                // As a shell does it, but only the first two: all take minutes in a test's build.
                "recordings/*.ron" => {
                    args.extend(["class", "grow"].map(|name| format!("recordings/{name}.ron")));
                }
                // What is written goes into the temporary folder.
                _ if [".png", ".svg", ".html", ".ndjson"].iter().any(|ending| word.ends_with(ending)) => {
                    args.push(folder.path().join(word).to_string_lossy().into_owned());
                }
                _ => args.push(word.to_owned()),
            }
        }
        // Its growing model alone takes minutes in a test's build.
        args.extend((args[0] == "bench").then(|| "--no-growth".to_owned()));
        OSP.done(&args);
    }
}
