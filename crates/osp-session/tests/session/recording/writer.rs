//! The writer: complete lines, written at once; sessions that continue after a crash.

use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use super::events::{STRICT, read, sample_events, undo, write};
use osp_session::recording::{
    Event, Flush, Header, MAX_LINE_BYTES, OpenOptions, RecordingError, RonWriter, StrokeId, open,
};
use osp_testkit::events::SOLE;

/// Stores every write call separately; fails once `room` bytes are used up.
#[derive(Clone)]
struct Calls {
    calls: Arc<Mutex<Vec<Vec<u8>>>>,
    room: usize,
}

impl Calls {
    fn new(room: usize) -> Self {
        Self { calls: Arc::default(), room }
    }
}

impl Write for Calls {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let length = bytes.len().min(self.room);
        if length == 0 {
            return Err(io::Error::new(io::ErrorKind::StorageFull, "no room"));
        }
        self.room -= length;
        self.calls.lock().unwrap().push(bytes[..length].to_vec());
        Ok(length)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn header() -> Header {
    Header::new("name", "source")
}

fn events_of(path: &std::path::Path) -> Vec<Event> {
    let mut session = open(path, &OpenOptions::default()).unwrap();
    let events = session.by_ref().map(|event| event.unwrap()).collect();
    assert!(session.events.notes().warnings.is_empty(), "{:?}", session.events.notes());
    events
}

#[test]
fn each_event_is_one_write_of_one_whole_line() {
    let out = Calls::new(usize::MAX);
    let mut writer = RonWriter::new(out.clone(), "a.ron", &header(), Flush::EachEvent).unwrap();
    for (i, event) in sample_events().iter().enumerate() {
        writer.write(event).unwrap();
        let calls = out.calls.lock().unwrap();
        assert_eq!(calls.len(), i + 2, "the event is out before the next one comes");
        assert!(calls.iter().all(|call| call.iter().position(|&b| b == b'\n') == Some(call.len() - 1)));
    }
    assert_eq!(writer.lines(), 1 + sample_events().len() as u64);
}

#[test]
fn collected_lines_come_out_whole_and_none_is_lost() {
    let out = Calls::new(usize::MAX);
    let mut writer = RonWriter::new(out.clone(), "a.ron", &header(), Flush::AtEnd).unwrap();
    for _ in 0..1000 {
        sample_events().iter().for_each(|event| writer.write(event).unwrap());
    }
    drop(writer);
    let calls = out.calls.lock().unwrap();
    assert!(calls.len() < 50 && calls.iter().all(|call| call.last() == Some(&b'\n')));
    assert_eq!(read(&calls.concat(), STRICT).events.len(), 1000 * sample_events().len());
}

#[test]
fn what_a_reader_would_refuse_is_not_written() {
    let mut bytes = Vec::new();
    let mut writer = RonWriter::new(&mut bytes, "a.ron", &header(), Flush::EachEvent).unwrap();
    writer.write(&undo(1.0)).unwrap();
    let error = writer.write(&undo(f64::NAN)).unwrap_err().to_string();
    assert!(error.starts_with("a.ron, line 3: expected a finite time"), "{error}");
    let long = SOLE.moved(vec![StrokeId(u32::MAX); MAX_LINE_BYTES / 10], glam::Vec3::ZERO);
    assert!(matches!(writer.write(&long), Err(RecordingError::Line { line: 3, .. })));
    writer.write(&undo(2.0)).unwrap();
    drop(writer);
    assert_eq!(read(&bytes, STRICT).events, [undo(1.0), undo(2.0)]);
    let mut root = header();
    root.root = Some(osp_session::recording::Root { center: glam::Vec3::NAN, size: 1.0 });
    assert!(RonWriter::new(Vec::new(), "a.ron", &root, Flush::EachEvent).is_err());
}

#[test]
fn nothing_follows_a_torn_line() {
    let whole = write(&header(), &sample_events());
    let out = Calls::new(whole.len() / 2);
    let mut writer = RonWriter::new(out.clone(), "a.ron", &header(), Flush::EachEvent).unwrap();
    let results: Vec<bool> = sample_events().iter().map(|event| writer.write(event).is_ok()).collect();
    let first_error = results.iter().position(|ok| !ok).unwrap();
    assert!(results[first_error..].iter().all(|ok| !ok));
    // The writer must not write again in its drop.
    drop(writer);
    let written = out.calls.lock().unwrap().concat();
    assert_eq!(written, whole[..whole.len() / 2]);
    assert_eq!(read(&written, STRICT).events, sample_events()[..first_error]);
}

#[test]
fn a_session_goes_on_after_every_possible_crash() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.ron", "a.ron.zst"] {
        let path = folder.path().join(name);
        let mut writer = RonWriter::create(&path, &header(), Flush::EachEvent).unwrap();
        sample_events().iter().for_each(|event| writer.write(event).unwrap());
        writer.finish().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(events_of(&path), sample_events());
        let mut resumed = 0;
        // Only some lengths are tested, because opening compressed files is slow; the reader's own test covers every
        // length.
        let step = if name.ends_with(".zst") { 3 } else { 1 };
        for length in (0..=bytes.len()).rev().step_by(step) {
            std::fs::write(&path, &bytes[..length]).unwrap();
            let before = match open(&path, &STRICT) {
                Ok(session) => session.map(|event| event.unwrap()).collect::<Vec<_>>(),
                Err(_) => {
                    let appended = RonWriter::append(&path, Flush::EachEvent);
                    assert!(appended.is_err(), "{name} {length}: no header");
                    continue;
                }
            };
            let (mut writer, header_read) = RonWriter::append(&path, Flush::EachEvent).unwrap();
            assert_eq!(header_read, header());
            assert_eq!(writer.lines(), 1 + before.len() as u64, "{name} {length}");
            writer.write(&undo(77.0)).unwrap();
            writer.finish().unwrap();
            let after = events_of(&path);
            assert_eq!(after[..before.len()], before, "{name} {length}");
            assert_eq!(after[before.len()..], [undo(77.0)], "{name} {length}");
            resumed += 1;
        }
        assert!(resumed > 150, "{name}: {resumed}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside {name}");
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn appending_to_what_is_no_recording_leaves_it_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ron");
    assert!(matches!(RonWriter::append(&path, Flush::AtEnd), Err(RecordingError::Io { .. })));
    assert!(!path.exists());
    std::fs::write(&path, "my diary\nwithout a newline at the end").unwrap();
    assert!(RonWriter::append(&path, Flush::AtEnd).is_err());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "my diary\nwithout a newline at the end");
}
