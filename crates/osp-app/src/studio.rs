use std::{
    io::{self, Write},
    time::Duration,
};

use glam::{Vec2, Vec3};

#[cfg(feature = "live")]
use super::session::Live;
use super::{
    command::Command,
    culling::{Culling, Indexed},
    journal::{Autosaves, Unwritten},
    layers::LayerChoice,
    navigator::Navigator,
    room::{Room, RoomView},
    session::{Opened, Replay, Session},
    spans::Part,
    tool::ToolChoice,
    tracker::Pose,
};
use osp::{
    frame::StageClock,
    math::{Aabb, Ray, rotate},
    polygon::{Change, PolygonId},
    view::View,
};
use osp_render::quoted;
use osp_rivals::IndexKind;
use osp_session::{
    platform::time::Instant,
    recording::{Event, Limits, StrokeId},
    replay::{main_bounds, sees_most},
    scene::Stroke,
};

#[cfg(feature = "live")]
mod on_screen;
#[cfg(feature = "live")]
mod others;
mod overlay;
mod parts;
mod state;

#[cfg(feature = "live")]
pub use others::OtherInView;
pub use parts::FrameReport;
pub(super) use parts::Pending;
use parts::{Input, Shown, Work};

const READ_ONLY_MESSAGE: &str = "this session is open read-only: draw on a copy, or save it elsewhere first";

/// The whole window except its panels and the GPU: the session, the tools, the camera and the culling.
///
/// Input is converted to [`Event`]s, events change the [`Scene`](osp_session::scene::Scene), and the index follows the
/// changes, as in a replay.
#[derive(Debug)]
pub struct Studio {
    pub(super) session: Session,
    pub(super) input: Input,
    pub(super) work: Work,
    pub(super) shown: Shown,
    pub(super) autosaves: Autosaves,
    pub(super) limits: Limits,
    pub(super) culling: Culling,
    pub(super) navigator: Navigator,
    pub(super) frozen: Option<Vec<View>>,
    pub(super) room: Room,
    pub(super) layers: LayerChoice,
    /// The fixed time of animated brushes, seconds; `None` if time runs.
    pub(super) moment_s: Option<f32>,
    pub(super) follows_replay_camera: bool,
    pub(super) messages: Vec<String>,
    message_at: Option<Instant>,
    pub(super) pending: Pending,
    pub(super) events: Vec<Event>,
    pub(super) changes: Vec<Change>,
    samples: u64,
    strokes_ns: u64,
    clock: StageClock,
    started: Instant,
    /// Time stamp at which the session was resumed; new events continue from it.
    resumed_secs: f64,
    pub(super) last_aspect: f32,
    pub(super) last_height_px: f32,
}

impl Studio {
    pub fn new(session: Session, autosaves: Autosaves, index: IndexKind) -> Self {
        let resumed_secs = session.last_secs();
        let mut studio = Self {
            session,
            input: Input::default(),
            work: Work::default(),
            shown: Shown::default(),
            autosaves,
            limits: Limits::DEFAULT,
            culling: Culling::new(index),
            navigator: Navigator::default(),
            frozen: None,
            room: Room::default(),
            layers: LayerChoice::default(),
            moment_s: None,
            follows_replay_camera: true,
            messages: Vec::new(),
            message_at: None,
            pending: Pending::default(),
            events: Vec::new(),
            changes: Vec::new(),
            samples: 0,
            strokes_ns: 0,
            clock: StageClock::default(),
            started: Instant::now(),
            resumed_secs,
            last_aspect: 1.0,
            last_height_px: 1.0,
        };
        studio.take_session(None);
        studio.offer_edits();
        studio
    }

    /// Starts to show a new session: inserts its model into the index, unless `indexed` already contains it, and shows
    /// the whole model.
    pub(super) fn take_session(&mut self, indexed: Option<Indexed>) {
        // The whole model is inserted at once, so its changes are not needed.
        self.session.take_changes(&mut Vec::new());
        self.pending = Pending { is_other_scene: true, ..Pending::default() };
        self.input.take_session();
        self.frozen = None;
        let bounds = self.session.bounds();
        self.culling.take_indexed(indexed, self.session.scene(), &bounds);
        self.navigator = Navigator::default();
        if self.input.tool == ToolChoice::Look {
            self.set_tool(ToolChoice::Draw(self.input.brush.tool));
        }
        // A sketch of another program is shown without a grid, as in that program. In a copy, the first tool shows the
        // grid.
        let camera = self.session.header().camera;
        self.layers.grid = camera.is_none() || self.session.is_import();
        if self.session.is_import() {
            self.set_tool(ToolChoice::Look);
        }
        self.navigator.set_lens(camera);
        if self.session.is_replay() {
            self.follows_replay_camera = true;
            self.navigator.show_all(&bounds);
        } else {
            self.see_as_painted();
        }
    }

    /// Shows the model from the artist's last view, or the whole model if the session has no camera. The camera then
    /// orbits around the centre of the model.
    pub(super) fn see_as_painted(&mut self) {
        let bounds = self.show_main();
        let Some(camera) = self.session.header().camera else { return };
        let ahead_m = (bounds.center() - camera.p).dot(rotate(camera.q, Vec3::NEG_Z));
        let distance_m = if ahead_m > 0.0 { ahead_m } else { self.navigator.distance_m() };
        let whole = self.navigator;
        self.navigator.go_to_from(camera.p, camera.q, distance_m);
        let is_in_view = self.navigator.view(self.last_aspect, &bounds).frustum().may_see(&bounds);
        if !is_in_view {
            self.navigator = whole;
        }
    }

    /// Moves the camera back if it sees less than half of the model.
    pub(super) fn show_most(&mut self) {
        let view = self.navigator.view(self.last_aspect, &self.session.bounds());
        if !sees_most(&view, self.session.scene()) {
            self.show_main();
        }
    }

    /// Moves the camera back until the main part of the model is in view. Returns the box of this part.
    pub(super) fn show_main(&mut self) -> Aabb {
        let bounds = main_bounds(self.session.scene(), &self.session.bounds());
        self.navigator.show_all(&bounds);
        bounds
    }

    /// Shows the finished model of a replay from the artist's last view. When played from there, the replay restarts
    /// from the beginning and takes at most a minute.
    pub(super) fn show_finished(&mut self) {
        let Some(frames) = self.session.replay().map(Replay::frame_count) else { return };
        self.command(Command::Play(false));
        self.command(Command::Seek(frames));
        self.see_as_painted();
    }

    pub(super) fn replace(&mut self, session: Session, indexed: Option<Indexed>) {
        self.finish_gestures();
        self.end_hands_strokes();
        let mut old = std::mem::replace(&mut self.session, session);
        match old.leave() {
            Ok(said) => said.into_iter().for_each(|line| self.show_message(line)),
            Err(unwritten) => {
                self.show_message(unwritten.to_string());
                self.work.unwritten.get_or_insert(unwritten);
            }
        }
        if let Some(place) = old.journal().place_of_edits() {
            self.show_message(place);
        }
        if let Err(unwritten) = old.close() {
            self.show_message(unwritten.to_string());
            self.work.unwritten.get_or_insert(unwritten);
        }
        self.take_up_time();
        self.take_session(indexed);
        self.offer_edits();
    }

    /// Continues the session's time from its last event.
    pub(super) fn take_up_time(&mut self) {
        self.started = Instant::now();
        self.resumed_secs = self.session.last_secs();
    }

    /// Whether the session can be drawn on.
    pub fn can_draw(&self) -> bool {
        !self.session.is_read_only()
    }

    /// Checks the session's file and the background work. Call it regularly, with or without frames. Returns whether
    /// there is something new to show.
    pub fn tend(&mut self) -> bool {
        let is_done = self.take_work();
        self.look_after_session() || is_done
    }

    /// The session's part of [`Studio::tend`].
    fn look_after_session(&mut self) -> bool {
        #[cfg(feature = "live")]
        self.session.follow();
        self.session.tend(Instant::now());
        let news = self.session.take_news();
        let is_news = !news.is_empty();
        #[cfg(feature = "live")]
        let is_news = is_news || self.session.live_mut().is_some_and(Live::take_note);
        news.into_iter().for_each(|line| self.show_message(line));
        is_news
    }

    pub(super) fn show_remarks(&mut self, opened: Opened) {
        self.messages.extend(opened.remarks);
    }

    pub(super) fn now_secs(&self) -> f64 {
        self.resumed_secs + self.started.elapsed().as_secs_f64()
    }

    /// Whether the picture changes without input, so that frames must be drawn continuously.
    pub fn is_moving(&self) -> bool {
        let is_playing = self.session.replay().is_some_and(Replay::is_playing);
        is_playing || self.input.tracker_waits || self.input.gestures.flight != Vec3::ZERO
    }

    /// Time until the next frame that is due without input: to end a tracker's stroke, or to show the result of
    /// background work.
    pub fn next_frame_in(&self) -> Option<Duration> {
        let is_resting = self.input.gestures.resting.is_some();
        is_resting
            .then_some(Duration::from_millis(50))
            .or(self.is_working().then_some(Duration::from_millis(250)))
            .or(self.input.hands.is_drawing().then_some(Duration::from_millis(300)))
    }

    /// Longest time until the next call of [`Studio::tend`]. It is shorter while data may be received.
    pub fn tend_within(&self) -> Duration {
        if self.works_in_turns() || self.session.has_unread_events() {
            return Duration::ZERO;
        }
        Duration::from_millis(if self.session.is_shared() || self.is_working() { 20 } else { 500 })
    }

    /// Whether a gesture of the pointer is in progress.
    pub fn is_dragging(&self) -> bool {
        self.input.gestures.is_dragging()
    }

    /// Writes the pending events to the session and applies them to the model.
    pub(super) fn apply_events(&mut self) {
        let start = self.clock.start();
        let mut events = std::mem::take(&mut self.events);
        if self.can_draw() {
            let was_within = self.session.excess(&self.limits).is_none();
            self.session.apply_all(&mut events);
            let excess = self.session.excess(&self.limits).filter(|_| was_within);
            self.samples += events.iter().filter(|event| event.is_sample()).count() as u64;
            if let Some((most, what)) = excess {
                let more = self.limits.polygons.saturating_mul(2);
                self.show_message(format!(
                    "this session now has more than {most} {what}: open it with --max-polygons {more} or more"
                ));
            }
        } else if !events.is_empty() {
            self.report_read_only();
        }
        events.clear();
        self.events = events;
        self.strokes_ns += self.clock.since(start).ns;
    }

    fn report_read_only(&mut self) {
        if !self.session.is_replay() {
            self.show_once(READ_ONLY_MESSAGE);
        }
    }

    pub(super) fn new_stroke(&mut self) -> Option<StrokeId> {
        if self.can_draw() {
            return Some(self.session.new_stroke());
        }
        self.report_read_only();
        None
    }

    /// The head for the views of the screens. In a replay on a rig, the recorded head acts as the tracked head while
    /// the camera follows it. Its position and direction move the room; its tilt moves only the eyes.
    fn tracked_head(&self) -> Option<Pose> {
        let head = self.input.hands.head();
        match self.session.replay() {
            Some(replay) if self.follows_replay_camera() && head.is_none() => {
                self.room.head_tilted_like(replay.view().world_from_view)
            }
            _ => head,
        }
    }

    /// The view under a point of the window (-1 to 1), and that point on its own screen (-1 to 1).
    pub(super) fn view_at(&self, at: Vec2, aspect: f32) -> Option<(View, Vec2)> {
        self.room.under(&self.views_of(aspect), at)
    }

    fn views_of(&self, aspect: f32) -> Vec<RoomView> {
        self.room.views(&self.navigator, self.tracked_head(), aspect, &self.session.bounds())
    }

    /// The first polygon hit by a ray, among strokes for which `counts` returns `true`, and the point that is hit.
    pub(super) fn pick(&mut self, ray: &Ray, counts: impl Fn(&Stroke) -> bool) -> Option<(PolygonId, Vec3)> {
        let (id, t) = self.culling.pick(self.session.scene(), self.session.changes(), ray, counts)?;
        Some((id, ray.origin + ray.direction * t))
    }

    pub(super) fn strokes_in(&mut self, part: &Part) -> Vec<StrokeId> {
        self.culling.strokes_in(self.session.scene(), self.session.changes(), part)
    }

    /// Shows a message about screens that the head has moved behind.
    fn report_screens_behind(&mut self) {
        let behind = self.room.screens_behind(&self.shown.views);
        if behind.clone().eq(self.shown.behind.iter().map(String::as_str)) {
            return;
        }
        let behind: Vec<String> = behind.map(str::to_owned).collect();
        if !behind.is_empty() {
            self.show_once(&format!(
                "the head is behind {} or too near to it: drawn as seen from 5 cm in front",
                behind.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            ));
        }
        self.shown.behind = behind;
    }

    /// Processes one frame for a window of this size in pixels: handles the input, updates the index, culls, and stores
    /// the views and their draw lists.
    pub fn frame(&mut self, size_px: Vec2, frame_secs: f32) -> FrameReport {
        self.listen();
        // Work in turns continues between frames.
        if !self.works_in_turns() {
            self.take_work();
        }
        self.look_after_session();
        self.fly(frame_secs);
        let aspect = size_px.x / size_px.y.max(1.0);
        (self.last_aspect, self.last_height_px) = (aspect, size_px.y);
        self.follow_width();
        self.changes.clear();
        let start = self.clock.start();
        self.samples += self.session.advance(frame_secs) as u64;
        self.session.take_changes(&mut self.changes);
        if let Some(replay) = self.session.replay()
            && self.follows_replay_camera()
            && replay.is_playing()
        {
            let view = replay.view();
            self.navigator.go_to(view.eye_in_world, view.world_from_view);
        }
        self.strokes_ns += self.clock.since(start).ns;
        self.pending.changes.extend_from_slice(&self.changes);

        let bounds = self.session.bounds();
        let head = self.tracked_head();
        self.room.views_into(&self.navigator, head, aspect, &bounds, &mut self.shown.views);
        self.report_screens_behind();
        let eyes: Vec<View> = self.shown.views.iter().map(|view| view.view).collect();
        let cull_views = match &self.frozen {
            Some(frozen) if frozen.len() == eyes.len() => frozen,
            _ => &eyes,
        };
        let record = self.culling.frame(self.session.scene(), &self.changes, cull_views);
        self.find_culled();
        self.draw_lines(size_px);
        self.draw_patterns();
        self.shown.report = FrameReport {
            record,
            strokes_ns: std::mem::take(&mut self.strokes_ns),
            samples: std::mem::take(&mut self.samples),
            drawn: (0..self.shown.views.len()).map(|i| self.culling.drawn(i).len() as u64).sum(),
        };
        self.shown.report
    }

    pub(super) fn take_pending(&mut self) -> Pending {
        std::mem::take(&mut self.pending)
    }

    /// Takes back the list of changes, to reuse its memory.
    pub(super) fn give_back(&mut self, mut pending: Pending) {
        pending.changes.clear();
        if self.pending.changes.is_empty() {
            self.pending.changes = pending.changes;
        }
    }

    /// Records that the GPU has lost its data, so that all polygons are uploaded again.
    pub fn send_all_again(&mut self) {
        self.pending = Pending { is_other_scene: true, ..Pending::default() };
    }

    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn settle(&mut self) -> Result<(), Unwritten> {
        self.session.settle()
    }

    /// Ends the session regularly.
    ///
    /// # Errors
    /// A part of this session, or of a session that was closed before, could not be written.
    pub fn close(mut self) -> Result<(), Unwritten> {
        self.finish_gestures();
        self.end_hands_strokes();
        if let Err(error) = self.end_work() {
            // The window is closed, so standard error gets the message.
            let _ = writeln!(io::stderr().lock(), "warning: {error}");
        }
        let mut session = self.session;
        match session.leave() {
            Ok(said) => {
                for line in said {
                    let _ = writeln!(io::stderr().lock(), "warning: {line}");
                }
            }
            Err(unwritten) => _ = self.work.unwritten.get_or_insert(unwritten),
        }
        let (place, path) = (session.journal().place_of_edits(), session.path().to_owned());
        session.close()?;
        if let Some(place) = place {
            let path = quoted(&path.to_string_lossy());
            // The window is closed here, too.
            let _ = writeln!(io::stderr().lock(), "{place}; `osp sketch {path}` opens that file");
        }
        self.work.unwritten.map_or(Ok(()), Err)
    }

    /// The pose of the tracked head, world space.
    pub fn head(&self) -> Option<Pose> {
        self.input.hands.head()
    }
}
