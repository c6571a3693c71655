use super::Moment;
use crate::{
    recording::{Event, Pace, Pacer, RecordingError},
    scene::Scene,
};
use osp::{
    frame::{Stage, StageClock},
    polygon::Change,
};

/// A session after a number of frames: the model, and the poses of head and hand.
#[derive(Clone, Debug, Default)]
pub struct SessionState {
    pub scene: Scene,
    pub moment: Moment,
}

impl SessionState {
    /// Creates the state before the first frame, with a scene in which groups [move as a
    /// whole](Scene::keeping_groups_whole).
    pub fn keeping_groups_whole() -> Self {
        Self { scene: Scene::keeping_groups_whole(), ..Self::default() }
    }

    /// Applies the events of a frame, and appends the model's changes to `changes`.
    pub fn play(&mut self, events: &[Event], changes: &mut Vec<Change>) {
        events.iter().for_each(|event| self.moment.note(event));
        self.scene.apply_all(events, changes);
        self.moment.frame += 1;
    }
}

/// Work for which [`Player::merging_frames`] merges no frames, in units of
/// [`SceneWork::total`](crate::scene::SceneWork::total): for each event, about as long as reading it, and about half a
/// second for a whole session. With less, sessions of groups that move for minutes would lose frames.
const WORK_AN_EVENT: u64 = 8;
const WORK_A_SESSION: u64 = 3 << 20;

/// A player of a session: for each frame it reads the events, applies them to the model and lists the changes.
///
/// ```
/// # use osp_session::{recording::{Event, Pace}, replay::Player};
/// # let events: Vec<Result<Event, osp_session::recording::RecordingError>> = Vec::new();
/// let mut player = Player::new(events.into_iter(), Pace::Samples(16));
/// while player.step()? {
///     // Cull and draw `player.scene()`; `player.changes()` are the changes of the last frame.
/// }
/// # Ok::<(), osp_session::recording::RecordingError>(())
/// ```
#[derive(Debug)]
pub struct Player<I> {
    pacer: Pacer<I>,
    state: SessionState,
    events: Vec<Event>,
    /// Number of events played, if frames are merged.
    merged: Option<u64>,
    changes: Vec<Change>,
    clock: StageClock,
    applying: Stage,
    /// The state that the only step gives, in place of events.
    finished: Option<SessionState>,
}

impl<I: Iterator<Item = Result<Event, RecordingError>>> Player<I> {
    /// A player before the first frame of a session, with an empty model.
    pub fn new(events: I, pace: Pace) -> Self {
        Self {
            pacer: Pacer::new(events, pace),
            state: SessionState::default(),
            events: Vec::new(),
            merged: None,
            changes: Vec::new(),
            clock: StageClock::default(),
            applying: Stage::default(),
            finished: None,
        }
    }

    /// Plays a finished model in place of the events: the only step inserts all its visible polygons. The poses and the
    /// number of the frame are those of `state`.
    #[must_use]
    pub fn at_once(self, state: SessionState) -> Self {
        Self { finished: Some(state), ..self }
    }

    /// Merges frames, up to about [`Pace::MOST_EVENTS`] events, while their events cost more work than it takes to read
    /// them. For readers that need the finished model. Merged frames count as several.
    #[must_use]
    pub fn merging_frames(self) -> Self {
        Self { merged: Some(0), ..self }
    }

    /// Makes groups [move as a whole](Scene::keeping_groups_whole). Call it before the first frame.
    #[must_use]
    pub fn keeping_groups_whole(self) -> Self {
        Self { state: SessionState::keeping_groups_whole(), ..self }
    }

    /// Plays the next frame. Returns `false` after the last frame.
    ///
    /// # Errors
    /// The recording is damaged. The events before the damage have been played as a last frame.
    pub fn step(&mut self) -> Result<bool, RecordingError> {
        self.changes.clear();
        self.applying = Stage::default();
        if let Some(state) = self.finished.take() {
            self.state = state;
            self.changes.extend(self.state.scene.visible_ids().map(Change::Insert));
            return Ok(true);
        }
        let mut read = self.pacer.next_frame(&mut self.events);
        if let Some(played) = &mut self.merged {
            let is_behind = self.state.scene.work().total() > *played * WORK_AN_EVENT + WORK_A_SESSION;
            while is_behind && matches!(read, Ok(true)) && self.events.len() < Pace::MOST_EVENTS {
                let first = self.events.len();
                read = self.pacer.extend_frame(&mut self.events);
                self.state.moment.frame += u64::from(self.events.len() > first || matches!(read, Ok(true)));
            }
            read = read.map(|has_more| has_more || !self.events.is_empty());
            *played += self.events.len() as u64;
        }
        if self.events.is_empty() && !matches!(read, Ok(true)) {
            return read;
        }
        let start = self.clock.start();
        self.state.scene.free_unreachable();
        self.state.play(&self.events, &mut self.changes);
        self.applying = self.clock.since(start);
        read
    }

    pub fn scene(&self) -> &Scene {
        &self.state.scene
    }

    /// The model after the last frame, the poses, and the number of frames played.
    pub fn state(&self) -> &SessionState {
        &self.state
    }

    /// Returns the state after the last frame and drops the player.
    pub fn into_state(self) -> SessionState {
        self.state
    }

    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Time to apply the events of the last frame to the model, without the time to read them.
    pub fn applying(&self) -> Stage {
        self.applying
    }

    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// The poses at the last frame, and the frame's number from 0.
    pub fn moment(&self) -> Moment {
        Moment { frame: self.frames().saturating_sub(1), ..self.state.moment }
    }

    pub fn frames(&self) -> u64 {
        self.state.moment.frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Author;
    use glam::Vec3;
    use std::path::Path;

    fn polygon(x: f32) -> Event {
        let vertices = vec![Vec3::X * x, Vec3::X * x + Vec3::Y, Vec3::X * (x + 1.0)];
        Event::Polygon {
            author: Author::SOLE,
            t: 0.0,
            stroke: None,
            vertices,
            shading: None,
            color: (1.0, 1.0, 1.0, 1.0),
        }
    }

    #[test]
    fn what_comes_before_damage_is_played() {
        let damage = RecordingError::io(Path::new("a.ron"), std::io::Error::other("torn"));
        let events = [Ok(polygon(0.0)), Ok(polygon(1.0)), Err(damage)];
        let mut player = Player::new(events.into_iter(), Pace::Samples(8));
        assert!(player.step().is_err());
        assert_eq!((player.frames(), player.scene().polygon_count(), player.changes().len()), (1, 2, 2));
        assert!(!player.step().expect("the session has ended"));
    }
}
