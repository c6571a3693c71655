use std::path::PathBuf;

use super::{
    altering::Altering, drawing_aids::Aids, groups::Placing, layers::LayerChoice, paint_layers::LayerEdit,
    pen::Snap, question::Answer, session::Opening, tool::ToolChoice,
};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    brush::Brush,
    recording::GroupId,
    rig::{RoomFromTracker, Stereo},
};

/// A command from a key, button or menu.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Undo the last edit.
    Undo,
    /// Redo the edit that was undone last.
    Redo,
    Tool(ToolChoice),
    /// Make the brush wider (positive) or narrower by steps.
    Widen(f32),
    /// Set the brush width, metres.
    Width(f32),
    /// Set the brush for ribbons.
    Paint(Option<&'static Brush>),
    /// Set the brush colour, sRGB.
    Color([f32; 4]),
    Aids(Aids),
    /// Set the rule for the depth of new strokes.
    Snap(Snap),
    EraseSelected,
    /// Change the selected strokes.
    Alter(Altering),
    /// Change the layers or their strokes.
    Layer(LayerEdit),
    /// Copy the selected strokes to the clipboard.
    Copy,
    /// Copy the selected strokes to the clipboard and erase them.
    Cut,
    /// Draw the strokes of the clipboard again.
    Paste,
    /// Copy the selected strokes and paste the copies.
    Duplicate,
    SelectAll,
    /// Cancel the background work.
    CancelWork,
    /// Take back the unfinished stroke, movement or erasure of the pointer.
    CancelGesture,
    /// Clear the selection.
    SelectNone,
    GroupSelected,
    /// Select all strokes of a group and its descendants.
    SelectGroup(GroupId),
    /// Set a group's name; an empty name removes it.
    NameGroup(GroupId, String),
    /// Change the transform of a group.
    PlaceGroup(GroupId, Placing),
    /// Store the view under a number.
    KeepView(u32),
    /// Go to the stored view of this number.
    GoToView(u32),
    /// Move the camera back until the main part of the model is in view.
    ShowAll,
    /// Show the model from the artist's last view, or the whole model if the session has no such view.
    ShowAsPainted,
    /// Show the finished model of a replay from the artist's last view.
    ShowFinished,
    /// Rotate the camera towards the point under the pointer.
    LookAtPointer,
    /// Freeze the culling camera, or let it follow the view again.
    Freeze(bool),
    /// Insert the model into another index.
    Index(IndexKind),
    /// Choose the method of occlusion culling.
    Occlusion(Method),
    /// Set the largest number of occluders of a view; `None` is the method's default.
    Occluders(Option<usize>),
    /// Turn frustum culling on or off.
    FrustumCulling(bool),
    /// Show animated brushes at a fixed time, seconds; `None` lets time run.
    Moment(Option<f32>),
    /// Choose which debug structures are drawn over the model.
    Layers(LayerChoice),
    /// Set how the rig's screens show the pictures for two eyes.
    Stereo(Stereo),
    /// Set whether the pictures of the two eyes are exchanged.
    SwapEyes(bool),
    /// Set the distance between the eyes, metres.
    EyeSeparation(f32),
    /// Show a test pattern (`true`) or the model on the rig's screens.
    TestPattern(bool),
    /// Set the transform from tracker space to room space.
    Calibrate(RoomFromTracker),
    /// Start an empty session.
    New,
    Open(PathBuf),
    /// Open a session with options, such as read-only access.
    OpenAs(PathBuf, Opening),
    /// Write unsaved events to the session's file.
    Save,
    /// Save the session under a path; the user confirms the replacement of a file.
    SaveAs(PathBuf),
    /// Retry a failed write immediately.
    RetrySaving,
    /// Write the model as glTF (`.glb`) or as a sketch (`.tilt`), or a film of it (`.mp4`, `.gif`); the user confirms
    /// the replacement of a file.
    Export(PathBuf),
    /// Write the window's picture of the model to a file; the user confirms the replacement of a file.
    Picture(PathBuf),
    /// Execute one of these three commands, and replace a file there without a question.
    Over(Box<Command>),
    /// Close the window; if a part of the session could not be written, the user decides.
    Quit,
    /// Answer the window's open question.
    Answer(Answer),
    /// Replay the session in this file, and play it.
    PlayFile(PathBuf),
    /// Replay: play or pause.
    Play(bool),
    /// Replay: go to a frame.
    Seek(u64),
    /// Replay: go forwards or back by this number of frames.
    Step(i64),
    /// Replay: speed, as a multiple of the recorded speed.
    Speed(f64),
}
