use std::{
    path::PathBuf,
    sync::mpsc::{Receiver, TryRecvError},
    time::Duration,
};

use egui::{
    Align2, Context, Key, RichText, TextEdit, Window,
    text::{CCursor, CCursorRange},
};

use super::panel_commands::{ALARM, PathPurpose};
use crate::{command::Command, studio::Studio, working::ExportKind};
use osp_session::platform::fs;

/// Whether the system's dialog requires a confirmation before a file is replaced. The dialogs of Windows and macOS do.
/// For a desktop portal this is unknown, so osp then shows its own question.
const SYSTEM_CONFIRMS: bool = cfg!(any(windows, target_os = "macos"));

/// A person needs longer to cancel the system's dialog: an earlier end means that there was none.
const QUICKEST: Duration = Duration::from_millis(300);

/// The words of a dialog for a file, and the files that the system's dialog shows.
struct Words {
    title: &'static str,
    verb: &'static str,
    hint: &'static str,
    /// The name of the filter, and the endings. The first ending is added to a name without one.
    files: (&'static str, &'static [&'static str]),
}

impl PathPurpose {
    fn words(self) -> Words {
        let (title, verb, hint, files): (_, _, _, (_, &[_])) = match self {
            Self::Open => {
                let endings = &["ron", "zst", "tilt", "apa", "json", "poses", "obj", "gz", "glb", "gltf"];
                let hint = ".ron .tilt .apa .json .poses .obj .glb .gltf";
                ("Open a session", "Open", hint, ("sessions", endings))
            }
            Self::SaveAs => ("Save as", "Save", "session.ron", ("recording", &["ron"])),
            Self::Export => ("Export glTF", "Export", "model.glb", ("binary glTF", &["glb"])),
            Self::ExportTilt => {
                ("Export a sketch (.tilt)", "Export", "sketch.tilt", ("Tilt Brush", &["tilt"]))
            }
            Self::Film => {
                let title = "Save a film: once around the model";
                (title, "Save", "film.mp4 .gif", ("film", &["mp4", "gif"]))
            }
            Self::Picture => ("Save a picture", "Save", "picture.png", ("picture", &["png"])),
        };
        Words { title, verb, hint, files }
    }

    fn ending(self) -> &'static str {
        self.words().files.1[0]
    }

    fn command(self, path: PathBuf) -> Command {
        match self {
            Self::Open => Command::Open(path),
            // These formats keep the model, not how it was drawn: the session itself stays where it is saved.
            Self::SaveAs if ExportKind::of(&path).is_some() => Command::Export(path),
            Self::SaveAs => Command::SaveAs(with_ending(path, self.ending())),
            Self::Picture => Command::Picture(with_ending(path, self.ending())),
            Self::Export | Self::ExportTilt | Self::Film => Command::Export(with_ending(path, self.ending())),
        }
    }

    /// The command for a path from the system's dialog, in which the user has confirmed to replace the file at this
    /// path. An added ending changes the path, which then needs a new confirmation.
    fn command_of_chosen(self, path: PathBuf) -> Command {
        let is_confirmed = SYSTEM_CONFIRMS && path.extension().is_some() && self != Self::Open;
        let command = self.command(path);
        if is_confirmed { Command::Over(Box::new(command)) } else { command }
    }
}

/// Adds the default ending to a name without an ending. The path of a folder is not changed, so that the command
/// refuses it.
fn with_ending(path: PathBuf, ending: &str) -> PathBuf {
    let is_folder = path.as_os_str().as_encoded_bytes().ends_with(b"/") || fs::is_folder(&path);
    if is_folder || path.extension().is_some() { path } else { path.with_extension(ending) }
}

/// Suggested path of a file: the session's path with the file's ending; for a copy, a file beside the original; for a
/// new session, a file in the home folder.
fn suggestion(ask: PathPurpose, studio: &Studio) -> PathBuf {
    let ending = ask.ending();
    let session = studio.session();
    let named = Some(session.path()).filter(|_| session.journal().is_named());
    match named.or(session.original()) {
        // The suggested path must not replace the sketch that was opened.
        Some(path)
            if path.extension().is_some_and(|own| own == ending)
                && (named.is_none() || session.is_read_only()) =>
        {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            path.with_file_name(format!("{stem}-copy.{ending}"))
        }
        Some(path) => path.with_extension(ending),
        None => std::env::home_dir().unwrap_or_default().join("sketch").with_extension(ending),
    }
}

/// A path from typed text; `~` means the home folder.
fn at_home(text: &str) -> PathBuf {
    match (text.strip_prefix('~'), std::env::home_dir()) {
        (Some(rest), Some(home)) if rest.is_empty() || rest.starts_with(['/', '\\']) => {
            home.join(rest.trim_start_matches(['/', '\\']))
        }
        _ => PathBuf::from(text),
    }
}

/// Selects the whole text of a text field, so that typing replaces it.
fn select_all(ctx: &Context, edit: egui::Id, text: &str) {
    let mut state = TextEdit::load_state(ctx, edit).unwrap_or_default();
    let end = CCursor::new(text.chars().count());
    state.cursor.set_char_range(Some(CCursorRange::two(CCursor::new(0), end)));
    state.store(ctx, edit);
}

/// A dialog for a path, which is typed, or chosen in the system's dialog if there is one.
#[derive(Debug)]
pub(super) struct PathDialog {
    ask: PathPurpose,
    text: String,
    is_new: bool,
    /// Reason of the last failure.
    reason: Option<String>,
    /// The path from the system's dialog, and the time until it came.
    chosen: Option<Receiver<(Option<PathBuf>, Duration)>>,
}

#[derive(Debug, PartialEq)]
pub(super) enum Answer {
    StillOpen,
    Closed,
    Chosen(Command),
}

impl PathDialog {
    /// A dialog with a suggested path. To open a session, the path is empty at first.
    pub(super) fn new(ask: PathPurpose, studio: &Studio) -> Self {
        let text = match ask {
            PathPurpose::Open => String::new(),
            _ => suggestion(ask, studio).display().to_string(),
        };
        Self { ask, text, is_new: true, reason: None, chosen: None }
    }

    /// Moves the keyboard focus to the path's field in the next frame.
    pub(super) fn take_keyboard(&mut self) {
        self.is_new = true;
    }

    /// Keeps the dialog open after a failure and shows the reason.
    pub(super) fn fail(&mut self, reason: String) {
        (self.reason, self.is_new) = (Some(reason), true);
    }

    pub(super) fn show(&mut self, ctx: &Context) -> Answer {
        if let Some(answer) = self.take_chosen() {
            return answer;
        }
        let mut is_open = true;
        let mut is_done = false;
        let mut is_cancelled = false;
        let Words { title, verb, hint, .. } = self.ask.words();
        Window::new(title)
            .open(&mut is_open)
            .collapsible(false)
            .resizable(false)
            .anchor(Align2::CENTER_CENTER, egui::Vec2::ZERO)
            .show(ctx, |ui| {
                let label = ui.label("Path");
                let edit = TextEdit::singleline(&mut self.text).desired_width(420.0).hint_text(hint);
                let response = ui.add(edit).labelled_by(label.id);
                if std::mem::take(&mut self.is_new) {
                    response.request_focus();
                    select_all(ui.ctx(), response.id, &self.text);
                }
                if let Some(reason) = &self.reason {
                    ui.set_max_width(response.rect.width());
                    ui.label(RichText::new(reason).color(ALARM));
                }
                is_done |= response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
                is_cancelled |= ui.input(|input| input.key_pressed(Key::Escape));
                ui.horizontal(|ui| {
                    is_done |= ui.button(verb).clicked();
                    // The browser's own dialog can only open files, not choose a name.
                    let can_browse = cfg!(not(target_arch = "wasm32")) || self.ask == PathPurpose::Open;
                    let browse = egui::Button::new("Browse…");
                    if can_browse && ui.add_enabled(self.chosen.is_none(), browse).clicked() {
                        self.browse(ui.ctx().clone());
                    }
                    is_cancelled |= ui.button("Cancel").clicked();
                });
            });
        let text = self.text.trim();
        if is_done && !text.is_empty() {
            self.reason = None;
            return Answer::Chosen(self.ask.command(at_home(text)));
        }
        if is_open && !is_cancelled { Answer::StillOpen } else { Answer::Closed }
    }

    /// Returns the answer with the path that was chosen in the system's dialog. If the user cancels the system's
    /// dialog, this dialog stays open.
    fn take_chosen(&mut self) -> Option<Answer> {
        match self.chosen.as_ref()?.try_recv() {
            Ok((Some(path), _)) => {
                (self.chosen, self.reason) = (None, None);
                self.text = path.display().to_string();
                Some(Answer::Chosen(self.ask.command_of_chosen(path)))
            }
            Err(TryRecvError::Empty) => None,
            answer => {
                self.chosen = None;
                // A thread that stopped had no dialog, either.
                if answer.is_err() || answer.is_ok_and(|(_, after)| after < QUICKEST) {
                    self.reason = Some(
                        "this system shows no dialog for files (it has no desktop portal): type the path"
                            .to_owned(),
                    );
                }
                None
            }
        }
    }

    /// Requests the browser's file dialog from the page, which then opens the chosen files.
    #[cfg(target_arch = "wasm32")]
    fn browse(&mut self, _: Context) {
        crate::page::ask_for_file();
    }

    /// Opens the system's dialog on a separate thread, because the dialog blocks.
    #[cfg(not(target_arch = "wasm32"))]
    fn browse(&mut self, ctx: Context) {
        let (sender, chosen) = std::sync::mpsc::channel();
        let ask = self.ask;
        let dialog = move || {
            let since = std::time::Instant::now();
            let Words { title, files: (name, endings), .. } = ask.words();
            let dialog = rfd::FileDialog::new().set_title(title).add_filter(name, endings);
            let path = if ask == PathPurpose::Open { dialog.pick_file() } else { dialog.save_file() };
            // The receiver is gone if the window was closed meanwhile.
            let _ = sender.send((path, since.elapsed()));
            ctx.request_repaint();
        };
        if cfg!(target_os = "macos") {
            // On macOS a dialog must run on the main thread.
            dialog();
        } else {
            std::thread::spawn(dialog);
        }
        self.chosen = Some(chosen);
    }
}
