//! What is done with results: merged, checked, shown; and what is no results of a study.

use std::{fs, fs::File, path::Path, sync::Arc};

use osp::lab::study::{StudyReader, StudyRow, StudyWriter};
use parquet::{file::writer::SerializedFileWriter, schema::parser::parse_message_type};

use super::{done, osp, rows, sessions, stderr, temp};

pub(crate) fn write_rows(path: &Path, rows: impl IntoIterator<Item = StudyRow>) {
    let mut writer = StudyWriter::new(File::create(path).expect("made")).expect("begun");
    rows.into_iter().for_each(|row| writer.write(row).expect("written"));
    writer.finish().expect("ended");
}

/// A table that another program might have written.
fn write_foreign(path: &Path) {
    let schema = parse_message_type("message people { required int32 age; }").expect("a schema");
    let writer =
        SerializedFileWriter::new(File::create(path).expect("made"), Arc::new(schema), Arc::default())
            .expect("begun");
    writer.close().expect("ended");
}

#[test]
fn machines_that_disagree_are_found() {
    let folder = temp();
    sessions(folder.path(), 3);
    done(folder.path(), ["study", "in", "--out", "a.parquet"]);
    let ours = rows(&folder.path().join("a.parquet"));
    let elsewhere =
        |row: &StudyRow| StudyRow { host: "elsewhere".to_owned(), simd: "neon".to_owned(), ..row.clone() };
    write_rows(&folder.path().join("b.parquet"), ours.iter().map(elsewhere));
    let said = done(folder.path(), ["study", "check", "a.parquet", "b.parquet"]);
    assert!(said.contains("24 results compared"), "{said}");
    let mut wrong: Vec<StudyRow> = ours.iter().map(elsewhere).collect();
    wrong[5].fingerprint = Some("0123456789abcdef".to_owned());
    let (file, index) = (wrong[5].file.clone(), wrong[5].index.clone().expect("an index"));
    write_rows(&folder.path().join("c.parquet"), wrong);
    let output = osp(folder.path(), ["study", "check", "a.parquet", "c.parquet"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert_eq!(said.lines().count(), 1, "{said}");
    for word in [&*file, &*index, "0123456789abcdef on elsewhere neon"] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

#[test]
fn tables_are_kept_to_the_bit() {
    let folder = temp();
    let row = |i: usize| StudyRow {
        file: format!("größe/{i}.ron"),
        file_bytes: u64::MAX - i as u64,
        error: i.is_multiple_of(3).then(|| "line 1\n\u{1b}[31m: \"expected\"".to_owned()),
        polygons: i.is_multiple_of(2).then_some(u64::MAX),
        indexes_agree: [None, Some(true), Some(false)][i % 3],
        frame_p50_us: [None, Some(0.1 + 0.2), Some(1.0e-300)][i % 3],
        optimized: i % 2 == 1,
        ..StudyRow::default()
    };
    // Several groups of rows, and none.
    for n in [0, 1, 20_000] {
        let path = folder.path().join(format!("{n}.parquet"));
        let written: Vec<StudyRow> = (0..n).map(row).collect();
        write_rows(&path, written.clone());
        assert!(rows(&path) == written, "{n} rows");
    }
}

#[test]
fn a_table_of_another_program_is_neither_read_nor_replaced() {
    let folder = temp();
    sessions(folder.path(), 1);
    let foreign = folder.path().join("people.parquet");
    write_foreign(&foreign);
    let before = fs::read(&foreign).expect("there");
    for args in [
        &["study", "check", "people.parquet"][..],
        &["study", "merge", "people.parquet", "--out", "r.parquet"],
        &["study", "report", "people.parquet", "--out", "r.html"],
        &["study", "in", "--out", "people.parquet"],
    ] {
        let output = osp(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let said = stderr(&output);
        assert!(
            said.contains("people.parquet") && said.contains("a table of another program"),
            "{args:?}: {said}"
        );
        assert_eq!((said.lines().count(), fs::read(&foreign).expect("there")), (1, before.clone()), "{said}");
    }
    done(folder.path(), ["study", "in", "--out", "people.parquet", "--force"]);
    assert_eq!(rows(&foreign).len(), 4);
    // Our own table is replaced unasked, an input never.
    done(folder.path(), ["study", "in", "--out", "people.parquet"]);
    let output =
        osp(folder.path(), ["study", "merge", "people.parquet", "--out", "people.parquet", "--force"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("is the input, too"), "{}", stderr(&output));
}

#[test]
fn a_damaged_table_is_one_clear_error() {
    let folder = temp();
    sessions(folder.path(), 1);
    done(folder.path(), ["study", "in", "--out", "r.parquet"]);
    let whole = fs::read(folder.path().join("r.parquet")).expect("there");
    let damaged = folder.path().join("d.parquet");
    let check = |what: &str| {
        let output = osp(folder.path(), ["study", "check", "d.parquet"]);
        let said = stderr(&output);
        assert!(!said.contains("panicked"), "{what}: {said}");
        match output.status.code() {
            // Some bytes mean nothing; others are a name that changes nothing here, or a fingerprint.
            Some(0 | 1) => {}
            code => {
                assert_eq!(code, Some(2), "{what}: {said}");
                assert!(said.contains("d.parquet") && said.lines().count() == 1, "{what}: {said}");
            }
        }
        output.status.code()
    };
    for length in [0, 3, 4, 8, 100, whole.len() / 2, whole.len() - 1] {
        fs::write(&damaged, &whole[..length]).expect("written");
        assert_eq!(check(&format!("{length} bytes")), Some(2));
    }
    let step = whole.len() / 150;
    for at in (0..whole.len()).step_by(step.max(1)) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0xff;
        fs::write(&damaged, bytes).expect("written");
        check(&format!("byte {at}"));
    }
}

/// Bytes as good as random, the same in every run (SplitMix64; Steele, Lea, Flood, 2014).
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ *state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ z >> 31) as usize
}

#[test]
fn no_damage_of_a_table_is_a_panic() {
    let folder = temp();
    let path = folder.path().join("d.parquet");
    let row = |i: usize| StudyRow {
        file: format!("{i}.ron"),
        polygons: Some(i as u64),
        frame_p50_us: i.is_multiple_of(2).then_some(i as f64),
        ..StudyRow::default()
    };
    write_rows(&path, (0..40).map(row));
    let whole = fs::read(&path).expect("there");
    // What the table is like is said at its end.
    let footer = u32::from_le_bytes(whole[whole.len() - 8..][..4].try_into().expect("four bytes")) as usize;
    let (mut state, mut refused) = (7, 0);
    for round in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..[1, 1, 2, 8][round % 4] {
            let from = if round % 3 == 0 { 0 } else { whole.len() - footer - 8 };
            let at = from + random(&mut state) % (whole.len() - from);
            bytes[at] = random(&mut state) as u8;
        }
        fs::write(&path, bytes).expect("written");
        let read = StudyReader::open(&path).and_then(|rows| rows.collect::<Result<Vec<_>, _>>());
        refused += usize::from(read.is_err_and(|error| error.to_string().contains("d.parquet")));
    }
    assert!(refused > 300, "{refused}");
}

#[test]
fn the_page_has_a_verdict_charts_and_every_session() {
    let folder = temp();
    sessions(folder.path(), 4);
    fs::write(folder.path().join("in/<b>bad.ron"), "Header(version: 2)\n").expect("written");
    done(folder.path(), ["study", "in", "--out", "r.parquet"]);
    done(folder.path(), ["study", "report", "r.parquet", "--out", "r.html"]);
    let page = fs::read_to_string(folder.path().join("r.html")).expect("a page");
    assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"));
    for word in [
        "took the least time",
        "times as long as osp in the median session",
        "All machines and indexes saw the same polygons",
        "&lt;b&gt;bad.ron",
        "4 with figures, 1 that could not be read",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert_eq!(page.matches("<svg").count(), 3);
    assert!(!page.contains("<b>bad") && !page.contains("http://") || page.contains("www.w3.org"));
    for row in rows(&folder.path().join("r.parquet")).iter().filter(|row| row.error.is_none()) {
        assert!(page.contains(&format!("<td>{}</td>", row.file)), "{}", row.file);
    }
    // A session is not replaced, a page is.
    fs::write(folder.path().join("s.html"), fs::read(folder.path().join("in/s0.ron")).expect("there"))
        .expect("written");
    let output = osp(folder.path(), ["study", "report", "r.parquet", "--out", "s.html"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    done(folder.path(), ["study", "report", "r.parquet", "--out", "r.html"]);
}
