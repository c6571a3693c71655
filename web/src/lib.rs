//! The page's interface to osp's window. `page.js` calls these functions; the window itself never calls the page.
//!
//! No opened file leaves the machine: there is no server behind the page.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp},
    occlusion::Occlusion,
};
use osp_app::{
    Access, Autosaves, Command, LayerChoice, Opening, Session, Settings, Studio, WindowOptions,
    page::{self, Typed, USER_FOLDER, Wish},
    run,
};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{self, Limits, OpenOptions, Pace, RecordingError, open_bytes},
    replay::{CameraChoice, CameraPath, Player, SessionFingerprint, fingerprint_of_frame, summarize},
};
use serde_json::json;
use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Shows an error; defined in `page.js`.
    #[wasm_bindgen(js_name = ospPanic)]
    fn osp_panic(text: &str);
}

/// Opens the window. A session that was left open on an earlier visit is restored.
#[wasm_bindgen]
pub fn start() -> Result<(), JsError> {
    std::panic::set_hook(Box::new(|panic| osp_panic(&panic.to_string())));
    let autosaves = Autosaves::new(None);
    let (session, opened) = Session::recover_or_new(&autosaves, Limits::DEFAULT);
    let mut studio = Studio::new(session, autosaves, IndexKind::Osp);
    for remark in opened.remarks {
        studio.show_message(remark);
    }
    studio.command(Command::Occlusion(Occlusion::Auto.into()));
    let settings = Some(Settings::default_path());
    run(studio, WindowOptions { settings, ..WindowOptions::default() })?;
    Ok(())
}

/// Returns the folder of the files that are kept from one visit to the next.
#[wasm_bindgen]
pub fn user_folder() -> String {
    USER_FOLDER.to_owned()
}

/// Puts a file into the page's memory.
#[wasm_bindgen]
pub fn put(path: &str, bytes: Vec<u8>) {
    page::put_file(&PathBuf::from(path), bytes);
}

/// Replays a file in the page's memory.
#[wasm_bindgen]
pub fn replay(path: &str) {
    page::wish(Wish::Replay(PathBuf::from(path)));
}

/// Reads a file in the page's memory for a replay, and shows the finished model first.
#[wasm_bindgen]
pub fn show(path: &str) {
    page::wish(Wish::Show(PathBuf::from(path)));
}

/// Draws on a copy of a file in the page's memory.
#[wasm_bindgen]
pub fn draw_on(path: &str) {
    page::wish(Wish::Do(Command::OpenAs(PathBuf::from(path), Opening::with(Access::Copy))));
}

/// Stops reading a session. The previous session stays.
#[wasm_bindgen]
pub fn cancel() {
    page::wish(Wish::Do(Command::CancelWork));
}

/// Plays or pauses a replay, or goes to one of its frames.
#[wasm_bindgen]
pub fn seek(frame: Option<u32>) {
    page::wish(Wish::Do(Command::Play(false)));
    if let Some(frame) = frame {
        page::wish(Wish::Do(Command::Seek(u64::from(frame))));
    }
}

/// Makes the camera follow the camera of the replay, or stay in place.
#[wasm_bindgen]
pub fn follow_camera(follows: bool) {
    page::wish(Wish::FollowCamera(follows));
}

/// Chooses an index and a method of occlusion culling by their names on the command line.
#[wasm_bindgen]
pub fn choose(index: &str, occlusion: &str) -> Result<(), JsError> {
    let unknown =
        || JsError::new(&format!("{index}, {occlusion}: expected the names of an index and of a method"));
    let index = IndexKind::ALL.iter().copied().find(|kind| kind.name() == index).ok_or_else(unknown)?;
    let occlusion = Method::all().find(|choice| choice.name() == occlusion).ok_or_else(unknown)?;
    page::wish(Wish::Do(Command::Index(index)));
    page::wish(Wish::Do(Command::Occlusion(occlusion)));
    Ok(())
}

/// Chooses the contents of pictures: the model with or without the floor, and no other layer. Animated brushes are
/// shown at this moment in seconds; without one they move.
#[wasm_bindgen]
pub fn look(floor: bool, moment_s: Option<f32>) {
    page::wish(Wish::Do(Command::Layers(LayerChoice { grid: floor, ..LayerChoice::default() })));
    page::wish(Wish::Do(Command::Moment(moment_s)));
}

/// Saves the model as `NAME.glb`, or the window's picture of it as `NAME.png`; see [`take_downloads`].
#[wasm_bindgen]
pub fn save(name: &str) {
    let path = PathBuf::from(name);
    let is_picture = path.extension().is_some_and(|ending| ending == "png");
    let command = if is_picture { Command::Picture(path) } else { Command::Export(path) };
    page::wish(Wish::Do(Command::Over(Box::new(command))));
}

/// Returns the file of the open session: `{name, bytes}`.
#[wasm_bindgen]
pub fn session_file() -> Result<JsValue, JsError> {
    let path = page::state().path;
    let bytes = page::read_file(&path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(object(&[("name", name.into()), ("bytes", js_sys::Uint8Array::from(&bytes[..]).into())]))
}

/// Returns the files of the open session: an array of `{path, bytes}`.
#[wasm_bindgen]
pub fn session_files() -> Result<js_sys::Array, JsError> {
    let paths = page::files_of_session(&page::state().path).into_iter();
    let file = |path: PathBuf| {
        let bytes = page::read_file(&path)?;
        let path = path.to_string_lossy();
        Ok(object(&[("path", path.as_ref().into()), ("bytes", js_sys::Uint8Array::from(&bytes[..]).into())]))
    };
    paths.map(file).collect()
}

/// Returns the window's state as JSON. `camera` is the view of the last frame, in the form of `osp render --view`.
#[wasm_bindgen]
pub fn state() -> String {
    let state = page::state();
    json!({
        "frames": state.frames,
        "adapter": state.adapter,
        "path": state.path,
        "isReplay": state.is_replay,
        "camera": state.camera.map(|camera| camera.to_string()),
        "clockStepNs": state.clock_step_ns,
        "position": state.position,
        "length": state.length,
        "polygons": state.polygons,
        "drawn": state.drawn,
        "wantsText": state.wants_text,
        "message": state.message,
        "work": state.work,
        "refused": state.refused,
        "failure": state.failure,
    })
    .to_string()
}

/// Types for the window: text, or the keys `Backspace` and `Enter`.
#[wasm_bindgen]
pub fn type_in(text: &str, is_key: bool) {
    page::type_in(match (text, is_key) {
        ("Backspace", true) => Typed::Backspace,
        ("Enter", true) => Typed::Enter,
        _ => Typed::Text(text.to_owned()),
    });
}

/// Whether the user has requested to choose a file since the last call.
#[wasm_bindgen]
pub fn wants_file() -> bool {
    page::wants_file()
}

/// Returns the changes of the files to keep: an array of `{path, from, bytes}`. Without `bytes` the file was removed.
#[wasm_bindgen]
pub fn take_kept() -> js_sys::Array {
    let changes = page::take_kept().into_iter().map(|change| {
        let bytes = change.bytes.map(|bytes| js_sys::Uint8Array::from(&bytes[..]));
        object(&[
            ("path", change.path.to_string_lossy().as_ref().into()),
            ("from", (change.from as f64).into()),
            ("bytes", bytes.map_or(JsValue::UNDEFINED, Into::into)),
        ])
    });
    changes.collect()
}

/// Returns the files that were saved or exported since the last call: an array of `{name, bytes}`.
#[wasm_bindgen]
pub fn take_downloads() -> js_sys::Array {
    let files = page::take_downloads().into_iter().map(|(path, bytes)| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        object(&[("name", name.into()), ("bytes", js_sys::Uint8Array::from(&bytes[..]).into())])
    });
    files.collect()
}

fn object(fields: &[(&str, JsValue)]) -> JsValue {
    let object = js_sys::Object::new();
    for (name, value) in fields {
        // A plain object accepts any field.
        let _ = js_sys::Reflect::set(&object, &(*name).into(), value);
    }
    object.into()
}

/// Returns the fingerprint of a whole session, the same as `osp replay`: 16 samples a frame, the automatic camera. The
/// JSON has the number, the frames, and the fingerprints of ten frames spread over the session.
#[wasm_bindgen]
pub fn fingerprint(name: &str, bytes: Vec<u8>) -> Result<String, JsError> {
    let bytes: Arc<[u8]> = bytes.into();
    fingerprint_with(|| open_bytes(name, Arc::clone(&bytes), &OpenOptions::default()))
}

/// The same as [`fingerprint`], for a file in the page's memory with its related files.
#[wasm_bindgen]
pub fn fingerprint_of(path: &str) -> Result<String, JsError> {
    fingerprint_with(|| recording::open(Path::new(path), &OpenOptions::default()))
}

fn fingerprint_with(
    open: impl Fn() -> Result<recording::Session, RecordingError>,
) -> Result<String, JsError> {
    let (summary, _, read) = summarize(open()?, Pace::Samples(16));
    read?;
    let session = open()?;
    let camera = CameraPath::new(CameraChoice::Auto, session.header.camera, &summary.bounds);
    let index = Osp::new(&IndexConfig::default());
    let mut pipeline = Pipeline::new(Box::new(index), 0);
    let mut player = Player::new(session, Pace::Samples(16));
    let (mut whole, mut frames) = (SessionFingerprint::new(), Vec::new());
    while player.step()? {
        let view = camera.view(&player.moment());
        pipeline.frame(player.scene(), player.changes(), &view);
        let frame = fingerprint_of_frame(pipeline.draw_list().ids());
        whole.add(player.frames() - 1, frame);
        frames.push(frame);
    }
    let count = frames.len();
    let ten: Vec<_> =
        (0..10.min(count)).map(|i| i * count / 10).map(|at| (at, format!("{:016x}", frames[at]))).collect();
    Ok(json!({ "fingerprint": format!("{:016x}", whole.value()), "frames": count, "ten": ten }).to_string())
}
