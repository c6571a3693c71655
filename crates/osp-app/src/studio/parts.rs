//! The parts of the studio that begin empty: input, the work of commands, what a frame shows.

use std::path::PathBuf;

use glam::Vec3;

use crate::{
    altering::{Clip, Replaced},
    drawing_aids::{Aids, Twins},
    frames::FrameWriter,
    gestures::Gestures,
    journal::Unwritten,
    pen::{Brush, Pen, Snap},
    question::Question,
    room::RoomView,
    selection::Selection,
    session::OpenError,
    tool::ToolChoice,
    tracker::{Hands, Senders, Tracker, Watch},
    working::{Way, Working},
};
use osp::{
    frame::FrameRecord,
    math::Aabb,
    polygon::{Change, VisibleBlocks},
};
use osp_render::{DrawnCounts, LineBatch, PassTimes};

/// Times and counts of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameReport {
    /// Times and counts of the index.
    pub record: FrameRecord,
    /// Making polygons of the input since the last frame, nanoseconds.
    pub strokes_ns: u64,
    /// Input samples that became part of this frame.
    pub samples: u64,
    /// Polygons drawn.
    pub drawn: u64,
}

/// The changes that the GPU scene needs before a frame is drawn.
#[derive(Debug, Default)]
pub(crate) struct Pending {
    /// Whether the model is another one, so that all polygons must be sent again.
    pub(crate) is_other_scene: bool,
    /// Only the first so many polygons are unchanged; later numbers are given to new polygons.
    pub(crate) keep: Option<usize>,
    /// For the GPU scene.
    pub(crate) changes: Vec<Change>,
}

/// What a person holds and does: tools, selection, gestures, tracked hands.
#[derive(Debug, Default)]
pub(crate) struct Input {
    pub(crate) tool: ToolChoice,
    pub(crate) brush: Brush,
    pub(crate) snap: Snap,
    pub(crate) aids: Aids,
    pub(crate) twins: Twins,
    pub(crate) pen: Pen,
    pub(crate) selection: Selection,
    pub(crate) replaced: Replaced,
    pub(crate) clip: Clip,
    /// The box of what is selected, as it was last shown.
    pub(crate) shown_bounds: Option<Aabb>,
    /// The selection that it is of.
    pub(crate) bounds_of: Option<Selection>,
    pub(crate) measured: Option<(Vec3, Vec3)>,
    pub(crate) gestures: Gestures,
    pub(crate) tracker: Option<Tracker>,
    /// The tracker has sent more than the last frame took.
    pub(crate) tracker_waits: bool,
    pub(crate) hands: Hands,
    /// The senders of the tracker's messages, if each is an author of its own.
    pub(crate) senders: Option<Senders>,
    pub(crate) watch: Watch,
    /// The tracker is being calibrated: hands do not draw.
    pub(crate) is_calibrating: bool,
}

impl Input {
    /// Lets go of all that belongs to the session before.
    pub(crate) fn meet_session(&mut self) {
        (self.brush.layer, self.twins) = (0, Twins::default());
        (self.selection, self.bounds_of) = (Selection::default(), None);
        (self.replaced, self.measured) = (Replaced::default(), None);
        (self.pen, self.gestures) = (Pen::default(), Gestures::default());
    }
}

/// What commands have begun, and what has come of them.
#[derive(Debug, Default)]
pub(crate) struct Work {
    pub(crate) question: Option<Question>,
    /// A person has closed the window, and no question is open.
    pub(crate) is_closing: bool,
    /// How the last file was read or written that a command named.
    pub(crate) file_outcome: Option<Result<(), String>>,
    /// Where the next frame is to be written as a picture.
    pub(crate) picture: Option<PathBuf>,
    /// Writes each frame.
    pub(crate) frames: Option<FrameWriter>,
    /// When it reads and writes.
    pub(crate) way: Way,
    pub(crate) working: Option<Working>,
    /// Why the session of a replay could not be read.
    pub(crate) unread: Option<OpenError>,
    /// A session was closed although a part of it was not written.
    pub(crate) unwritten: Option<Unwritten>,
}

/// What the last frame shows.
#[derive(Debug, Default)]
pub(crate) struct Shown {
    /// Polygons in view that lie in the frustum as a whole, and those that its planes cut, while that is shown.
    pub(crate) cut: Option<(u64, u64)>,
    /// The screens that the head was behind in the last frame.
    pub(crate) behind: Vec<String>,
    pub(crate) lines: LineBatch,
    /// The test pattern of each view, while it is shown.
    pub(crate) patterns: Vec<LineBatch>,
    pub(crate) report: FrameReport,
    pub(crate) while_drawing: Option<(DrawnCounts, Option<PassTimes>)>,
    pub(crate) views: Vec<RoomView>,
    pub(crate) culled: VisibleBlocks,
    pub(crate) hidden: VisibleBlocks,
}
