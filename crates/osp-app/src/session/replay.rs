//! A recorded session that plays, pauses, and jumps to any frame.

mod reader;

use std::sync::Arc;

use super::model::Model;
use osp::{
    polygon::{Change, Geometry, PolygonId},
    view::View,
};
use osp_session::{
    export::{KeptStrokes, PolygonTimes},
    recording::Event,
    replay::{CameraPath, Moment, SessionState},
    scene::Scene,
};

pub use reader::ReplayReader;

/// The changes to an index and a GPU scene after a jump to another frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Jump {
    /// The changes for the index, from the old model to the new one.
    pub changes: Vec<Change>,
    /// All polygons that have moved, visible or not. Includes polygons that moved earlier without a reported change.
    pub moved: Vec<PolygonId>,
    /// Number of polygons after the jump. New polygons get the ids from this number on.
    pub polygon_count: usize,
}

#[derive(Debug)]
struct Snapshot {
    state: SessionState,
    weight: usize,
}

impl Snapshot {
    fn frames(&self) -> u64 {
        self.state.moment.frame
    }
}

/// Largest speed, as a multiple of the recorded speed.
const FASTEST: f64 = 10_000.0;
/// Longest time that a replay makes up for between two frames of the window, seconds.
const LONGEST_FRAME_S: f32 = 1.0;

/// The state of a replay: the recording, the position, and the speed.
#[derive(Debug)]
pub struct Replay {
    recorded: Arc<Recorded>,
    /// Frames in which a stroke begins, ascending.
    pub stroke_starts: Vec<u64>,
    snapshots: Vec<Snapshot>,
    /// A background colour that contrasts with the finished model: linear red, green, blue.
    pub background: [f64; 3],
    camera: CameraPath,
    /// Whether the camera moves, or sees a good part of the finished model.
    pub is_camera_useful: bool,
    /// Warnings of the reader, one line each.
    pub remarks: Vec<String>,
    /// Poses of the current frame, and the number of frames played.
    moment: Moment,
    /// Memory for the changes during a jump.
    changes: Vec<Change>,
    is_playing: bool,
    speed: f64,
    /// The fraction of the next frame that is due.
    due: f64,
}

impl Replay {
    pub fn frame_count(&self) -> u64 {
        self.recorded.frame_ends.len() as u64
    }

    /// Number of frames played: 0 before the first frame.
    pub fn position(&self) -> u64 {
        self.moment.frame
    }

    /// Number of events in the frames played.
    pub(super) fn events_played(&self) -> u64 {
        let last =
            self.position().checked_sub(1).and_then(|last| self.recorded.frame_ends.get(last as usize));
        last.map_or(0, |&end| end as u64)
    }

    /// Time after this number of frames, seconds since the first event.
    pub fn secs_at(&self, frames: u64) -> f64 {
        let Recorded { events, frame_ends } = &*self.recorded;
        let time_of = |at: usize| events.get(at).map(Event::time_secs);
        let end = (frames as usize).checked_sub(1).and_then(|last| frame_ends.get(last)).copied();
        let last = end.and_then(|end| end.checked_sub(1)).and_then(time_of);
        match (time_of(0), last) {
            (Some(first), Some(last)) => (last - first).max(0.0),
            _ => 0.0,
        }
    }

    pub fn is_playing(&self) -> bool {
        self.is_playing
    }

    /// The speed, as a multiple of the recorded speed.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// The speed with which the session plays in a minute; a shorter session plays as fast as it was recorded.
    pub fn minute_speed(&self) -> f64 {
        (self.secs_at(self.frame_count()) / 60.0).clamp(1.0, FASTEST)
    }

    pub(super) fn set_speed(&mut self, speed: f64) {
        self.speed = if speed.is_finite() { speed.clamp(0.01, FASTEST) } else { 1.0 };
    }

    /// Mean number of recorded frames a second. Pauses of the artist would only be waited for, so frames play evenly.
    fn frames_a_second(&self) -> f64 {
        let secs = self.secs_at(self.frame_count());
        if secs > 0.0 { self.frame_count() as f64 / secs } else { 60.0 }
    }

    /// Plays or pauses. At the end, playing restarts from the first frame.
    pub(super) fn play(&mut self, model: &mut Model, run: bool) -> Option<Jump> {
        self.is_playing = run && self.frame_count() > 0;
        (self.is_playing && self.position() == self.frame_count()).then(|| self.seek(model, 0))
    }

    /// The view of the replay camera at the current frame.
    pub fn view(&self) -> View {
        self.camera.view(&self.moment)
    }

    /// Plays the recorded frames that are due after this time since the window's last frame, seconds. Returns the number
    /// of changes.
    pub(super) fn advance(&mut self, model: &mut Model, frame_secs: f32) -> usize {
        if !self.is_playing {
            return 0;
        }
        let before = model.changes.len();
        self.due += self.speed * self.frames_a_second() * f64::from(frame_secs.clamp(0.0, LONGEST_FRAME_S));
        while self.due >= 1.0 {
            self.due -= 1.0;
            if !self.step(model) {
                self.is_playing = false;
                self.due = 0.0;
            }
        }
        model.changes.len() - before
    }

    /// Plays one frame. Returns `false` at the end.
    pub(super) fn step(&mut self, model: &mut Model) -> bool {
        if self.position() == self.frame_count() {
            return false;
        }
        let events = self.recorded.of(self.position());
        events.iter().for_each(|event| self.moment.note(event));
        model.scene.apply_all(events, &mut model.changes);
        self.moment.frame += 1;
        true
    }

    /// Returns a function that finds the time at which each polygon of the current model was drawn. The function plays
    /// the session again up to the current frame. It may run on another thread, and stops when its argument returns
    /// `false`.
    pub fn polygon_times(&self) -> impl FnOnce(&dyn Fn() -> bool) -> PolygonTimes + Send + use<> {
        let (recorded, end) = (Arc::clone(&self.recorded), self.position());
        move |goes_on| recorded.polygon_times(end, goes_on)
    }

    /// Returns a function that finds the strokes of the current model. It may run on another thread. It calls its
    /// argument with the number of events, and returns `None` once this call returns `false`.
    pub(super) fn find_strokes(
        &self,
    ) -> impl FnOnce(&dyn Fn(u64) -> bool) -> Option<KeptStrokes> + Send + use<> {
        let (recorded, end) = (Arc::clone(&self.recorded), self.position());
        move |goes_on| recorded.strokes(end, goes_on)
    }

    pub(super) fn seek(&mut self, model: &mut Model, frames: u64) -> Jump {
        let frames = frames.min(self.frame_count());
        let best = self.snapshots.iter().rev().find(|snapshot| snapshot.frames() <= frames);
        let is_ahead = frames >= self.position();
        let mut state = match best {
            Some(snapshot) if !(is_ahead && snapshot.frames() <= self.position()) => snapshot.state.clone(),
            _ if is_ahead => SessionState { scene: model.scene.clone(), moment: self.moment },
            _ => SessionState::keeping_groups_whole(),
        };
        while state.moment.frame < frames {
            // `difference` below includes these changes.
            self.changes.clear();
            state.scene.free_unreachable();
            state.play(self.recorded.of(state.moment.frame), &mut self.changes);
        }
        let jump = difference(&model.scene, &state.scene);
        (model.scene, self.moment, self.due) = (state.scene, state.moment, 0.0);
        jump
    }
}

/// The changes between two models of the same session.
fn difference(from: &Scene, to: &Scene) -> Jump {
    let (old, new) = (from.polygon_count(), to.polygon_count());
    let mut jump = Jump { polygon_count: new, ..Jump::default() };
    // The polygon and its space may have moved in opposite directions, so that the polygon's position in the world is
    // unchanged.
    let is_elsewhere_in_space = |id| {
        from.space(id).is_some() && Geometry::bounds_in_space(from, id) != Geometry::bounds_in_space(to, id)
    };
    for id in (0..old.max(new) as u32).map(PolygonId) {
        let (in_old, in_new) = (id.index() < old, id.index() < new);
        let was_visible = in_old && from.is_visible(id);
        let is_visible = in_new && to.is_visible(id);
        let has_moved = in_old
            && in_new
            && (from.polygon(id) != to.polygon(id)
                || from.space(id) != to.space(id)
                || from.stroke_of(id).was_displaced_unseen());
        // The polygon's group may have moved as a whole since the polygon was uploaded to the GPU scene.
        if has_moved || (in_old && in_new && from.space(id).is_some()) {
            jump.moved.push(id);
        }
        match (was_visible, is_visible) {
            (true, false) => jump.changes.push(Change::Remove(id)),
            (false, true) => jump.changes.push(Change::Insert(id)),
            (true, true) if has_moved || is_elsewhere_in_space(id) => jump.changes.push(Change::Update(id)),
            _ => {}
        }
    }
    // The former transforms are unknown, so all spaces are placed again.
    jump.changes.extend(to.spaces().map(Change::Place));
    jump
}

/// The events of a session, divided into frames.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) events: Vec<Event>,
    /// For each frame, the index in `events` of its end.
    pub(super) frame_ends: Vec<usize>,
}

impl Recorded {
    pub(super) fn of(&self, frame: u64) -> &[Event] {
        let at = frame as usize;
        let start = if at == 0 { 0 } else { self.frame_ends[at - 1] };
        &self.events[start..self.frame_ends[at]]
    }

    /// Plays `end` frames and returns the time at which each polygon was drawn. Stops early if `goes_on` returns
    /// `false`.
    pub(super) fn polygon_times(&self, end: u64, goes_on: &dyn Fn() -> bool) -> PolygonTimes {
        let (mut state, mut times) = (SessionState::keeping_groups_whole(), PolygonTimes::default());
        let mut changes = Vec::new();
        for frame in (0..end).take_while(|_| goes_on()) {
            changes.clear();
            state.scene.free_unreachable();
            state.play(self.of(frame), &mut changes);
            times.note(self.of(frame), &state.scene);
        }
        times
    }

    /// Returns the strokes after `end` frames. Calls `goes_on` with the number of events. Returns `None` once `goes_on`
    /// returns `false`.
    pub(super) fn strokes(&self, end: u64, goes_on: &dyn Fn(u64) -> bool) -> Option<KeptStrokes> {
        let (mut kept, mut events) = (KeptStrokes::default(), 0);
        for frame in 0..end {
            self.of(frame).iter().for_each(|event| kept.note(event));
            events += self.of(frame).len() as u64;
            if !goes_on(events) {
                return None;
            }
        }
        Some(kept)
    }
}

#[cfg(test)]
mod tests {
    use super::{
        reader::{FirstPlay, MAX_SNAPSHOTS},
        *,
    };
    use crate::{
        journal::{Autosaves, Journal},
        session::Session,
    };
    use glam::{Quat, Vec3};
    use osp::{
        frame::Pipeline,
        index::BruteForce,
        view::{Projection, View},
    };
    use osp_session::{
        recording::{Author, GroupId, Header, StrokeId, Transform},
        replay::CameraChoice,
    };
    use std::path::Path;

    fn replay(session: &Session) -> &Replay {
        session.replay().expect("a replay")
    }

    fn player_of(events: Vec<Event>, frame_ends: Vec<usize>) -> Session {
        let recorded = Recorded { events, frame_ends };
        let journal = Journal::of_reader(Path::new(""), Header::new("", ""), &Autosaves::new(None));
        let mut play = FirstPlay::new(journal.expect("a header"), recorded, CameraChoice::Orbit, Vec::new());
        while play.step() {}
        play.finish()
    }

    /// The group and a stroke in it move in opposite directions. The stroke stays in place, but moves in the group's
    /// space.
    #[test]
    fn a_jump_tells_of_a_stroke_that_moved_against_its_group() {
        let (t, stroke, group) = (0.0, StrokeId(0), GroupId(0));
        let place = |x: f32| Event::Place {
            author: Author::SOLE,
            t,
            group,
            to: Transform { p: Vec3::X * x, q: Quat::IDENTITY, s: 1.0 },
        };
        let vertices = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let color = (1.0, 1.0, 1.0, 1.0);
        let events = vec![
            Event::Polygon { author: Author::SOLE, t, stroke: Some(stroke), vertices, shading: None, color },
            Event::Group { author: Author::SOLE, t, group, strokes: vec![stroke], parent: None, name: None },
            place(1.0),
            place(2.0),
            place(3.0),
            Event::Move { author: Author::SOLE, t, strokes: vec![stroke], by: -Vec3::X },
        ];
        let mut player = player_of(events, vec![3, 4, 6]);
        let mut pipeline = Pipeline::new(Box::new(BruteForce::new()), 16);
        let view = View::look_at(
            Vec3::new(2.2, 0.2, 3.0),
            Vec3::new(2.2, 0.2, 0.0),
            Projection::symmetric(5.0, 1.0, 0.1, 10.0),
        );
        for frame in [2, 3, 2, 3] {
            let jump = player.seek(frame).expect("a replay");
            let record = pipeline.frame(player.scene(), &jump.changes, &view);
            assert!(player.scene().space(PolygonId(0)).is_some());
            assert_eq!((record.polygons, record.visible), (1, 1), "at {frame}");
        }
    }

    #[test]
    fn it_stops_at_the_end_and_begins_again() {
        let events = vec![Event::Undo { author: Author::SOLE, t: 0.0 }; 100];
        let mut player = player_of(events, (1..=100).collect());
        assert!((9..=MAX_SNAPSHOTS).contains(&replay(&player).snapshots.len()));
        assert_eq!(player.play(true), None);
        // Without recorded times, 60 frames play in a second.
        player.set_speed(2.5);
        let mut shown = 0;
        while replay(&player).is_playing() {
            player.advance(1.0 / 60.0);
            shown += 1;
        }
        assert_eq!(replay(&player).position(), replay(&player).frame_count());
        assert!((shown as f64 - replay(&player).frame_count() as f64 / 2.5).abs() < 2.0);
        assert!(player.play(true).is_some_and(|jump| jump.polygon_count == 0));
        assert_eq!(replay(&player).position(), 0);
    }
}
