//! docs/seeds.md: every row of its tables has a command, every command runs, and prints what its row says it does.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
};

use crate::OSP;
use osp_testkit::{at, packages, stderr, stdout};

/// What stands between backticks.
fn code(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

/// What a cell says after `prints`, up to a semicolon or a bracket, between backticks: an ellipsis is any other text of the same line.
fn printed(cell: &str) -> impl Iterator<Item = &str> {
    cell.split("prints ").skip(1).flat_map(|rest| code(rest.split([';', '(']).next().unwrap_or(rest)))
}

/// What may stand beside a word.
const BESIDE: [char; 6] = [',', ';', ':', '.', '(', ')'];

/// Whether a line has all parts of a figure in this order, as whole words. Runs of spaces count as one.
fn prints(output: &str, figure: &str) -> bool {
    let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
    output.lines().any(|line| {
        let mut rest = &words(line)[..];
        figure.split('…').map(words).all(|part| {
            let at = rest.windows(part.len().max(1)).position(|window| {
                // A comma or the like beside a word does not belong to the figure.
                let is_same = |(word, of): (&String, &String)| word.trim_matches(BESIDE) == of || word == of;
                window.iter().zip(&part).all(is_same)
            });
            at.inspect(|at| rest = &rest[at + part.len()..]).is_some()
        })
    })
}

/// A row of a table: its first cell, the cell of the commands, the figures that these print, and the whole line.
struct Row {
    name: String,
    commands: Vec<String>,
    figures: Vec<String>,
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
                let figures = cells.get(column + 1).map_or("", |cell| cell);
                let figures = printed(figures).map(str::to_owned).collect();
                rows.push(Row { name: cells[0].to_owned(), commands, figures, line: line.to_owned() });
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
                ["cargo", "run", "-p", package, "--example", example] => {
                    let source = format!("crates/{package}/examples/{example}.rs");
                    assert!(at(&source).exists(), "{}: there is no {source}", row.name);
                }
                _ => panic!(
                    "{}: expected `osp ...`, `cargo test ... --test TARGET NAME` or `cargo run -p PACKAGE --example NAME`: {command}",
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
    let rows = table();
    let of_osp = |command: &&String| command.starts_with("osp ");
    let commands: BTreeSet<&String> = rows.iter().flat_map(|row| &row.commands).filter(of_osp).collect();
    let mut outputs = BTreeMap::new();
    for command in commands {
        let args: Vec<&str> = command.split_whitespace().skip(1).collect();
        let output = OSP.run_in(folder.path(), &args);
        let said = stderr(&output);
        // Commands of other builds say which.
        let is_not_built = said.contains("needs a build with the feature");
        assert!(output.status.success() || is_not_built, "{command}: {said}");
        if !is_not_built {
            outputs.insert(command, stdout(&output));
        }
    }
    let with_figures: Vec<&Row> = rows.iter().filter(|row| !row.figures.is_empty()).collect();
    assert!(with_figures.len() >= 20, "{} rows say what is printed", with_figures.len());
    let mut missing = Vec::new();
    for row in with_figures {
        let of_row: Vec<_> = row.commands.iter().filter(of_osp).map(|command| outputs.get(command)).collect();
        // A figure may be that of a command that this build lacks.
        if of_row.contains(&None) {
            continue;
        }
        let is_missing = |figure: &&String| !of_row.iter().flatten().any(|output| prints(output, figure));
        missing.extend(row.figures.iter().filter(is_missing).map(|figure| format!("{}: {figure}", row.name)));
    }
    assert!(missing.is_empty(), "docs/seeds.md says what no command of the row prints: {missing:#?}");
}
