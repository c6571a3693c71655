use serde::Serialize;

use super::{Contender, Estimate, estimate::quantile};
use crate::report::{AgainstOneView, ReplayReport, RigReport, RunReport};
use osp::{
    frame::{FrameRecord, Pipeline, StageClock},
    index::IndexConfig,
    math::Aabb,
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, Pace, RecordingError},
    replay::{Budget, CameraPath, Lane, Player, Replay, RigPath, STRETCHES, Summary, stretch_of_frame},
};

/// A session as it is to be measured.
#[derive(Clone, Debug)]
pub struct SessionInput {
    /// Name of the recording.
    pub recording: String,
    /// What it holds at this pace.
    pub summary: Summary,
    /// How much of it a frame takes.
    pub pace: Pace,
    /// The camera's path, and its name.
    pub camera: (CameraPath, &'static str),
    /// The screens around the camera's eye, if each frame is culled for those of a rig.
    pub rig: Option<RigPath>,
    /// The modelling volume.
    pub root: Aabb,
    /// The indexes.
    pub kinds: Vec<Contender>,
    /// The index that the others are compared with, if it is among them.
    pub reference: IndexKind,
    /// Time to spend on measured frames of each index, seconds.
    pub budget_secs: f64,
}

/// A session through several indexes.
#[derive(Clone, Debug, Serialize)]
pub struct SessionResult {
    /// Name of the recording.
    pub recording: String,
    /// Strokes of the session.
    pub strokes: u64,
    /// Control points.
    pub points: u64,
    /// Polygons made.
    pub polygons: u64,
    /// Frames played.
    pub frames: u64,
    /// The pace, as on the command line.
    pub pace: String,
    /// The camera, as on the command line.
    pub camera: String,
    /// The rig whose screens every frame was culled for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rig: Option<RigReport>,
    /// Whether all indexes saw the same polygons in every frame.
    pub indexes_agree: bool,
    /// One for each index.
    pub rows: Vec<SessionRow>,
    /// The frames measured, of each index.
    #[serde(skip)]
    pub records: Vec<Vec<FrameRecord>>,
}

/// One index on a session. A frame is insertion and culling; drawing is not in it.
#[derive(Clone, Debug, Serialize)]
pub struct SessionRow {
    /// Name of the index.
    pub index: String,
    /// Insertion, over the frames that only inserted, nanoseconds a polygon.
    pub insert_ns_per_polygon: Estimate,
    /// Insertion of such a frame at 50, 99 and 100 per cent, microseconds.
    pub insert_us: [f64; 3],
    /// Culling, microseconds.
    pub cull_us: Estimate,
    /// A frame, microseconds.
    pub frame_us: Estimate,
    /// A frame at 99 and 100 per cent, microseconds.
    pub frame_high_us: [f64; 2],
    /// A frame of the reference, over the same frames, microseconds.
    pub reference_us: Estimate,
    /// Time of a frame, divided by the time that the reference took for the same frame.
    pub ratio: Estimate,
    /// Time of a frame, divided by the time that the fastest index (the one with the least `ratio`) took for the same frame.
    pub against_fastest: Estimate,
    /// Nodes visited, mean of the frames.
    pub nodes: f64,
    /// Boxes tested, mean of the frames.
    pub boxes: f64,
    /// Single box-plane tests, mean of the frames.
    pub planes: f64,
    /// The frames of a rig beside frames with one of their views.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub views: Option<ViewsRow>,
    /// Memory at the end, bytes for each polygon made.
    pub bytes_per_polygon: f64,
    /// Frames measured.
    pub frames_measured: usize,
}

/// The frames of a rig beside frames with one of their views.
#[derive(Clone, Debug, Serialize)]
pub struct ViewsRow {
    /// Views of a frame, mean.
    pub views: f64,
    /// What they cost.
    pub against_one_view: AgainstOneView,
}

impl ViewsRow {
    fn of(all: &[FrameRecord], one: &[FrameRecord]) -> Option<Self> {
        let with_views = || same_frames(all, one).filter(|(all, _)| all.views > 0);
        let times = |(all, one): (&FrameRecord, &FrameRecord)| (all.total_ns(), one.total_ns() * all.views);
        let against_one_view = AgainstOneView::of(with_views().map(times).collect())?;
        let views = with_views().map(|(all, _)| all.views).sum::<u64>() as f64 / with_views().count() as f64;
        Some(Self { views, against_one_view })
    }
}

/// Plays a session through the indexes. `progress` is called after every frame.
///
/// # Errors
/// The recording is damaged.
pub fn run_session<I>(
    input: &SessionInput,
    events: I,
    mut progress: impl FnMut(),
) -> Result<SessionResult, RecordingError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let summary = &input.summary;
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let config = IndexConfig { root: input.root, capacity };
    let budget = Budget { ns: (input.budget_secs * 1.0e9) as u64, frames: summary.frames };
    let lane = |kind: &Contender| {
        Lane::new(Pipeline::new(kind.create(&config), capacity, StageClock::default()), budget)
    };
    let mut lanes: Vec<Lane> = input.kinds.iter().map(lane).collect();
    if input.rig.is_some() {
        lanes.extend(input.kinds.iter().map(lane).map(|lane| lane.of_one_view(1)));
    }
    let run = |kind: &Contender| RunReport::new(kind.name(), summary.frames);
    let mut report = ReplayReport {
        recording: input.recording.clone(),
        strokes: summary.counts.strokes,
        points: summary.counts.points,
        polygons: summary.counts.polygons,
        frames: summary.frames,
        pace: input.pace.to_string(),
        camera: input.camera.1.to_owned(),
        rig: input.rig.as_ref().map(RigReport::new),
        runs: input.kinds.iter().map(run).collect(),
    };
    let mut records = vec![Vec::new(); lanes.len()];
    let mut replay = Replay::new(Player::new(events, input.pace), input.camera.0, lanes);
    if let Some(rig) = &input.rig {
        replay = replay.on_rig(rig.clone());
    }
    while let Some(outcomes) = replay.step()? {
        for (i, (records, frame)) in records.iter_mut().zip(outcomes).enumerate() {
            let Some(frame) = frame else { continue };
            // The lanes of one view come after the others.
            if let Some(run) = report.runs.get_mut(i) {
                run.add(frame);
            }
            if !frame.catches_up {
                records.push(frame.record);
            }
        }
        if let Some(rig) = &mut report.rig {
            rig.add(replay.rig_views());
        }
        progress();
    }
    let of_one_view = records.split_off(input.kinds.len());
    let reference = input
        .kinds
        .iter()
        .position(|&kind| kind == Contender::Own(input.reference))
        .map_or(&[][..], |i| &records[i]);
    let played = (summary.frames, summary.counts.polygons);
    let mut rows: Vec<SessionRow> = (input.kinds.iter().zip(replay.lanes()).zip(&records).enumerate())
        .map(|(i, ((kind, lane), records))| {
            let bytes = lane.pipeline().bytes();
            let views = of_one_view.get(i).and_then(|one| ViewsRow::of(records, one));
            SessionRow { views, ..row(kind.name(), records, reference, played, bytes) }
        })
        .collect();
    let measured = rows.iter().enumerate().filter(|(_, row)| row.ratio.values > 0);
    let fastest =
        measured.min_by(|(_, a), (_, b)| a.ratio.median.total_cmp(&b.ratio.median)).map(|(at, _)| at);
    if let Some(fastest) = fastest {
        for (row, of) in rows.iter_mut().zip(&records) {
            row.against_fastest = Compared::new(of, &records[fastest], summary.frames).ratio();
        }
    }
    Ok(SessionResult {
        indexes_agree: report.first_disagreement().is_none(),
        recording: report.recording,
        strokes: report.strokes,
        points: report.points,
        polygons: report.polygons,
        frames: report.frames,
        pace: report.pace,
        camera: match &report.rig {
            Some(rig) => rig.camera(&report.camera),
            None => report.camera,
        },
        rig: report.rig,
        rows,
        records,
    })
}

/// As many frames of every stretch of the session, evenly spaced: a slow index is measured on fewer of the late frames,
/// and its median must not be one of early frames for that. An eighth of the stretches may have fewer frames, of which all are
/// taken: where something else disturbed the machine for a moment, the time for a stretch is spent on one frame.
fn balanced(records: &[FrameRecord], frames: u64) -> Vec<FrameRecord> {
    if records.len() as u64 == frames {
        return records.to_vec();
    }
    let stretch = |record: &FrameRecord| stretch_of_frame(record.frame, frames);
    let chunks = || records.chunk_by(|a, b| stretch(a) == stretch(b));
    // The last stretches of a short session hold fewer frames, or none.
    let mut lengths: Vec<usize> = chunks().map(<[FrameRecord]>::len).collect();
    lengths.sort_unstable();
    debug_assert!(lengths.len() as u64 <= STRETCHES);
    let Some(&few) = lengths.get(lengths.len() / 8) else { return Vec::new() };
    let some = |chunk: &[FrameRecord]| {
        let count = few.min(chunk.len());
        (0..count).map(|i| chunk[i * chunk.len() / count]).collect::<Vec<_>>()
    };
    chunks().flat_map(some).collect()
}

/// The frames of one list that are in the other, too; both are in the order of the frames.
pub(super) fn same_frames<'a>(
    of: &'a [FrameRecord],
    against: &'a [FrameRecord],
) -> impl Iterator<Item = (&'a FrameRecord, &'a FrameRecord)> {
    of.iter().filter_map(|record| {
        let at = against.binary_search_by_key(&record.frame, |other| other.frame).ok()?;
        Some((record, &against[at]))
    })
}

/// Frames that two indexes were both measured on, as many of every stretch of the session.
struct Compared(Vec<(FrameRecord, FrameRecord)>);

impl Compared {
    fn new(of: &[FrameRecord], against: &[FrameRecord], frames: u64) -> Self {
        let both: Vec<FrameRecord> = same_frames(of, against).map(|(record, _)| *record).collect();
        let fair = balanced(&both, frames);
        Self(same_frames(&fair, against).map(|(a, b)| (*a, *b)).collect())
    }

    fn estimate(&self, value: impl Fn(&FrameRecord, &FrameRecord) -> f64) -> Estimate {
        let mut values: Vec<f64> = self.0.iter().map(|(a, b)| value(a, b)).collect();
        Estimate::of(&mut values).unwrap_or_default()
    }

    fn ratio(&self) -> Estimate {
        self.estimate(|a, b| a.total_ns().max(1) as f64 / b.total_ns().max(1) as f64)
    }
}

fn row(
    index: &str,
    records: &[FrameRecord],
    reference: &[FrameRecord],
    (frames, polygons): (u64, u64),
    bytes: usize,
) -> SessionRow {
    let compared = Compared::new(records, reference, frames);
    // The frames of a row are those that its ratio is of.
    let fair: Vec<FrameRecord> = match reference {
        [] => balanced(records, frames),
        _ => compared.0.iter().map(|(record, _)| *record).collect(),
    };
    let us = |ns: u64| ns as f64 / 1000.0;
    let estimate = |mut values: Vec<f64>| Estimate::of(&mut values).unwrap_or_default();
    let inserts = || fair.iter().filter(|record| record.inserted > 0 && record.removed + record.updated == 0);
    let mut insert_us: Vec<f64> = inserts().map(|record| us(record.insert.ns)).collect();
    insert_us.sort_unstable_by(f64::total_cmp);
    let mut frame_us: Vec<f64> = fair.iter().map(|record| us(record.total_ns())).collect();
    frame_us.sort_unstable_by(f64::total_cmp);
    let mean = |count: fn(&FrameRecord) -> u64| {
        fair.iter().map(|record| count(record) as f64).sum::<f64>() / fair.len().max(1) as f64
    };
    SessionRow {
        index: index.to_owned(),
        insert_ns_per_polygon: estimate(
            inserts().map(|record| record.insert.ns as f64 / record.inserted as f64).collect(),
        ),
        insert_us: [0.5, 0.99, 1.0].map(|q| quantile(&insert_us, q)),
        cull_us: estimate(fair.iter().map(|record| us(record.cull.ns)).collect()),
        frame_high_us: [0.99, 1.0].map(|q| quantile(&frame_us, q)),
        frame_us: estimate(frame_us),
        reference_us: compared.estimate(|_, other| us(other.total_ns())),
        ratio: compared.ratio(),
        against_fastest: Estimate::default(),
        nodes: mean(|record| record.work.nodes),
        boxes: mean(|record| record.work.boxes),
        planes: mean(|record| record.work.planes),
        views: None,
        bytes_per_polygon: bytes as f64 / polygons.max(1) as f64,
        frames_measured: records.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(frame: u64, ns: u64) -> FrameRecord {
        let mut record = FrameRecord { frame, ..FrameRecord::default() };
        record.cull.ns = ns;
        record
    }

    #[test]
    fn each_stretch_counts_alike_and_a_disturbed_one_does_not_empty_the_others() {
        // A frame in ten of the second half, and one frame of the very last stretch.
        let frames = 64 * STRETCHES;
        let is_measured = |&frame: &u64| match frame {
            early if early < frames / 2 => true,
            late if late < frames - 64 => late % 8 == 0,
            last => last == frames - 64,
        };
        let records: Vec<FrameRecord> =
            (0..frames).filter(is_measured).map(|frame| record(frame, 1)).collect();
        let fair = balanced(&records, frames);
        let late = fair.iter().filter(|record| record.frame >= frames / 2).count() as u64;
        assert_eq!(fair.len() as u64 - late, 8 * STRETCHES / 2);
        assert_eq!(late, 8 * (STRETCHES / 2 - 1) + 1);
        assert!(balanced(&[], frames).is_empty());
    }

    #[test]
    fn a_row_has_the_times_of_the_frames_that_its_ratio_is_of() {
        // The reference was measured in every other frame, and those are the short ones.
        let of: Vec<FrameRecord> =
            (0..100).map(|frame| record(frame, if frame % 2 == 0 { 3_000 } else { 90_000 })).collect();
        let reference: Vec<FrameRecord> = (0..50).map(|at| record(2 * at, 1_000)).collect();
        let row = row("a", &of, &reference, (100, 1), 0);
        assert_eq!((row.frame_us.median, row.reference_us.median, row.ratio.median), (3.0, 1.0, 3.0));
        assert_eq!(row.frame_us.values, row.reference_us.values);
        assert_eq!(row.frame_us.values, row.ratio.values);
        assert_eq!(row.frame_high_us, [3.0, 3.0]);
        let alone = super::row("a", &of, &[], (100, 1), 0);
        assert_eq!((alone.frame_us.values, alone.ratio.values), (100, 0));
    }
}
