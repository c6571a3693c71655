use super::{Player, SessionState};
use crate::{
    recording::{Event, Pace, RecordingError},
    scene::{Scene, SceneCounts},
};
use osp::{math::Aabb, polygon::Change};

/// Contents of a session, counted by reading it once.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    /// Counts of strokes, points, polygons and omitted parts.
    pub counts: SceneCounts,
    pub frames: u64,
    pub heads: u64,
    pub erases: u64,
    pub undos: u64,
    /// Number of move, group and place events.
    pub moves: u64,
    /// Smallest and largest time stamp, seconds.
    pub time_span_secs: Option<(f64, f64)>,
    /// Number of time stamps smaller than the previous one.
    pub backward_steps: u64,
    /// Box of all polygons that were visible after a frame, world space.
    pub bounds: Aabb,
}

/// Reads a session to its end, frame by frame. It stores only the scene.
///
/// # Errors
/// The recording is damaged. The summary and the scene then cover the part before the damage.
pub fn summarize<I>(events: I, pace: Pace) -> (Summary, Scene, Result<(), RecordingError>)
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let (summary, state, outcome) = summarize_each(Player::new(events, pace), |_, _| {});
    (summary, state.scene, outcome)
}

/// Does the same as [`summarize`] with a player before its first frame. Calls `each` after each frame with the frame's
/// events and the state, and also returns the last poses.
///
/// # Errors
/// The errors of [`summarize`].
pub fn summarize_each<I>(
    mut player: Player<I>,
    mut each: impl FnMut(&[Event], &SessionState),
) -> (Summary, SessionState, Result<(), RecordingError>)
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let mut summary = Summary {
        counts: SceneCounts::default(),
        frames: 0,
        heads: 0,
        erases: 0,
        undos: 0,
        moves: 0,
        time_span_secs: None,
        backward_steps: 0,
        bounds: Aabb::EMPTY,
    };
    let mut last_secs = f64::NEG_INFINITY;
    let outcome = loop {
        let outcome = player.step();
        for event in player.events() {
            let t = event.time_secs();
            summary.backward_steps += u64::from(t < last_secs);
            last_secs = t;
            let (first, last) = summary.time_span_secs.unwrap_or((t, t));
            summary.time_span_secs = Some((first.min(t), last.max(t)));
            match event {
                Event::Head { .. } => summary.heads += 1,
                Event::Erase { .. } => summary.erases += 1,
                Event::Undo { .. } | Event::Redo { .. } => summary.undos += 1,
                Event::Move { .. } | Event::Group { .. } | Event::Assign { .. } | Event::Place { .. } => {
                    summary.moves += 1
                }
                _ => {}
            }
        }
        for change in player.changes() {
            if let Change::Insert(id) | Change::Update(id) = *change {
                summary.bounds = summary.bounds.union(&player.scene().bounds(id));
            }
        }
        if !player.events().is_empty() {
            each(player.events(), player.state());
        }
        match outcome {
            Ok(true) => {}
            Ok(false) => break Ok(()),
            Err(error) => break Err(error),
        }
    };
    summary.frames = player.frames();
    let state = player.into_state();
    summary.counts = state.scene.counts();
    (summary, state, outcome)
}
