use super::{Contender, curves::grouped};
use crate::{
    report::{RunReport, first_disagreement},
    rows::{Curves, Figures, Rows},
};
use osp::{
    frame::{FrameRecord, Pipeline},
    index::IndexConfig,
    math::Aabb,
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, Pace, RecordingError},
    replay::{Budget, CameraPath, Lane, PARTS_OF_SESSION, Player, Replay, Summary, part_of_frame},
};

const PART: &str = "session";

#[derive(Clone, Debug)]
pub struct SessionInput {
    pub recording: String,
    /// Summary of the session at this pace.
    pub summary: Summary,
    /// Part of the session that each frame plays.
    pub pace: Pace,
    pub camera: (CameraPath, &'static str),
    /// The modelling volume.
    pub root: Aabb,
    pub kinds: Vec<Contender>,
    /// The reference, with which the others are compared; it is one of `kinds`.
    pub reference: IndexKind,
    /// Time for the measured frames of each index, seconds.
    pub budget_secs: f64,
}

/// Plays a session through the indexes; the rows are the part `session`. `progress` is called after every frame. A
/// frame inserts and culls; nothing is drawn.
pub fn run_session<I>(
    input: &SessionInput,
    events: I,
    mut progress: impl FnMut(),
) -> Result<Rows, RecordingError>
where
    I: Iterator<Item = Result<Event, RecordingError>>,
{
    let summary = &input.summary;
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let config = IndexConfig { root: input.root, capacity };
    let budget = Budget { ns: (input.budget_secs * 1.0e9) as u64, frames: summary.frames };
    let lane = |kind: &Contender| Lane::new(Pipeline::new(kind.create(&config), capacity), budget);
    let lanes: Vec<Lane> = input.kinds.iter().map(lane).collect();
    let mut rows = Rows::default();
    // The fingerprints of the polygons that the indexes found, frame by frame.
    let mut seen: Vec<RunReport> =
        input.kinds.iter().map(|kind| RunReport::new(kind.name(), summary.frames)).collect();
    let mut records = vec![Vec::new(); lanes.len()];
    let mut replay = Replay::new(Player::new(events, input.pace), input.camera.0, lanes);
    while let Some(outcomes) = replay.step()? {
        for ((records, run), frame) in records.iter_mut().zip(&mut seen).zip(outcomes) {
            let Some(frame) = frame else { continue };
            run.add(frame);
            if !frame.catches_up {
                records.push(frame.record);
            }
        }
        progress();
    }
    rows.load = replay.load();
    let reference = input.kinds.iter().position(|&kind| kind == Contender::Own(input.reference));
    let reference = reference.map_or(&[][..], |i| &records[i]);
    let name = input.recording.as_str();
    rows.part(PART, "Sessions: insertion and culling of a frame, nothing is drawn");
    rows.note(PART, format!("{name}: {}, camera {}.", input.pace, input.camera.1));
    if let Some((a, b, frame)) = first_disagreement(&seen) {
        rows.faults.push(format!(
            "NOT ALL INDEXES FOUND THE SAME POLYGONS in {name}: {a} and {b} differ in frame {frame}."
        ));
    }
    let counts = summary.counts;
    rows.of(PART, name, "")
        .value("polygons", "polygons", counts.polygons as f64)
        .value("frames", "frames", summary.frames as f64)
        .value("strokes", "strokes", counts.strokes as f64)
        .value("points", "points", counts.points as f64);
    for ((kind, lane), records) in input.kinds.iter().zip(replay.lanes()).zip(&records) {
        let mut figures = rows.of(PART, name, kind.name());
        add(&mut figures, records, reference, summary.frames);
        let bytes = lane.pipeline().bytes() as f64;
        figures.value("memory", "bytes/polygon", bytes / counts.polygons.max(1) as f64);
    }
    let line = |value: fn(&FrameRecord) -> Option<(f64, f64)>| {
        let of = |(kind, records): (&Contender, &Vec<FrameRecord>)| {
            (kind.name().to_owned(), grouped(records.iter().filter_map(value).collect()))
        };
        input.kinds.iter().zip(&records).map(of).collect()
    };
    rows.curves.push(Curves {
        part: PART,
        title: format!("{name}: time of a frame"),
        x: "frame",
        y: "µs",
        lines: line(|record| Some((record.frame as f64, us(record.total_ns())))),
    });
    rows.curves.push(Curves {
        part: PART,
        title: format!("{name}: inserting the polygons of a frame"),
        x: "polygons",
        y: "µs",
        lines: line(|record| (record.inserted > 0).then(|| (record.polygons as f64, us(record.insert.ns)))),
    });
    Ok(rows)
}

fn us(ns: u64) -> f64 {
    ns as f64 / 1000.0
}

/// Selects the same number of frames, evenly spaced, from every part of the session. A slow index is measured on fewer
/// late frames, so without this selection its median would describe the early frames. An eighth of the parts may have
/// fewer frames, because one disturbance of the machine can use up a part's budget. All frames of such a part are
/// selected.
fn balanced(records: &[FrameRecord], frames: u64) -> Vec<FrameRecord> {
    if records.len() as u64 == frames {
        return records.to_vec();
    }
    let part = |record: &FrameRecord| part_of_frame(record.frame, frames);
    let chunks = || records.chunk_by(|a, b| part(a) == part(b));
    // The last parts of a short session have fewer frames, or none.
    let mut lengths: Vec<usize> = chunks().map(<[FrameRecord]>::len).collect();
    lengths.sort_unstable();
    debug_assert!(lengths.len() as u64 <= PARTS_OF_SESSION);
    let Some(&few) = lengths.get(lengths.len() / 8) else { return Vec::new() };
    let some = |chunk: &[FrameRecord]| {
        let count = few.min(chunk.len());
        (0..count).map(|i| chunk[i * chunk.len() / count]).collect::<Vec<_>>()
    };
    chunks().flat_map(some).collect()
}

fn same_frames<'a>(
    of: &'a [FrameRecord],
    against: &'a [FrameRecord],
) -> impl Iterator<Item = (&'a FrameRecord, &'a FrameRecord)> {
    of.iter().filter_map(|record| {
        let at = against.binary_search_by_key(&record.frame, |other| other.frame).ok()?;
        Some((record, &against[at]))
    })
}

/// Adds the times of the frames on which both the index and the reference were measured, the same number from every
/// part of the session.
fn add(figures: &mut Figures<'_>, records: &[FrameRecord], reference: &[FrameRecord], frames: u64) {
    let both: Vec<FrameRecord> = same_frames(records, reference).map(|(record, _)| *record).collect();
    let fair = balanced(&both, frames);
    let pairs: Vec<(f64, f64)> =
        same_frames(&fair, reference).map(|(a, b)| (us(a.total_ns()), us(b.total_ns()))).collect();
    let inserts = || fair.iter().filter(|record| record.inserted > 0 && record.removed + record.updated == 0);
    let mean = |count: fn(&FrameRecord) -> u64| {
        fair.iter().map(|record| count(record) as f64).sum::<f64>() / fair.len().max(1) as f64
    };
    figures
        .against(&pairs)
        .median("insert", "ns/polygon", inserts().map(|r| r.insert.ns as f64 / r.inserted as f64).collect())
        .spread("insert", inserts().map(|record| us(record.insert.ns)).collect())
        .median("cull", "µs", fair.iter().map(|record| us(record.cull.ns)).collect())
        .counted("nodes", "1/frame", mean(|record| record.work.nodes))
        .counted("boxes", "1/frame", mean(|record| record.work.boxes))
        .counted("planes", "1/frame", mean(|record| record.work.planes));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(frame: u64, ns: u64) -> FrameRecord {
        let mut record = FrameRecord::default();
        record.frame = frame;
        record.cull.ns = ns;
        record
    }

    #[test]
    fn each_stretch_counts_alike_and_a_disturbed_one_does_not_empty_the_others() {
        // Every eighth frame of the second half, and one frame of the very last part.
        let frames = 64 * PARTS_OF_SESSION;
        let is_measured = |&frame: &u64| match frame {
            early if early < frames / 2 => true,
            late if late < frames - 64 => late % 8 == 0,
            last => last == frames - 64,
        };
        let records: Vec<FrameRecord> =
            (0..frames).filter(is_measured).map(|frame| record(frame, 1)).collect();
        let fair = balanced(&records, frames);
        let late = fair.iter().filter(|record| record.frame >= frames / 2).count() as u64;
        assert_eq!(fair.len() as u64 - late, 8 * PARTS_OF_SESSION / 2);
        assert_eq!(late, 8 * (PARTS_OF_SESSION / 2 - 1) + 1);
        assert!(balanced(&[], frames).is_empty());
    }

    #[test]
    fn a_row_has_the_times_of_the_frames_that_its_ratio_is_of() {
        // The reference was measured on every second frame; these frames are short.
        let of: Vec<FrameRecord> =
            (0..100).map(|frame| record(frame, if frame % 2 == 0 { 3_000 } else { 90_000 })).collect();
        let reference: Vec<FrameRecord> = (0..50).map(|at| record(2 * at, 1_000)).collect();
        let mut rows = Rows::default();
        add(&mut rows.of(PART, "r", "a"), &of, &reference, 100);
        let figure = |figure| rows.value(PART, "r", "a", figure);
        assert_eq!([figure("time"), figure("reference"), figure("ratio")], [Some(3.0), Some(1.0), Some(3.0)]);
        assert_eq!([figure("p99"), figure("max")], [Some(3.0), Some(3.0)]);
        assert!(figure("values") >= Some(30.0) && figure("values") <= Some(50.0));
    }
}
