//! Checks that a reader understands each sentence of the project at the first reading. The sentences are those of
//! README, CHANGELOG, docs and doc comments. The program's help consists of doc comments.
//!
//! `counts.txt` has the number of findings of each folder. A number may only fall. `OSP_PROSE=src/index` prints the
//! findings of a folder or file, and `OSP_PROSE=lower` stores lower numbers.

mod rules;
mod sentences;

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
    fs,
    path::{Path, PathBuf},
};

use osp_testkit::{ROOT, at, packages};
use rules::{Rule, findings};
use sentences::{Sentence, of_doc_comments, of_markdown};

const COUNTS: &str = "crates/osp-testkit/tests/prose/counts.txt";

/// Number of findings by folder and rule.
type Counts = BTreeMap<(String, &'static str), usize>;

struct Found {
    file: String,
    rule: Rule,
    /// File, line, sentence and advice.
    line: String,
}

fn files_in(folder: &Path, files: &mut BTreeSet<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            files_in(&path, files);
        } else {
            files.insert(path);
        }
    }
}

/// Returns all files with prose, by their paths in the repository.
fn files() -> Vec<String> {
    let mut files = BTreeSet::from([at("README.md"), at("CHANGELOG.md")]);
    files_in(&at("docs"), &mut files);
    for package in packages() {
        files_in(&package.join("src"), &mut files);
    }
    let inner = files.iter().map(|path| path.strip_prefix(ROOT).expect("a file of the repository"));
    let names = inner.map(|path| path.to_str().expect("a name in UTF-8").to_owned());
    names.filter(|name| name.ends_with(".md") || name.ends_with(".rs")).collect()
}

/// Returns the group in which the findings of a file are counted: the page itself, or the folder of a source.
fn group(file: &str) -> String {
    if file.ends_with(".md") {
        return file.to_owned();
    }
    let (before, after) = file.split_once("src/").expect("a source file");
    match after.split_once('/') {
        Some((folder, _)) => format!("{before}src/{folder}"),
        None => format!("{before}src"),
    }
}

fn all_findings() -> Vec<Found> {
    let mut all = Vec::new();
    for file in files() {
        let text = fs::read_to_string(at(&file)).expect("a file of text");
        let sentences = if file.ends_with(".md") { of_markdown(&text) } else { of_doc_comments(&text) };
        for sentence in sentences {
            for (rule, advice) in findings(&sentence) {
                let line = format!("{file}:{}: {}\n    {advice}", sentence.line, sentence.text());
                all.push(Found { file: file.clone(), rule, line });
            }
        }
    }
    all
}

fn counted(all: &[Found]) -> Counts {
    let mut counts = Counts::new();
    for found in all {
        *counts.entry((group(&found.file), found.rule.name())).or_default() += 1;
    }
    counts
}

/// Returns the committed numbers. A folder and rule without a line have none.
fn allowed(text: &str) -> BTreeMap<(String, String), usize> {
    let lines = text.lines().map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
        [folder, rule, count] => {
            ((folder.to_owned(), rule.to_owned()), count.parse().expect("a number of findings"))
        }
        _ => panic!("{COUNTS}: expected `FOLDER RULE NUMBER`: {line}"),
    });
    lines.collect()
}

fn written(counts: &Counts) -> String {
    counts.iter().fold(String::new(), |mut text, ((folder, rule), count)| {
        writeln!(text, "{folder} {rule} {count}").expect("a string");
        text
    })
}

#[test]
fn sentences_are_understood_at_the_first_reading() {
    let all = all_findings();
    let counts = counted(&all);
    let wish = std::env::var("OSP_PROSE").unwrap_or_default();
    if !wish.is_empty() {
        for found in all.iter().filter(|found| found.file.starts_with(&wish)) {
            println!("{}", found.line);
        }
    }
    let allowed = allowed(&fs::read_to_string(at(COUNTS)).expect("a file of numbers"));
    let mut risen = String::new();
    for ((folder, rule), &count) in &counts {
        let most = allowed.get(&(folder.clone(), (*rule).to_owned())).copied().unwrap_or(0);
        if count > most {
            writeln!(risen, "{folder}: {rule}: {count} findings, at most {most} allowed").expect("a string");
            let here = all.iter().filter(|found| found.rule.name() == *rule && group(&found.file) == *folder);
            here.for_each(|found| writeln!(risen, "{}", found.line).expect("a string"));
        }
    }
    assert!(risen.is_empty(), "{risen}");
    if wish == "lower" {
        fs::write(at(COUNTS), written(&counts)).expect("a file of numbers");
        return;
    }
    let has_fallen = allowed.iter().any(|((folder, rule), &most)| {
        let count =
            counts.iter().find(|((of, by), _)| of == folder && by == rule).map_or(0, |(_, &count)| count);
        count < most
    });
    assert!(!has_fallen, "fewer findings than in {COUNTS}: lower its numbers with OSP_PROSE=lower");
}

fn sentences(text: &str) -> Vec<String> {
    of_markdown(text).iter().map(Sentence::text).collect()
}

#[test]
fn code_tables_headings_and_addresses_are_left_out() {
    let text = "# A heading\n\nOne [link](http://a.b/c.d) and\n`code. With a point`. Two: three.\n\n```sh\nosp asks\n```\n\n    \
                osp hears\n\n| what |\n| --- |\n| it says |\n\n![A picture.](a.png)\n\n- An item\n  of two lines\n1. First";
    let expected = ["One link and `code. With a point`.", "Two:", "three.", "An item of two lines", "First"];
    assert_eq!(sentences(text), expected);
}

#[test]
fn doc_comments_end_at_code_and_keep_their_lines() {
    let source = "//! A file. It has\n//! two sentences.\n\n/// Of a function\nfn f() {} // says nothing\n    /// A field.";
    let found: Vec<_> =
        of_doc_comments(source).iter().map(|sentence| (sentence.line, sentence.text())).collect();
    let expected = [(1, "A file."), (1, "It has two sentences."), (4, "Of a function"), (6, "A field.")];
    assert_eq!(found, expected.map(|(line, text)| (line, text.to_owned())));
}

#[test]
fn each_rule_finds_its_forms_and_spares_people() {
    let rules_of = |text: &str| -> Vec<Rule> {
        of_markdown(text).iter().flat_map(findings).map(|(rule, _)| rule).collect()
    };
    assert_eq!(rules_of("The index asks the tree."), [Rule::Personified]);
    assert_eq!(rules_of("What a frame took."), [Rule::Nominal]);
    assert_eq!(rules_of("That of a free slot."), [Rule::Nominal]);
    assert_eq!(rules_of("A page is thinned."), [Rule::Private]);
    assert_eq!(rules_of(&["word"; 26].join(" ")), [Rule::Long]);
    let fine =
        "Somebody who asks gets an answer. You want it. Which index is the fastest? `it says`. A known box.";
    assert_eq!(rules_of(fine), []);
    assert_eq!(rules_of(&["word"; 25].join(" ")), []);
}
