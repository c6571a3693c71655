use egui::{Button, Ui};

use super::{actions::Action, keys::SHORTCUTS, wishes::Wishes};
use crate::studio::Studio;

/// A menu entry with its shortcut.
pub(super) fn entry(
    ui: &mut Ui,
    name: &str,
    action: Action,
    studio: &Studio,
    wishes: &mut Wishes,
) -> egui::Response {
    let mut button = Button::new(name);
    if let Some(shortcut) = SHORTCUTS.iter().find(|shortcut| shortcut.action == action) {
        button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut.keys));
    }
    let response = ui.add_enabled(action.is_possible(studio), button);
    if response.clicked() {
        action.perform(studio, wishes);
        ui.close();
    }
    response
}
