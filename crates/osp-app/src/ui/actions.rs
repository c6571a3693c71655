use egui::{Button, Ui};

use crate::{
    command::Command,
    drawing_aids::Aids,
    layers::LayerChoice,
    studio::Studio,
    ui::{
        keys, numbers,
        panel_commands::{PanelCommands, PathPurpose},
    },
};
use osp_rivals::IndexKind;

/// Action of a key, a menu entry or a button. The table of [`keys`] describes them.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    /// A command that needs no dialog.
    Do(Command),
    /// Open the dialog for a file.
    Ask(PathPurpose),
    ToggleFreeze,
    NextIndex,
    NextOcclusion,
    /// Save the session in its file. For an unnamed session a dialog opens.
    Save,
    ToggleBrushes,
    TogglePlay,
    TogglePanel,
    TogglePyramid,
    ToggleStraight,
    ToggleMirror,
    ToggleScreenWidth,
    ToggleHelp,
    ToggleFullscreen,
    /// Close the help; else cancel the background work, the stroke or the movement; else clear the selection; else
    /// leave full screen.
    Escape,
}

impl Action {
    /// Whether the action would have an effect now; otherwise its key and its menu entry are disabled.
    pub(super) fn is_possible(&self, studio: &Studio) -> bool {
        let has_model = studio.scene().counts().visible > 0;
        match self {
            Self::Do(command) => studio.can(command),
            Self::Save | Self::Ask(PathPurpose::SaveAs) => studio.can(&Command::Save),
            Self::Ask(PathPurpose::Open) => true,
            Self::Ask(PathPurpose::Film) => studio.makes_films() && has_model,
            Self::Ask(_) => has_model,
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
        let (aids, layers) = (studio.aids(), studio.layers());
        let command = match self {
            Self::Do(command) => command.clone(),
            Self::ToggleFreeze => Command::Freeze(!studio.is_frozen()),
            Self::NextIndex => Command::Index(next_of(IndexKind::ALL, studio.culling().plan.kind)),
            Self::NextOcclusion => {
                Command::Occlusion(next_of(&numbers::sound_occlusion(), studio.culling().plan.occlusion))
            }
            Self::Save if studio.session().journal().is_named() && !studio.session().is_read_only() => {
                Command::Save
            }
            Self::TogglePlay => {
                Command::Play(!studio.session().replay().is_some_and(|replay| replay.is_playing()))
            }
            Self::TogglePyramid => Command::Layers(LayerChoice { pyramid: !layers.pyramid, ..layers }),
            Self::ToggleStraight => Command::Aids(Aids { straight: !aids.straight, ..aids }),
            Self::ToggleMirror => {
                let mirror_x = if aids.mirror_x.is_none() { Some(0.0) } else { None };
                Command::Aids(Aids { mirror_x, ..aids })
            }
            Self::ToggleScreenWidth => {
                let width_px = if aids.width_px.is_none() { Some(studio.width_px()) } else { None };
                Command::Aids(Aids { width_px, ..aids })
            }
            Self::Escape if panel_commands.help => return panel_commands.help = false,
            Self::Escape if studio.is_working() => Command::CancelWork,
            Self::Escape if studio.is_dragging() => Command::CancelGesture,
            Self::Escape if !studio.selection().is_empty() => Command::SelectNone,
            Self::Escape => return panel_commands.fullscreen = false,
            Self::Save => return panel_commands.ask = Some(PathPurpose::SaveAs),
            Self::Ask(purpose) => return panel_commands.ask = Some(*purpose),
            Self::ToggleBrushes => return panel_commands.brushes = true,
            Self::TogglePanel => return panel_commands.panel = !panel_commands.panel,
            Self::ToggleHelp => return panel_commands.help = !panel_commands.help,
            Self::ToggleFullscreen => return panel_commands.fullscreen = !panel_commands.fullscreen,
        };
        panel_commands.commands.push(command);
    }
}

/// The entry after `now`, or the first entry if `now` is the last.
fn next_of<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let next = all.iter().position(|&one| one == now).map_or(0, |at| at + 1);
    all.get(next).or(all.first()).copied().unwrap_or(now)
}

pub(super) fn entry(
    ui: &mut Ui,
    name: &str,
    action: Action,
    studio: &Studio,
    panel_commands: &mut PanelCommands,
) -> egui::Response {
    let mut button = Button::new(name);
    if let Some(shortcut) = keys::shortcuts().find(|shortcut| shortcut.action == action) {
        button = button.shortcut_text(ui.ctx().format_shortcut(&shortcut.keys));
    }
    let response = ui.add_enabled(action.is_possible(studio), button);
    if response.clicked() {
        action.perform(studio, panel_commands);
        ui.close();
    }
    response
}
