use egui::{Align, Button, Color32, Layout, MenuBar, Ui};

use super::{
    actions::{Action, entry},
    help,
    keys::{LARGER, SMALLER, TURN_LEFT, TURN_RIGHT},
    panel_commands::{PanelCommands, PathPurpose},
    recent::RecentList,
};
use crate::{
    altering::Altering,
    command::Command,
    paint_layers::LayerEdit,
    session::Opening,
    settings::{Settings, Theme},
    studio::Studio,
    tool::ToolChoice,
};

pub(super) fn show(
    ui: &mut Ui,
    studio: &Studio,
    settings: &mut Settings,
    recent: &mut RecentList,
    panel_commands: &mut PanelCommands,
) {
    MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| file(ui, studio, settings, recent, panel_commands));
        ui.menu_button("Edit", |ui| edit(ui, studio, panel_commands));
        ui.menu_button("View", |ui| view(ui, studio, settings, panel_commands));
        ui.menu_button("Help", |ui| help::menu(ui, studio, panel_commands));
    });
}

/// Buttons that switch between drawing, with tools, looking, without tools, and a replay.
pub(super) fn mode(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let session = studio.session();
    let is_looking = studio.tool() == ToolChoice::Look || session.is_replay();
    let draw = || match session.is_replay() {
        // The page has its own button, below the window.
        true if cfg!(target_arch = "wasm32") => None,
        true => {
            let how = Opening { draws: true, ..Opening::default() };
            let open = Command::OpenAs(session.path().to_owned(), how);
            Some(("Draw", "open the session to draw on it", open))
        }
        false if !studio.can_draw() => None,
        false if is_looking => {
            let tool = ToolChoice::Draw(studio.brush().tool);
            Some(("Draw", "show the tools and draw (1)", Command::Tool(tool)))
        }
        false => Some(("Look", "hide the tools and only look around (0)", Command::Tool(ToolChoice::Look))),
    };
    let play = || {
        let path = session.file_to_play()?.to_owned();
        Some(("Play", "see how it was drawn", Command::PlayFile(path)))
    };
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        for (name, hint, command) in [draw(), play()].into_iter().flatten() {
            let fill = if is_looking { ui.visuals().selection.bg_fill } else { Color32::TRANSPARENT };
            if ui.add(Button::new(name).fill(fill)).on_hover_text(hint).clicked() {
                panel_commands.commands.push(command);
            }
        }
    });
}

fn file(
    ui: &mut Ui,
    studio: &Studio,
    settings: &Settings,
    recent: &mut RecentList,
    panel_commands: &mut PanelCommands,
) {
    entry(ui, "New", Action::Do(Command::New), studio, panel_commands);
    entry(ui, "Open…", Action::Ask(PathPurpose::Open), studio, panel_commands);
    recent.show(ui, settings, studio, panel_commands);
    ui.separator();
    entry(ui, "Save", Action::Save, studio, panel_commands);
    entry(ui, "Save as…", Action::Ask(PathPurpose::SaveAs), studio, panel_commands);
    entry(ui, "Export glTF…", Action::Ask(PathPurpose::Export), studio, panel_commands);
    entry(ui, "Export .tilt…", Action::Ask(PathPurpose::ExportTilt), studio, panel_commands)
        .on_hover_text("a sketch for Tilt Brush and Open Brush");
    entry(ui, "Save picture…", Action::Ask(PathPurpose::Picture), studio, panel_commands);
    if studio.makes_films() {
        entry(ui, "Save film…", Action::Ask(PathPurpose::Film), studio, panel_commands)
            .on_hover_text("once around the model; `osp film --help` lists other films");
    }
    ui.separator();
    entry(ui, "Quit", Action::Do(Command::Quit), studio, panel_commands);
}

fn edit(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    entry(ui, "Undo", Action::Do(Command::Undo), studio, panel_commands);
    entry(ui, "Redo", Action::Do(Command::Redo), studio, panel_commands);
    ui.separator();
    entry(ui, "Cut", Action::Do(Command::Cut), studio, panel_commands);
    entry(ui, "Copy", Action::Do(Command::Copy), studio, panel_commands);
    entry(ui, "Paste", Action::Do(Command::Paste), studio, panel_commands);
    entry(ui, "Duplicate", Action::Do(Command::Duplicate), studio, panel_commands);
    entry(ui, "Erase selection", Action::Do(Command::EraseSelected), studio, panel_commands);
    entry(ui, "Group selection", Action::Do(Command::GroupSelected), studio, panel_commands);
    ui.menu_button("Change selection", |ui| {
        let alter = |altering| Action::Do(Command::Alter(altering));
        entry(ui, "Colour of the brush", alter(Altering::Color), studio, panel_commands);
        entry(ui, "Width of the brush", alter(Altering::Width), studio, panel_commands);
        entry(ui, "Turn left", Action::Do(TURN_LEFT), studio, panel_commands);
        entry(ui, "Turn right", Action::Do(TURN_RIGHT), studio, panel_commands);
        entry(ui, "Larger", Action::Do(LARGER), studio, panel_commands);
        entry(ui, "Smaller", Action::Do(SMALLER), studio, panel_commands);
        entry(ui, "Mirror", alter(Altering::Mirror), studio, panel_commands);
    });
    ui.menu_button("Drawing", |ui| {
        entry(ui, "Straight lines", Action::ToggleStraight, studio, panel_commands);
        entry(ui, "Mirror while drawing", Action::ToggleMirror, studio, panel_commands);
        entry(ui, "Width on the screen", Action::ToggleScreenWidth, studio, panel_commands);
    });
    ui.menu_button("Layer", |ui| {
        let edit = |edit| Action::Do(Command::Layer(edit));
        entry(ui, "New layer", edit(LayerEdit::New), studio, panel_commands);
        entry(ui, "Move the selection here", edit(LayerEdit::TakeSelection), studio, panel_commands);
        entry(ui, "Hide or show", edit(LayerEdit::ToggleHidden), studio, panel_commands);
        entry(ui, "Lock or unlock", edit(LayerEdit::ToggleLocked), studio, panel_commands);
    });
    ui.separator();
    entry(ui, "Select all", Action::Do(Command::SelectAll), studio, panel_commands);
    entry(ui, "Select nothing", Action::Do(Command::SelectNone), studio, panel_commands);
}

fn view(ui: &mut Ui, studio: &Studio, settings: &mut Settings, panel_commands: &mut PanelCommands) {
    entry(ui, "Whole model", Action::Do(Command::ShowAll), studio, panel_commands);
    entry(ui, "Artist's view", Action::Do(Command::ShowAsPainted), studio, panel_commands);
    ui.menu_button("Saved views", |ui| {
        for (name, of) in
            [("Go to view", Command::GoToView as fn(u32) -> Command), ("Save view", Command::KeepView)]
        {
            for slot in 0..4 {
                let name = format!("{name} {}", slot + 1);
                entry(ui, &name, Action::Do(of(slot)), studio, panel_commands);
            }
            ui.separator();
        }
    });
    entry(ui, "Full screen", Action::ToggleFullscreen, studio, panel_commands);
    let panel = if panel_commands.panel { "Hide culling panel" } else { "Show culling panel" };
    entry(ui, panel, Action::TogglePanel, studio, panel_commands);
    ui.separator();
    ui.menu_button("Theme", |ui| {
        for theme in Theme::ALL {
            ui.radio_value(&mut settings.theme, theme, theme.name());
        }
    });
    ui.menu_button("Text size", egui::gui_zoom::zoom_menu_buttons);
}
