//! What is done with results: merged, checked, shown; and what is no results of a study.

use std::{fs, fs::File, path::Path};

use osp_lab::study::{StudyReader, StudyRow, StudyWriter, TableFormat};

use super::{done, osp, rows, sessions, stderr, temp};

pub(crate) fn write_rows(path: &Path, rows: impl IntoIterator<Item = StudyRow>) {
    let format = TableFormat::named_by(path).expect("the name of a table");
    let mut writer = StudyWriter::new(File::create(path).expect("made"), format).expect("begun");
    rows.into_iter().for_each(|row| writer.write(row).expect("written"));
    writer.finish().expect("ended");
}

#[test]
fn machines_that_disagree_are_found() {
    let folder = temp();
    sessions(folder.path(), 3);
    done(folder.path(), ["study", "in", "--out", "a.ndjson"]);
    let ours = rows(&folder.path().join("a.ndjson"));
    let elsewhere =
        |row: &StudyRow| StudyRow { host: "elsewhere".to_owned(), simd: "neon".to_owned(), ..row.clone() };
    write_rows(&folder.path().join("b.ndjson"), ours.iter().map(elsewhere));
    let said = done(folder.path(), ["study", "check", "a.ndjson", "b.ndjson"]);
    assert!(said.contains("24 results compared"), "{said}");
    let mut wrong: Vec<StudyRow> = ours.iter().map(elsewhere).collect();
    wrong[5].fingerprint = Some("0123456789abcdef".to_owned());
    let (file, index) = (wrong[5].file.clone(), wrong[5].index.clone().expect("an index"));
    write_rows(&folder.path().join("c.ndjson"), wrong);
    let output = osp(folder.path(), ["study", "check", "a.ndjson", "c.ndjson"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let said = stderr(&output);
    assert_eq!(said.lines().count(), 1, "{said}");
    for word in [&*file, &*index, "0123456789abcdef on elsewhere neon"] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

/// Rows of `ending` are read as they were written.
pub(crate) fn are_kept_to_the_bit(ending: &str) {
    let folder = temp();
    let row = |i: usize| StudyRow {
        file: format!("größe/{i}.ron"),
        file_bytes: u64::MAX - i as u64,
        error: i.is_multiple_of(3).then(|| "line 1\n\u{1b}[31m: \"expected\"".to_owned()),
        polygons: i.is_multiple_of(2).then_some(u64::MAX),
        indexes_agree: [None, Some(true), Some(false)][i % 3],
        frame_p50_us: [None, Some(0.1 + 0.2), Some(1.0e-300)][i % 3],
        // Numbers of 17 digits.
        visible_mean: Some(1.0 / (i as f64 + 3.0)),
        measuring_s: 1.0e6 / (i as f64 + 7.0),
        optimized: i % 2 == 1,
        ..StudyRow::default()
    };
    // Several groups of rows, and none.
    for n in [0, 1, 20_000] {
        let path = folder.path().join(format!("{n}.{ending}"));
        let written: Vec<StudyRow> = (0..n).map(row).collect();
        write_rows(&path, written.clone());
        assert!(rows(&path) == written, "{n} rows");
    }
}

#[test]
fn tables_are_kept_to_the_bit() {
    are_kept_to_the_bit("ndjson");
}

/// A table that `foreign` made, with a name of `ending`, is left alone.
pub(crate) fn is_neither_read_nor_replaced(ending: &str, foreign: impl Fn(&Path)) {
    let folder = temp();
    sessions(folder.path(), 1);
    let (name, other) = (format!("people.{ending}"), format!("r.{ending}"));
    let path = folder.path().join(&name);
    foreign(&path);
    let before = fs::read(&path).expect("there");
    for args in [
        &["study", "check", &name][..],
        &["study", "merge", &name, "--out", &other],
        &["study", "report", &name, "--out", "r.html"],
        &["study", "in", "--out", &name],
    ] {
        let output = osp(folder.path(), args);
        assert_eq!(output.status.code(), Some(2), "{args:?}");
        let said = stderr(&output);
        assert!(said.contains(&name), "{args:?}: {said}");
        assert!(said.contains("a table of another program") || said.contains("line 1: "), "{args:?}: {said}");
        assert_eq!((said.lines().count(), fs::read(&path).expect("there")), (1, before.clone()), "{said}");
    }
    done(folder.path(), ["study", "in", "--out", &name, "--force"]);
    assert_eq!(rows(&path).len(), 4);
    // The table of the same study is replaced unasked, an input never.
    done(folder.path(), ["study", "in", "--out", &name]);
    let output = osp(folder.path(), ["study", "merge", &name, "--out", &name, "--force"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("is the input, too"), "{}", stderr(&output));
}

#[test]
fn a_table_of_another_program_is_neither_read_nor_replaced() {
    is_neither_read_nor_replaced("ndjson", |path| {
        fs::write(path, "{\"file\":\"a.txt\",\"age\":7}\n").expect("written");
    });
}

/// Pieces of a table, and tables with a wrong byte.
pub(crate) fn damage_is_one_clear_error(ending: &str) {
    let folder = temp();
    sessions(folder.path(), 1);
    let (table, copy) = (format!("r.{ending}"), format!("d.{ending}"));
    done(folder.path(), ["study", "in", "--out", &table]);
    let whole = fs::read(folder.path().join(&table)).expect("there");
    let damaged = folder.path().join(&copy);
    let check = |what: &str| {
        let output = osp(folder.path(), ["study", "check", &copy]);
        let said = stderr(&output);
        assert!(!said.contains("panicked"), "{what}: {said}");
        match output.status.code() {
            // Some bytes mean nothing; others are a name that changes nothing here, or a fingerprint.
            Some(0 | 1) => {}
            code => {
                assert_eq!(code, Some(2), "{what}: {said}");
                assert!(said.contains(&copy) && said.lines().count() == 1, "{what}: {said}");
            }
        }
        output.status.code()
    };
    for length in [1, 3, 4, 8, 100, whole.len() / 2, whole.len() - 1] {
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

#[test]
fn a_damaged_table_is_one_clear_error() {
    damage_is_one_clear_error("ndjson");
    let folder = temp();
    fs::write(folder.path().join("none.ndjson"), "").expect("written");
    assert!(done(folder.path(), ["study", "check", "none.ndjson"]).starts_with("Nothing could be compared"));
}

/// Bytes as good as random, the same in every run (SplitMix64; Steele, Lea, Flood, 2014).
fn random(state: &mut u64) -> usize {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ *state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    (z ^ z >> 31) as usize
}

/// Reads a table of forty rows with random bytes in it, thousands of times. `tail`: of how many last bytes, in a table, most are
/// taken.
pub(crate) fn no_damage_is_a_panic(ending: &str, tail: impl Fn(&[u8]) -> usize) {
    let folder = temp();
    let name = format!("d.{ending}");
    let path = folder.path().join(&name);
    let row = |i: usize| StudyRow {
        file: format!("{i}.ron"),
        polygons: Some(i as u64),
        frame_p50_us: i.is_multiple_of(2).then_some(i as f64),
        ..StudyRow::default()
    };
    write_rows(&path, (0..40).map(row));
    let whole = fs::read(&path).expect("there");
    let tail = tail(&whole);
    let (mut state, mut refused) = (7, 0);
    for round in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..[1, 1, 2, 8][round % 4] {
            let from = if round % 3 == 0 { 0 } else { whole.len() - tail };
            let at = from + random(&mut state) % (whole.len() - from);
            bytes[at] = random(&mut state) as u8;
        }
        fs::write(&path, bytes).expect("written");
        let read = StudyReader::open(&path).and_then(|rows| rows.collect::<Result<Vec<_>, _>>());
        refused += usize::from(read.is_err_and(|error| error.to_string().contains(&name)));
    }
    assert!(refused > 300, "{refused}");
}

#[test]
fn no_damage_of_a_table_is_a_panic() {
    no_damage_is_a_panic("ndjson", <[u8]>::len);
}

#[test]
fn a_line_without_end_is_not_read_into_memory() {
    let folder = temp();
    let path = folder.path().join("long.ndjson");
    let file = File::create(&path).expect("made");
    // A hole of 64 GiB: no disk holds it, and no memory.
    file.set_len(64 << 30).expect("a sparse file");
    drop(file);
    let mut start = File::options().write(true).open(&path).expect("there");
    std::io::Write::write_all(&mut start, b"{\"file\":\"").expect("written");
    let read = StudyReader::open(&path).map(drop).expect_err("no table").to_string();
    assert!(read.contains("long.ndjson: ") && read.contains("line 1: expected a line end"), "{read}");
}

#[test]
fn the_page_has_a_verdict_charts_and_every_session() {
    let folder = temp();
    sessions(folder.path(), 4);
    fs::write(folder.path().join("in/<b>bad.ron"), "Header(version: 2)\n").expect("written");
    done(folder.path(), ["study", "in", "--out", "r.ndjson"]);
    done(folder.path(), ["study", "report", "r.ndjson", "--out", "r.html"]);
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
    for row in rows(&folder.path().join("r.ndjson")).iter().filter(|row| row.error.is_none()) {
        assert!(page.contains(&format!("<td>{}</td>", row.file)), "{}", row.file);
    }
    // A session is not replaced, a page is.
    fs::write(folder.path().join("s.html"), fs::read(folder.path().join("in/s0.ron")).expect("there"))
        .expect("written");
    let output = osp(folder.path(), ["study", "report", "r.ndjson", "--out", "s.html"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    done(folder.path(), ["study", "report", "r.ndjson", "--out", "r.html"]);
}
