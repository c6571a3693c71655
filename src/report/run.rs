use hdrhistogram::Histogram;
use serde::Serialize;

use crate::{
    metrics::{FrameRecord, SessionFingerprint},
    visibility::LaneFrame,
};

/// Frames before which allocations count as warm-up, as a fraction of the session.
const WARM_UP: (u64, u64) = (1, 2);

/// One index's way through a session, gathered frame by frame.
#[derive(Clone, Debug)]
pub struct RunReport {
    /// Name of the index.
    pub index: String,
    /// Frames of the session.
    session_frames: u64,
    insert_ns: u64,
    inserted: u64,
    cull_ns: Histogram<u64>,
    frame_ns: Histogram<u64>,
    visible: u64,
    culled: u64,
    measured: u64,
    allocations_steady: u64,
    fingerprint: SessionFingerprint,
    frames: Vec<(u64, u64)>,
    curve: Vec<CurvePoint>,
    /// Memory of the index at the end, bytes.
    pub bytes: usize,
    /// Changes that the index refused.
    pub refused: u64,
}

/// A measured frame, for the chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurvePoint {
    pub(super) frame: u64,
    pub(super) polygons: u64,
    pub(super) total_ns: u64,
}

impl RunReport {
    /// A report without frames.
    pub fn new(index: impl Into<String>, session_frames: u64) -> Self {
        Self {
            index: index.into(),
            session_frames,
            insert_ns: 0,
            inserted: 0,
            cull_ns: histogram(),
            frame_ns: histogram(),
            visible: 0,
            culled: 0,
            measured: 0,
            allocations_steady: 0,
            fingerprint: SessionFingerprint::new(),
            frames: Vec::new(),
            curve: Vec::new(),
            bytes: 0,
            refused: 0,
        }
    }

    /// Adds a frame.
    pub fn add(&mut self, frame: &LaneFrame) {
        let record = &frame.record;
        self.fingerprint.add(record.frame, record.fingerprint);
        self.frames.push((record.frame, record.fingerprint));
        if !frame.catches_up {
            self.measure(record);
        }
    }

    fn measure(&mut self, record: &FrameRecord) {
        self.measured += 1;
        if record.inserted > 0 {
            self.insert_ns += record.insert.ns;
            self.inserted += record.inserted;
        }
        self.cull_ns.saturating_record(record.cull.ns);
        self.frame_ns.saturating_record(record.total_ns());
        self.visible += record.visible;
        self.culled += record.polygons - record.visible.min(record.polygons);
        if record.frame * WARM_UP.1 >= self.session_frames * WARM_UP.0 {
            self.allocations_steady += record.allocations();
        }
        let point =
            CurvePoint { frame: record.frame, polygons: record.polygons, total_ns: record.total_ns() };
        self.curve.push(point);
    }

    /// Frames whose times were taken.
    pub fn measured_frames(&self) -> u64 {
        self.measured
    }

    /// Filing a polygon, mean, nanoseconds.
    pub fn insert_ns_per_polygon(&self) -> f64 {
        self.insert_ns as f64 / self.inserted.max(1) as f64
    }

    /// Culling a frame, median, microseconds.
    pub fn cull_us(&self) -> f64 {
        self.cull_ns.value_at_quantile(0.5) as f64 / 1000.0
    }

    /// A whole frame at a quantile from 0 to 1, microseconds.
    pub fn frame_us(&self, quantile: f64) -> f64 {
        self.frame_ns.value_at_quantile(quantile) as f64 / 1000.0
    }

    /// Polygons to draw, mean over the measured frames.
    pub fn visible_mean(&self) -> f64 {
        self.visible as f64 / self.measured.max(1) as f64
    }

    /// Polygons culled, mean over the measured frames.
    pub fn culled_mean(&self) -> f64 {
        self.culled as f64 / self.measured.max(1) as f64
    }

    /// Allocations in insertion and culling over the second half of the session.
    pub fn allocations_steady(&self) -> u64 {
        self.allocations_steady
    }

    /// Whether every frame of the session was looked at.
    pub fn is_complete(&self) -> bool {
        self.frames.len() as u64 == self.session_frames
    }

    /// Of all frames looked at.
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint.value()
    }

    /// Number and fingerprint of each frame looked at.
    pub fn frames(&self) -> &[(u64, u64)] {
        &self.frames
    }

    /// The first frame that both looked at and in which they saw different sets.
    pub fn first_difference(&self, other: &Self) -> Option<u64> {
        let mut theirs = other.frames.iter().peekable();
        for &(frame, fingerprint) in &self.frames {
            while theirs.next_if(|(f, _)| *f < frame).is_some() {}
            if theirs.peek().is_some_and(|(f, p)| *f == frame && *p != fingerprint) {
                return Some(frame);
            }
        }
        None
    }

    pub(super) fn curve(&self) -> &[CurvePoint] {
        &self.curve
    }
}

fn histogram() -> Histogram<u64> {
    // Three significant digits; grows by itself.
    let mut histogram = Histogram::new_with_max(60_000_000_000, 3).unwrap_or_else(|_| {
        // The bounds are constants within the type's range; an auto-sizing one serves as well.
        Histogram::new_from(
            &Histogram::<u64>::new(3).unwrap_or_else(|_| unreachable!("3 digits are in range")),
        )
    });
    histogram.auto(true);
    histogram
}

/// A session's replay through several indexes.
#[derive(Clone, Debug)]
pub struct ReplayReport {
    /// Name of the file.
    pub recording: String,
    /// Strokes of the session.
    pub strokes: u64,
    /// Control points.
    pub points: u64,
    /// Polygons made.
    pub polygons: u64,
    /// Frames played.
    pub frames: u64,
    /// One for each index.
    pub runs: Vec<RunReport>,
}

#[derive(Serialize)]
struct JsonReport<'a> {
    recording: &'a str,
    strokes: u64,
    points: u64,
    polygons: u64,
    frames: u64,
    runs: Vec<JsonRun<'a>>,
}

#[derive(Serialize)]
struct JsonRun<'a> {
    index: &'a str,
    insert_ns_per_polygon: f64,
    cull_us: f64,
    frame_us: JsonQuantiles,
    visible_mean: f64,
    culled_mean: f64,
    fingerprint: String,
    bytes: usize,
    allocations_steady: u64,
    frames_measured: u64,
}

#[derive(Serialize)]
struct JsonQuantiles {
    p50: f64,
    p95: f64,
    p99: f64,
    max: f64,
}

impl ReplayReport {
    /// The report as one JSON object on one line.
    pub fn to_json(&self) -> String {
        let runs = self
            .runs
            .iter()
            .map(|run| JsonRun {
                index: &run.index,
                insert_ns_per_polygon: run.insert_ns_per_polygon(),
                cull_us: run.cull_us(),
                frame_us: JsonQuantiles {
                    p50: run.frame_us(0.5),
                    p95: run.frame_us(0.95),
                    p99: run.frame_us(0.99),
                    max: run.frame_us(1.0),
                },
                visible_mean: run.visible_mean(),
                culled_mean: run.culled_mean(),
                fingerprint: format!("{:016x}", run.fingerprint()),
                bytes: run.bytes,
                allocations_steady: run.allocations_steady(),
                frames_measured: run.measured_frames(),
            })
            .collect();
        let report = JsonReport {
            recording: &self.recording,
            strokes: self.strokes,
            points: self.points,
            polygons: self.polygons,
            frames: self.frames,
            runs,
        };
        serde_json::to_string(&report).unwrap_or_else(|e| format!("{{\"error\":{:?}}}", e.to_string()))
    }

    /// The first two indexes that saw different sets in a frame that both looked at.
    pub fn first_disagreement(&self) -> Option<(&str, &str, u64)> {
        let (first, rest) = self.runs.split_first()?;
        rest.iter().find_map(|run| {
            first.first_difference(run).map(|frame| (first.index.as_str(), run.index.as_str(), frame))
        })
    }
}
