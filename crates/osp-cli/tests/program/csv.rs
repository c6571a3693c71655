//! The CSV files that the program writes.

use std::{fs, path::Path};

/// The lines of a file, by column.
pub(crate) struct Lines {
    pub(crate) names: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Lines {
    pub(crate) fn read(path: impl AsRef<Path>) -> Self {
        let mut rows = cells(&fs::read_to_string(path).expect("the CSV"));
        let names = rows.remove(0);
        assert!(rows.iter().all(|row| row.len() == names.len()), "{}", names.join("|"));
        Self { names, rows }
    }

    pub(crate) fn column(&self, name: &str) -> Vec<&str> {
        let at = self.names.iter().position(|other| other == name);
        let at = at.unwrap_or_else(|| panic!("{name}: {}", self.names.join("|")));
        self.rows.iter().map(|row| row[at].as_str()).collect()
    }

    pub(crate) fn numbers(&self, name: &str) -> Vec<u64> {
        self.column(name).iter().map(|text| text.parse().expect("a number")).collect()
    }
}

/// The lines of a CSV as cells.
fn cells(csv: &str) -> Vec<Vec<String>> {
    let mut lines = vec![vec![String::new()]];
    let (mut is_quoted, mut letters) = (false, csv.chars().peekable());
    while let Some(letter) = letters.next() {
        let line = lines.last_mut().expect("a line");
        match letter {
            '"' if is_quoted && letters.next_if_eq(&'"').is_some() => {
                line.last_mut().expect("a cell").push('"')
            }
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => line.push(String::new()),
            '\n' if !is_quoted => lines.push(vec![String::new()]),
            letter => line.last_mut().expect("a cell").push(letter),
        }
    }
    lines.retain(|line| line.len() > 1);
    lines
}
