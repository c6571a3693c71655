//! Tables as Parquet, which builds with the feature `parquet` have.

use std::{fs, fs::File, path::Path, sync::Arc};

use parquet::{file::writer::SerializedFileWriter, schema::parser::parse_message_type};

use super::{done, facts, results, rows, sessions, temp};

/// A table that another program might have written.
fn write_foreign(path: &Path) {
    let schema = parse_message_type("message people { required int32 age; }").expect("a schema");
    let writer =
        SerializedFileWriter::new(File::create(path).expect("made"), Arc::new(schema), Arc::default())
            .expect("begun");
    writer.close().expect("ended");
}

#[test]
fn tables_are_kept_to_the_bit() {
    results::are_kept_to_the_bit("parquet");
}

#[test]
fn a_table_of_another_program_is_neither_read_nor_replaced() {
    results::is_neither_read_nor_replaced("parquet", write_foreign);
}

#[test]
fn a_damaged_table_is_one_clear_error() {
    results::damage_is_one_clear_error("parquet");
}

#[test]
fn no_damage_of_a_table_is_a_panic() {
    // What the table is like is said at its end.
    results::no_damage_is_a_panic("parquet", |whole| {
        u32::from_le_bytes(whole[whole.len() - 8..][..4].try_into().expect("four bytes")) as usize + 8
    });
}

#[test]
fn each_format_is_made_of_the_other() {
    let folder = temp();
    sessions(folder.path(), 3);
    done(folder.path(), ["study", "in", "--out", "r.parquet"]);
    let measured = rows(&folder.path().join("r.parquet"));
    assert_eq!(facts(&measured).len(), 12);
    done(folder.path(), ["study", "merge", "r.parquet", "--out", "r.ndjson"]);
    done(folder.path(), ["study", "merge", "r.ndjson", "--out", "again.parquet"]);
    assert!(rows(&folder.path().join("r.ndjson")) == measured);
    assert!(rows(&folder.path().join("again.parquet")) == measured);
    // What was measured is the same row in the table and in the folder of parts.
    let said = done(folder.path(), ["study", "merge", "r.parquet", "r.parquet.parts", "--out", "all.ndjson"]);
    assert!(said.contains("12 rows") && said.contains("12 were there twice"), "{said}");
    assert_eq!(fs::read_to_string(folder.path().join("all.ndjson")).expect("text").lines().count(), 12);
}
