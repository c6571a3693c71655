use egui::{Button, Ui};

use super::{actions::Action, keys::SHORTCUTS, panel_commands::PanelCommands};
use crate::studio::Studio;

/// A menu entry with its shortcut.
pub(super) fn entry(
    ui: &mut Ui,
    name: &str,
    action: Action,
    studio: &Studio,
    panel_commands: &mut PanelCommands,
) -> egui::Response {
    let mut button = Button::new(name);
    if let Some(shortcut) = SHORTCUTS.iter().find(|shortcut| shortcut.action == action) {
        button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut.keys));
    }
    let response = ui.add_enabled(action.is_possible(studio), button);
    if response.clicked() {
        action.perform(studio, panel_commands);
        ui.close();
    }
    response
}
