//! A session's file that is cut off anywhere and damaged: what replays is what was written before the cut, and writing
//! goes on behind it.

use std::{fs, path::Path};

use super::{
    input::{self, Input, below, chance},
    scratch,
};
use osp_session::recording::{Event, Flush, Header, OpenOptions, RecordingError, RonWriter, open};

const STRICT: OpenOptions = OpenOptions::STRICT;
const LENIENT: OpenOptions = OpenOptions::LENIENT;

/// Everything that can be read, and the error that ended it.
fn read(path: &Path, options: OpenOptions) -> (Vec<Event>, Option<RecordingError>) {
    let mut session = match open(path, &options) {
        Ok(session) => session,
        Err(error) => return (Vec::new(), Some(error)),
    };
    let mut events = Vec::new();
    loop {
        match session.events.next_event() {
            Ok(Some(event)) => events.push(event),
            Ok(None) => return (events, None),
            Err(error) => return (events, Some(error)),
        }
    }
}

fn some_events(u: &mut Input<'_>) -> Vec<Event> {
    (0..1 + below(u, 24)).map(|_| input::event(u)).collect()
}

fn write_all(writer: &mut RonWriter<osp_session::recording::RecordingFile>, events: &[Event]) {
    events.iter().for_each(|event| writer.write(event).expect("a sound event"));
}

pub fn run(data: &[u8]) {
    let mut u = Input::new(data);
    let name = ["a.ron", "a.ron.zst"][below(&mut u, 2)];
    let is_plain = name == "a.ron";
    let path = scratch::file(name, b"");
    let (first, more) = (some_events(&mut u), some_events(&mut u));
    let flush = if chance(&mut u, 4) { Flush::AtEnd } else { Flush::EachEvent };
    let mut writer =
        RonWriter::create(&path, &Header::new("fuzz", "osp sketch fuzz"), flush).expect("a writer");
    write_all(&mut writer, &first);
    writer.finish().expect("written");
    let whole = fs::read(&path).expect("the file");

    let mut bytes = whole[..below(&mut u, whole.len() + 1)].to_vec();
    let is_damaged = chance(&mut u, 3) && !bytes.is_empty();
    if is_damaged {
        for _ in 0..1 + below(&mut u, 4) {
            let at = below(&mut u, bytes.len());
            bytes[at] = u.arbitrary().unwrap_or(0);
        }
    }
    fs::write(&path, &bytes).expect("written");
    if is_damaged {
        after_damage(&path, &more, is_plain);
        return;
    }

    // What replays is a prefix; of plain text every whole line.
    let (before, error) = read(&path, STRICT);
    assert!(first.starts_with(&before), "{} events of {}", before.len(), first.len());
    let lines = bytes.iter().filter(|&&b| b == b'\n').count();
    match &error {
        Some(RecordingError::Line { line: 1, .. } | RecordingError::Unknown { .. }) => {
            assert!(before.is_empty())
        }
        Some(error) => panic!("cut at {} of {}: {error}", bytes.len(), whole.len()),
        None if is_plain => assert!(before.len() + 1 >= lines, "{} events in {lines} lines", before.len()),
        None => {}
    }
    // Going on behind the cut.
    let appended = RonWriter::append(&path, Flush::EachEvent);
    match appended {
        Ok((mut writer, header)) => {
            assert!(error.is_none(), "appended to what cannot be read: {error:?}");
            assert_eq!(header.name, "fuzz");
            write_all(&mut writer, &more);
            writer.finish().expect("written");
            let (after, error) = read(&path, STRICT);
            assert!(error.is_none(), "{name} cut at {} of {}: {error:?}", bytes.len(), whole.len());
            assert_eq!(
                after,
                [before.as_slice(), &more].concat(),
                "cut at {} of {}",
                bytes.len(),
                whole.len()
            );
        }
        Err(refused) => assert!(error.is_some(), "not appended to: {refused}"),
    }
}

/// A damaged file may be refused. What was written behind the damage is read by whoever passes over it.
fn after_damage(path: &Path, more: &[Event], is_plain: bool) {
    let (strict, _) = read(path, STRICT);
    let (lenient, _) = read(path, LENIENT);
    assert!(lenient.starts_with(&strict), "lenient reading gives at least as much");
    let Ok((mut writer, _)) = RonWriter::append(path, Flush::EachEvent) else { return };
    write_all(&mut writer, more);
    writer.finish().expect("written");
    let (after, error) = read(path, LENIENT);
    if is_plain {
        assert!(error.is_none(), "{error:?}");
        assert!(
            after.ends_with(more),
            "{} events of which the last {} are not the new ones",
            after.len(),
            more.len()
        );
    }
}
