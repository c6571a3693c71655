use egui::{Button, Ui};

use crate::{
    command::Command,
    drawing_aids::Aids,
    layers::LayerChoice,
    occlusion_steps::StepsEdit,
    studio::Studio,
    ui::{
        keys::SHORTCUTS,
        numbers,
        panel_commands::{PanelCommands, PathPurpose},
    },
};
use osp_rivals::IndexKind;

/// Action of a key, a menu entry or a button.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// A command that needs no dialog.
    Do(Command),
    /// Freeze or release the culling camera.
    ToggleFreeze,
    /// Change to the next index in the list.
    NextIndex,
    /// Change to the next occlusion culling method in the list.
    NextOcclusion,
    /// Save the session in its file. For an unnamed session a dialog opens.
    Save,
    /// Open the dialog to open a session.
    AskOpen,
    /// Open the dialog to save the session under a path.
    AskSaveAs,
    /// Open the dialog to export the model.
    AskExport,
    /// Open the dialog to export the model as a sketch of Tilt Brush.
    AskExportTilt,
    /// Open the dialog to save a film.
    AskFilm,
    /// Open the dialog to save a picture.
    AskPicture,
    /// Open or close the list of brushes.
    ToggleBrushes,
    /// Replay: play or pause.
    TogglePlay,
    /// Show or hide the panel with times, counts and switches.
    TogglePanel,
    /// Switch between the picture and the depth pyramid.
    TogglePyramid,
    /// Show or hide occlusion culling step by step.
    ToggleSteps,
    /// Switch between straight lines and freehand.
    ToggleStraight,
    /// Switch the mirror on or off.
    ToggleMirror,
    /// Switch between a brush width in pixels and in metres.
    ToggleScreenWidth,
    /// Show or hide the list of shortcuts.
    ToggleHelp,
    /// Enter or leave full screen.
    ToggleFullscreen,
    /// Close the help; else cancel the background work, the stroke or the movement; else clear the selection; else
    /// leave full screen.
    Escape,
}

impl Action {
    /// Whether the action would have an effect now; otherwise its key and its menu entry are disabled.
    pub fn is_possible(&self, studio: &Studio) -> bool {
        match self {
            Self::Do(command) => studio.can(command),
            Self::Save => studio.can(&Command::Save),
            Self::AskSaveAs => studio.can(&Command::SaveAs(Default::default())),
            Self::AskExport | Self::AskExportTilt | Self::AskPicture => studio.scene().counts().visible > 0,
            Self::AskFilm => studio.makes_films() && studio.scene().counts().visible > 0,
            Self::ToggleBrushes | Self::ToggleStraight | Self::ToggleMirror | Self::ToggleScreenWidth => {
                studio.can_draw()
            }
            Self::TogglePlay => studio.session().is_replay(),
            _ => true,
        }
    }

    /// Performs the action, or queues it until all panels are laid out.
    pub(super) fn perform(&self, studio: &Studio, panel_commands: &mut PanelCommands) {
        if !self.is_possible(studio) {
            return;
        }
        match self {
            Self::Do(command) => panel_commands.commands.push(command.clone()),
            Self::ToggleFreeze => panel_commands.commands.push(Command::Freeze(!studio.is_frozen())),
            Self::NextIndex => {
                let next = next_of(IndexKind::ALL, studio.culling().kind());
                panel_commands.commands.push(Command::Index(next));
            }
            Self::NextOcclusion => {
                let next = next_of(&numbers::sound_occlusion(), studio.culling().occlusion());
                panel_commands.commands.push(Command::Occlusion(next));
            }
            Self::Save if studio.session().journal().is_named() && !studio.session().is_read_only() => {
                panel_commands.commands.push(Command::Save);
            }
            Self::Save => panel_commands.ask = Some(PathPurpose::SaveAs),
            Self::AskOpen => panel_commands.ask = Some(PathPurpose::Open),
            Self::AskSaveAs => panel_commands.ask = Some(PathPurpose::SaveAs),
            Self::AskExport => panel_commands.ask = Some(PathPurpose::Export),
            Self::AskExportTilt => panel_commands.ask = Some(PathPurpose::ExportTilt),
            Self::AskFilm => panel_commands.ask = Some(PathPurpose::Film),
            Self::AskPicture => panel_commands.ask = Some(PathPurpose::Picture),
            Self::TogglePlay => {
                if let Some(replay) = studio.session().replay() {
                    panel_commands.commands.push(Command::Play(!replay.is_playing()));
                }
            }
            Self::TogglePyramid => {
                let layers = studio.layers();
                panel_commands
                    .commands
                    .push(Command::Layers(LayerChoice { pyramid: !layers.pyramid, ..layers }));
            }
            Self::ToggleSteps => {
                panel_commands.commands.push(Command::Steps(StepsEdit::Show(studio.steps().is_none())));
            }
            Self::ToggleStraight => {
                let aids = studio.aids();
                panel_commands.commands.push(Command::Aids(Aids { straight: !aids.straight, ..aids }));
            }
            Self::ToggleMirror => {
                let aids = studio.aids();
                let mirror_x = if aids.mirror_x.is_none() { Some(0.0) } else { None };
                panel_commands.commands.push(Command::Aids(Aids { mirror_x, ..aids }));
            }
            Self::ToggleScreenWidth => {
                let aids = studio.aids();
                let width_px = if aids.width_px.is_none() { Some(studio.width_px()) } else { None };
                panel_commands.commands.push(Command::Aids(Aids { width_px, ..aids }));
            }
            Self::ToggleBrushes => panel_commands.brushes = true,
            Self::TogglePanel => panel_commands.panel = !panel_commands.panel,
            Self::ToggleHelp => panel_commands.help = !panel_commands.help,
            Self::ToggleFullscreen => panel_commands.fullscreen = !panel_commands.fullscreen,
            Self::Escape if panel_commands.help => panel_commands.help = false,
            Self::Escape if studio.is_working() => panel_commands.commands.push(Command::CancelWork),
            Self::Escape if studio.is_dragging() => panel_commands.commands.push(Command::CancelGesture),
            Self::Escape if !studio.selection().is_empty() => {
                panel_commands.commands.push(Command::SelectNone)
            }
            Self::Escape => panel_commands.fullscreen = false,
        }
    }
}

/// The entry after `now`, or the first entry if `now` is the last.
fn next_of<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let next = all.iter().position(|&one| one == now).map_or(0, |at| at + 1);
    all.get(next).or(all.first()).copied().unwrap_or(now)
}

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
