//! Writes results to standard output and remarks to standard error. Names and titles come from files that others made:
//! control characters are shown as `\u001b`.

use std::{
    borrow::Cow,
    io::{self, Write},
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use anyhow::Context;
use comfy_table::{CellAlignment, Table, presets};

use super::progress;
pub(super) use osp_lab::report::one_line;
use osp_lab::report::printable;

/// The result of a command that ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    Done,
    CheckFailed,
}

/// Whether an output file is written to standard output, so that results must not go there.
static HOLDS_A_FILE: AtomicBool = AtomicBool::new(false);

/// Sends results to standard error from now on, because an output (`--csv -`) is written to standard output.
pub(super) fn keep_standard_output_for_a_file() {
    HOLDS_A_FILE.store(true, Ordering::Relaxed);
}

/// Returns the number of characters in a line of the terminal: the variable `COLUMNS`, else the width of the terminal.
/// `None` if both are missing.
pub(super) fn columns() -> Option<u16> {
    let said = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    said.filter(|columns| *columns > 0).or_else(|| Some(console::Term::stdout().size_checked()?.1))
}

pub(super) fn file_name(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy()
}

/// Writes a result, with a line end.
pub(super) fn print_result(text: &str) -> anyhow::Result<()> {
    if HOLDS_A_FILE.load(Ordering::Relaxed) {
        warn_lines(text);
        return Ok(());
    }
    let text = printable(text);
    let write = || {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.write_all(b"\n")).and_then(|()| out.flush())
    };
    match progress::aside(write) {
        // The reader has closed the pipe (`osp replay … | head`). The checks still decide the exit code.
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome.context("standard output"),
    }
}

/// Writes a remark in one line. Ignores errors, such as a closed standard error.
pub(super) fn warn(text: &str) {
    warn_lines(&one_line(text));
}

/// Writes a remark of several lines.
pub(super) fn warn_lines(text: &str) {
    let _ = progress::aside(|| writeln!(io::stderr().lock(), "{}", printable(text)));
}

/// Returns an indented table without rules. All columns but the first and the last are numbers.
pub(super) fn table(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING);
    table.set_header(header);
    for row in rows {
        table.add_row(row);
    }
    for column in table.column_iter_mut().skip(1).take(header.len() - 2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string().lines().map(|line| format!("   {}", line.trim_end())).collect::<Vec<_>>().join("\n")
}
