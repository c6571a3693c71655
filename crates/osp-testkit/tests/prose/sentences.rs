//! Splits Markdown and doc comments into sentences. Code blocks, headings, tables, pictures and addresses are left out.

/// A sentence, and the line on which its paragraph begins, counted from 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Sentence {
    pub(crate) line: usize,
    pub(crate) words: Vec<String>,
}

impl Sentence {
    /// Returns the sentence in its original form, with single spaces.
    pub(crate) fn text(&self) -> String {
        self.words.join(" ").replace('\u{a0}', " ")
    }
}

/// Returns the sentences of a Markdown file.
pub(crate) fn of_markdown(text: &str) -> Vec<Sentence> {
    let lines = text.lines().enumerate().map(|(index, line)| (index + 1, line));
    of_lines(lines)
}

/// Returns the sentences in the doc comments of a Rust file.
pub(crate) fn of_doc_comments(source: &str) -> Vec<Sentence> {
    let lines = source.lines().enumerate().map(|(index, line)| {
        let line = line.trim_start();
        let comment = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
        // A line of code ends a paragraph, like an empty line.
        (index + 1, comment.map_or("", |comment| comment.strip_prefix(' ').unwrap_or(comment)))
    });
    of_lines(lines)
}

fn of_lines<'a>(lines: impl Iterator<Item = (usize, &'a str)>) -> Vec<Sentence> {
    let mut sentences = Vec::new();
    let mut paragraph: Vec<(usize, &str)> = Vec::new();
    let mut in_code = false;
    for (number, line) in lines {
        let inner = line.trim();
        let is_fence = inner.starts_with("```");
        let is_indented_code = paragraph.is_empty() && line.starts_with("    ");
        let is_left_out =
            in_code || is_fence || is_indented_code || inner.starts_with('#') || inner.starts_with('|');
        in_code ^= is_fence;
        let item = list_item(inner);
        if is_left_out || inner.is_empty() || item.is_some() {
            split(&paragraph, &mut sentences);
            paragraph.clear();
        }
        if !is_left_out && !inner.is_empty() {
            paragraph.push((number, item.unwrap_or(inner)));
        }
    }
    split(&paragraph, &mut sentences);
    sentences
}

/// Returns the text after the mark of a list item.
fn list_item(line: &str) -> Option<&str> {
    let number = line.trim_start_matches(|c: char| c.is_ascii_digit());
    let numbered = if number.len() < line.len() { number.strip_prefix(". ") } else { None };
    line.strip_prefix("- ").or_else(|| line.strip_prefix("* ")).or(numbered)
}

fn split(paragraph: &[(usize, &str)], sentences: &mut Vec<Sentence>) {
    let mut words: Vec<(usize, String)> = Vec::new();
    let text: Vec<String> = paragraph.iter().map(|(number, line)| format!("\u{1}{number} {line}")).collect();
    let text = without_addresses(&with_whole_code(&text.join(" ")));
    let mut line = 0;
    for word in text.split([' ', '\t']).filter(|word| !word.is_empty()) {
        match word.strip_prefix('\u{1}') {
            Some(number) => line = number.parse().expect("a number of a line"),
            None => words.push((line, word.to_owned())),
        }
    }
    let mut start = 0;
    for end in 1..=words.len() {
        let next = words.get(end).map(|(_, word)| word.as_str());
        if ends_sentence(&words[end - 1].1, next) {
            let line = words[start].0;
            let words = words[start..end].iter().map(|(_, word)| word.clone()).collect();
            sentences.push(Sentence { line, words });
            start = end;
        }
    }
}

/// Makes one word of each code span, even of one with a line break in it.
fn with_whole_code(text: &str) -> String {
    let mut parts = text.split('`').enumerate().peekable();
    let mut whole = String::new();
    while let Some((index, part)) = parts.next() {
        if index % 2 == 1 {
            let words = part.split(' ').filter(|word| !word.starts_with('\u{1}'));
            whole.push_str(&words.collect::<Vec<_>>().join("\u{a0}"));
        } else {
            whole.push_str(part);
        }
        if parts.peek().is_some() {
            whole.push('`');
        }
    }
    whole
}

/// Keeps the text of links, and removes their addresses and all pictures.
fn without_addresses(text: &str) -> String {
    let mut kept = String::new();
    let mut rest = text;
    while let Some(middle) = rest.find("](") {
        let end = rest[middle..].find(')').map_or(rest.len(), |length| middle + length + 1);
        let start = rest[..middle].rfind('[').unwrap_or(middle);
        if rest[..start].ends_with('!') {
            kept.push_str(&rest[..start - 1]);
        } else {
            kept.push_str(&rest[..start]);
            kept.push_str(rest[start..middle].trim_start_matches('['));
        }
        rest = &rest[end..];
    }
    kept + rest
}

/// Words that end with a period in the middle of a sentence.
const ABBREVIATIONS: [&str; 5] = ["Fig.", "Figs.", "e.g.", "i.e.", "cf."];

fn ends_sentence(word: &str, next: Option<&str>) -> bool {
    let Some(next) = next else { return true };
    let bare = word.trim_end_matches([')', '"', '*', '_', '\'']);
    if bare.ends_with(':') {
        return true;
    }
    // Names that begin with a lower-case letter: `osp`, `glTF`, pages.
    let begins = !next.starts_with(|c: char| c.is_lowercase())
        || next == "osp"
        || next.contains(char::is_uppercase)
        || next.contains(".md");
    bare.ends_with(['.', '!', '?']) && begins && !ABBREVIATIONS.contains(&bare.trim_start_matches('('))
}
