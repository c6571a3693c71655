use std::{
    path::PathBuf,
    sync::mpsc::{Receiver, TryRecvError, channel},
};

use egui::{Align2, Context, Key, TextEdit, Window};

use crate::app::command::Command;

/// Whether the system's dialog asks before a file is replaced. Those of Windows and macOS do; which one a desktop
/// portal brings up is not known, and one question too many is better than a file too few.
const ASKS_ITSELF: bool = cfg!(any(windows, target_os = "macos"));

/// The purpose of a path that the window asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ask {
    Open,
    SaveAs,
    Export,
}

impl Ask {
    fn title(self) -> &'static str {
        match self {
            Self::Open => "Open a session",
            Self::SaveAs => "Save as",
            Self::Export => "Export glTF",
        }
    }

    fn verb(self) -> &'static str {
        match self {
            Self::Open => "Open",
            Self::SaveAs => "Save",
            Self::Export => "Export",
        }
    }

    fn hint(self) -> &'static str {
        match self {
            Self::Open => ".ron .tilt .apa .json .poses .obj .glb .gltf",
            Self::SaveAs => "session.ron",
            Self::Export => "model.glb",
        }
    }

    /// The command for a path that was typed.
    fn command(self, path: PathBuf) -> Command {
        match self {
            Self::Open => Command::Open(path),
            Self::SaveAs => Command::SaveAs(with_ending(path, "ron")),
            Self::Export => Command::ExportGltf(with_ending(path, "glb")),
        }
    }

    /// The command for a path from the system's own dialog, which has asked whether to replace a file there,
    /// but not about a name whose ending is added here.
    fn command_of_chosen(self, path: PathBuf) -> Command {
        let is_whole = path.extension().is_some();
        match (self, is_whole && ASKS_ITSELF) {
            (Self::SaveAs, true) => Command::SaveOver(path),
            (Self::Export, true) => Command::ExportOver(path),
            (_, _) => self.command(path),
        }
    }
}

/// A name without an ending gets the usual one.
fn with_ending(path: PathBuf, ending: &str) -> PathBuf {
    if path.extension().is_some() { path } else { path.with_extension(ending) }
}

/// Asks for a path: typed here, or chosen in the system's own dialog where there is one.
#[derive(Debug)]
pub(super) struct PathDialog {
    ask: Ask,
    text: String,
    is_new: bool,
    chosen: Option<Receiver<Option<PathBuf>>>,
}

/// The result of a dialog.
#[derive(Debug, PartialEq)]
pub(super) enum Answer {
    StillOpen,
    Closed,
    Chosen(Command),
}

impl PathDialog {
    pub(super) fn new(ask: Ask) -> Self {
        Self { ask, text: String::new(), is_new: true, chosen: None }
    }

    pub(super) fn show(&mut self, ctx: &Context) -> Answer {
        if let Some(answer) = self.take_chosen() {
            return answer;
        }
        let mut is_open = true;
        let mut is_done = false;
        let mut is_cancelled = false;
        Window::new(self.ask.title())
            .open(&mut is_open)
            .collapsible(false)
            .resizable(false)
            .anchor(Align2::CENTER_CENTER, egui::Vec2::ZERO)
            .show(ctx, |ui| {
                let label = ui.label("Path");
                let edit =
                    TextEdit::singleline(&mut self.text).desired_width(420.0).hint_text(self.ask.hint());
                let response = ui.add(edit).labelled_by(label.id);
                if std::mem::take(&mut self.is_new) {
                    response.request_focus();
                }
                is_done |= response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
                is_cancelled |= ui.input(|input| input.key_pressed(Key::Escape));
                ui.horizontal(|ui| {
                    is_done |= ui.button(self.ask.verb()).clicked();
                    if ui.add_enabled(self.chosen.is_none(), egui::Button::new("Browse…")).clicked() {
                        self.browse(ui.ctx().clone());
                    }
                    is_cancelled |= ui.button("Cancel").clicked();
                });
            });
        let text = self.text.trim();
        if is_done && !text.is_empty() {
            return Answer::Chosen(self.ask.command(PathBuf::from(text)));
        }
        if is_open && !is_cancelled { Answer::StillOpen } else { Answer::Closed }
    }

    /// The path chosen in the system's dialog; if that is cancelled, this one stays open.
    fn take_chosen(&mut self) -> Option<Answer> {
        match self.chosen.as_ref()?.try_recv() {
            Ok(Some(path)) => Some(Answer::Chosen(self.ask.command_of_chosen(path))),
            Ok(None) | Err(TryRecvError::Disconnected) => {
                self.chosen = None;
                None
            }
            Err(TryRecvError::Empty) => None,
        }
    }

    /// The system's dialog blocks: it gets a thread of its own.
    fn browse(&mut self, ctx: Context) {
        let (sender, chosen) = channel();
        let ask = self.ask;
        let dialog = move || {
            let dialog = rfd::FileDialog::new().set_title(ask.title());
            let path = match ask {
                Ask::Open => dialog
                    .add_filter("sessions", &["ron", "zst", "tilt", "apa", "json", "poses", "obj", "gz"])
                    .pick_file(),
                Ask::SaveAs => dialog.add_filter("recording", &["ron"]).save_file(),
                Ask::Export => dialog.add_filter("binary glTF", &["glb"]).save_file(),
            };
            // Nobody listens any more if the window was closed meanwhile.
            let _ = sender.send(path);
            ctx.request_repaint();
        };
        if cfg!(target_os = "macos") {
            // There a dialog belongs to the main thread.
            dialog();
        } else {
            std::thread::spawn(dialog);
        }
        self.chosen = Some(chosen);
    }
}
