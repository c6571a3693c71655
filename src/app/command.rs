use std::path::PathBuf;

use super::{culling::Stages, layers::LayerChoice, pen::Snap, studio::ToolChoice};
use crate::{index::IndexKind, visibility::OcclusionChoice};

/// What a person can ask for, by key, button or menu.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Take back the last edit.
    Undo,
    /// Make the edit last taken back again.
    Redo,
    /// Choose a tool.
    Tool(ToolChoice),
    /// Make the brush wider (positive) or narrower by steps.
    Widen(f32),
    /// Brush width, metres.
    Width(f32),
    /// Brush colour, sRGB.
    Color([f32; 4]),
    /// How strokes find their depth.
    Snap(Snap),
    /// Erase the selected strokes.
    EraseSelected,
    /// Select all strokes.
    SelectAll,
    /// Select nothing.
    SelectNone,
    /// Step back until everything is in view.
    ShowAll,
    /// Look at what is under the pointer.
    LookAtPointer,
    /// Stop moving the culling camera, or let it follow the view again.
    Freeze(bool),
    /// File the model into another index.
    Index(IndexKind),
    /// Choose how polygons are found that others hide.
    Occlusion(OcclusionChoice),
    /// Most occluders of a view; `None` is the method's own number.
    Occluders(Option<usize>),
    /// Turn stages of culling on and off.
    Stages(Stages),
    /// Turn pictures of the structures on and off.
    Layers(LayerChoice),
    /// Start an empty session.
    New,
    /// Open a session.
    Open(PathBuf),
    /// Put the session at a place of its own.
    SaveAs(PathBuf),
    /// Write the model as glTF.
    ExportGltf(PathBuf),
    /// Replay: run or stand.
    Play(bool),
    /// Replay: go to a frame.
    Seek(u64),
    /// Replay: go on by frames, or back.
    Step(i64),
    /// Replay: frames shown for each recorded one.
    Speed(f64),
}
