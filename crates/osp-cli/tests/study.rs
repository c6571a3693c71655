//! `osp study`: many sessions, measured once each, whatever stops the program; and what is said of the results.
#![expect(clippy::print_stderr, reason = "a test that is left out says why")]

#[path = "study/measuring.rs"]
mod measuring;
#[cfg(feature = "parquet")]
#[path = "study/parquet.rs"]
mod parquet_tables;
#[path = "study/recipes.rs"]
mod recipes;
#[path = "study/replacing.rs"]
mod replacing;
#[path = "../../../tests/support/repository.rs"]
mod repository;
#[path = "study/results.rs"]
mod results;
#[path = "study/resuming.rs"]
mod resuming;

use std::{
    collections::BTreeMap,
    ffi::OsStr,
    fs,
    path::Path,
    process::{Command, Output},
};

use osp_lab::study::{StudyReader, StudyRow};

fn command<S: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = S>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_osp"));
    command.args(args).current_dir(folder);
    command
}

fn osp<S: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = S>) -> Output {
    command(folder, args).output().expect("the program starts")
}

/// What it says where it has to succeed.
fn done<S: AsRef<OsStr>>(folder: &Path, args: impl IntoIterator<Item = S>) -> String {
    let output = osp(folder, args);
    assert!(output.status.success(), "{}", stderr(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn temp() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Small sessions that differ, in the folder `in`.
fn sessions(folder: &Path, n: usize) {
    fs::create_dir_all(folder.join("in/deep")).expect("folders");
    for i in 0..n {
        let (kind, seed) = (["room", "portrait", "scribble"][i % 3], i.to_string());
        let name = if i % 2 == 0 { format!("in/s{i}.ron") } else { format!("in/deep/s{i}.ron") };
        done(folder, ["synth", kind, &name, "--polygons", "900", "--seed", &seed]);
    }
}

fn rows(table: &Path) -> Vec<StudyRow> {
    let rows = StudyReader::open(table).expect("a table of a study");
    rows.map(|row| row.expect("a row")).collect()
}

/// What does not depend on the clock: by file and index.
fn facts(rows: &[StudyRow]) -> BTreeMap<(String, Option<String>), [String; 3]> {
    let facts = |row: &StudyRow| {
        let key = (row.file.clone(), row.index.clone());
        let counts = format!("{:?} {:?} {:?}", row.polygons, row.frames, row.visible_mean);
        (key, [format!("{:?}", row.fingerprint), counts, format!("{:?} {:?}", row.error, row.file_hash)])
    };
    let found: BTreeMap<_, _> = rows.iter().map(facts).collect();
    assert_eq!(found.len(), rows.len(), "a row is there twice");
    found
}

/// The parts in a work folder, each with what shows that it was written anew.
fn parts(folder: &Path) -> BTreeMap<String, (std::time::SystemTime, u64, Vec<u8>)> {
    let Ok(entries) = fs::read_dir(folder) else { return BTreeMap::new() };
    let mut parts = BTreeMap::new();
    for entry in entries {
        let entry = entry.expect("an entry");
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.ends_with(".json") {
            let data = entry.metadata().expect("its data");
            #[cfg(unix)]
            let inode = std::os::unix::fs::MetadataExt::ino(&data);
            #[cfg(not(unix))]
            let inode = 0;
            let bytes = fs::read(entry.path()).expect("a part");
            parts.insert(name, (data.modified().expect("a time"), inode, bytes));
        }
    }
    parts
}
