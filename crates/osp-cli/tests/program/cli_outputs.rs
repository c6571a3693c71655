//! What the program writes: nothing is replaced unasked, every file is whole or not there, and what cannot be used is
//! refused before the work, in one clear line.
#![cfg_attr(feature = "render", expect(clippy::print_stderr, reason = "a test that is left out says why"))]

mod arguments;
pub(super) mod built;
mod command;
mod converting;
mod cost;
#[cfg(feature = "bench")]
mod draw_index;
#[cfg(feature = "bench")]
mod draw_occlusion;
mod export_times;
mod exporting;
mod groups_whole;
mod index_settings;
mod messages;
mod naming;
mod occlusion_options;
mod pvs;
mod query;
mod rigs;
#[cfg(unix)]
mod table;
mod terminal;
mod verify_all;
mod whole;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Output,
};

use osp_testkit::{names, stderr, stdout};

/// A session of a few strokes; `y` makes several differ.
fn session_text(y: f32) -> String {
    strokes_text(3, 20, y)
}

pub(crate) fn strokes_text(strokes: u16, points: u16, y: f32) -> String {
    let mut text = String::from("Header(format: 1, name: \"small\", source: \"test\")\n");
    for stroke in 0..strokes {
        text += &format!(
            "Begin(t: 0.0, stroke: {stroke}, tool: Ribbon, width: 0.05, color: (1.0, 0.5, 0.2, 1.0), thinnest: 1.0)\n"
        );
        for i in 0..points {
            let (x, t) = (f32::from(i) * 0.02, f64::from(stroke) + f64::from(i) * 0.011);
            text += &format!(
                "Point(t: {t}, stroke: {stroke}, p: ({x}, {}, {}))\n",
                y + f32::from(stroke) * 0.1,
                x * x
            );
        }
        text += &format!("End(t: 0.0, stroke: {stroke})\n");
    }
    text
}

fn write_session(folder: &Path, name: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, session_text(name.len() as f32)).expect("a temporary folder can be written");
    path
}

/// That a command ended with 2, printed nothing but one line, and that says all of `words`.
fn assert_refused(output: &Output, words: &[&str]) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.starts_with("error: ") && said.lines().count() == 1, "{said}");
    assert!(words.iter().all(|word| said.contains(word)), "{words:?}: {said}");
    assert_eq!(stdout(output), "");
}
