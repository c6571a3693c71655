use super::dialog::Ask;
use crate::command::Command;

/// Commands that the panels asked for; they are carried out when all panels are laid out.
#[derive(Debug, Default)]
pub(super) struct Wishes {
    pub(super) commands: Vec<Command>,
    pub(super) ask: Option<Ask>,
    pub(super) panel: bool,
    pub(super) help: bool,
    pub(super) fullscreen: bool,
    /// Open the list of brushes, or close it.
    pub(super) brushes: bool,
    pub(super) follow_camera: Option<bool>,
}
