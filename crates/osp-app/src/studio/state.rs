use std::time::Duration;

use super::{Studio, parts::FrameReport};
#[cfg(feature = "live")]
use crate::session::{Live, Overlay};
use crate::{
    culling::{Culling, CullingPlan},
    layers::LayerChoice,
    navigator::Navigator,
    pen::{Brush, Snap},
    room::{Room, RoomView},
    selection::Selection,
    session::Session,
    tool::ToolChoice,
    tracker::{Tracker, Watch},
};
use osp::polygon::VisibleBlocks;
use osp_render::{DrawnCounts, LineBatch, PassTimes};
use osp_session::{platform::time::Instant, recording::Limits, scene::Scene};

/// Settings, and values for the panels.
impl Studio {
    /// Sets the tracker to read.
    pub fn set_tracker(&mut self, tracker: Tracker) {
        self.input.tracker = Some(tracker);
    }

    /// The user's strokes that the shared session does not have yet.
    #[cfg(feature = "live")]
    pub fn overlay(&self) -> Option<&Overlay> {
        self.session.live().map(|live| &live.overlay)
    }

    #[cfg(feature = "live")]
    pub(crate) fn overlay_mut(&mut self) -> Option<&mut Overlay> {
        self.session.live_mut().map(Live::overlay_mut)
    }

    /// The settings of culling. Change them before the method of occlusion culling is chosen.
    pub fn culling_plan_mut(&mut self) -> &mut CullingPlan {
        &mut self.culling.plan
    }

    /// Sets the limits of sessions that are opened later.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
    }

    /// Shows the model on the screens of a rig.
    pub fn set_room(&mut self, room: Room) {
        self.room = room;
    }

    /// The tracker, if any.
    pub fn tracker(&self) -> Option<&Tracker> {
        self.input.tracker.as_ref()
    }

    /// Recent messages of the tracker.
    pub fn watch(&self) -> &Watch {
        &self.input.watch
    }

    /// Sets whether the tracker is being calibrated; its hands then do not draw.
    pub fn set_calibrating(&mut self, is_calibrating: bool) {
        self.input.is_calibrating = is_calibrating;
    }

    /// The names of the screens that the head is behind, or nearly touches.
    pub fn screens_behind(&self) -> impl Iterator<Item = &str> {
        self.room.screens_behind(&self.shown.views)
    }

    /// Records that the last frame's picture was passed to the display.
    pub fn note_shown(&mut self) {
        self.input.watch.note_shown(Instant::now());
    }

    /// The session or replay that the window shows.
    pub fn session(&self) -> &Session {
        &self.session
    }

    pub fn scene(&self) -> &Scene {
        self.session.scene()
    }

    pub fn culling(&self) -> &Culling {
        &self.culling
    }

    /// Records the time to draw the last frame, nanoseconds.
    pub fn note_drawing(&mut self, ns: u64) {
        self.culling.note_drawing(self.shown.report.drawn, ns);
    }

    /// The settings of the pen.
    pub fn brush(&self) -> Brush {
        self.input.brush
    }

    pub fn tool(&self) -> ToolChoice {
        self.input.tool
    }

    /// Rule for the depth of strokes.
    pub fn snap(&self) -> Snap {
        self.input.snap
    }

    /// For the first view: the number of polygons inside the frustum, and the number of polygons that intersect its
    /// planes. `None` while these numbers are not shown.
    pub fn inside_and_cut(&self) -> Option<(u64, u64)> {
        self.shown.cut
    }

    /// The fixed time of animated brushes, seconds; `None` if time runs.
    pub fn moment_s(&self) -> Option<f32> {
        self.moment_s
    }

    /// The debug structures that are drawn over the model.
    pub fn layers(&self) -> LayerChoice {
        self.layers
    }

    /// Whether the culling camera is frozen.
    pub fn is_frozen(&self) -> bool {
        self.frozen.is_some()
    }

    /// The selected strokes.
    pub fn selection(&self) -> &Selection {
        &self.input.selection
    }

    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    pub fn room(&self) -> &Room {
        &self.room
    }

    /// Whether a replay moves the camera.
    pub fn follows_replay_camera(&self) -> bool {
        self.follows_replay_camera && self.has_useful_camera()
    }

    /// Sets whether a replay moves the camera.
    pub fn follow_replay_camera(&mut self, follow: bool) {
        self.follows_replay_camera = follow;
    }

    /// Whether a replay is open whose camera shows the model.
    pub fn has_useful_camera(&self) -> bool {
        self.session.replay().is_some_and(|replay| replay.is_camera_useful)
    }

    /// Messages to the user, oldest first.
    pub fn messages(&self) -> &[String] {
        &self.messages
    }

    /// Adds a message for the user.
    pub fn show_message(&mut self, message: String) {
        /// Largest number of messages that are kept.
        const KEPT: usize = 50;
        if self.messages.len() >= KEPT {
            self.messages.remove(0);
        }
        self.messages.push(message);
        self.message_at = Some(Instant::now());
    }

    pub(crate) fn message_age(&self) -> Option<Duration> {
        self.message_at.map(|at| at.elapsed())
    }

    /// Adds a message, unless it equals the last message.
    pub(crate) fn show_once(&mut self, message: &str) {
        if self.messages.last().is_none_or(|last| last != message) {
            self.show_message(message.to_owned());
        }
    }

    /// Times and counts of the last frame.
    pub fn report(&self) -> FrameReport {
        self.shown.report
    }

    /// Counts of culling on the GPU over all views, and times of the GPU. Both belong to the latest frame whose results
    /// were received; `None` before.
    pub fn while_drawing(&self) -> Option<(DrawnCounts, Option<PassTimes>)> {
        self.shown.while_drawing
    }

    /// Stores the painter's counts of culling on the GPU.
    pub(crate) fn note_drawn(&mut self, counts: Option<(DrawnCounts, Option<PassTimes>)>) {
        self.shown.while_drawing = counts;
    }

    /// The views of the last frame, one for each screen and eye.
    pub fn views(&self) -> &[RoomView] {
        &self.shown.views
    }

    /// The lines drawn on top of the model in the last frame.
    pub fn lines(&self) -> &LineBatch {
        &self.shown.lines
    }

    /// The lines of a view: lines on top of the model, or the test pattern of its screen.
    pub(crate) fn lines_of(&self, view: usize) -> &LineBatch {
        self.shown.patterns.get(view).filter(|_| self.room.shows_pattern()).unwrap_or(&self.shown.lines)
    }

    /// Polygons outside the views of the last frame; empty unless they are shown.
    pub fn culled(&self) -> &VisibleBlocks {
        &self.shown.culled
    }

    /// Polygons that occlusion culling removed in the last frame; empty unless they are shown.
    pub fn hidden(&self) -> &VisibleBlocks {
        &self.shown.hidden
    }
}
