//! Foreign files that claim to be too large, or become too large when they are unpacked.

use std::path::Path;

use super::files::{
    OBJ, POSES, gzip, raw_points, sketch, sketch_stroke, small_apa, small_tilt, tilt, write, write_cassie,
};
use osp_session::recording::{Limits, OpenOptions, RecordingError, open};
use zip::CompressionMethod;

/// Events, the error that ended them, and the warnings.
fn read(path: &Path, lenient: bool, limits: Limits) -> (usize, Option<RecordingError>, Vec<String>) {
    let mut session = match open(path, &OpenOptions { lenient, limits, ..OpenOptions::STRICT }) {
        Ok(session) => session,
        Err(error) => return (0, Some(error), Vec::new()),
    };
    let mut events = 0;
    let error = loop {
        match session.events.next_event() {
            Ok(Some(_)) => events += 1,
            Ok(None) => break None,
            Err(error) => break Some(error),
        }
    };
    assert!(matches!(session.events.next_event(), Ok(None)), "an event after the end");
    (events, error, session.events.notes().warnings)
}

/// Checks what is said of a file beyond its limits, and that the same file is read under wider ones.
fn refused(path: &Path, limits: Limits, wider: Limits, expected: &[&str]) {
    let (before, error, _) = read(path, false, limits);
    let Some(error @ RecordingError::Limit { .. }) = error else { panic!("{}: {error:?}", path.display()) };
    let said = error.to_string();
    let name = path.file_name().unwrap().to_string_lossy();
    for part in expected.iter().copied().chain([&*name, "expected at most", "N allows more", "read before: "])
    {
        assert!(said.contains(part), "{part}: {said}");
    }
    let (events, error, warnings) = read(path, true, limits);
    assert!(error.is_none() && events >= before, "{error:?}");
    assert!(warnings.iter().any(|warning| warning.contains(expected[0])), "{warnings:?}");
    let (all, error, _) = read(path, false, wider);
    assert!(error.is_none() && all > before, "{error:?}: {all} and {before} events");
}

#[test]
fn every_format_ends_at_the_limits() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let wider = Limits::DEFAULT;
    let polygons = |polygons| Limits { polygons, ..wider };
    let path = write(folder, "a.tilt", &small_tilt(CompressionMethod::Stored));
    refused(&path, polygons(9), wider, &["2 strokes", "a.tilt, byte "]);
    let path = write(
        folder,
        "b.tilt",
        &tilt(
            &[(
                "data.sketch",
                &sketch(5, &[sketch_stroke([1.0; 4], 1.0, 1.0, &raw_points(20, [0.0; 3], 0))]).0,
            )],
            CompressionMethod::Stored,
        ),
    );
    refused(&path, polygons(9), wider, &["9 polygons", "byte ", "1 strokes, 9 points"]);
    let path = write(folder, "a.apa", &small_apa());
    refused(&path, polygons(7), wider, &["1 strokes", "byte "]);
    let path = write(folder, "a.poses", POSES.as_bytes());
    refused(&path, polygons(5), wider, &["1 strokes", "line "]);
    let path = write(folder, "a.poses.gz", &gzip(POSES.as_bytes()));
    refused(&path, polygons(5), wider, &["1 strokes", "line "]);
    // A limit of so few polygons leaves room for one stroke, and none for groups.
    let obj = OBJ.replace("o thing\n", "\n").replace("usemtl wall\n", "\n");
    let path = write(folder, "a.obj", obj.as_bytes());
    refused(&path, polygons(4), wider, &["4 polygons", "line ", "3 faces"]);
    refused(&path, polygons(3), wider, &["3 vertices", "line ", "0 faces"]);
    let path = write(folder, "a.obj.gz", &gzip(obj.as_bytes()));
    refused(&path, polygons(3), wider, &["3 vertices", "line ", "0 faces"]);
}

/// Both files of a CASSIE sketch are held whole.
#[test]
fn a_cassie_sketch_is_limited_before_it_is_read_and_after() {
    let temp = tempfile::tempdir().unwrap();
    let (history, raw) = write_cassie(temp.path());
    for path in [&history, &raw] {
        let (events, error, _) = read(path, true, Limits { polygons: 16, ..Limits::DEFAULT });
        let said = error.expect("a limit, lenient or not: nothing was read").to_string();
        assert!(events == 0 && said.contains("expected at most 64 bytes (--max-polygons N"), "{said}");
    }
    // The history alone is small enough for its bytes, and has three strokes.
    std::fs::remove_file(raw).unwrap();
    let bytes = std::fs::metadata(&history).unwrap().len();
    std::fs::write(&history, std::fs::read_to_string(&history).unwrap().replace("  ", "")).unwrap();
    let limits = Limits { polygons: bytes / 4 + 1, ..Limits::DEFAULT };
    assert!(read(&history, false, limits).1.is_none());
}

#[test]
fn what_an_entry_or_a_stream_unpacks_to_is_limited() {
    let temp = tempfile::tempdir().unwrap();
    let folder = temp.path();
    let (limits, wider) = (Limits::DEFAULT, Limits { unpacking: 2000, ..Limits::DEFAULT });
    // All points at one place, facing one way: 3.6 MB that pack to some kilobytes.
    let same = vec![([0.0; 3], [0.0, 0.0, 0.0, 1.0], 1.0, 0); 100_000];
    let bomb = sketch(5, &[sketch_stroke([1.0; 4], 0.5, 2.0, &same)]).0;
    let path = write(folder, "bomb.tilt", &tilt(&[("data.sketch", &bomb)], CompressionMethod::Deflated));
    refused(
        &path,
        limits,
        wider,
        &["bytes unpacked from", "bomb.tilt/data.sketch, byte ", "--max-polygons", "1 strokes"],
    );
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned() + &"f 1 2 3\n".repeat(300_000);
    let path = write(folder, "bomb.obj.gz", &gzip(faces.as_bytes()));
    refused(&path, limits, wider, &["bytes unpacked from", "line ", "--max-polygons", " faces"]);
    let path = write(folder, "line.obj.gz", &gzip(&[b' '; 8 << 20]));
    let said = read(&path, false, limits).1.expect("a limit").to_string();
    assert!(said.contains("line.obj.gz, line 1: expected at most"), "{said}");
    let path =
        write(folder, "bomb.poses.gz", &gzip("10.00 0.1 0.2 0.3 1 0 0 0\n".repeat(100_000).as_bytes()));
    refused(&path, limits, wider, &["bytes unpacked from", "line ", "--max-polygons", "1 strokes"]);
    // Metadata are read whole.
    let spaces = vec![b' '; 8 << 20];
    let small = sketch(5, &[]).0;
    let entries: [(&str, &[u8]); 2] = [("data.sketch", &small), ("metadata.json", &spaces)];
    let path = write(folder, "metadata.tilt", &tilt(&entries, CompressionMethod::Deflated));
    let said = read(&path, false, limits).1.expect("a limit").to_string();
    assert!(said.contains("metadata.tilt/metadata.json, byte 0: expected at most"), "{said}");
}
