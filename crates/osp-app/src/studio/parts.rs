//! The parts of the studio that are initially empty: input, the work of commands, the contents of a frame.

use std::path::PathBuf;

use glam::Vec3;

use crate::{
    altering::{Clip, Replaced},
    drawing_aids::{Aids, MirrorStrokes},
    film_maker::FilmMaker,
    gestures::Gestures,
    journal::Unwritten,
    pen::{Brush, Pen, Snap},
    question::Question,
    room::RoomView,
    selection::Selection,
    tool::ToolChoice,
    tracker::{Hands, Tracker, Watch},
    working::{WorkMode, Working},
};
use osp::{
    frame::FrameRecord,
    math::Aabb,
    polygon::{Change, VisibleBlocks},
};
use osp_render::{DrawnCounts, LineBatch, PassTimes};
use osp_session::recording::RecordingError;

/// Times and counts of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameReport {
    /// Times and counts of the index.
    pub record: FrameRecord,
    /// Time to convert the input since the last frame to polygons, nanoseconds.
    pub strokes_ns: u64,
    /// Number of input samples in this frame.
    pub samples: u64,
    pub drawn: u64,
}

/// The changes that the GPU scene needs before a frame is drawn.
#[derive(Debug, Default)]
pub(crate) struct Pending {
    /// Whether the model was replaced, so that the GPU needs all polygons again.
    pub(crate) is_other_scene: bool,
    /// Number of polygons that keep their ids. New polygons reuse the ids from this number on.
    pub(crate) keep: Option<usize>,
    pub(crate) changes: Vec<Change>,
}

/// The state of the input: tools, selection, gestures, tracked hands.
#[derive(Debug, Default)]
pub(crate) struct Input {
    pub(crate) tool: ToolChoice,
    /// Whether the next tool other than [`ToolChoice::Look`] shows the grid again.
    pub(crate) grid_with_tools: bool,
    pub(crate) brush: Brush,
    pub(crate) snap: Snap,
    pub(crate) aids: Aids,
    pub(crate) twins: MirrorStrokes,
    pub(crate) pen: Pen,
    pub(crate) selection: Selection,
    pub(crate) replaced: Replaced,
    pub(crate) clip: Clip,
    /// The box of the selection when it was last shown.
    pub(crate) shown_bounds: Option<Aabb>,
    /// The selection that `shown_bounds` belongs to.
    pub(crate) bounds_of: Option<Selection>,
    pub(crate) measured: Option<(Vec3, Vec3)>,
    pub(crate) gestures: Gestures,
    pub(crate) tracker: Option<Tracker>,
    /// Whether the last frame left messages of the tracker unread.
    pub(crate) tracker_waits: bool,
    pub(crate) hands: Hands,
    pub(crate) watch: Watch,
    /// Whether the tracker is being calibrated; hands then do not draw.
    pub(crate) is_calibrating: bool,
}

impl Input {
    /// Drops all state that belongs to the previous session.
    pub(crate) fn take_session(&mut self) {
        (self.brush.layer, self.twins) = (0, MirrorStrokes::default());
        (self.selection, self.bounds_of) = (Selection::default(), None);
        (self.replaced, self.measured) = (Replaced::default(), None);
        (self.pen, self.gestures) = (Pen::default(), Gestures::default());
    }
}

#[derive(Debug, Default)]
pub(crate) struct Work {
    pub(crate) question: Option<Question>,
    /// Whether the user has closed the window and no question is open.
    pub(crate) is_closing: bool,
    pub(crate) file_outcome: Option<Result<(), String>>,
    /// File for a picture of the next frame.
    pub(crate) picture: Option<PathBuf>,
    /// Mode in which commands read and write: immediately or in the background.
    pub(crate) mode: WorkMode,
    pub(crate) working: Option<Working>,
    pub(crate) film_maker: Option<FilmMaker>,
    /// The error of a session that could not be read for a replay.
    pub(crate) unread: Option<RecordingError>,
    /// The error of a session that was closed before all of it was written.
    pub(crate) unwritten: Option<Unwritten>,
}

#[derive(Debug, Default)]
pub(crate) struct Shown {
    /// Number of polygons inside the frustum, and number of polygons that intersect its planes; `None` while they are
    /// not shown.
    pub(crate) cut: Option<(u64, u64)>,
    /// Names of the screens that the head was behind in the last frame.
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
