use super::Moment;
use crate::{
    polygon::Change,
    recording::{Event, Pace, Pacer, RecordingError},
    scene::Scene,
};

/// A session after some of its frames: the model, and where the head and the hand are.
#[derive(Clone, Debug, Default)]
pub struct SessionState {
    /// The model.
    pub scene: Scene,
    /// Poses, and the number of frames played.
    pub moment: Moment,
}

impl SessionState {
    /// Plays the events of a frame; what they change in the model is appended to `changes`.
    pub fn play(&mut self, events: &[Event], changes: &mut Vec<Change>) {
        events.iter().for_each(|event| self.moment.note(event));
        self.scene.apply_all(events, changes);
        self.moment.frame += 1;
    }
}

/// Plays a session frame by frame: reads a frame's events, applies them to the model and lists what has changed.
///
/// ```
/// # use osp::{recording::{Event, Pace}, replay::Player};
/// # let events: Vec<Result<Event, osp::recording::RecordingError>> = Vec::new();
/// let mut player = Player::new(events.into_iter(), Pace::Samples(16));
/// while player.step()? {
///     // Cull and draw `player.scene()`; the last frame's part of it is in `player.changes()`.
/// }
/// # Ok::<(), osp::recording::RecordingError>(())
/// ```
#[derive(Debug)]
pub struct Player<I> {
    pacer: Pacer<I>,
    state: SessionState,
    /// The model is finished: events only move the eye.
    is_walk: bool,
    events: Vec<Event>,
    changes: Vec<Change>,
}

impl<I: Iterator<Item = Result<Event, RecordingError>>> Player<I> {
    /// A player before the first frame of a session, with an empty model.
    pub fn new(events: I, pace: Pace) -> Self {
        Self {
            pacer: Pacer::new(events, pace),
            state: SessionState::default(),
            is_walk: false,
            events: Vec::new(),
            changes: Vec::new(),
        }
    }

    /// A walk through a finished model: the session's events only move the eye.
    pub fn walk(events: I, pace: Pace, scene: Scene) -> Self {
        let state = SessionState { scene, moment: Moment::default() };
        Self { state, is_walk: true, ..Self::new(events, pace) }
    }

    /// Plays the next frame; `false`: the session is over.
    ///
    /// # Errors
    /// The recording is damaged. The events before the damage have been played as a last frame, if there are any.
    pub fn step(&mut self) -> Result<bool, RecordingError> {
        let read = self.pacer.next_frame(&mut self.events);
        self.changes.clear();
        if self.events.is_empty() && !matches!(read, Ok(true)) {
            return read;
        }
        if self.is_walk {
            self.events.iter().for_each(|event| self.state.moment.note(event));
            self.state.moment.frame += 1;
        } else {
            self.state.scene.let_go();
            self.state.play(&self.events, &mut self.changes);
        }
        read
    }

    /// The model as it is now.
    pub fn scene(&self) -> &Scene {
        &self.state.scene
    }

    /// The model as it is now, without the player.
    pub fn into_scene(self) -> Scene {
        self.state.scene
    }

    /// The events of the last frame.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// What the last frame changed.
    pub fn changes(&self) -> &[Change] {
        &self.changes
    }

    /// The poses at the last frame, and its number: the first is 0.
    pub fn moment(&self) -> Moment {
        Moment { frame: self.frames().saturating_sub(1), ..self.state.moment }
    }

    /// Frames played so far.
    pub fn frames(&self) -> u64 {
        self.state.moment.frame
    }
}
