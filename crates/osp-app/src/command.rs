use std::path::PathBuf;

use super::{
    altering::Altering, culling::Stages, drawing_aids::Aids, groups::Placing, layers::LayerChoice,
    paint_layers::LayerEdit, pen::Snap, question::Answer, session::Opening, tool::ToolChoice,
};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    brush::Brush,
    recording::GroupId,
    rig::{RoomFromTracker, Stereo},
};

/// A command that a person gives by key, button or menu.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Undo the last edit.
    Undo,
    /// Redo the edit that was undone last.
    Redo,
    /// Choose a tool.
    Tool(ToolChoice),
    /// Make the brush wider (positive) or narrower by steps.
    Widen(f32),
    /// Brush width, metres.
    Width(f32),
    /// The brush that paints ribbons.
    Paint(Option<&'static Brush>),
    /// Brush colour, sRGB.
    Color([f32; 4]),
    /// Set the aids for drawing.
    Aids(Aids),
    /// Set the depth of new strokes.
    Snap(Snap),
    /// Erase the selected strokes.
    EraseSelected,
    /// Change the selected strokes.
    Alter(Altering),
    /// Change the layers, or what is on them.
    Layer(LayerEdit),
    /// Remember the selected strokes.
    Copy,
    /// Remember the selected strokes and erase them.
    Cut,
    /// Draw the remembered strokes again.
    Paste,
    /// Draw the selected strokes once more.
    Duplicate,
    /// Select all strokes.
    SelectAll,
    /// End the reading or writing beside the window.
    CancelWork,
    /// Select nothing.
    SelectNone,
    /// Make a group of the selection.
    GroupSelected,
    /// Select all strokes of a group and of those below it.
    SelectGroup(GroupId),
    /// Give a group a name; none if it is empty.
    NameGroup(GroupId, String),
    /// Place a group again.
    PlaceGroup(GroupId, Placing),
    /// Remember the view under a number.
    KeepView(u32),
    /// Go to the view with a number.
    GoToView(u32),
    /// Write each frame as a picture, or end that.
    Frames,
    /// Step back until the model is in view, without strays far from it.
    ShowAll,
    /// Show the finished model of a replay as its artist last saw it.
    ShowFinished,
    /// Turn the camera to the point under the pointer.
    LookAtPointer,
    /// Stop moving the culling camera, or let it follow the view again.
    Freeze(bool),
    /// Insert the model into another index.
    Index(IndexKind),
    /// Choose the method of occlusion culling.
    Occlusion(Method),
    /// Most occluders of a view; `None` is the method's own number.
    Occluders(Option<usize>),
    /// Turn stages of culling on and off.
    Stages(Stages),
    /// Show animated brushes at this moment, seconds; `None` lets them move.
    Moment(Option<f32>),
    /// Choose which structures are drawn over the model.
    Layers(LayerChoice),
    /// Change how the rig's screens show the model to two eyes.
    Stereo(Stereo),
    /// Give each eye the picture of the other one, or its own.
    SwapEyes(bool),
    /// Distance of the eyes, metres.
    EyeSeparation(f32),
    /// Show a test pattern on the rig's screens, or the model.
    TestPattern(bool),
    /// Set the transform from the tracker's space to the room.
    Calibrate(RoomFromTracker),
    /// Start an empty session.
    New,
    /// Open a session.
    Open(PathBuf),
    /// Open a session to draw on it, read-only, or without its damaged pieces.
    OpenAs(PathBuf, Opening),
    /// Write what is not yet in the session's file.
    Save,
    /// Save the session under a path; the user confirms the replacement of a file.
    SaveAs(PathBuf),
    /// Save the session under a path, and replace a file there.
    SaveOver(PathBuf),
    /// Try at once to write what could not be written.
    RetrySaving,
    /// Discard everything drawn since the session was opened or saved under a name, after the user has confirmed it.
    Discard,
    /// Write the model as glTF; the user confirms the replacement of a file.
    ExportGltf(PathBuf),
    /// Write the model as glTF, and replace a file there.
    ExportOver(PathBuf),
    /// Write the window's picture of the model to a file; the user confirms the replacement of a file.
    Picture(PathBuf),
    /// Write a picture of the model, and replace a file there.
    PictureOver(PathBuf),
    /// Close the window; if a part of the session could not be written, the user decides.
    Quit,
    /// Answer the window's open question.
    Answer(Answer),
    /// Replay: play or pause.
    Play(bool),
    /// Replay: go to a frame.
    Seek(u64),
    /// Replay: move on by frames, or back.
    Step(i64),
    /// Replay: frames shown for each recorded one.
    Speed(f64),
}
