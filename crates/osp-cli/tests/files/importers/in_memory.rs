//! A session in memory is read as the same one on the disk is: its events, its notes, and what is wrong with it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use osp_session::recording::{
    Event, Flush, Header, MemoryFiles, Notes, OpenOptions, RecordingError, RonWriter, Session, open,
    open_bytes,
};

use super::files::{small_glb, small_gltf, write};

/// All that a reader tells.
type Told = Result<(Header, &'static str, Vec<Event>, Option<String>, Notes), String>;

fn told(session: Result<Session, RecordingError>) -> Told {
    let mut session = session.map_err(|error| error.to_string())?;
    let (mut events, mut error) = (Vec::new(), None);
    for event in session.by_ref() {
        match event {
            Ok(event) => events.push(event),
            Err(found) => error = Some(found.to_string()),
        }
    }
    Ok((session.header.clone(), session.format, events, error, session.events.notes()))
}

/// Holds the files of `paths` in memory under their own names, and compares what is told of the first.
fn assert_same(paths: &[&Path]) -> Told {
    let mut files = MemoryFiles::new();
    for path in paths {
        files.insert(path, fs::read(path).unwrap());
    }
    let mut strict = Err(String::new());
    for options in [OpenOptions::LENIENT, OpenOptions::STRICT] {
        let on_disk = told(open(paths[0], &options));
        assert!(told(files.open(paths[0], &options)) == on_disk, "{}", paths[0].display());
        strict = on_disk;
    }
    strict
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(files_below(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

#[test]
fn files_of_the_corpus() {
    let Some(corpus) = std::env::var_os("OSP_CORPUS").map(PathBuf::from) else {
        eprintln!("skipped: OSP_CORPUS is not set");
        return;
    };
    let mut formats = std::collections::BTreeSet::new();
    for path in files_below(&corpus) {
        let sibling = ["raw_data", "sketch_history"]
            .map(|folder| path.parent().unwrap().join("..").join(folder).join(path.file_name().unwrap()));
        let mut paths = vec![path.as_path()];
        paths.extend(sibling.iter().filter(|path| path.is_file()).map(PathBuf::as_path));
        if let Ok((_, format, ..)) = assert_same(&paths) {
            formats.insert(format);
        }
    }
    let expected = ["tilt", "apa", "cassie", "poses", "obj"];
    assert!(expected.iter().all(|format| formats.contains(format)), "{formats:?}");
}

#[test]
fn sessions_of_several_files_and_packed_ones() {
    let folder = tempfile::tempdir().unwrap();
    let (json, buffer) = small_gltf();
    let with_uri = json.replace("{\"byteLength\":124}", "{\"byteLength\":124,\"uri\":\"parts/a%20b.bin\"}");
    let gltf = write(folder.path(), "b.gltf", with_uri.as_bytes());
    let parts = write(folder.path(), "parts/a b.bin", &buffer);
    let (.., events, error, _) = assert_same(&[&gltf, &parts]).unwrap();
    assert!(error.is_none() && events.iter().any(|event| matches!(event, Event::Polygon { .. })));
    // Without the other file, what is wrong names it.
    let mut files = MemoryFiles::new();
    files.insert("-", fs::read(&gltf).unwrap());
    let alone = told(files.open("-", &OpenOptions::STRICT)).unwrap_err();
    assert!(alone.contains("parts/a b.bin") && alone.contains("from a pipe is read alone"), "{alone}");

    let zst = folder.path().join("a.ron.zst");
    let mut writer = RonWriter::create(&zst, &Header::new("a", "test"), Flush::AtEnd).unwrap();
    let source = Path::new(osp_testkit::ROOT).join("recordings/room.ron");
    for event in open(&source, &OpenOptions::STRICT).unwrap().take(500) {
        writer.write(&event.unwrap()).unwrap();
    }
    writer.finish().unwrap();
    let (_, format, events, error, _) = assert_same(&[&zst]).unwrap();
    assert_eq!((format, events.len(), error), ("ron.zst", 500, None));
}

#[test]
fn damage_is_told_alike() {
    let folder = tempfile::tempdir().unwrap();
    let glb = small_glb();
    let cut = write(folder.path(), "cut.glb", &glb[..glb.len() / 2]);
    assert_same(&[&cut]).unwrap_err();
    let mut damaged = fs::read(Path::new(osp_testkit::ROOT).join("recordings/grow.ron")).unwrap();
    damaged.truncate(20_000);
    damaged[10_000..10_010].fill(b'?');
    let damaged = write(folder.path(), "damaged.ron", &damaged);
    let (.., error, _) = assert_same(&[&damaged]).unwrap();
    assert!(error.is_some_and(|error| error.contains("damaged.ron")));
    for (name, bytes) in
        [("empty.ron", &b""[..]), ("a.tilt", b"tilT"), ("a.apa", b"x"), ("a.json", b"["), ("a", b"?")]
    {
        assert_same(&[&write(folder.path(), name, bytes)]).unwrap_err();
        assert!(open_bytes(name, bytes, &OpenOptions::STRICT).is_err());
    }
    let missing = open_bytes("a.ron", *b"", &OpenOptions::STRICT).map(drop).unwrap_err();
    assert!(missing.to_string().contains("a.ron"), "{missing}");
    let none = MemoryFiles::new().open("b.ron", &OpenOptions::STRICT).map(drop).unwrap_err();
    assert!(none.to_string().contains("b.ron"), "{none}");
}
