//! Files cut off at every byte, and metadata with flipped bits: an error or fewer events, never a panic, and nothing lost that
//! was read before the damage.

use std::path::PathBuf;

use super::files::{
    METADATA, OBJ, POSES, gzip, read, small_apa, small_cassie, small_glb, small_sketch, small_tilt, write,
};
use osp_session::recording::{Event, OpenOptions, open};
use zip::CompressionMethod;

/// Files of every format: name and bytes.
fn every_format() -> Vec<(&'static str, Vec<u8>)> {
    let (history, raw) = small_cassie();
    vec![
        ("stored.tilt", small_tilt(CompressionMethod::Stored)),
        ("deflated.tilt", small_tilt(CompressionMethod::Deflated)),
        ("a.apa", small_apa()),
        ("history.json", history.into_bytes()),
        ("raw.json", raw.into_bytes()),
        ("a.poses", POSES.into()),
        ("a.obj", OBJ.into()),
        ("b.obj.gz", gzip(OBJ.as_bytes())),
        ("a.glb", small_glb()),
    ]
}

/// The bit pattern of everything an event holds, so that a prefix can be compared.
fn same(a: &Event, b: &Event) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

fn has_paint(event: &Event) -> bool {
    matches!(event, Event::Begin { paint: Some(_), .. })
}

fn without_paint(event: &Event) -> Event {
    let mut event = event.clone();
    if let Event::Begin { paint, .. } = &mut event {
        *paint = None;
    }
    event
}

#[test]
fn a_file_cut_off_anywhere_gives_what_came_before() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in every_format() {
        let path = write(folder.path(), name, &bytes);
        let whole = read(&path, false);
        assert!(whole.error.is_none(), "{name}: {:?}", whole.error);
        let mut most_kept = 0;
        for length in 0..bytes.len() {
            std::fs::write(&path, &bytes[..length]).unwrap();
            for lenient in [false, true] {
                let cut = read(&path, lenient);
                assert!(
                    cut.events.len() <= whole.events.len(),
                    "{name} cut at {length}: more than the whole file"
                );
                // In a binary format every event that is delivered stands in the whole file; a lenient reader may close the
                // stroke it was in. (A text file may end in a number that was longer.)
                if name.ends_with("tilt") || name.ends_with("apa") {
                    let mut kept = cut.events.as_slice();
                    if lenient && matches!(kept.last(), Some(Event::End { .. })) {
                        kept = &kept[..kept.len() - 1];
                    }
                    for (event, expected) in kept.iter().zip(&whole.events) {
                        // The scale of pressures in .apa is a property of the whole file; this one has it at 1.
                        // The brushes of a .tilt stand in another entry, which the cut may have taken.
                        let expected = if has_paint(event) { expected } else { &without_paint(expected) };
                        assert!(same(event, expected), "{name} cut at {length}: {event:?}");
                    }
                    let complete = cut.error.is_none() && cut.notes.warnings.is_empty();
                    assert!(!complete, "{name} cut at {length}: nothing was said");
                }
                if lenient {
                    most_kept = most_kept.max(cut.events.len());
                    let late = matches!(cut.error, Some(osp_session::recording::RecordingError::Io { .. }));
                    assert!(!late, "{name} cut at {length}: {:?}", cut.error);
                }
            }
        }
        // The last byte of a file is of little weight, so a lenient reader had nearly everything at one point.
        assert!(most_kept + 3 >= whole.events.len(), "{name}: kept {most_kept} of {}", whole.events.len());
    }
}

/// The reader takes sound lights and layers from damaged metadata, and leaves out the others.
#[test]
fn every_cut_and_flipped_bit_of_bare_metadata_does_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("bare.tilt");
    write(&path, "data.sketch", &small_sketch().0);
    let check = |text: &[u8]| {
        write(&path, "metadata.json", text);
        for lenient in [false, true] {
            if let Ok(session) = open(&path, &OpenOptions { lenient, ..OpenOptions::default() }) {
                assert_eq!(session.header.check(), Ok(()), "{}", String::from_utf8_lossy(text));
            }
            let read = read(&path, lenient);
            assert!(!lenient || read.error.is_none(), "{:?}", read.error);
            assert!(read.notes.warnings.iter().all(|text| text.contains("bare.tilt") && text.len() < 1000));
        }
    };
    let text = METADATA.as_bytes();
    (0..text.len()).for_each(|length| check(&text[..length]));
    for bit in 0..8 * text.len() {
        let mut damaged = text.to_vec();
        damaged[bit / 8] ^= 1 << (bit % 8);
        check(&damaged);
    }
}

/// A zip remembers a checksum of what it holds: a changed coordinate is noticed at the end, and the strokes are delivered.
#[test]
fn a_changed_coordinate_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = small_tilt(CompressionMethod::Stored);
    let sketch = small_sketch().0;
    let at = bytes.windows(sketch.len()).position(|window| window == sketch).unwrap();
    // The lowest bit of the first position: head 20, stroke 48, then x.
    bytes[at + 20 + 52] ^= 1;
    let path = write(folder.path(), "a.tilt", &bytes);
    let strict = read(&path, false);
    assert_eq!(strict.events.len(), 3 + 11 + 3, "all events come first");
    assert!(strict.error.unwrap().to_string().contains("CRC-32"));
    let lenient = read(&path, true);
    assert_eq!(lenient.events.len(), 3 + 11 + 3);
    assert!(lenient.notes.warnings[0].contains("CRC-32"), "{:?}", lenient.notes);
}
