//! Reads a session for a replay in steps, so that a caller with little time can take a few steps between two frames.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{Recorded, Replay, Snapshot};
use crate::{
    journal::{Autosaves, Journal},
    session::{Session, Source},
};
use osp::{math::Aabb, polygon::Change};
use osp_render::background_for;
use osp_session::{
    recording::{self, Event, OpenOptions, Pace, Pacer, RecordingError},
    replay::{CameraChoice, CameraPath, Moment, SessionState, sees_most},
};

/// Largest number of snapshots.
pub(super) const MAX_SNAPSHOTS: usize = 32;
/// Largest total weight of all snapshots; a weight of 1 is about a hundred bytes.
const MAX_SNAPSHOT_WEIGHT: usize = 4_000_000;

impl Session {
    /// Reads a whole session of any format for a replay, positioned before its first frame. A damaged session plays up
    /// to the damage, which the remarks describe.
    pub fn to_play(path: &Path, pace: Pace, camera: CameraChoice) -> Result<Self, RecordingError> {
        Self::to_play_with(path, pace, camera, &OpenOptions::default())
    }

    /// Does the same as [`Session::to_play`], with options for the reader.
    ///
    /// # Errors
    /// The errors of [`Session::to_play`].
    pub fn to_play_with(
        path: &Path,
        pace: Pace,
        camera: CameraChoice,
        options: &OpenOptions,
    ) -> Result<Self, RecordingError> {
        let mut reader = ReplayReader::new(path, pace, camera, options);
        loop {
            if let Some(session) = reader.step()? {
                return Ok(session);
            }
        }
    }
}

/// Reads a session for a replay. Each step opens the file, reads a frame, or plays a frame.
#[derive(Debug)]
pub struct ReplayReader {
    path: PathBuf,
    camera: CameraChoice,
    /// Number of events read.
    pub events: u64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Closed(Pace, OpenOptions),
    Reading(Box<Reading>),
    Playing(Box<FirstPlay>),
    Over,
}

/// The reader, and the events read so far, divided into frames.
#[derive(Debug)]
struct Reading {
    pacer: Pacer<recording::Session>,
    journal: Journal,
    frame: Vec<Event>,
    recorded: Recorded,
    remarks: Vec<String>,
}

impl ReplayReader {
    /// A reader of this file; the first step opens it.
    pub fn new(path: &Path, pace: Pace, camera: CameraChoice, options: &OpenOptions) -> Self {
        let stage = Stage::Closed(pace, *options);
        Self { path: path.to_owned(), camera, events: 0, stage }
    }

    /// Takes a step. The last step returns the session; later steps return `None`.
    pub fn step(&mut self) -> Result<Option<Session>, RecordingError> {
        self.stage = match std::mem::replace(&mut self.stage, Stage::Over) {
            Stage::Closed(pace, options) => {
                let session = recording::open(&self.path, &options)?;
                // A replay has no autosave files.
                let journal = Journal::of_reader(&self.path, session.header.clone(), &Autosaves::new(None))?;
                Stage::Reading(Box::new(Reading::new(session, journal, pace)))
            }
            Stage::Reading(mut reading) => {
                let goes_on = reading.step();
                self.events = reading.recorded.events.len() as u64;
                if goes_on {
                    Stage::Reading(reading)
                } else {
                    let Reading { pacer, journal, recorded, mut remarks, .. } = *reading;
                    remarks.extend(pacer.into_events().events.notes().warnings);
                    Stage::Playing(Box::new(FirstPlay::new(journal, recorded, self.camera, remarks)))
                }
            }
            Stage::Playing(mut play) => match play.step() {
                true => Stage::Playing(play),
                false => return Ok(Some(play.finish())),
            },
            Stage::Over => Stage::Over,
        };
        Ok(None)
    }
}

impl Reading {
    fn new(session: recording::Session, journal: Journal, pace: Pace) -> Self {
        let recorded = Recorded { events: Vec::new(), frame_ends: Vec::new() };
        let pacer = Pacer::new(session, pace);
        Self { pacer, journal, frame: Vec::new(), recorded, remarks: Vec::new() }
    }

    /// Reads a frame. Returns `false` after the last frame.
    fn step(&mut self) -> bool {
        let read = self.pacer.next_frame(&mut self.frame);
        let goes_on = matches!(read, Ok(true));
        if let Err(error) = read {
            self.remarks.push(format!("{error}: only the part before it is played"));
        }
        if !self.frame.is_empty() || goes_on {
            self.recorded.events.append(&mut self.frame);
            self.recorded.frame_ends.push(self.recorded.events.len());
        }
        goes_on
    }
}

/// The first play of a whole session. It collects snapshots of the model at evenly spaced frames, the frames in which
/// strokes begin, and a box around all polygons.
#[derive(Debug)]
pub(super) struct FirstPlay {
    journal: Journal,
    recorded: Recorded,
    choice: CameraChoice,
    remarks: Vec<String>,
    stroke_starts: Vec<u64>,
    snapshots: Vec<Snapshot>,
    bounds: Aabb,
    state: SessionState,
    changes: Vec<Change>,
    spacing: u64,
    kept_weight: usize,
    edit_weight: usize,
}

impl FirstPlay {
    pub(super) fn new(
        journal: Journal,
        recorded: Recorded,
        choice: CameraChoice,
        remarks: Vec<String>,
    ) -> Self {
        Self {
            journal,
            recorded,
            choice,
            remarks,
            stroke_starts: Vec::new(),
            snapshots: Vec::new(),
            bounds: Aabb::EMPTY,
            state: SessionState::keeping_groups_whole(),
            changes: Vec::new(),
            spacing: 1,
            kept_weight: 0,
            edit_weight: 0,
        }
    }

    /// Plays a frame. Returns `false` after the last frame.
    pub(super) fn step(&mut self) -> bool {
        let Self { state, changes, snapshots, .. } = self;
        let frame = state.moment.frame;
        if frame == self.recorded.frame_ends.len() as u64 {
            return false;
        }
        if frame.is_multiple_of(self.spacing) {
            // A stroke weighs as much as three polygons. An edit weighs as much as one polygon, plus a quarter for each
            // stroke that it lists.
            let scene = &state.scene;
            let weight = scene.polygon_count() + 3 * scene.strokes().len() + self.edit_weight;
            self.kept_weight += weight;
            snapshots.push(Snapshot { state: state.clone(), weight });
        }
        while snapshots.len() > 2
            && (snapshots.len() > MAX_SNAPSHOTS || self.kept_weight > MAX_SNAPSHOT_WEIGHT)
        {
            self.spacing *= 2;
            snapshots.retain(|snapshot| snapshot.frames().is_multiple_of(self.spacing));
            self.kept_weight = snapshots.iter().map(|snapshot| snapshot.weight).sum();
        }
        changes.clear();
        let events = self.recorded.of(frame);
        if events.iter().any(begins) {
            self.stroke_starts.push(frame);
        }
        self.edit_weight += events.iter().map(kept_by_undo).sum::<usize>();
        state.scene.free_unreachable();
        state.play(events, changes);
        for change in changes {
            self.bounds = self.bounds.union(&state.scene.bounds_of_change(*change));
        }
        true
    }

    /// Returns the session, positioned before its first frame.
    pub(super) fn finish(self) -> Session {
        let Self { journal, recorded, choice, remarks, stroke_starts, snapshots, bounds, state, .. } = self;
        let camera = CameraPath::new(choice, journal.header().camera, &bounds);
        let has_fixed_camera =
            choice == CameraChoice::Auto && state.moment.head.is_none() && journal.header().camera.is_some();
        let is_camera_useful = !has_fixed_camera || sees_most(&camera.view(&state.moment), &state.scene);
        let mut replay = Replay {
            recorded: Arc::new(recorded),
            stroke_starts,
            snapshots,
            background: background_for(&state.scene),
            camera,
            is_camera_useful,
            remarks,
            moment: Moment::default(),
            changes: Vec::new(),
            is_playing: false,
            speed: 1.0,
            due: 0.0,
        };
        replay.speed = replay.minute_speed();
        let mut session = Session { source: Source::Replay(Box::new(replay)), ..Session::around(journal) };
        session.model.bounds = bounds;
        session
    }
}

fn begins(event: &Event) -> bool {
    matches!(event, Event::Begin { .. } | Event::Polygon { stroke: None, .. })
}

/// The weight of the undo step that an event adds.
fn kept_by_undo(event: &Event) -> usize {
    match event {
        Event::Erase { .. }
        | Event::Move { .. }
        | Event::Group { .. }
        | Event::Assign { .. }
        | Event::Place { .. } => 1 + event.list_len() / 4,
        _ => 0,
    }
}
