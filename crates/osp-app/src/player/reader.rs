//! Reads a session that is to be replayed, step by step: whoever has little time at once takes a few steps and comes back.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{Player, Recorded, Snapshot};
use osp::{math::Aabb, polygon::Change};
use osp_render::background_for;
use osp_session::{
    recording::{self, Event, Header, OpenOptions, Pace, Pacer, RecordingError, Session},
    replay::{CameraChoice, CameraPath, SessionState},
    scene::Scene,
};

/// Snapshots kept at most.
pub(super) const MAX_SNAPSHOTS: usize = 32;
/// Largest weight of all snapshots together; 1 is about a hundred bytes.
const MAX_SNAPSHOT_WEIGHT: usize = 4_000_000;

/// A session on its way to a [`Player`]. A step opens the file, reads a frame, or plays one.
#[derive(Debug)]
pub struct PlayerReader {
    path: PathBuf,
    camera: CameraChoice,
    events: u64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    Closed(Pace, OpenOptions),
    Reading(Box<Reading>),
    Playing(Box<FirstPlay>),
    Over,
}

/// The events, cut into frames.
#[derive(Debug)]
struct Reading {
    pacer: Pacer<Session>,
    header: Header,
    frame: Vec<Event>,
    recorded: Recorded,
    remarks: Vec<String>,
}

impl PlayerReader {
    /// Reads this file, of which nothing is asked yet.
    pub fn new(path: &Path, pace: Pace, camera: CameraChoice, options: &OpenOptions) -> Self {
        let stage = Stage::Closed(pace, *options);
        Self { path: path.to_owned(), camera, events: 0, stage }
    }

    /// Events that were read.
    pub fn events(&self) -> u64 {
        self.events
    }

    /// Takes a step. Returns the player once it is there, which is once; a further step returns nothing.
    ///
    /// # Errors
    /// The file cannot be read, or is of no known format.
    pub fn step(&mut self) -> Result<Option<Player>, RecordingError> {
        self.stage = match std::mem::replace(&mut self.stage, Stage::Over) {
            Stage::Closed(pace, options) => {
                let session = recording::open(&self.path, &options)?;
                Stage::Reading(Box::new(Reading::new(session, pace)))
            }
            Stage::Reading(mut reading) => {
                let goes_on = reading.step();
                self.events = reading.recorded.events.len() as u64;
                if goes_on {
                    Stage::Reading(reading)
                } else {
                    let Reading { pacer, header, recorded, mut remarks, .. } = *reading;
                    remarks.extend(pacer.into_events().events.notes().warnings);
                    let path = self.path.clone();
                    Stage::Playing(Box::new(FirstPlay::new(path, header, recorded, self.camera, remarks)))
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
    fn new(session: Session, pace: Pace) -> Self {
        let header = session.header.clone();
        let recorded = Recorded { events: Vec::new(), frame_ends: Vec::new() };
        let pacer = Pacer::new(session, pace);
        Self { pacer, header, frame: Vec::new(), recorded, remarks: Vec::new() }
    }

    /// Reads a frame; `false` after the last one.
    fn step(&mut self) -> bool {
        let read = self.pacer.next_frame(&mut self.frame);
        let goes_on = matches!(read, Ok(true));
        if let Err(error) = read {
            self.remarks.push(format!("{error}: what comes before it is played"));
        }
        if !self.frame.is_empty() || goes_on {
            self.recorded.events.append(&mut self.frame);
            self.recorded.frame_ends.push(self.recorded.events.len());
        }
        goes_on
    }
}

/// Plays a whole session once; keeps the model at evenly spaced frames, where strokes begin, and the box of everything.
#[derive(Debug)]
pub(super) struct FirstPlay {
    player: Player,
    choice: CameraChoice,
    state: SessionState,
    changes: Vec<Change>,
    spacing: u64,
    kept_weight: usize,
    edit_weight: usize,
}

impl FirstPlay {
    pub(super) fn new(
        path: PathBuf,
        header: Header,
        recorded: Recorded,
        choice: CameraChoice,
        remarks: Vec<String>,
    ) -> Self {
        let player = Player {
            path,
            recorded: Arc::new(recorded),
            stroke_starts: Vec::new(),
            snapshots: Vec::new(),
            bounds: Aabb::EMPTY,
            background: background_for(&Scene::new()),
            camera: CameraPath::new(choice, header.camera, &Aabb::EMPTY),
            header,
            remarks,
            state: SessionState::keeping_groups_whole(),
            changes: Vec::new(),
            is_playing: false,
            speed: 1.0,
            due: 0.0,
        };
        let (state, changes) = (SessionState::keeping_groups_whole(), Vec::new());
        Self { player, choice, state, changes, spacing: 1, kept_weight: 0, edit_weight: 0 }
    }

    /// Plays a frame; `false` if there is no further one.
    pub(super) fn step(&mut self) -> bool {
        let Self { player, state, changes, .. } = self;
        let frame = state.moment.frame;
        if frame == player.frame_count() {
            return false;
        }
        let snapshots = &mut player.snapshots;
        if frame.is_multiple_of(self.spacing) {
            // A stroke weighs as much as three polygons, and what undo keeps of an edit a part of one.
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
        let events = player.recorded.of(frame);
        if events.iter().any(begins) {
            player.stroke_starts.push(frame);
        }
        self.edit_weight += events.iter().map(kept_by_undo).sum::<usize>();
        state.scene.let_go();
        state.play(events, changes);
        for change in changes {
            player.bounds = player.bounds.union(&state.scene.bounds_of_change(*change));
        }
        true
    }

    /// The player, before its first frame.
    pub(super) fn finish(self) -> Player {
        let Self { mut player, choice, state, .. } = self;
        player.background = background_for(&state.scene);
        player.camera = CameraPath::new(choice, player.header.camera, &player.bounds);
        player
    }
}

fn begins(event: &Event) -> bool {
    matches!(event, Event::Begin { .. } | Event::Polygon { stroke: None, .. })
}

/// The weight of an event's undo step.
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
