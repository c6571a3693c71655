use std::path::{Path, PathBuf};

use egui::{RichText, Ui};

use super::{
    actions::{Action, entry},
    panel_commands::PanelCommands,
};
use crate::{command::Command, journal::Autosave, settings::Settings, studio::Studio};
use osp_session::platform::fs;

/// Largest number of autosave files in the list.
const MOST_AUTOSAVES: usize = 12;

/// The recent sessions: named sessions, and autosave files.
#[derive(Debug, Default)]
pub(super) struct RecentList {
    autosaves: Vec<Autosave>,
    /// The last layout pass in which the list was shown.
    shown_in: Option<u64>,
    /// The session that was open in that pass; it is not listed.
    open: PathBuf,
}

impl RecentList {
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        settings: &Settings,
        studio: &Studio,
        panel_commands: &mut PanelCommands,
    ) {
        self.refresh(ui.ctx().cumulative_pass_nr(), studio);
        let is_any = !settings.recent.is_empty() || !self.autosaves.is_empty();
        ui.add_enabled_ui(is_any, |ui| {
            ui.menu_button("Open recent", |ui| {
                self.named(ui, settings, studio, panel_commands);
                self.without_name(ui, studio, panel_commands);
            });
        });
    }

    /// Reads the list of autosave files when the menu opens, not in every frame.
    fn refresh(&mut self, pass: u64, studio: &Studio) {
        let session = studio.session();
        let open = if session.is_replay() { Path::new("") } else { session.path() };
        // A frame may have several layout passes.
        let is_still_open = self.shown_in.is_some_and(|shown| pass.saturating_sub(shown) <= 3);
        self.shown_in = Some(pass);
        if is_still_open && open == self.open {
            return;
        }
        self.autosaves = studio.autosaves.last(MOST_AUTOSAVES + 1);
        self.autosaves.retain(|autosave| autosave.path() != open);
        self.autosaves.truncate(MOST_AUTOSAVES);
        open.clone_into(&mut self.open);
    }

    fn named(&self, ui: &mut Ui, settings: &Settings, studio: &Studio, panel_commands: &mut PanelCommands) {
        for path in &settings.recent {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let action = Action::Do(Command::Open(path.clone()));
            // A missing file is disabled, because it would be opened as an empty session.
            ui.add_enabled_ui(fs::is_there(path), |ui| {
                entry(ui, &name, action, studio, panel_commands)
                    .on_hover_text(path.display().to_string())
                    .on_disabled_hover_text(format!("{}: the file is gone", path.display()));
            });
        }
    }

    fn without_name(&self, ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
        if self.autosaves.is_empty() {
            return;
        }
        ui.separator();
        ui.label(RichText::new("Autosaved").weak())
            .on_hover_text(format!("all of them are in {}", studio.autosaves.folder().display()));
        for autosave in &self.autosaves {
            let action = Action::Do(Command::Open(autosave.path().to_owned()));
            entry(ui, &autosave.to_string(), action, studio, panel_commands)
                .on_hover_text(autosave.path().display().to_string());
        }
    }
}
