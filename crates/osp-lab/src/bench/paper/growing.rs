//! Figs. 19 and 21 to 23: polygons are added one after the other, and every frame inserts, culls and draws.

use std::{any::Any, ops::Range};

use super::{
    drawing::{Adapter, Drawer, Drawn},
    input::{PaperConfig, PaperError, PaperInput, mean},
};
use crate::{
    Contender, Method,
    bench::curves::grouped,
    rows::{Curves, Rows, quantile},
};
use osp::{
    frame::{FrameRecord, Pipeline},
    index::{IndexConfig, SpatialIndex},
    polygon::Change,
    view::View,
};
use osp_rivals::{CutNodes, IndexKind, InsertionCounts, OctreePaper, OctreePaperConfig, OspGrid, OspPaper};
use osp_session::{
    recording::{Event, RecordingError},
    replay::{Moment, Player, Summary},
    scene::Scene,
};

/// Number of consecutive frames that are measured together. The frame before them applies the changes of the skipped
/// frames, and does not count.
const STRETCH: u64 = 10;
/// Number of runs of consecutive frames that are measured in each band of sizes, besides those spread over the session.
const RUNS_OF_A_BAND: u64 = 6;
/// The sizes of Figs. 21 to 23, polygons.
const BANDS: [(&str, Range<u64>); 3] =
    [("up to 1,000 polygons", 0..1000), ("1,000 to 10,000", 1000..10_000), ("over 10,000", 10_000..u64::MAX)];

pub(super) const WHOLE: &str = "paper-growing/whole session";
const STILL: &str = "nothing inserted";
pub(super) const PART: &str = "paper-growing";

#[derive(Clone, Copy, Debug, Default)]
struct GrowingFrame {
    record: FrameRecord,
    /// Whether the frame belongs to the runs that are evenly spaced over the session.
    is_of_session: bool,
    /// 0 if the frame was not drawn.
    draw_ns: u64,
    /// Number of plane tests of polygons.
    planes: u64,
    in_view: u64,
}

impl GrowingFrame {
    fn total_us(&self) -> f64 {
        (self.record.total_ns() + self.draw_ns) as f64 / 1000.0
    }

    /// Number of polygons that were inserted, removed or moved.
    fn changed(&self) -> u64 {
        self.record.inserted + self.record.removed + self.record.updated
    }
}

/// The tests of planes during insertion, if the tree counts them.
fn insertions(index: &dyn SpatialIndex) -> Option<InsertionCounts> {
    let index: &dyn Any = index;
    let of_octree = || index.downcast_ref().map(OctreePaper::insertions);
    index.downcast_ref().map(OspPaper::insertions).or_else(of_octree)
}

struct Lane {
    pipeline: Pipeline,
    drawer: Option<Drawer>,
    frames: Vec<GrowingFrame>,
}

impl Lane {
    fn name(&self) -> &'static str {
        self.pipeline.index().name()
    }

    fn planes(&self) -> u64 {
        insertions(self.pipeline.index()).map_or(0, |counts| counts.planes)
    }

    fn frame(&mut self, scene: &Scene, changes: &[Change], view: &View) -> Result<GrowingFrame, PaperError> {
        let planes = self.planes();
        let record = self.pipeline.frame(scene, changes, view);
        let list = self.pipeline.in_view();
        let draw = match &mut self.drawer {
            Some(drawer) => drawer.draw(scene, view, list)?,
            None => Drawn::default(),
        };
        Ok(GrowingFrame {
            record,
            draw_ns: draw.total_ns(),
            planes: self.planes() - planes,
            ..GrowingFrame::default()
        })
    }
}

/// Creates a structure for the growing model: the paper's two trees as printed, other structures in their best form.
fn tree(kind: Contender, input: &PaperInput<'_>, config: &PaperConfig) -> Box<dyn SpatialIndex> {
    let index = IndexConfig { root: input.root, capacity: input.capacity() };
    match kind {
        Contender::Own(IndexKind::OspPaper) => {
            let cube = input.cube(config.cube());
            let grid = OspGrid::new(cube.center(), cube.extent().max_element(), config.depth());
            Box::new(OspPaper::new(grid, index.capacity).with_cut_nodes(CutNodes::Drawn))
        }
        Contender::Own(IndexKind::OctreePaper) => {
            let octree = OctreePaper::new(OctreePaperConfig::default(), &index);
            Box::new(octree.with_cut_nodes(CutNodes::Drawn))
        }
        kind => kind.create(&index),
    }
}

/// Measures the growing model. Returns the poses of the measured frames.
pub(super) fn grow<I>(
    rows: &mut Rows,
    input: &PaperInput<'_>,
    config: &PaperConfig,
    events: I,
    adapter: Option<&Adapter>,
) -> Result<Vec<Moment>, PaperError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let (lanes, reference, moments) = play(input, config, events, adapter)?;
    add(rows, input, &lanes, reference);
    Ok(moments)
}

/// Plays the session. Returns the lanes, the number of the reference among them, and the poses of the measured frames.
fn play<I>(
    input: &PaperInput<'_>,
    config: &PaperConfig,
    events: I,
    adapter: Option<&Adapter>,
) -> Result<(Vec<Lane>, usize, Vec<Moment>), PaperError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    // Adds `osp`, which finds exactly the polygons in view, and the reference for the ratios.
    let mut kinds = config.kinds.clone();
    for own in [IndexKind::Osp, config.reference].map(Contender::Own) {
        if !kinds.contains(&own) {
            kinds.push(own);
        }
    }
    let of =
        |name: IndexKind| kinds.iter().position(|&kind| kind == Contender::Own(name)).unwrap_or_default();
    let (exact, reference) = (of(IndexKind::Osp), of(config.reference));
    let mut lanes = Vec::new();
    for &kind in &kinds {
        let drawer = adapter.map(|adapter| adapter.drawer(Method::NONE)).transpose()?;
        let pipeline = Pipeline::new(tree(kind, input, config), input.capacity());
        lanes.push(Lane { pipeline, drawer, frames: Vec::new() });
    }
    let mut chosen = Chosen::new(input.summary, config.frames);
    let mut moments = Vec::new();
    let mut player = Player::new(events, input.pace);
    while player.step()? {
        let (scene, changes, moment) = (player.scene(), player.changes(), player.moment());
        for drawer in lanes.iter_mut().filter_map(|lane| lane.drawer.as_mut()) {
            drawer.follow(changes);
        }
        let polygons = lanes[exact].pipeline.polygon_count() as u64;
        let Some(Choice { counts, is_of_session }) = chosen.next(moment.frame, polygons) else {
            lanes.iter_mut().for_each(|lane| lane.pipeline.skip(scene, changes));
            continue;
        };
        let view = input.camera.0.view(&moment);
        // Another tree begins in each frame, so that the caches favour none.
        let (count, mut in_view) = (lanes.len(), 0);
        for i in 0..count {
            let i = (i + moment.frame as usize) % count;
            let frame = lanes[i].frame(scene, changes, &view)?;
            if counts {
                lanes[i].frames.push(GrowingFrame { is_of_session, ..frame });
            }
            if i == exact {
                in_view = frame.record.visible;
            }
        }
        for frame in lanes.iter_mut().filter(|_| counts).filter_map(|lane| lane.frames.last_mut()) {
            frame.in_view = in_view;
        }
        moments.extend(is_of_session.then_some(moment));
    }
    Ok((lanes, reference, moments))
}

/// Selects the frames to measure, in runs of consecutive frames. Some runs are evenly spaced over the session, the others
/// over the sizes of each band.
struct Chosen {
    frames: u64,
    most: u64,
    /// Sizes at which runs begin, polygons, in ascending order.
    sizes: Vec<u64>,
    /// Number of these sizes that the model has passed.
    passed: usize,
    /// Number of remaining frames of the run that began at the last passed size.
    left: u64,
    /// Whether the previous frame was measured.
    is_running: bool,
}

/// The choice of a frame that is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Choice {
    /// Whether the frame is part of the statistics: only if the previous frame was measured, too.
    counts: bool,
    /// Whether the frame is part of the statistics of the whole session.
    is_of_session: bool,
}

impl Chosen {
    fn new(summary: &Summary, most: u64) -> Self {
        let sizes = BANDS.iter().flat_map(|(_, band)| {
            let end = band.end.min(summary.counts.polygons);
            let size = end.saturating_sub(band.start);
            let run = move |run| band.start + size * (2 * run + 1) / (2 * RUNS_OF_A_BAND);
            (0..RUNS_OF_A_BAND).filter(move |_| size > 0).map(run)
        });
        Self { frames: summary.frames, most, sizes: sizes.collect(), passed: 0, left: 0, is_running: false }
    }

    /// Decides about the next frame, before which the model has this number of polygons. `None` if the frame is
    /// skipped.
    fn next(&mut self, frame: u64, polygons: u64) -> Option<Choice> {
        let passed = self.sizes.partition_point(|&size| size <= polygons).max(self.passed);
        self.left = if passed > self.passed { STRETCH + 1 } else { self.left.saturating_sub(1) };
        self.passed = passed;
        let of_session = measured(frame, self.frames, self.most);
        let was_running = std::mem::replace(&mut self.is_running, self.left > 0 || of_session.is_some());
        let is_of_session = of_session == Some(true);
        self.is_running.then_some(Choice { counts: was_running || is_of_session, is_of_session })
    }
}

/// Whether a frame of the runs that are evenly spaced over the session counts. `None` for a frame outside of these
/// runs. The first frame of each run does not count, because it applies the changes of the skipped frames.
fn measured(frame: u64, frames: u64, most: u64) -> Option<bool> {
    if frames <= most.max(2 * (STRETCH + 1)) {
        return Some(true);
    }
    let stretches = (most / STRETCH).max(2);
    let (last, gaps) = (frames - STRETCH - 1, stretches - 1);
    // The last run that begins at or before this frame.
    let number = (0..stretches).rev().find(|number| number * last / gaps <= frame)?;
    let at = frame - number * last / gaps;
    (at <= STRETCH).then_some(at > 0)
}

/// Whether a frame belongs to a part of the session.
type IsIn = Box<dyn Fn(&GrowingFrame) -> bool>;

fn add(rows: &mut Rows, input: &PaperInput<'_>, lanes: &[Lane], reference: usize) {
    rows.part(PART, "The paper: the model grows (Figs. 19, 21 to 23)");
    let of_band = |(name, band): (&'static str, Range<u64>)| -> (&'static str, IsIn) {
        (name, Box::new(move |frame| band.contains(&frame.record.polygons)))
    };
    let whole: IsIn = Box::new(|frame| frame.is_of_session);
    let still: IsIn = Box::new(|frame| frame.is_of_session && frame.changed() == 0);
    let parts = [("whole session", whole)].into_iter().chain(BANDS.map(of_band)).chain([(STILL, still)]);
    // All structures have the same frames.
    let Some(reference) = lanes.get(reference) else { return };
    for (part, is_in) in parts {
        for lane in lanes {
            let both = || lane.frames.iter().zip(&reference.frames).filter(|(_, other)| is_in(other));
            let frames: Vec<GrowingFrame> = both().map(|(frame, _)| *frame).collect();
            if frames.is_empty() {
                continue;
            }
            let times: Vec<(f64, f64)> =
                both().map(|(own, other)| (own.total_us(), other.total_us())).collect();
            let us =
                |ns: fn(&GrowingFrame) -> u64| frames.iter().map(|frame| ns(frame) as f64 / 1000.0).collect();
            let sum = |count: fn(&GrowingFrame) -> u64| frames.iter().map(count).sum::<u64>();
            let (changed, task) = (sum(GrowingFrame::changed), format!("{PART}/{part}"));
            let mut figures = rows.of(task, input.recording, lane.name());
            figures.against(&times).median("insert", "µs", us(|frame| frame.record.insert.ns));
            figures.median("cull", "µs", us(|frame| frame.record.cull.ns));
            if lane.drawer.is_some() {
                let mut rates: Vec<f64> =
                    frames.iter().map(|frame| 1.0e6 / frame.total_us().max(1.0e-3)).collect();
                rates.sort_unstable_by(f64::total_cmp);
                figures.median("insert_and_cull", "µs", us(|frame| frame.record.total_ns()));
                figures.median("draw", "µs", us(|frame| frame.draw_ns));
                figures.value("frames", "1/s", quantile(&rates, 0.5));
            }
            let counts_planes = insertions(lane.pipeline.index()).is_some() && changed > 0;
            figures
                .maybe(
                    "planes",
                    "1/polygon",
                    counts_planes.then(|| sum(|frame| frame.planes) as f64 / changed as f64),
                )
                .value("drawn", "polygons", mean(sum(|frame| frame.record.visible), frames.len()))
                .value("in_view", "polygons", mean(sum(|frame| frame.in_view), frames.len()));
        }
    }
    let line = |lane: &Lane| {
        let points = lane.frames.iter().map(|frame| (frame.record.frame as f64, frame.total_us()));
        (lane.name().to_owned(), grouped(points.collect()))
    };
    rows.curves.push(Curves {
        part: PART,
        title: format!("{}: the OSP tree and the octree as the model grows", input.recording),
        x: "frame",
        y: "µs",
        lines: lanes.iter().map(line).collect(),
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::occlusion::{NodeTest, Score};
    use osp_session::{
        recording::{Header, Pace, SynthKind, synthesize},
        replay::{self, Budget, CameraChoice, CameraPath, Replay, root_cube, summarize},
    };

    #[test]
    fn frames_between_the_measured_ones_leave_the_index_as_in_a_replay() {
        let (events, pace) = (|| synthesize(SynthKind::Scribble, 20_000, 1), Pace::Samples(4));
        let (summary, scene, read) = summarize(events(), pace);
        read.expect("a whole session");
        let camera = CameraPath::new(CameraChoice::Orbit, None, &summary.bounds);
        let root = root_cube(&Header::new("", ""), &summary.bounds);
        let input = PaperInput {
            recording: "s",
            summary: &summary,
            pace,
            camera: (camera, "orbit"),
            root,
            scene: &scene,
        };
        let config = PaperConfig {
            kinds: Vec::new(),
            reference: IndexKind::Osp,
            depths: vec![6],
            cubes: vec![1.0],
            frames: 60,
            verified: 0,
            occluders: 1,
            node_test: NodeTest::Box,
            score: Score::Paper,
        };
        let (lanes, ..) = play(&input, &config, events(), None).expect("a whole session");
        // One lane measures every frame, the other a frame of each part of the session.
        let index = || IndexKind::Osp.create(&IndexConfig { root, capacity: input.capacity() });
        let replayed = [u64::MAX, 0].map(|ns| {
            let pipeline = Pipeline::new(index(), input.capacity());
            replay::Lane::new(pipeline, Budget { ns, frames: summary.frames })
        });
        let mut replay = Replay::new(Player::new(events(), pace), camera, replayed.into());
        let (mut all, mut few) = (Vec::new(), Vec::new());
        while let Some([of_all, of_few]) = replay.step().expect("a whole session") {
            all.extend(of_all.map(|frame| frame.record.work));
            few.extend(of_few.map(|frame| (frame.record.frame, frame.record.work)));
        }
        assert_eq!(all.len() as u64, summary.frames);
        assert!(few.len() < 100, "{} frames", few.len());
        let grown = &lanes[0].frames;
        assert!(grown.len() > 100 && grown.len() * 2 < all.len(), "{} frames", grown.len());
        for (frame, work) in grown.iter().map(|frame| (frame.record.frame, frame.record.work)).chain(few) {
            assert_eq!(work, all[frame as usize], "frame {frame}");
        }
    }

    fn chosen(frames: u64, most: u64, polygons: u64) -> Chosen {
        let (mut summary, ..) = summarize(std::iter::empty(), Pace::Samples(1));
        summary.frames = frames;
        summary.counts.polygons = polygons;
        Chosen::new(&summary, most)
    }

    #[test]
    fn as_many_frames_count_as_are_wanted_all_over_the_session() {
        for (frames, most) in [(10, 90), (1000, 90), (12_345, 360), (91, 90), (30, 1)] {
            let mut chosen = chosen(frames, most, 0);
            let choices: Vec<_> = (0..frames).map(|frame| chosen.next(frame, 0)).collect();
            let of = |frame: u64| choices[frame as usize];
            let counted: Vec<u64> =
                (0..frames).filter(|&frame| of(frame).is_some_and(|of| of.is_of_session)).collect();
            assert!(counted.len() as u64 <= most.max(3 * STRETCH) + STRETCH, "{frames}: {}", counted.len());
            assert!(counted.len() as u64 >= frames.min(most) * 9 / 10, "{frames}: {}", counted.len());
            // A frame that counts is preceded by a measured frame.
            assert!(counted.iter().all(|&frame| frame == 0 || of(frame - 1).is_some()), "{frames}");
            assert!(counted.contains(&(frames - 1)) && counted.iter().any(|&frame| frame < 12), "{frames}");
        }
    }

    #[test]
    fn the_frames_of_a_band_are_spread_over_its_sizes() {
        // A polygon a frame.
        for polygons in [700, 12_000, 150_000] {
            let mut chosen = chosen(polygons, 60, polygons);
            let counted: Vec<u64> = (0..polygons)
                .filter(|&frame| chosen.next(frame, frame).is_some_and(|of| of.counts))
                .collect();
            assert!(counted.len() as u64 <= 80 + 3 * RUNS_OF_A_BAND * STRETCH, "{}", counted.len());
            for (name, band) in BANDS {
                let end = band.end.min(polygons);
                let Some(size) = end.checked_sub(band.start) else { continue };
                for part in 0..3 {
                    let part = band.start + size * part / 3..band.start + size * (part + 1) / 3;
                    let count = counted.iter().filter(|frame| part.contains(frame)).count() as u64;
                    assert!(count >= 2 * STRETCH - 1, "{name} of {polygons}: {count} in {part:?}");
                }
            }
        }
    }
}
