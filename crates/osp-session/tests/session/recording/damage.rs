//! Files that were truncated, changed, or forged.

use std::io::{BufReader, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use osp_session::recording::{MAX_LINE_BYTES, RecordingError};
use osp_testkit::peak_of;
use proptest::prelude::*;

use super::events::{LENIENT, Outcome, STRICT, read, read_file, read_from, sample_events, undo, write};
use super::look::header;

/// The length of the lines up to and including line `n`, without the last newline.
fn ends_of_lines(bytes: &[u8]) -> Vec<usize> {
    bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(i, _)| i).collect()
}

#[test]
fn every_truncation_replays_up_to_the_cut() {
    let bytes = write(&header(), &sample_events());
    let ends = ends_of_lines(&bytes);
    for length in 0..bytes.len() {
        let outcome = read(&bytes[..length], STRICT);
        let whole = ends.iter().filter(|&&end| end <= length).count();
        if whole == 0 {
            assert!(matches!(outcome.error, Some(RecordingError::Line { line: 1, .. })), "{length}");
            continue;
        }
        assert!(outcome.error.is_none(), "{length}: {:?}", outcome.error);
        assert_eq!(outcome.events, sample_events()[..whole - 1], "{length}");
        let at_line_end = ends.iter().any(|&end| length == end || length == end + 1);
        let warnings = &outcome.notes.warnings;
        if at_line_end {
            assert!(warnings.is_empty(), "{length}: {warnings:?}");
        } else {
            assert_eq!(warnings.len(), 1, "{length}");
            assert!(warnings[0].contains(&format!("line {}:", whole + 1)), "{length}: {}", warnings[0]);
        }
    }
}

const START: &str = "Header(format: 1)\nUndo(t: 1)\n";

#[test]
fn a_whole_last_line_that_means_nothing_is_an_error_and_no_cut() {
    for (line, expected) in [
        (
            "Place(t: 2, group: 1, to: (p: (0, 0, 0), q: (0, 0, 0, 1), s: 1e30))",
            "a scale above 0, at most 1e15",
        ),
        ("Point(t: 2, stroke: 1, p: (1e16, 0, 0))", "finite coordinates"),
        ("Undo(t: inf)", "a finite time"),
    ] {
        for end in ["", "\n", "\nUndo(t: 3)\n"] {
            let text = format!("{START}{line}{end}");
            let outcome = read(text.as_bytes(), STRICT);
            let Some(RecordingError::Line { line: 3, expected: said, .. }) = &outcome.error else {
                panic!("{line}: {:?}", outcome.error);
            };
            assert!(said.contains(expected), "{said}");
            assert!(outcome.notes.warnings.is_empty(), "{:?}", outcome.notes);
            // A lenient reader also treats the line as damaged.
            let outcome = read(text.as_bytes(), LENIENT);
            assert_eq!(outcome.notes.skipped, 1, "{line}");
        }
    }
}

#[test]
fn a_last_line_that_ends_inside_is_a_cut() {
    for line in ["Place(t: 2, group: 1, to: (p: (0, 0, 0), q: (0, 0, 0, 1), s: 0)", "Un", "Undo(t: 2"] {
        for options in [STRICT, LENIENT] {
            let outcome = read(format!("{START}{line}").as_bytes(), options);
            assert_eq!(outcome.events, [undo(1.0)]);
            assert!(outcome.error.is_none() && outcome.notes.skipped == 0, "{:?}", outcome.error);
            assert_eq!(outcome.notes.warnings.len(), 1);
            assert!(outcome.notes.warnings[0].contains("line 3: the file ends inside this line"));
        }
    }
}

#[test]
fn a_character_cut_in_half_at_the_end_is_a_cut() {
    let mut bytes = [START.as_bytes(), b"// caf\xC3"].concat();
    let outcome = read(&bytes, STRICT);
    assert_eq!(outcome.events.len(), 1);
    assert!(outcome.error.is_none());
    assert_eq!(outcome.notes.warnings.len(), 1);
    bytes.push(b'\n');
    let error = read(&bytes, STRICT).error.expect("an error").to_string();
    assert!(error.contains("line 3: expected UTF-8 text; found other bytes in column 7"), "{error}");
}

/// Counts the bytes that are read from it.
struct Counted<R> {
    input: R,
    taken: Arc<AtomicU64>,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let length = self.input.read(buffer)?;
        self.taken.fetch_add(length as u64, Ordering::Relaxed);
        Ok(length)
    }
}

#[test]
fn a_giant_line_is_refused_without_being_kept() {
    const GIANT: u64 = 300 << 20;
    // One line of 300 MiB between valid lines.
    let giant = |taken: &Arc<AtomicU64>| {
        let start = &b"Header(format: 1)\nUndo(t: 1)\n"[..];
        let input = start.chain(std::io::repeat(b'7').take(GIANT)).chain(&b"\nUndo(t: 2)\n"[..]);
        BufReader::new(Counted { input, taken: taken.clone() })
    };
    let taken = Arc::default();
    let (outcome, first) = peak_of(|| read_from(giant(&taken), STRICT));
    assert_eq!(outcome.events.len(), 1);
    let Some(RecordingError::Line { line: 3, expected, found, .. }) = &outcome.error else {
        panic!("{:?}", outcome.error);
    };
    assert!(expected.contains(&MAX_LINE_BYTES.to_string()), "{expected}");
    assert!(found.chars().count() < 120, "{found}");
    assert!(taken.load(Ordering::Relaxed) < 2 * MAX_LINE_BYTES as u64, "the rest was not even read");

    let (outcome, second) = peak_of(|| read_from(giant(&taken), LENIENT));
    assert_eq!(outcome.events, [undo(1.0), undo(2.0)]);
    assert_eq!(outcome.notes.skipped, 1);

    let (outcome, third) = peak_of(|| read_from(BufReader::new(std::io::repeat(b'7').take(GIANT)), LENIENT));
    assert!(matches!(outcome.error, Some(RecordingError::Line { line: 1, .. })));
    assert!([first, second, third].iter().all(|peak| *peak < GIANT as i64 / 4), "{first} {second} {third}");
}

#[test]
fn the_longest_line_allowed_is_read() {
    let mut text = b"Header(format: 1)\n".to_vec();
    let event = b"Undo(t: 1)";
    text.extend_from_slice(event);
    text.resize(text.len() + MAX_LINE_BYTES - event.len(), b' ');
    for (extra, events) in [(&b""[..], 1), (b"\n", 1), (b"\nUndo(t: 2)\n", 2)] {
        let outcome = read(&[&text, extra].concat(), STRICT);
        assert!(outcome.error.is_none(), "{:?}", outcome.error.map(|e| e.to_string()));
        assert_eq!(outcome.events.len(), events);
    }
    assert!(read(&[&text[..], b" \n"].concat(), STRICT).error.is_some());
}

proptest! {
    #[test]
    fn flipped_bits_never_panic_and_never_add(flips in prop::collection::vec((any::<prop::sample::Index>(), 0..8u8), 1..6)) {
        let mut bytes = write(&header(), &sample_events());
        for (at, bit) in &flips {
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
        }
        let strict = read(&bytes, STRICT);
        let lenient = read(&bytes, LENIENT);
        // A bit flip can split a line in two, but cannot create an event.
        prop_assert!(strict.events.len() <= sample_events().len() + flips.len());
        prop_assert!(lenient.events.len() >= strict.events.len());
        prop_assert!(lenient.events.starts_with(&strict.events));
        prop_assert!(strict.error.is_some() || lenient.notes.skipped == 0);
        prop_assert!(strict.events.iter().chain(&lenient.events).all(|event| event.check().is_ok()));
    }

    #[test]
    fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..300), with_header in any::<bool>()) {
        let start: &[u8] = if with_header { b"Header(format: 1)\n" } else { b"" };
        let outcome = read(&[start, &bytes].concat(), LENIENT);
        prop_assert_eq!(outcome.error.is_some(), !with_header && outcome.events.is_empty());
    }
}

/// Compressed recordings, as files, because only `open` uses the frame decoder.
mod compressed {
    use osp_session::recording::{Flush, RonWriter, open};

    use super::*;

    fn compress(path: &std::path::Path, flush: Flush) -> Vec<u8> {
        let mut writer = RonWriter::create(path, &header(), flush).unwrap();
        sample_events().iter().for_each(|event| writer.write(event).unwrap());
        writer.finish().unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn every_truncation_replays_up_to_the_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ron.zst");
        for flush in [Flush::EachEvent, Flush::AtEnd] {
            let bytes = compress(&path, flush);
            let Outcome { events, notes, error } = read_file(&path, STRICT);
            assert_eq!(events, sample_events());
            assert!(error.is_none() && notes.warnings.is_empty());
            let mut seen = 0;
            for length in 0..bytes.len() {
                std::fs::write(&path, &bytes[..length]).unwrap();
                let Outcome { events, notes, error } = read_file(&path, STRICT);
                if let Some(error) = error {
                    assert!(matches!(error, RecordingError::Line { line: 1, .. }), "{length}: {error}");
                    assert!(error.to_string().contains("line 1: expected the header"), "{error}");
                    continue;
                }
                assert!(sample_events().starts_with(&events), "{length}");
                assert!(events.len() >= seen, "more of the file gives no less");
                seen = events.len();
                assert_eq!(notes.warnings.len(), 1, "{length}: {notes:?}");
                assert!(notes.warnings[0].contains("a.ron.zst, line "), "{notes:?}");
            }
            assert!(
                flush == Flush::AtEnd || seen == sample_events().len(),
                "events flushed one by one survive"
            );
        }
    }

    #[test]
    fn flipped_bits_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ron.zst");
        let bytes = compress(&path, Flush::AtEnd);
        let mut unnoticed = 0;
        for at in 0..bytes.len() {
            for bit in 0..8 {
                let mut changed = bytes.clone();
                changed[at] ^= 1 << bit;
                std::fs::write(&path, &changed).unwrap();
                if open(&path, &STRICT).is_err() {
                    continue;
                }
                let Outcome { events, notes, error } = read_file(&path, STRICT);
                let quiet = error.is_none() && notes.warnings.is_empty();
                unnoticed += usize::from(quiet && events != sample_events());
                if bit != at % 8 || at < 4 {
                    continue; // Once a byte is enough, and without its mark the file is none of ours.
                }
                let Outcome { notes, error, .. } = read_file(&path, LENIENT);
                assert!(error.is_none(), "a lenient reader ends where the data are damaged");
                assert!(quiet || !notes.warnings.is_empty(), "and says so");
            }
        }
        assert_eq!(unnoticed, 0, "the checksum finds every changed event");
    }
}
