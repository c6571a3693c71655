use osp_session::platform::time::{Instant, Load};
use std::ops::Range;

use super::{Contender, curves::synthetic_name};
use crate::{
    clock::{resolution_ns, runs_for},
    report::{short, thousands},
    rows::{Figures, Rows},
};
use osp::{
    index::{IndexConfig, SpatialIndex, WorkCounts, kernels::ROOM_BEHIND},
    math::{Aabb, Frustum},
    polygon::{Change, ConvexPolygon, PolygonId},
};
use osp_rivals::{Bsp, IndexKind};
use osp_session::{
    recording::{RecordingError, SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

const PART: &str = "growth";
const TASKS: [&str; 3] = ["growth/inserting", "growth/still", "growth/all in view"];

/// Largest number of measured frames of an index with insertion, and largest number without insertion.
const MOST_FRAMES: usize = 400;
/// Smallest number of frames that are measured, whatever the budget.
const FEWEST_FRAMES: usize = 3;

/// An index is skipped if filling it and measuring [`FEWEST_FRAMES`] frames would take more than this multiple of the
/// budget.
const LONGEST: f64 = 10.0;
/// Number of polygons whose corners are stored for an index that needs corners. For later polygons such an index gets
/// only the boxes.
const MOST_SHAPES: usize = 1_100_000;

/// Settings of [`grow`].
#[derive(Clone, Debug, PartialEq)]
pub struct GrowthConfig {
    /// Numbers of polygons of the models.
    pub sizes: Vec<u32>,
    pub kinds: Vec<Contender>,
    /// The reference index, with which the others are compared frame by frame.
    pub reference: IndexKind,
    /// Number of polygons that a frame inserts: slightly more than a hand draws at 90 frames a second.
    pub batch: u32,
    /// Time for the frames of an index at one size, seconds. An index is skipped if filling it and measuring three
    /// frames would take ten times as long, estimated from the previous size.
    pub budget_secs: f64,
}

/// The note for the report that a structure was not measured at a size.
pub(super) fn skipped(index: &str, polygons: u32, expected_secs: f64) -> String {
    let (polygons, secs) = (thousands(u64::from(polygons)), short(expected_secs));
    format!(
        "{index} was not measured at {polygons} polygons: filling it and three frames take about {secs} s."
    )
}

/// Measures indexes at increasing numbers of polygons of a synthetic session: loose strokes in a 4 m cube.
///
/// The rows are the part `growth`. At each size an index and the reference grow like a drawing, then they are measured in
/// turns, frame by frame. `progress` is called with the name of the next measurement.
///
/// # Errors
/// Never, because synthetic sessions have no damage.
pub fn grow(config: &GrowthConfig, mut progress: impl FnMut(&str)) -> Result<Rows, RecordingError> {
    let mut rows = Rows::default();
    let mut sizes = config.sizes.clone();
    sizes.sort_unstable();
    sizes.dedup();
    let Some(&largest) = sizes.last() else { return Ok(rows) };
    rows.part(PART, "Growth: a synthetic session of loose strokes in a 4 m cube");
    rows.note(
        PART,
        "inserting: a frame inserts a batch and culls from inside; still: a frame only culls; all in view: it culls from outside.",
    );
    progress("drawing the synthetic session");
    // The session ends with a whole stroke, so it has a few more polygons than requested. The frames insert the
    // polygons beyond the size.
    let spare = config.batch * MOST_FRAMES as u32;
    let shapes = if config.kinds.contains(&Contender::Own(IndexKind::Bsp)) { MOST_SHAPES } else { 0 };
    let drawing = Drawing::new(largest.saturating_add(spare), shapes)?;
    // For each index the time at the previous size, nanoseconds, and that size.
    let mut took_before: Vec<Option<(f64, u32)>> = vec![None; config.kinds.len()];
    for &size in &sizes {
        let count = (size as usize).min(drawing.boxes.len());
        let name = synthetic_name(size);
        for task in TASKS {
            rows.of(task, &name, "").value("polygons", "polygons", count as f64);
        }
        let most = drawing.boxes.len().min(count + spare as usize);
        for (kind, before) in config.kinds.iter().zip(&mut took_before) {
            if let Some((ns, polygons)) = *before {
                let expected_secs = ns * 1.0e-9 * f64::from(size) / f64::from(polygons);
                if expected_secs > config.budget_secs * LONGEST {
                    rows.note(PART, skipped(kind.name(), size, expected_secs));
                    continue;
                }
            }
            progress(&format!("{} at {size} polygons", kind.name()));
            let [mut subject, mut reference] = [*kind, Contender::Own(config.reference)]
                .map(|kind| Subject::filled(kind, &drawing, count, most, config.batch as usize));
            let begun = Load::begin();
            let frame_us = measure(&mut rows, &name, &mut subject, &mut reference, config);
            rows.load.add(begun);
            *before = Some((subject.fill_ns + FEWEST_FRAMES as f64 * 1000.0 * frame_us, size));
        }
    }
    Ok(rows)
}

/// A synthetic session's polygons in order of drawing.
pub(super) struct Drawing {
    boxes: Vec<Aabb>,
    /// Corners of the first polygons.
    pub(super) shapes: Vec<ConvexPolygon>,
}

impl Drawing {
    pub(super) fn new(polygons: u32, shapes: usize) -> Result<Self, RecordingError> {
        let mut scene = Scene::new();
        let mut changes = Vec::new();
        let mut drawing = Self { boxes: Vec::with_capacity(polygons as usize), shapes: Vec::new() };
        for event in synthesize(SynthKind::Scribble, polygons, 1) {
            changes.clear();
            scene.apply(&event?, &mut changes);
            for change in &changes {
                if let Change::Insert(id) = *change
                    && id.index() >= drawing.boxes.len()
                {
                    drawing.boxes.push(scene.bounds(id));
                    if drawing.shapes.len() < shapes {
                        drawing.shapes.push(scene.polygon(id));
                    }
                }
            }
        }
        Ok(drawing)
    }
}

/// An index and the state of its measurement.
struct Subject<'a> {
    index: Box<dyn SpatialIndex>,
    drawing: &'a Drawing,
    wants_shapes: bool,
    draw_list: Vec<PolygonId>,
    /// Number of polygons of the fill.
    inserted: usize,
    /// Largest number of polygons, at the end of the measurement.
    most: usize,
    /// Number of polygons inserted since the fill.
    more: usize,
    fill_ns: f64,
    bytes: usize,
}

/// Times of a frame, nanoseconds, and the numbers of nodes and boxes that it tested.
#[derive(Clone, Copy, Debug, Default)]
struct Frame {
    insert_ns: f64,
    cull_ns: f64,
    nodes: u64,
    boxes: u64,
}

impl Frame {
    fn total_ns(&self) -> f64 {
        (self.insert_ns + self.cull_ns).max(1.0)
    }
}

impl<'a> Subject<'a> {
    /// An index that has grown by `batch` polygons a frame.
    fn filled(kind: Contender, drawing: &'a Drawing, inserted: usize, most: usize, batch: usize) -> Self {
        let mut index = kind.create(&IndexConfig { capacity: most, ..IndexConfig::default() });
        let draw_list = Vec::with_capacity(most + ROOM_BEHIND);
        let wants_shapes = Bsp::of(&mut *index).is_some();
        let mut subject =
            Self { index, drawing, wants_shapes, draw_list, inserted, most, more: 0, fill_ns: 0.0, bytes: 0 };
        let start = Instant::now();
        let batch = if subject.index.may_skip_commits() { inserted } else { batch };
        for first in (0..inserted).step_by(batch.max(1)) {
            subject.insert(first..inserted.min(first + batch));
            subject.index.commit();
        }
        subject.fill_ns = start.elapsed().as_nanos() as f64;
        subject.bytes = subject.index.bytes();
        subject
    }

    fn insert(&mut self, range: Range<usize>) {
        let first = range.start;
        for (bounds, at) in self.drawing.boxes[range].iter().zip(first..) {
            let id = PolygonId(at as u32);
            // Boxes of a synthetic session are finite, and each id is inserted once, so no error can occur.
            let inserted = self.index.insert(id, bounds);
            debug_assert_eq!(inserted, Ok(()));
            if self.wants_shapes
                && let Some(shape) = self.drawing.shapes.get(at)
                && let Some(tree) = Bsp::of(&mut *self.index)
            {
                tree.shape(id, shape);
            }
        }
    }

    /// Number of polygons that are not inserted yet.
    fn left(&self) -> usize {
        self.most - self.inserted - self.more
    }

    fn frame(&mut self, batch: usize, frustum: &Frustum) -> Frame {
        let first = self.inserted + self.more;
        let start = Instant::now();
        self.insert(first..first + batch);
        self.index.commit();
        let insert_ns = start.elapsed().as_nanos() as f64;
        self.more += batch;
        self.draw_list.clear();
        let start = Instant::now();
        let work = self.index.frustum_cull(frustum, &mut self.draw_list);
        let cull_ns = start.elapsed().as_nanos() as f64;
        Frame { insert_ns, cull_ns, nodes: work.nodes, boxes: work.boxes }
    }

    /// Measures a frame without insertion as the mean of `runs` runs, so that the resolution of the clock does not
    /// matter.
    fn still(&mut self, runs: u32, frustum: &Frustum) -> Frame {
        let mut work = WorkCounts::default();
        let start = Instant::now();
        for _ in 0..runs {
            self.index.commit();
            self.draw_list.clear();
            work = self.index.frustum_cull(frustum, &mut self.draw_list);
        }
        let cull_ns = start.elapsed().as_nanos() as f64 / f64::from(runs);
        Frame { insert_ns: 0.0, cull_ns, nodes: work.nodes, boxes: work.boxes }
    }
}

/// The frames of an index, each with the same frame of the reference.
#[derive(Default)]
struct Pairs(Vec<(Frame, Frame)>);

impl Pairs {
    fn measure(
        subject: &mut Subject<'_>,
        reference: &mut Subject<'_>,
        batch: usize,
        view: impl Fn(u64) -> Frustum,
        budget_secs: f64,
    ) -> Self {
        let mut pairs = Vec::with_capacity(MOST_FRAMES);
        // Frames without insertion can be repeated. Both indexes get the same number of repeats, so that the caches
        // favour neither.
        let runs = match batch {
            0 => {
                let first = view(0);
                let ns = [subject.still(1, &first).total_ns(), reference.still(1, &first).total_ns()];
                runs_for(ns[0].min(ns[1]), resolution_ns())
            }
            _ => 1,
        };
        let measured = |of: &mut Subject<'_>, frustum: &Frustum| match batch {
            0 => of.still(runs, frustum),
            batch => of.frame(batch, frustum),
        };
        let start = Instant::now();
        for frame in 0..MOST_FRAMES {
            if frame >= FEWEST_FRAMES && start.elapsed().as_secs_f64() > budget_secs {
                break;
            }
            if batch > subject.left() {
                break;
            }
            let frustum = view(frame as u64);
            // The two indexes alternate in running first.
            let pair = if frame % 2 == 0 {
                let first = measured(subject, &frustum);
                (first, measured(reference, &frustum))
            } else {
                let first = measured(reference, &frustum);
                (measured(subject, &frustum), first)
            };
            pairs.push(pair);
        }
        Self(pairs)
    }

    /// Adds the times of both indexes.
    fn add<'f, 'r>(&self, figures: &'f mut Figures<'r>) -> &'f mut Figures<'r> {
        let us = |frame: &Frame| frame.total_ns() / 1000.0;
        let times: Vec<(f64, f64)> = self.0.iter().map(|(own, other)| (us(own), us(other))).collect();
        figures.against(&times)
    }

    fn mean(&self, count: fn(&Frame) -> u64) -> f64 {
        self.0.iter().map(|(frame, _)| count(frame) as f64).sum::<f64>() / self.0.len().max(1) as f64
    }
}

/// Measures an index and the reference in turns. Returns the median of a frame with insertion, microseconds.
fn measure(
    rows: &mut Rows,
    name: &str,
    subject: &mut Subject<'_>,
    reference: &mut Subject<'_>,
    config: &GrowthConfig,
) -> f64 {
    let path = |choice| {
        let camera = CameraPath::new(choice, None, &IndexConfig::default().root);
        // The camera turns fast, so that even a few frames show the model from every side.
        move |frame: u64| camera.view(&Moment { frame: frame * 7, ..Moment::default() }).frustum()
    };
    let share = config.budget_secs / 3.0;
    let batch = config.batch as usize;
    let polygons = subject.inserted.max(1) as f64;
    let index = subject.index.name();
    let inserting = Pairs::measure(subject, reference, batch, path(CameraChoice::Inside), share);
    let still = Pairs::measure(subject, reference, 0, path(CameraChoice::Inside), share);
    let all = Pairs::measure(subject, reference, 0, path(CameraChoice::Orbit), share);
    let [inserts, stands, sees_all] = TASKS;
    inserting
        .add(&mut rows.of(inserts, name, index))
        .spread("insert", inserting.0.iter().map(|(frame, _)| frame.insert_ns / 1000.0).collect())
        .value("fill", "ns/polygon", subject.fill_ns / polygons)
        .value("memory", "bytes/polygon", subject.bytes as f64 / polygons);
    for (task, pairs) in [(stands, &still), (sees_all, &all)] {
        pairs
            .add(&mut rows.of(task, name, index))
            .counted("nodes", "1/frame", pairs.mean(|frame| frame.nodes))
            .counted("boxes", "1/frame", pairs.mean(|frame| frame.boxes));
    }
    rows.value(inserts, name, index, "time").unwrap_or(0.0)
}
