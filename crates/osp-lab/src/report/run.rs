use std::collections::BTreeMap;

use super::{AgainstOneView, DrawReport, RigReport, ViewMeans, ViewsReport};
use osp::{
    frame::{FrameRecord, OcclusionRecord, Stage},
    occlusion::{NodeTest, Score},
};
use osp_session::platform::time::Load;
use osp_session::replay::{LaneFrame, PARTS_OF_SESSION, SessionFingerprint, part_of_frame};

/// Fraction of the session during which allocations count as warm-up.
const WARM_UP: (u64, u64) = (1, 2);

/// The replay of a session through one index, collected frame by frame.
///
/// An index that exceeds its budget is measured on fewer frames of the late, expensive parts of a session than of the
/// early parts. So the measured frames of a part get the weight of all its frames, and all rows of a table describe the
/// same session.
#[derive(Clone, Debug)]
pub struct RunReport {
    pub index: String,
    session_frames: u64,
    measured: Vec<Measured>,
    /// Number of allocations in insertion and culling over the second half of the session.
    pub allocations_steady: u64,
    fingerprint: SessionFingerprint,
    /// Number and fingerprint of each replayed frame.
    pub frames: Vec<(u64, u64)>,
    pub bytes: usize,
    pub refused: u64,
    /// Occlusion culling, if the run used it.
    pub occlusion: Option<OcclusionReport>,
    /// Drawing times, if the run drew.
    pub draw: Option<DrawReport>,
    /// The views of the rig, if the run used one.
    pub views: Option<ViewsReport>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct OcclusionReport {
    pub method: &'static str,
    /// The node test and the occluder score of the method.
    pub tests: (NodeTest, Score),
    /// Time that drawing a polygon is assumed to take, nanoseconds.
    pub polygon_ns: f64,
    /// Number of visible polygons that were culled, over the verified frames; `None` if no frame was verified.
    pub false_culls: Option<u64>,
    /// Fingerprint of the drawn polygons over all replayed frames.
    pub fingerprint: SessionFingerprint,
}

impl OcclusionReport {
    pub fn new(method: &'static str, polygon_ns: f64) -> Self {
        Self {
            method,
            tests: (NodeTest::Box, Score::default()),
            polygon_ns,
            false_culls: None,
            fingerprint: SessionFingerprint::new(),
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Measured {
    pub(super) frame: u64,
    #[cfg_attr(not(feature = "bench"), expect(dead_code, reason = "only charts show it"))]
    pub(super) polygons: u64,
    culled: u64,
    input_ns: u64,
    pub(super) total_ns: u64,
    cull_ns: u64,
    visible: u64,
    /// Insertion time per polygon, nanoseconds, if the frame only inserted.
    insert_ns: Option<f64>,
    /// Boxed, so that a frame without occlusion culling takes little memory. A session may have millions of frames.
    occlusion: Option<Box<OcclusionRecord>>,
}

impl Measured {
    fn occlusion(&self) -> OcclusionRecord {
        self.occlusion.as_deref().copied().unwrap_or_default()
    }
}

impl RunReport {
    /// Makes a report without frames. `index` is the name of the index, `session_frames` the number of frames
    /// of the session.
    pub fn new(index: impl Into<String>, session_frames: u64) -> Self {
        Self {
            index: index.into(),
            session_frames,
            measured: Vec::new(),
            allocations_steady: 0,
            fingerprint: SessionFingerprint::new(),
            frames: Vec::new(),
            bytes: 0,
            refused: 0,
            occlusion: None,
            draw: None,
            views: None,
        }
    }

    /// The name of the run: its index, and its occlusion culling method if it has one.
    pub fn name(&self) -> String {
        match &self.occlusion {
            Some(occlusion) => format!("{} + {}", self.index, occlusion.method),
            None => self.index.clone(),
        }
    }

    pub fn add(&mut self, frame: &LaneFrame) {
        let record = &frame.record;
        self.fingerprint.add(record.frame, frame.in_view);
        self.frames.push((record.frame, frame.in_view));
        if let Some(occlusion) = &mut self.occlusion {
            occlusion.fingerprint.add(record.frame, frame.drawn);
        }
        if !frame.catches_up {
            self.measure(record, frame.applying);
        }
    }

    fn measure(&mut self, record: &FrameRecord, applying: Stage) {
        if record.frame * WARM_UP.1 >= self.session_frames * WARM_UP.0 {
            self.allocations_steady += record.allocations();
        }
        let only_inserts = record.inserted > 0 && record.removed + record.updated == 0;
        self.measured.push(Measured {
            frame: record.frame,
            polygons: record.polygons,
            culled: record.culled(),
            input_ns: applying.ns,
            total_ns: record.total_ns(),
            cull_ns: record.cull.ns,
            visible: record.visible,
            insert_ns: only_inserts.then(|| record.insert.ns as f64 / record.inserted as f64),
            occlusion: (record.occlusion != OcclusionRecord::default()).then(|| Box::new(record.occlusion)),
        });
    }

    pub fn measured_frames(&self) -> u64 {
        self.measured.len() as u64
    }

    /// For each measured frame, the number of the session's frames that it represents.
    pub(super) fn weights(&self) -> Vec<f64> {
        let part = |frame| part_of_frame(frame, self.session_frames) as usize;
        let mut of_session = vec![0u32; PARTS_OF_SESSION as usize];
        (0..self.session_frames).for_each(|frame| of_session[part(frame)] += 1);
        let mut measured = vec![0u32; PARTS_OF_SESSION as usize];
        self.measured.iter().for_each(|m| measured[part(m.frame)] += 1);
        self.measured
            .iter()
            .map(|m| f64::from(of_session[part(m.frame)]) / f64::from(measured[part(m.frame)]))
            .collect()
    }

    /// A quantile, 0 to 1, over the session's frames; 0 if no frame was measured.
    fn quantile(&self, quantile: f64, value: impl Fn(&Measured) -> Option<f64>) -> f64 {
        let weighted = self.measured.iter().zip(self.weights());
        let mut values: Vec<_> = weighted.filter_map(|(m, weight)| Some((value(m)?, weight))).collect();
        values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let mut left = quantile * values.iter().map(|(_, weight)| weight).sum::<f64>();
        let found = values.iter().find(|(_, weight)| {
            left -= weight;
            left <= 0.0
        });
        found.or(values.last()).map_or(0.0, |(ns, _)| *ns)
    }

    fn mean(&self, value: impl Fn(&Measured) -> u64) -> f64 {
        let weights = self.weights();
        let sum: f64 = self.measured.iter().zip(&weights).map(|(m, w)| value(m) as f64 * w).sum();
        sum / weights.iter().sum::<f64>().max(1.0)
    }

    /// Median time of applying a frame's events to the model, microseconds.
    pub fn input_us(&self) -> f64 {
        self.quantile(0.5, |m| Some(m.input_ns as f64)) / 1000.0
    }

    /// Insertion time per polygon, rebuilds included: median over the frames that only inserted, nanoseconds.
    pub fn insert_ns_per_polygon(&self) -> f64 {
        self.quantile(0.5, |m| m.insert_ns)
    }

    /// Median culling time of a frame, microseconds.
    pub fn cull_us(&self) -> f64 {
        self.quantile(0.5, |m| Some(m.cull_ns as f64)) / 1000.0
    }

    /// A quantile, 0 to 1, of the whole frame time, microseconds.
    pub fn frame_us(&self, quantile: f64) -> f64 {
        self.quantile(quantile, |m| Some(m.total_ns as f64)) / 1000.0
    }

    /// Mean number of polygons in the frustum over the session, in all views together.
    pub fn visible_mean(&self) -> f64 {
        self.mean(|m| m.visible)
    }

    pub fn culled_mean(&self) -> f64 {
        self.mean(|m| m.culled)
    }

    /// Mean number of polygons culled by occlusion over the session.
    pub fn occluded_mean(&self) -> f64 {
        if let Some(draw) = self.draw.as_ref().filter(|draw| draw.has_culling()) {
            return draw.culling_mean(|drawn| drawn.hidden);
        }
        self.mean(|m| m.occlusion().occluded)
    }

    /// Whether a stage of occlusion culling took time in a measured frame.
    pub(super) fn has_run(&self, stage: impl Fn(&OcclusionRecord) -> u64) -> bool {
        self.measured.iter().any(|m| m.occlusion.as_deref().is_some_and(|record| stage(record) > 0))
    }

    /// Median time of a stage of occlusion culling, over the frames that used it, microseconds.
    pub(super) fn occlusion_us(&self, stage: impl Fn(&OcclusionRecord) -> u64) -> f64 {
        self.quantile(0.5, |m| m.occlusion().used.then(|| stage(&m.occlusion()) as f64)) / 1000.0
    }

    /// Median time of all of occlusion culling, over the frames that used it, microseconds.
    pub fn occlusion_total_us(&self) -> f64 {
        self.occlusion_us(OcclusionRecord::total_ns)
    }

    /// Share of the session's frames that used occlusion culling, per cent.
    pub fn occlusion_used_percent(&self) -> f64 {
        self.mean(|m| 100 * u64::from(m.occlusion().used))
    }

    /// Share of the session's frames whose occluders were the polygons visible in the previous frame, per cent.
    pub fn occlusion_by_last_percent(&self) -> f64 {
        self.mean(|m| 100 * u64::from(m.occlusion().by_last))
    }

    /// A quantile, 0 to 1, of the whole frame time plus the drawing time of the remaining polygons at `polygon_ns`
    /// each, microseconds.
    pub fn drawn_frame_us(&self, quantile: f64, polygon_ns: f64) -> f64 {
        let drawn = |m: &Measured| m.visible - m.occlusion().occluded.min(m.visible);
        self.quantile(quantile, |m| Some(m.total_ns as f64 + drawn(m) as f64 * polygon_ns)) / 1000.0
    }

    /// Whether every frame of the session was replayed.
    pub fn is_complete(&self) -> bool {
        self.frames.len() as u64 == self.session_frames
    }

    pub fn fingerprint(&self) -> u64 {
        self.fingerprint.value()
    }

    pub(super) fn curve(&self) -> &[Measured] {
        &self.measured
    }

    /// Means of one view of the rig; `None` if no measured frame had it.
    pub fn view_means(&self, number: usize) -> Option<ViewMeans> {
        let views = self.views.as_ref()?;
        let (mut frames, mut in_view, mut drawn) = (0.0, 0.0, 0.0);
        for (frame, weight) in views.frames.iter().zip(self.weights()) {
            let Some(counts) = frame.get(number).copied().flatten() else { continue };
            frames += weight;
            in_view += f64::from(counts.in_view) * weight;
            drawn += f64::from(counts.drawn) * weight;
        }
        (frames > 0.0).then(|| ViewMeans { in_view: in_view / frames, drawn: drawn / frames })
    }

    /// Cost of the frames with all views, compared with that of one view times the number of views. `None` if no frame
    /// was measured with both.
    pub fn against_one_view(&self) -> Option<AgainstOneView> {
        AgainstOneView::of(self.views.as_ref()?.against_one.iter().copied().flatten().collect())
    }
}

/// The replay of a session through several indexes.
#[derive(Clone, Debug)]
pub struct ReplayReport {
    pub recording: String,
    pub strokes: u64,
    pub points: u64,
    pub polygons: u64,
    pub frames: u64,
    pub pace: String,
    /// The camera, as on the command line; with a rig also the rig's name and settings.
    pub camera: String,
    pub rig: Option<RigReport>,
    /// How undisturbed the runs were.
    pub load: Load,
    pub runs: Vec<RunReport>,
}

impl ReplayReport {
    /// See [`first_disagreement`].
    pub fn first_disagreement(&self) -> Option<(&str, &str, u64)> {
        first_disagreement(&self.runs)
    }
}

/// Two indexes that found different polygons in a frame that both replayed, and the frame's number.
pub(crate) fn first_disagreement(runs: &[RunReport]) -> Option<(&str, &str, u64)> {
    let mut seen: BTreeMap<u64, (&str, u64)> = BTreeMap::new();
    for run in runs {
        for &(frame, fingerprint) in &run.frames {
            let &mut (first, expected) = seen.entry(frame).or_insert((&run.index, fingerprint));
            if fingerprint != expected {
                return Some((first, &run.index, frame));
            }
        }
    }
    None
}
