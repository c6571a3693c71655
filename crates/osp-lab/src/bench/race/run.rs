use thiserror::Error;

use super::{Racer, plot::ModelPlot};
use crate::Contender;
use osp::{
    frame::Pipeline,
    index::{IndexConfig, SpatialIndex},
    math::Aabb,
    view::View,
};
use osp_session::{
    platform::time::Load,
    recording::{Event, Pace, RecordingError},
    replay::{Budget, CameraPath, Lane, Player, Replay, SessionFingerprint, Summary},
};

#[derive(Clone, Debug)]
pub struct RaceInput {
    pub recording: String,
    pub summary: Summary,
    /// Part of the session that each frame plays.
    pub pace: Pace,
    pub camera: (CameraPath, &'static str),
    /// The modelling volume.
    pub root: Aabb,
    pub kinds: Vec<Contender>,
}

#[derive(Debug, Error)]
pub enum RaceError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error("{recording}: {first} and {second} found different polygons in frame {frame}")]
    Differ { recording: String, first: &'static str, second: &'static str, frame: u64 },
}

/// A race after a number of frames.
#[derive(Clone, Debug)]
pub struct Race {
    pub recording: String,
    pub(super) pace: Pace,
    pub(super) camera: &'static str,
    pub frames: u64,
    pub(super) polygons: u64,
    /// Number of polygons in the model after each played frame.
    pub(super) present: Vec<u64>,
    /// Fingerprints of the polygons in view, the same for all structures.
    pub(super) fingerprint: SessionFingerprint,
    /// Number of races of which this race has the shortest frame times.
    pub(super) runs: u32,
    /// How undisturbed the races were.
    pub(super) load: Load,
    /// The structures in the order of the input.
    pub racers: Vec<Racer>,
}

impl Race {
    fn new(input: &RaceInput, names: impl Iterator<Item = &'static str>) -> Self {
        Self {
            recording: input.recording.clone(),
            pace: input.pace,
            camera: input.camera.1,
            frames: input.summary.frames,
            polygons: input.summary.counts.polygons,
            present: Vec::new(),
            fingerprint: SessionFingerprint::new(),
            runs: 1,
            load: Load::default(),
            racers: names.map(Racer::new).collect(),
        }
    }

    /// Number of polygons in the model after the last played frame.
    pub fn present(&self) -> u64 {
        self.present.last().copied().unwrap_or(0)
    }

    /// Fingerprint of the polygons in view in all played frames. It is the same for all structures, and equals the
    /// fingerprint that `osp replay` prints for the same camera and pace.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint.value()
    }

    /// Returns for each frame the smaller of the times in this race and in another race with the same input. Both do
    /// the same work. So the longer time includes work of other programs on the same core.
    #[must_use]
    pub fn least(mut self, other: &Self) -> Self {
        self.load += other.load;
        let pairs = self.racers.iter().zip(&other.racers);
        let racers = pairs.map(|(racer, other)| racer.least(other, &self.present)).collect();
        Self { racers, runs: self.runs + other.runs, ..self }
    }
}

/// A race that is being played. A frame is insertion, commit and culling for the session's own view; nothing is drawn.
/// One thread runs all structures. Each frame begins with another structure.
#[derive(Debug)]
pub struct RaceRun<I> {
    /// The race up to the last frame that was played.
    pub race: Race,
    replay: Replay<I>,
    plot: Option<ModelPlot>,
}

impl<I: Iterator<Item = Result<Event, RecordingError>>> RaceRun<I> {
    /// A race of new structures, before its first frame.
    pub fn new(input: &RaceInput, events: I) -> Self {
        let config = IndexConfig { root: input.root, capacity: capacity(input) };
        Self::of(input, input.kinds.iter().map(|kind| kind.create(&config)).collect(), events)
    }

    /// A race of these empty structures.
    fn of(input: &RaceInput, indexes: Vec<Box<dyn SpatialIndex>>, events: I) -> Self {
        let race = Race::new(input, indexes.iter().map(|index| index.name()));
        // Every frame is measured, however long it takes.
        let budget = Budget { ns: u64::MAX, frames: input.summary.frames };
        let lane = |index| Lane::new(Pipeline::new(index, capacity(input)), budget);
        let lanes = indexes.into_iter().map(lane).collect();
        let replay = Replay::new(Player::new(events, input.pace), input.camera.0, lanes);
        Self { race, replay, plot: None }
    }

    /// Also draws the growing model in each frame; the measured times exclude the drawing. `size` is the picture's
    /// width and height in pixels, `ground` the background's colour (sRGB). The view must have the picture's aspect
    /// ratio.
    #[must_use]
    pub fn with_picture(self, view: View, size: (u32, u32), ground: [u8; 3]) -> Self {
        Self { plot: Some(ModelPlot::new(view, size, ground)), ..self }
    }

    /// The model after the last frame: red, green and blue bytes, rows from the top. Empty without
    /// [`RaceRun::with_picture`]. O(pixels), plus O(polygons) after a frame that removed or changed polygons.
    pub fn picture(&mut self) -> Vec<u8> {
        self.plot.as_mut().map_or_else(Vec::new, |plot| plot.picture(self.replay.scene()))
    }

    /// Plays the next frame through all structures. Returns `false` if the race has ended.
    ///
    /// # Errors
    /// The recording is damaged here, or two structures find different polygons in view. [`RaceRun::race`] contains the
    /// frame in which they differ.
    pub fn step(&mut self) -> Result<bool, RaceError> {
        let race = &mut self.race;
        let Some(outcomes) = self.replay.step()? else {
            race.load = self.replay.load();
            for (racer, lane) in race.racers.iter_mut().zip(self.replay.lanes()) {
                racer.bytes = lane.pipeline().bytes();
            }
            return Ok(false);
        };
        let (mut first, mut differs, mut number, mut polygons) = (None, None, 0, 0);
        for (racer, outcome) in race.racers.iter_mut().zip(outcomes) {
            let Some(frame) = outcome else { continue };
            racer.add(frame.record.total_ns(), frame.record.polygons);
            racer.in_view = frame.record.visible;
            (number, polygons) = (frame.record.frame, frame.record.polygons);
            let &mut (first, in_view) = first.get_or_insert((racer.name, frame.in_view));
            if frame.in_view != in_view {
                differs.get_or_insert((first, racer.name, frame.record.frame));
            }
        }
        if let Some((_, in_view)) = first {
            race.fingerprint.add(number, in_view);
        }
        race.present.push(polygons);
        if let Some(plot) = &mut self.plot {
            plot.follow(self.replay.scene(), self.replay.changes());
        }
        match differs {
            Some((first, second, frame)) => {
                Err(RaceError::Differ { recording: race.recording.clone(), first, second, frame })
            }
            None => Ok(true),
        }
    }
}

fn capacity(input: &RaceInput) -> usize {
    usize::try_from(input.summary.counts.polygons).unwrap_or(usize::MAX)
}

/// Plays a whole [`RaceRun`]. `progress` is called after every frame.
///
/// # Errors
/// The recording is damaged, or two structures find different polygons in view.
pub fn race<I>(input: &RaceInput, events: I, progress: impl FnMut(&Race)) -> Result<Race, RaceError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    to_the_end(RaceRun::new(input, events), progress)
}

fn to_the_end<I>(mut run: RaceRun<I>, mut progress: impl FnMut(&Race)) -> Result<Race, RaceError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    while run.step()? {
        progress(&run.race);
    }
    Ok(run.race)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::{index::BruteForce, polygon::PolygonId};
    use osp_rivals::IndexKind;
    use osp_session::{
        recording::{Header, SynthKind, synthesize},
        replay::{CameraChoice, root_cube, summarize},
    };
    use osp_testkit::Altered;

    fn events() -> impl Iterator<Item = Result<Event, RecordingError>> {
        synthesize(SynthKind::Scribble, 200, 1)
    }

    fn input() -> RaceInput {
        let pace = Pace::Samples(16);
        let (summary, _, read) = summarize(events(), pace);
        read.expect("a whole session");
        let camera = CameraPath::new(CameraChoice::Orbit, None, &summary.bounds);
        RaceInput {
            recording: "s".to_owned(),
            summary,
            pace,
            camera: (camera, CameraChoice::Orbit.name()),
            root: root_cube(&Header::new("", ""), &summary.bounds),
            kinds: vec![Contender::Own(IndexKind::Osp), Contender::Own(IndexKind::OctreeRebuild)],
        }
    }

    #[test]
    fn a_structure_that_loses_a_polygon_is_found_in_the_frame_in_which_it_does() {
        let input = input();
        let of = |lost| -> Vec<Box<dyn SpatialIndex>> {
            let loses = Altered::by(move |list| list.retain(|&id| id != PolygonId(lost)));
            vec![Box::new(BruteForce::default()), Box::new(loses)]
        };
        let mut frames = 0;
        let mut run = RaceRun::of(&input, of(100), events());
        let error = loop {
            match run.step() {
                Ok(is_on) => assert!(is_on, "one is lost"),
                Err(error) => break error,
            }
            frames += 1;
        };
        let said = format!("s: brute-force and altered found different polygons in frame {frames}");
        assert_eq!(error.to_string(), said);
        assert!(frames > 1, "the frames before are those of a race");
        let [all, fewer] = [0, 1].map(|at| run.race.racers[at].in_view);
        assert_eq!(all, fewer + 1, "the figures are those of the frame");
        assert_eq!(run.race.racers[1].times_ns.len(), frames + 1);
        let whole = to_the_end(RaceRun::of(&input, of(u32::MAX), events()), |_| ());
        assert!(whole.is_ok(), "there is none with this number");
    }
}
