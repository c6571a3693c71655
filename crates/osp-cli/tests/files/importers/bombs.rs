//! Small files that become more than memory holds, as a user meets them: each command says which limit is reached and
//! which option raises it, and takes little memory. That is forced by a cap on the program's address space.
#![cfg(target_os = "linux")]

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use super::files::{sketch, sketch_stroke, tilt, write};
use crate::OSP;
use osp_testkit::{stderr, stdout};

/// Address space of the program, KiB. It needs some for itself, four indexes, and a thread. An index reserves room for up to a
/// million scattered polygons, and does not write to it before they come.
const CAP_KIB: u32 = 832 << 10;

/// Runs the program with an address space of [`CAP_KIB`].
fn osp(args: &[&str]) -> Output {
    let script = format!("ulimit -v {CAP_KIB} && exec \"$0\" \"$@\"");
    let output =
        Command::new("sh").args(["-c", &script, OSP.0]).args(args).env("RUST_BACKTRACE", "0").output();
    output.expect("the program starts")
}

/// A file of a head and so many megabytes of copies of `line`, in packed pieces of their own.
fn packed(
    folder: &Path,
    name: &str,
    head: &str,
    line: &str,
    megabytes: usize,
    pack: fn(&[u8]) -> Vec<u8>,
) -> PathBuf {
    let chunk = pack(line.repeat((1 << 17) / line.len()).as_bytes());
    write(folder, name, &[pack(head.as_bytes()), chunk.repeat(8 * megabytes)].concat())
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(bytes).expect("memory");
    encoder.finish().expect("memory")
}

fn zstd(bytes: &[u8]) -> Vec<u8> {
    zstd::encode_all(bytes, 19).expect("memory")
}

const HEADER: &str = "Header(format:1,name:\"x\",source:\"y\")\n";
const TWO_POINTS: &str = "Point(t:0,stroke:0,p:(0,0,0))\nPoint(t:0,stroke:0,p:(1,0,0))\n";
const FACE: &str = "Polygon(vertices:[(0,0,0),(1,0,0),(0,1,0)],color:(1,1,1,1))\n";
const RAISED: [&str; 2] = ["--max-polygons", "4294967295"];

fn begin(tool: &str) -> String {
    format!("{HEADER}Begin(t:0,stroke:0,tool:{tool},width:0.1,color:(1,1,1,1))\n")
}

/// Files that would take hundreds of megabytes or gigabytes, and what their own bytes are at most.
fn bombs(folder: &Path) -> Vec<(PathBuf, u64)> {
    let points = [([0.0; 3], [0.0, 0.0, 0.0, 1.0], 1.0, 0), ([1.0; 3], [0.0, 0.0, 0.0, 1.0], 1.0, 0)];
    let sketch = sketch(5, &[sketch_stroke([1.0; 4], 0.5, 2.0, &points.repeat(250_000))]).0;
    let sketch = tilt(&[("data.sketch", &sketch)], zip::CompressionMethod::Deflated);
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    vec![
        (packed(folder, "ribbon.ron.zst", &begin("Ribbon"), TWO_POINTS, 100, zstd), 60_000),
        (packed(folder, "tube.ron.zst", &begin("Tube"), TWO_POINTS, 60, zstd), 40_000),
        (packed(folder, "faces.ron.zst", HEADER, FACE, 100, zstd), 60_000),
        (packed(folder, "vertices.obj.gz", obj, "v 0 0 0\n", 130, gzip), 300_000),
        (packed(folder, "faces.obj.gz", obj, "f 1 2 3\n", 60, gzip), 300_000),
        (write(folder, "points.tilt", &sketch), 300_000),
    ]
}

#[test]
fn bombs_are_refused_in_little_memory() {
    let temp = tempfile::tempdir().expect("a folder");
    for (path, most_bytes) in bombs(temp.path()) {
        let bytes = std::fs::metadata(&path).expect("written").len();
        assert!(bytes <= most_bytes, "{}: {bytes} bytes", path.display());
        let file = path.to_str().expect("utf-8");
        // What was read is told of all the same.
        let info = osp(&["info", file]);
        let said = stderr(&info);
        assert_eq!(info.status.code(), Some(2), "{said}");
        assert!(said.contains("expected at most") && said.contains("--max-"), "{said}");
        assert!(stdout(&info).contains("polygons"), "{info:?}");
    }
}

#[test]
fn what_was_read_of_a_bomb_is_used_where_damage_is_passed_over() {
    let temp = tempfile::tempdir().expect("a folder");
    let path = packed(temp.path(), "tube.ron.zst", &begin("Tube"), TWO_POINTS, 60, zstd);
    let file = path.to_str().expect("utf-8");
    let lenient = osp(&["replay", file, "--budget", "0.1", "--lenient"]);
    let said = stderr(&lenient);
    assert!(lenient.status.success() && said.contains("reading ended there"), "{said}");
    // It is what it seems: without the limits the same memory does not hold it.
    let burst = osp(&[&["info", file], &RAISED[..]].concat());
    assert!(!burst.status.success(), "{burst:?}");
    assert!(stderr(&burst).contains("memory allocation of"), "{}", stderr(&burst));
    let out = temp.path().join("out.ron");
    let import = osp(&["import", file, out.to_str().expect("utf-8")]);
    let said = stderr(&import);
    assert_eq!(import.status.code(), Some(2), "{said}");
    assert!(said.contains("--max-polygons N allows more") && !out.exists(), "{said}");
}

#[test]
fn frames_of_the_recorded_pace_are_limited() {
    let temp = tempfile::tempdir().expect("a folder");
    // A second between any two poses is ninety frames.
    let heads: String = (0..40).map(|t| format!("Head(t:{t},p:(0,0,0),q:(0,0,0,1))\n")).collect();
    let path = packed(temp.path(), "frames.ron.zst", HEADER, &heads, 100, zstd);
    let file = path.to_str().expect("utf-8");
    let output = osp(&["replay", file, "--lenient", "--pace", "recorded"]);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("expected at most 2000000 frames at the pace recorded"), "{said}");
    let output = osp(&["replay", file, "--lenient", "--budget", "0.1"]);
    assert!(output.status.success(), "{}", stderr(&output));
}
