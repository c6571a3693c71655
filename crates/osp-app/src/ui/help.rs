//! The list of keys, with a field to search in it, and the menu of the help.

use std::path::{Path, PathBuf};

use egui::{Align2, Frame, Grid, ModifierNames, ScrollArea, TextEdit, Ui, Window, os::OperatingSystem};

use super::{
    actions::{Action, entry},
    keys::{HINTS, Shortcut, TOPICS},
    panel_commands::PanelCommands,
};
use crate::{command::Command, studio::Studio};

/// The introduction in a new window, which is also the beginning of the help.
pub(super) const LESSON: [&str; 5] = [
    "1  Drag with the left button to draw; Shift makes it straight. Without tools, press 1 first.",
    "2  Drag with the right button to orbit; turn the wheel to come nearer.",
    "3  Choose tools, brushes and colours on the left. Ctrl+Z undoes the last step.",
    "4  Press V and click strokes to move, turn, scale or recolour them.",
    "5  The drawing is saved as you draw; Ctrl+S gives it a name. F1: these steps and all keys.",
];

/// Width of the help's two lists side by side, points.
const WIDTH: f32 = 1080.0;

#[derive(Debug, Default)]
pub(super) struct Help {
    wanted: String,
}

impl Help {
    pub(super) fn show(&mut self, ui: &Ui, is_open: &mut bool) {
        Window::new("Keys and pointer")
            .open(is_open)
            .collapsible(false)
            .resizable(false)
            .frame(Frame::window(ui.style()))
            .anchor(Align2::CENTER_CENTER, egui::Vec2::ZERO)
            .show(ui.ctx(), |ui| {
                // In a small window the two lists are stacked, and scroll.
                let room = ui.ctx().content_rect().size() - egui::vec2(60.0, 90.0);
                let is_wide = room.x > WIDTH;
                ui.set_width(if is_wide { WIDTH } else { room.x.min(WIDTH * 0.56) });
                ui.spacing_mut().scroll = egui::style::ScrollStyle::solid();
                let search = TextEdit::singleline(&mut self.wanted).hint_text("search the keys");
                ui.add(search.desired_width(240.0));
                ScrollArea::vertical().max_height(room.y).show(ui, |ui| self.lists(ui, is_wide));
            });
    }

    fn lists(&self, ui: &mut Ui, is_wide: bool) {
        let wanted = self.wanted.trim().to_lowercase();
        if wanted.is_empty() {
            LESSON.iter().for_each(|line| drop(ui.label(*line)));
            ui.separator();
        }
        match is_wide {
            true => ui.columns(2, |columns| {
                pointer_hints(&mut columns[0], &wanted);
                for (i, topic) in TOPICS.iter().enumerate() {
                    keys_of(&mut columns[i * 2 / TOPICS.len()], topic, &wanted);
                }
            }),
            false => {
                pointer_hints(ui, &wanted);
                TOPICS.iter().for_each(|topic| keys_of(ui, topic, &wanted));
            }
        }
    }
}

fn list(ui: &mut Ui, heading: &str, entries: &[(String, &str)]) {
    if entries.is_empty() {
        return;
    }
    ui.add_space(6.0);
    ui.weak(heading);
    Grid::new(heading).num_columns(2).show(ui, |ui| {
        for (how, what) in entries {
            ui.strong(how);
            ui.label(*what);
            ui.end_row();
        }
    });
}

fn fits(wanted: &str, how: &str, what: &str) -> bool {
    how.to_lowercase().contains(wanted) || what.to_lowercase().contains(wanted)
}

fn pointer_hints(ui: &mut Ui, wanted: &str) {
    let hints = HINTS.iter().filter(|(how, what)| fits(wanted, how, what));
    list(ui, "Pointer", &hints.map(|(how, what)| ((*how).to_owned(), *what)).collect::<Vec<_>>());
}

fn keys_of(ui: &mut Ui, (topic, shortcuts): &(&str, &[Shortcut]), wanted: &str) {
    let is_mac = ui.os() == OperatingSystem::Mac;
    let entries = shortcuts.iter().map(|shortcut| (name_of(shortcut, is_mac), shortcut.what));
    list(ui, topic, &entries.filter(|(how, what)| fits(wanted, how, what)).collect::<Vec<_>>());
}

/// The keys of a shortcut: `Ctrl+[`.
fn name_of(shortcut: &Shortcut, is_mac: bool) -> String {
    let key = shortcut.keys.logical_key.symbol_or_name();
    match ModifierNames::NAMES.format(&shortcut.keys.modifiers, is_mac) {
        modifiers if modifiers.is_empty() => key.to_owned(),
        modifiers => format!("{modifiers}+{key}"),
    }
}

pub(super) fn menu(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    entry(ui, "Keys and pointer", Action::ToggleHelp, studio, panel_commands);
    // The page has its own list of samples.
    if cfg!(not(target_arch = "wasm32")) {
        ui.menu_button("Samples", |ui| {
            let samples = samples();
            if samples.is_empty() {
                ui.weak(
                    "this installation has no samples: the packages of osp have them in share/osp/recordings",
                );
            }
            for path in samples {
                let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                if ui.button(name).clicked() {
                    panel_commands.commands.push(Command::PlayFile(path));
                }
            }
        });
    }
    ui.separator();
    ui.weak(concat!("osp ", env!("CARGO_PKG_VERSION")));
    ui.weak("all commands: osp --help");
}

/// The sessions that an installation brings, or that lie beside the program's sources.
fn samples() -> Vec<PathBuf> {
    let program = std::env::current_exe().unwrap_or_default();
    let folder = program.parent().unwrap_or(Path::new(""));
    let places =
        ["../share/osp/recordings", "recordings", "../../recordings"].map(|place| folder.join(place));
    let of = |place: &PathBuf| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(place).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path());
        paths.filter(|path| path.extension().is_some_and(|ending| ending == "ron")).collect()
    };
    let mut found = places.iter().map(of).find(|found| !found.is_empty()).unwrap_or_default();
    found.sort();
    found
}
