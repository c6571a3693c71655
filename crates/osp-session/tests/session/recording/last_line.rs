//! An incomplete last line is left out; a complete last line is read or refused.

use osp_session::recording::RecordingError;

use super::events::{LENIENT, STRICT, read, undo};

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
        for end in ["", "\n"] {
            let text = format!("{START}{line}{end}");
            let outcome = read(text.as_bytes(), STRICT);
            let Some(RecordingError::Line { line: 3, expected: said, .. }) = &outcome.error else {
                panic!("{line}: {:?}", outcome.error);
            };
            assert!(said.contains(expected), "{said}");
            assert!(outcome.notes.warnings.is_empty(), "{:?}", outcome.notes);
            // A lenient reader also treats the line as damaged.
            let outcome = read(text.as_bytes(), LENIENT);
            assert_eq!((outcome.events.len(), outcome.notes.skipped), (1, 1), "{line}");
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
