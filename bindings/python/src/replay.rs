use std::path::PathBuf;

use numpy::IntoPyArray;
use osp::{
    frame::{PassConfig, Pipeline},
    index::IndexConfig,
    math::Aabb,
    occlusion::Occlusion,
};
use osp_lab::Method;
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Header, OpenOptions, Pace, open},
    replay::{
        Budget, CameraChoice, CameraPath, Lane, LaneFrame, Player, Replay, SessionFingerprint, summarize,
    },
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{errors, names, recording::options, signals::Signals};

/// The columns of a replay, with a value for each measured frame of each run.
#[derive(Default)]
struct Columns {
    run: Vec<u32>,
    frame: Vec<u64>,
    inserted: Vec<u64>,
    removed: Vec<u64>,
    updated: Vec<u64>,
    polygons: Vec<u64>,
    visible: Vec<u64>,
    drawn: Vec<u64>,
    boxes: Vec<u64>,
    insert_ns: Vec<u64>,
    cull_ns: Vec<u64>,
    occlusion_ns: Vec<u64>,
    timed: Vec<bool>,
    fingerprint: Vec<u64>,
}

impl Columns {
    fn push(&mut self, run: usize, frame: &LaneFrame) {
        let LaneFrame { record, in_view, catches_up, .. } = frame;
        self.run.push(run as u32);
        self.frame.push(record.frame);
        self.inserted.push(record.inserted);
        self.removed.push(record.removed);
        self.updated.push(record.updated);
        self.polygons.push(record.polygons);
        self.visible.push(record.visible);
        self.drawn.push(record.drawn());
        self.boxes.push(record.work.boxes);
        self.insert_ns.push(record.insert.ns);
        self.cull_ns.push(record.cull.ns);
        self.occlusion_ns.push(record.occlusion.total_ns());
        self.timed.push(!catches_up);
        self.fingerprint.push(*in_view);
    }

    fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let table = PyDict::new(py);
        table.set_item("run", self.run.into_pyarray(py))?;
        for (name, column) in [
            ("frame", self.frame),
            ("inserted", self.inserted),
            ("removed", self.removed),
            ("updated", self.updated),
            ("polygons", self.polygons),
            ("visible", self.visible),
            ("drawn", self.drawn),
            ("boxes_tested", self.boxes),
            ("insert_ns", self.insert_ns),
            ("cull_ns", self.cull_ns),
            ("occlusion_ns", self.occlusion_ns),
            ("fingerprint", self.fingerprint),
        ] {
            table.set_item(name, column.into_pyarray(py))?;
        }
        table.set_item("timed", self.timed.into_pyarray(py))?;
        Ok(table)
    }
}

/// A structure, with or without a method of occlusion culling.
struct Run {
    index: IndexKind,
    occlusion: Option<Method>,
    bytes: usize,
    fingerprint: SessionFingerprint,
}

/// The settings of a replay.
struct Settings {
    path: PathBuf,
    pace: Pace,
    camera: CameraChoice,
    budget_secs: f64,
    options: OpenOptions,
}

/// The results of a replay.
struct Played {
    frames: u64,
    columns: Columns,
    runs: Vec<Run>,
}

/// Parses the pace of a replay.
pub(crate) fn pace(text: &str) -> PyResult<Pace> {
    text.parse().map_err(|error| PyValueError::new_err(format!("pace: {error}")))
}

/// Replays the frames of a session in several structures. Returns the columns, and the results for each run.
#[pyfunction]
#[pyo3(signature = (path, indexes, occlusion, pace, camera, budget_secs, lenient, max_polygons))]
#[expect(clippy::too_many_arguments, reason = "the arguments of `osp.replay`")]
pub(crate) fn replay_frames<'py>(
    py: Python<'py>,
    path: PathBuf,
    indexes: Vec<String>,
    occlusion: Vec<String>,
    pace: &str,
    camera: &str,
    budget_secs: f64,
    lenient: bool,
    max_polygons: Option<u64>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let kinds = indexes.iter().map(|name| names::index_kind(name)).collect::<PyResult<Vec<_>>>()?;
    let methods = occlusion.iter().map(|name| names::replayed(name)).collect::<PyResult<Vec<_>>>()?;
    if kinds.is_empty() {
        return Err(PyValueError::new_err("indexes: expected at least one"));
    }
    if !(budget_secs > 0.0 && budget_secs <= 1.0e9) {
        let message = format!("budget_secs: expected a positive number; found {budget_secs}");
        return Err(PyValueError::new_err(message));
    }
    let methods = match methods.is_empty() {
        true => vec![None],
        false => methods.into_iter().map(Some).collect(),
    };
    let run = |index: IndexKind, occlusion| Run {
        index,
        occlusion,
        bytes: 0,
        fingerprint: SessionFingerprint::new(),
    };
    let runs = kinds
        .iter()
        .flat_map(|&index| methods.iter().map(move |&method| run(index, method)))
        .collect::<Vec<_>>();
    let settings = Settings {
        path,
        pace: self::pace(pace)?,
        camera: names::camera(camera)?,
        budget_secs,
        options: options(lenient, max_polygons)?,
    };
    let played = py.detach(|| play(&settings, runs))?;

    let about = PyDict::new(py);
    let column = |of: &dyn Fn(&Run) -> String| played.runs.iter().map(of).collect::<Vec<_>>();
    about.set_item("index", column(&|run| run.index.name().to_owned()))?;
    about.set_item("occlusion", column(&|run| run.occlusion.unwrap_or(Method::NONE).name().to_owned()))?;
    about.set_item("bytes", played.runs.iter().map(|run| run.bytes as u64).collect::<Vec<_>>())?;
    // Only a run that measured every frame has a fingerprint: its value must equal the fingerprint of other programs.
    let fingerprint = |run: &Run| {
        (run.fingerprint.frames() == played.frames).then(|| format!("{:016x}", run.fingerprint.value()))
    };
    about.set_item("fingerprint", played.runs.iter().map(fingerprint).collect::<Vec<_>>())?;
    about.set_item("frames", played.frames)?;
    Ok((played.columns.into_dict(py)?, about))
}

/// Returns the root cube of the index: the cube that the recording declares, else a cube around all its polygons.
pub(crate) fn root_cube(header: &Header, bounds: &Aabb) -> Aabb {
    let own = header.root.map(|root| Aabb::cube(root.center, root.size)).filter(Aabb::is_valid);
    match own {
        Some(root) => root,
        None if bounds.is_empty() => IndexConfig::default().root,
        None => Aabb::cube(bounds.center(), bounds.extent().max_element().max(1.0e-3) * 1.01),
    }
}

fn play(settings: &Settings, mut runs: Vec<Run>) -> PyResult<Played> {
    let Settings { path, pace, camera, budget_secs, options } = settings;
    let failed = |error| errors::of_recording(&error);
    // The session is read twice: once to measure its length and size, and once to play it.
    let (summary, _, read) = summarize(open(path, options).map_err(failed)?, *pace);
    read.map_err(failed)?;
    let most = options.limits.frames();
    if summary.frames > most && *pace == Pace::Recorded {
        let (path, frames) = (path.display(), summary.frames);
        return Err(PyValueError::new_err(format!(
            "{path}: expected at most {most} frames at the recorded pace (max_polygons=N allows half as many); found \
             {frames}: pace=\"samples:16\" counts samples instead"
        )));
    }
    let session = open(path, options).map_err(failed)?;
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let config = IndexConfig { root: root_cube(&session.header, &summary.bounds), capacity };
    let budget = Budget { ns: (budget_secs * 1.0e9) as u64, frames: summary.frames };
    let lane = |run: &Run| {
        let pipeline = Pipeline::new(run.index.create(&config), capacity);
        let pipeline = match run.occlusion {
            // The drawn polygons must not depend on the clock.
            Some(method) => method.add_to(pipeline, PassConfig::for_strokes(Occlusion::Auto)),
            None => pipeline,
        };
        Lane::new(pipeline, budget)
    };
    let lanes = runs.iter().map(lane).collect();
    let camera = CameraPath::new(*camera, session.header.camera, &summary.bounds);
    let mut replay = Replay::new(Player::new(session, *pace), camera, lanes);
    let mut columns = Columns::default();
    let mut signals = Signals::new();
    while let Some(frames) = replay.step().map_err(failed)? {
        for (i, (run, frame)) in runs.iter_mut().zip(frames).enumerate() {
            let Some(frame) = frame else { continue };
            run.fingerprint.add(frame.record.frame, frame.in_view);
            columns.push(i, frame);
        }
        signals.check()?;
    }
    for (run, lane) in runs.iter_mut().zip(replay.lanes()) {
        run.bytes = lane.pipeline().bytes();
    }
    Ok(Played { frames: summary.frames, columns, runs })
}
