use super::{
    numbers,
    wishes::{Ask, Wishes},
};
use crate::{
    command::Command, drawing_aids::Aids, layers::LayerChoice, occlusion_steps::StepsEdit, studio::Studio,
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
    /// Open the dialog to save a picture.
    AskPicture,
    /// Open or close the list of brushes.
    ToggleBrushes,
    /// Replay: play or pause.
    TogglePlay,
    /// Show or hide the panel with times, counts and switches.
    TogglePanel,
    /// Show the depth pyramid instead of the picture, or the picture.
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
    /// Close the topmost of these: the help, the background work, the selection, full screen.
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
            Self::ToggleBrushes | Self::ToggleStraight | Self::ToggleMirror | Self::ToggleScreenWidth => {
                studio.can_draw()
            }
            Self::TogglePlay => studio.session().is_replay(),
            _ => true,
        }
    }

    /// Performs the action, or queues it until all panels are laid out.
    pub(super) fn perform(&self, studio: &Studio, wishes: &mut Wishes) {
        if !self.is_possible(studio) {
            return;
        }
        match self {
            Self::Do(command) => wishes.commands.push(command.clone()),
            Self::ToggleFreeze => wishes.commands.push(Command::Freeze(!studio.is_frozen())),
            Self::NextIndex => {
                let next = next_of(IndexKind::ALL, studio.culling().kind());
                wishes.commands.push(Command::Index(next));
            }
            Self::NextOcclusion => {
                let next = next_of(&numbers::sound_occlusion(), studio.culling().occlusion());
                wishes.commands.push(Command::Occlusion(next));
            }
            Self::Save if studio.session().journal().is_named() && !studio.session().is_read_only() => {
                wishes.commands.push(Command::Save);
            }
            Self::Save => wishes.ask = Some(Ask::SaveAs),
            Self::AskOpen => wishes.ask = Some(Ask::Open),
            Self::AskSaveAs => wishes.ask = Some(Ask::SaveAs),
            Self::AskExport => wishes.ask = Some(Ask::Export),
            Self::AskExportTilt => wishes.ask = Some(Ask::ExportTilt),
            Self::AskPicture => wishes.ask = Some(Ask::Picture),
            Self::TogglePlay => {
                if let Some(replay) = studio.session().replay() {
                    wishes.commands.push(Command::Play(!replay.is_playing()));
                }
            }
            Self::TogglePyramid => {
                let layers = studio.layers();
                wishes.commands.push(Command::Layers(LayerChoice { pyramid: !layers.pyramid, ..layers }));
            }
            Self::ToggleSteps => {
                wishes.commands.push(Command::Steps(StepsEdit::Show(studio.steps().is_none())));
            }
            Self::ToggleStraight => {
                let aids = studio.aids();
                wishes.commands.push(Command::Aids(Aids { straight: !aids.straight, ..aids }));
            }
            Self::ToggleMirror => {
                let aids = studio.aids();
                let mirror_x = if aids.mirror_x.is_none() { Some(0.0) } else { None };
                wishes.commands.push(Command::Aids(Aids { mirror_x, ..aids }));
            }
            Self::ToggleScreenWidth => {
                let aids = studio.aids();
                let width_px = if aids.width_px.is_none() { Some(studio.width_px()) } else { None };
                wishes.commands.push(Command::Aids(Aids { width_px, ..aids }));
            }
            Self::ToggleBrushes => wishes.brushes = true,
            Self::TogglePanel => wishes.panel = !wishes.panel,
            Self::ToggleHelp => wishes.help = !wishes.help,
            Self::ToggleFullscreen => wishes.fullscreen = !wishes.fullscreen,
            Self::Escape if wishes.help => wishes.help = false,
            Self::Escape if studio.is_working() => wishes.commands.push(Command::CancelWork),
            Self::Escape if !studio.selection().is_empty() => wishes.commands.push(Command::SelectNone),
            Self::Escape => wishes.fullscreen = false,
        }
    }
}

/// The entry after `now`; after the last one, the first.
fn next_of<T: Copy + PartialEq>(all: &[T], now: T) -> T {
    let next = all.iter().position(|&one| one == now).map_or(0, |at| at + 1);
    all.get(next).or(all.first()).copied().unwrap_or(now)
}
