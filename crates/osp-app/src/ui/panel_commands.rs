use egui::Color32;

use crate::command::Command;

/// The colour of warnings.
pub(super) const ALARM: Color32 = Color32::from_rgb(255, 120, 100);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PathPurpose {
    Open,
    SaveAs,
    Export,
    ExportTilt,
    Film,
    Picture,
}

/// Commands of the panels, which are executed after the layout.
#[derive(Debug, Default)]
pub(super) struct PanelCommands {
    pub(super) commands: Vec<Command>,
    /// The command with the path that was chosen in a dialog.
    pub(super) chosen: Option<Command>,
    pub(super) ask: Option<PathPurpose>,
    pub(super) panel: bool,
    pub(super) help: bool,
    pub(super) fullscreen: bool,
    /// Whether to open or close the list of brushes.
    pub(super) brushes: bool,
    pub(super) follow_camera: Option<bool>,
}
