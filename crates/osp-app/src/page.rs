//! Exchange between the window and the page around it in a browser. The page's script calls these functions; the
//! window never calls the script.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
};

use winit::event_loop::EventLoopProxy;

use super::{command::Command, studio::Studio, threads::Wake, working::ReplayStart};
use osp_session::{platform::memory, recording::Camera};

pub use osp_session::platform::USER_FOLDER;

/// A request of the page, which the next frame handles.
#[derive(Debug)]
pub enum Wish {
    /// Replay a session from the beginning.
    Replay(PathBuf),
    /// Read a session for a replay, and first show the finished model.
    Show(PathBuf),
    Do(Command),
    /// Set whether the camera follows the replay's camera.
    FollowCamera(bool),
}

#[derive(Clone, Debug, Default)]
pub struct State {
    /// Number of frames shown so far.
    pub frames: u64,
    /// Name of the graphics adapter; empty until the window is open.
    pub adapter: String,
    /// Path of the session's file.
    pub path: PathBuf,
    pub is_replay: bool,
    /// Number of played frames of a replay, or of events of a session for drawing.
    pub position: u64,
    /// Number of frames of the session.
    pub length: u64,
    /// The view of the last frame.
    pub camera: Option<Camera>,
    /// Resolution of the clock, nanoseconds.
    pub clock_step_ns: u64,
    /// Number of visible polygons of the model.
    pub polygons: u64,
    /// Number of polygons passed to the GPU in the last frame.
    pub drawn: u64,
    /// Whether the user is entering text.
    pub wants_text: bool,
    /// Latest message of the window.
    pub message: String,
    /// The file that is being read, and the progress, once reading has taken a while.
    pub work: Option<String>,
    /// Reason for which the last file was not opened.
    pub refused: Option<String>,
    /// Reason for which the window has ended.
    pub failure: Option<String>,
}

/// Input from a text field of the page. An on-screen keyboard needs such a field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Typed {
    Text(String),
    /// The key Backspace.
    Backspace,
    Enter,
}

/// Folder of opened files; each set of files has its own subfolder.
const INPUT_FOLDER: &str = "/input";
/// Number of components of a set's path: the root, this folder, and the set's number.
const SET_DEPTH: usize = 3;

#[derive(Default)]
struct Page {
    typed: Vec<Typed>,
    wake: Option<EventLoopProxy<Wake>>,
    panel_commands: Vec<Wish>,
    wants_file: bool,
    state: State,
}

thread_local! {
    static PAGE: RefCell<Page> = RefCell::default();
}

pub fn state() -> State {
    PAGE.with_borrow(|page| page.state.clone())
}

/// Stores a request for the next frame.
pub fn wish(wish: Wish) {
    PAGE.with_borrow_mut(|page| {
        page.panel_commands.push(wish);
        page.state.refused = None;
        // Before the window is open there is no receiver; the first frame then finds the request.
        let _ = page.wake.as_ref().map(|wake| wake.send_event(Wake));
    });
}

/// Passes typed input to the window.
pub fn type_in(typed: Typed) {
    PAGE.with_borrow_mut(|page| {
        page.typed.push(typed);
        let _ = page.wake.as_ref().map(|wake| wake.send_event(Wake));
    });
}

pub(super) fn take_typed(events: &mut Vec<egui::Event>) {
    let typed = PAGE.with_borrow_mut(|page| std::mem::take(&mut page.typed));
    let press = |key, pressed| egui::Event::Key {
        key,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: egui::Modifiers::NONE,
    };
    for typed in typed {
        match typed {
            Typed::Text(text) => events.push(egui::Event::Text(text)),
            Typed::Backspace => events.extend([true, false].map(|on| press(egui::Key::Backspace, on))),
            Typed::Enter => events.extend([true, false].map(|on| press(egui::Key::Enter, on))),
        }
    }
}

pub(super) fn note_text_field(is_open: bool) {
    PAGE.with_borrow_mut(|page| page.state.wants_text = is_open);
}

/// Adds a file, so that [`Wish`]es and the window's dialogs can open it.
pub fn put_file(path: &Path, bytes: Vec<u8>) {
    memory::put(path, bytes);
}

/// The bytes of a file.
///
/// # Errors
/// The file does not exist.
pub fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    memory::read(path)
}

/// The files of the session at `path`: all files of its set in `/input`, or only this file.
pub fn files_of_session(path: &Path) -> Vec<PathBuf> {
    let set: PathBuf = path.components().take(SET_DEPTH).collect();
    let is_in_set = path.starts_with(INPUT_FOLDER) && path.components().count() > SET_DEPTH;
    if is_in_set { memory::files_below(&set) } else { vec![path.to_owned()] }
}

/// A change of one of the program's own files ([`USER_FOLDER`]) or of a saved session. The page stores it until the
/// next visit.
#[derive(Clone, Debug)]
pub struct Kept {
    pub path: PathBuf,
    /// Position of `bytes` in the file; the file's earlier bytes are unchanged.
    pub from: usize,
    /// The new bytes; `None` if the file was removed.
    pub bytes: Option<Vec<u8>>,
}

/// Returns and clears the changes of files.
pub fn take_kept() -> Vec<Kept> {
    let is_session = |path: &Path| path.extension().is_some_and(|ending| ending == "ron" || ending == "open");
    let is_own = |path: &Path| path.starts_with(USER_FOLDER) || is_session(path);
    let own = memory::take_changes().into_iter().filter(|change| is_own(&change.path));
    own.map(|memory::Change { path, from, bytes }| Kept { path, from, bytes }).collect()
}

/// Files that the user has saved or exported since the last call.
pub fn take_downloads() -> Vec<(PathBuf, Vec<u8>)> {
    osp_session::atomic_file::take_downloads()
}

/// Whether the user has requested a file dialog since the last call.
pub fn wants_file() -> bool {
    PAGE.with_borrow_mut(|page| std::mem::take(&mut page.wants_file))
}

pub(super) fn ask_for_file() {
    PAGE.with_borrow_mut(|page| page.wants_file = true);
}

pub(super) fn listen(wake: EventLoopProxy<Wake>) {
    PAGE.with_borrow_mut(|page| page.wake = Some(wake));
}

pub(super) fn fail(error: &dyn std::error::Error) {
    PAGE.with_borrow_mut(|page| page.state.failure = Some(error.to_string()));
}

pub(super) fn before_frame(studio: &mut Studio) {
    let panel_commands = PAGE.with_borrow_mut(|page| std::mem::take(&mut page.panel_commands));
    let is_end =
        |wish: &Wish| matches!(wish, Wish::Replay(_) | Wish::Show(_) | Wish::Do(Command::CancelWork));
    // A user who opens another session should not wait for the current session.
    if studio.is_reading() && panel_commands.iter().any(is_end) {
        studio.command(Command::CancelWork);
    }
    let mut panel_commands = panel_commands.into_iter().peekable();
    while let Some(wish) = panel_commands.next_if(|_| !studio.is_reading()) {
        match wish {
            Wish::Replay(path) => studio.replay_file(&path, ReplayStart::Playing),
            Wish::Show(path) => studio.replay_file(&path, ReplayStart::Finished),
            Wish::Do(command) => studio.command(command),
            Wish::FollowCamera(follows) => studio.follow_replay_camera(follows),
        }
    }
    // The other requests wait until the session has been read.
    let waiting: Vec<Wish> =
        panel_commands.filter(|wish| !matches!(wish, Wish::Do(Command::CancelWork))).collect();
    PAGE.with_borrow_mut(|page| page.panel_commands.splice(..0, waiting).for_each(drop));
}

pub(super) fn after_frame(studio: &mut Studio, adapter: String, clock_step_ns: u64, is_shown: bool) {
    let refused = studio.take_unread().map(|error| error.to_string());
    let session = studio.session();
    let (position, length) = match session.replay() {
        Some(replay) => (replay.position(), replay.frame_count()),
        None => (session.event_count(), session.event_count()),
    };
    PAGE.with_borrow_mut(|page| {
        let state = &mut page.state;
        state.frames += u64::from(is_shown);
        state.refused = refused.or(state.refused.take());
        state.work = studio.work_shown().map(|work| work.text);
        (state.adapter, state.is_replay, state.path) =
            (adapter, session.is_replay(), session.path().to_owned());
        (state.position, state.length) = (position, length);
        (state.camera, state.clock_step_ns) = (camera(studio), clock_step_ns);
        state.polygons = studio.scene().counts().visible;
        state.drawn = studio.culling().drawn(0).len() as u64;
        state.message = studio.messages().last().cloned().unwrap_or_default();
    });
}

/// The camera of the first view. A page has one view, which is symmetric about its axis.
fn camera(studio: &Studio) -> Option<Camera> {
    let view = &studio.views().first()?.view;
    Some(Camera {
        p: view.eye_in_world,
        q: view.world_from_view,
        fov_degrees: 2.0 * view.projection.top.atan().to_degrees(),
        near_m: Some(view.projection.near_m),
    })
}
