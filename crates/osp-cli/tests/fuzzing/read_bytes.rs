//! A file of any format with anything in it: read to the end or to one error that names the file and the place, with
//! bounded memory; a lenient reader gives at least what a strict one gives; every event can be written and read again;
//! and every session can be written as a sketch that a strict reader reads.

use std::{
    io::Write as _,
    path::{Path, PathBuf},
};

use super::scratch;
use osp_session::{
    export::{ExportError, KeptStrokes, write_tilt},
    recording::{
        Event, EventSource as _, Flush, Header, Notes, OpenOptions, RecordingError, RonReader, RonWriter,
        open, open_bytes,
    },
};
use osp_testkit::peak_of;
use zip::{CompressionMethod, write::SimpleFileOptions};

/// What a file is called, and how the bytes of a target get into it. The first byte of the input is a place in this list.
pub const FORMATS: &[(&str, Packing)] = &[
    ("a.ron", Packing::Whole),
    ("a.ron.zst", Packing::Whole),
    ("b.ron.zst", Packing::Zstd),
    ("a.tilt", Packing::Whole),
    ("b.tilt", Packing::Sketch),
    ("c.tilt", Packing::Folder),
    ("d.tilt", Packing::Metadata),
    ("a.apa", Packing::Whole),
    ("a.json", Packing::Whole),
    ("a.poses", Packing::Whole),
    ("a.poses.gz", Packing::Gzip),
    ("a.obj", Packing::Whole),
    ("a.obj.gz", Packing::Gzip),
    ("b.obj.gz", Packing::Whole),
    ("a", Packing::Whole),
    ("a.glb", Packing::Whole),
    ("a.gltf", Packing::Whole),
];

/// How bytes become a file. Where a checksum would notice every change, the changed bytes are packed anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// The bytes are the file.
    Whole,
    /// Compressed.
    Zstd,
    /// Compressed.
    Gzip,
    /// They are the strokes in a zip.
    Sketch,
    /// They are the strokes in a folder.
    Folder,
    /// They are the metadata in a zip, beside sound strokes.
    Metadata,
}

/// Most events that are taken from a file; a packed one can hold more than there is time for.
const MOST_EVENTS: usize = 100_000;
/// Whole documents (metadata, CASSIE's JSON) may be this large; everything else streams.
const MOST_BYTES: i64 = 80 << 20;
/// What a byte of JSON becomes at most.
const BYTES_A_BYTE: i64 = 200;

/// A `.tilt`'s metadata that says nothing.
const METADATA: &[u8] = b"{}";
/// A sketch of version 5 without strokes.
const NO_STROKES: [u8; 20] = [0xCD, 0xA5, 0x76, 0xC5, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

struct Outcome {
    events: Vec<Event>,
    error: Option<RecordingError>,
    notes: Notes,
}

fn read(path: &Path, lenient: bool) -> Outcome {
    let mut outcome = Outcome { events: Vec::new(), error: None, notes: Notes::default() };
    let mut session = match open(path, &OpenOptions { lenient, ..OpenOptions::default() }) {
        Ok(session) => session,
        Err(error) => return Outcome { error: Some(error), ..outcome },
    };
    assert_eq!(session.header.check(), Ok(()), "{:?}", session.header);
    while outcome.events.len() < MOST_EVENTS {
        match session.events.next_event() {
            Ok(Some(event)) => {
                assert_eq!(event.check(), Ok(()), "{event:?}");
                outcome.events.push(event);
            }
            Ok(None) => break,
            Err(error) => {
                outcome.error = Some(error);
                break;
            }
        }
    }
    if outcome.events.len() < MOST_EVENTS {
        assert!(matches!(session.events.next_event(), Ok(None)), "an event after the end");
    }
    outcome.notes = session.events.notes();
    outcome
}

pub fn run(data: &[u8]) {
    let Some((format, data)) = data.split_first() else { return };
    let (name, packing) = FORMATS[*format as usize % FORMATS.len()];
    let path = file(name, packing, data);
    let (strict, strict_bytes) = peak_of(|| read(&path, false));
    let (lenient, lenient_bytes) = peak_of(|| read(&path, true));
    let held = |outcome: &Outcome| (outcome.events.capacity() * size_of::<Event>()) as i64;
    for (outcome, bytes) in [(&strict, strict_bytes), (&lenient, lenient_bytes)] {
        // What is kept here is no matter of the reader; while a list grows it is there twice.
        let most = MOST_BYTES + BYTES_A_BYTE * data.len() as i64 + 3 * held(outcome);
        assert!(bytes <= most, "{bytes} bytes held to read {} of {name}", data.len());
        outcome.error.iter().for_each(|error| check_error(error, name));
        outcome.notes.warnings.iter().for_each(|warning| check_message(warning, name));
    }
    assert!(lenient.events.len() >= strict.events.len(), "{name}: a lenient reader gives less");
    assert!(lenient.events.starts_with(&strict.events), "{name}: a lenient reader gives something else");
    if strict.error.is_none() {
        assert!(lenient.error.is_none(), "{name}: only a lenient reader fails: {:?}", lenient.error);
        assert_eq!(lenient.events.len(), strict.events.len(), "{name}");
        assert_eq!(lenient.notes.skipped, 0, "{name}: {:?}", lenient.notes);
    } else if lenient.error.is_none() && lenient.events.len() < MOST_EVENTS {
        assert!(!lenient.notes.warnings.is_empty() || lenient.notes.skipped > 0, "{name}: nothing was said");
    }
    write_again(&lenient.events);
    write_sketch(&path, &lenient.events);
}

fn file(name: &str, packing: Packing, data: &[u8]) -> PathBuf {
    match packing {
        Packing::Whole => scratch::file(name, data),
        Packing::Zstd => scratch::file(name, &zstd::encode_all(data, 1).expect("zstd packs")),
        Packing::Gzip => {
            let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            encoder.write_all(data).expect("gzip packs");
            scratch::file(name, &encoder.finish().expect("gzip packs"))
        }
        Packing::Sketch => scratch::file(name, &tilt(data, METADATA)),
        Packing::Metadata => scratch::file(name, &tilt(&NO_STROKES, data)),
        Packing::Folder => {
            scratch::file(&format!("{name}/metadata.json"), METADATA);
            scratch::file(&format!("{name}/data.sketch"), data);
            scratch::path(name)
        }
    }
}

fn tilt(sketch: &[u8], metadata: &[u8]) -> Vec<u8> {
    let mut bytes = b"tilT\x10\0\x01\0\0\0\0\0\0\0\0\0".to_vec();
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, content) in [("data.sketch", sketch), ("metadata.json", metadata)] {
        zip.start_file(name, options).expect("zip packs");
        zip.write_all(content).expect("zip packs");
    }
    bytes.extend(zip.finish().expect("zip packs").into_inner());
    bytes
}

fn check_message(text: &str, name: &str) {
    assert!(text.contains(name), "{name}: the file is not named: {text}");
    assert!(text.len() < 2000, "{name}: a message of {} bytes", text.len());
}

fn check_error(error: &RecordingError, name: &str) {
    check_message(&error.to_string(), name);
    match error {
        RecordingError::Line { line, expected, .. } => assert!(*line > 0 && !expected.is_empty(), "{error}"),
        RecordingError::Byte { expected, .. } | RecordingError::Unknown { expected, .. } => {
            assert!(!expected.is_empty(), "{error}");
        }
        RecordingError::Limit(_) => assert!(error.to_string().contains("--max"), "{error}"),
        RecordingError::Io { .. } => panic!("{name}: the file can be read, but: {error}"),
    }
}

/// As a recording of our own, the same events come back.
fn write_again(events: &[Event]) {
    let mut bytes = Vec::new();
    let mut writer =
        RonWriter::new(&mut bytes, "again.ron", &Header::new("", ""), Flush::AtEnd).expect("a header");
    let events = &events[..events.len().min(2000)];
    events.iter().for_each(|event| writer.write(event).expect("a sound event"));
    writer.flush().expect("memory");
    drop(writer);
    let mut reader =
        RonReader::new(bytes.as_slice(), "again.ron", OpenOptions::default()).expect("our own header");
    for event in events {
        assert_eq!(reader.next_event().expect("what was written is read").as_ref(), Some(event));
    }
}

/// As a sketch, the strokes that are left come back.
fn write_sketch(path: &Path, events: &[Event]) {
    let Ok(session) = open(path, &OpenOptions::LENIENT) else { return };
    let mut kept = KeptStrokes::default();
    events.iter().take(2000).for_each(|event| kept.note(event));
    let mut bytes = Vec::new();
    let counts = match write_tilt(&mut kept, &session.header, None, &mut bytes) {
        Err(ExportError::NoStrokes(_)) => return,
        other => other.expect("memory"),
    };
    let again = open_bytes("again.tilt", bytes, &OpenOptions::default()).expect("a sketch of our own");
    let events: Vec<Event> = again.map(|event| event.expect("what was written is read")).collect();
    let strokes = events.iter().filter(|event| matches!(event, Event::Begin { .. })).count();
    let points = events.iter().filter(|event| matches!(event, Event::Point { .. })).count();
    assert_eq!((strokes as u64, points as u64), (counts.strokes, counts.points));
}
