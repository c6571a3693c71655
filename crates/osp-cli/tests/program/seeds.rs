//! docs/seeds.md: every row of its tables has a command, and every command runs.

use std::{collections::BTreeSet, fs};

use crate::OSP;
use osp_testkit::{at, packages, stderr};

/// What stands between backticks.
fn code(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// A row of a table: its first cell, the cell of the commands, and the whole line.
struct Row {
    name: String,
    commands: Vec<String>,
    line: String,
}

/// The rows of all tables that have a column `command`.
fn rows(text: &str) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut column = None;
    for line in text.lines() {
        let Some(inner) = line.trim().strip_prefix('|') else {
            column = None;
            continue;
        };
        let cells: Vec<&str> = inner.split('|').map(str::trim).collect();
        let is_rule = cells[0].chars().all(|c| c == '-' || c == ':');
        match column {
            None => column = Some(cells.iter().position(|cell| *cell == "command")),
            Some(Some(column)) if !is_rule => {
                let cell = cells.get(column).unwrap_or_else(|| panic!("a row without a command: {line}"));
                let commands = code(cell).map(str::to_owned).collect();
                rows.push(Row { name: cells[0].to_owned(), commands, line: line.to_owned() });
            }
            Some(_) => {}
        }
    }
    rows
}

fn table() -> Vec<Row> {
    rows(&fs::read_to_string(at("docs/seeds.md")).expect("docs/seeds.md"))
}

/// All sources of a test target.
fn sources_of(target: &str) -> String {
    let folders = packages().into_iter().map(|package| package.join("tests").join(target));
    let files = folders.flat_map(|folder| walkdir::WalkDir::new(folder).into_iter().flatten());
    files.filter_map(|file| fs::read_to_string(file.path()).ok()).collect()
}

#[test]
fn every_row_has_a_command_and_names_files_that_are_there() {
    let rows = table();
    assert!(rows.len() > 15, "{} rows", rows.len());
    for row in &rows {
        assert!(!row.commands.is_empty(), "no command: {}", row.line);
        for command in &row.commands {
            let words: Vec<&str> = command.split_whitespace().collect();
            match words[..] {
                ["osp", ..] => {}
                // A test, by its target and a part of its name.
                ["cargo", "test", .., "--test", target, filter] => {
                    let is_there = sources_of(target).contains(filter);
                    assert!(is_there, "{}: no test of {target} is called {filter}", row.name);
                }
                _ => panic!(
                    "{}: expected `osp ...` or `cargo test ... --test TARGET NAME`: {command}",
                    row.name
                ),
            }
        }
        for path in code(&row.line)
            .filter(|text| ["src/", "crates/", "docs/"].iter().any(|start| text.starts_with(start)))
        {
            assert!(at(path).exists(), "{}: there is no {path}", row.name);
        }
    }
}

#[test]
fn every_command_of_the_table_runs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for of in ["recordings", "docs/figures"] {
        let copies = folder.path().join(of);
        fs::create_dir_all(&copies).expect("a folder");
        for entry in fs::read_dir(at(of)).expect("the shipped sessions") {
            let path = entry.expect("an entry").path();
            fs::copy(&path, copies.join(path.file_name().expect("a name"))).expect("a copy");
        }
    }
    let of_osp = |command: &String| command.starts_with("osp ");
    let commands: BTreeSet<String> =
        table().into_iter().flat_map(|row| row.commands).filter(of_osp).collect();
    for command in commands {
        let args: Vec<&str> = command.split_whitespace().skip(1).collect();
        let output = OSP.run_in(folder.path(), &args);
        let said = stderr(&output);
        // Commands of other builds say which.
        let is_not_built = said.contains("needs a build with the feature");
        assert!(output.status.success() || is_not_built, "{command}: {said}");
    }
}

#[test]
fn a_row_without_a_command_is_seen() {
    let text =
        "| a | command |\n| --- | --- |\n| x | `osp info` |\n| y | |\n\ntext\n\n| b |\n| --- |\n| z |\n";
    let rows = rows(text);
    let found: Vec<_> = rows.iter().map(|row| (row.name.as_str(), row.commands.len())).collect();
    assert_eq!(found, [("x", 1), ("y", 0)]);
}
