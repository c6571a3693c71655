use std::path::PathBuf;

use numpy::IntoPyArray;
use osp::{
    frame::StageClock,
    index::IndexConfig,
    occlusion::{CullConfig, PoolConfig, SelectConfig, Soundness},
};
use osp_lab::{
    oracle::OracleConfig,
    verify::{Trial, Verifier, VerifyConfig},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{OpenOptions, Pace, open},
    replay::{CameraChoice, CameraPath, Moment, Player, summarize},
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    errors, names,
    recording::options,
    replay::{pace, root_cube},
    signals::Signals,
};

/// Largest number of views of a session.
const MOST_VIEWS: u64 = 100_000;
/// Permitted sides of the picture that determines the visible polygons, pixels.
const PIXELS: std::ops::RangeInclusive<usize> = 16..=16_384;

/// The settings of a verification.
struct Settings {
    path: PathBuf,
    config: VerifyConfig,
    views: u64,
    whole: bool,
    pace: Pace,
    camera: CameraChoice,
    options: OpenOptions,
}

/// Compares occlusion culling with the truly visible polygons. Returns a column for each count, and a row for each
/// method and number of occluders.
#[pyfunction]
#[pyo3(signature = (path, occlusion, occluders, views, pixels, whole, pace, camera, lenient, max_polygons))]
#[expect(clippy::too_many_arguments, reason = "the arguments of `osp.verify`")]
pub(crate) fn verify_methods<'py>(
    py: Python<'py>,
    path: PathBuf,
    occlusion: Vec<String>,
    occluders: Vec<usize>,
    views: u64,
    pixels: (usize, usize),
    whole: bool,
    pace: &str,
    camera: &str,
    lenient: bool,
    max_polygons: Option<u64>,
) -> PyResult<(Bound<'py, PyDict>, Bound<'py, PyDict>)> {
    let kinds = occlusion.iter().map(|name| names::verified(name)).collect::<PyResult<Vec<_>>>()?;
    let (width, height) = pixels;
    let is_in = |ok: bool, message: String| if ok { Ok(()) } else { Err(PyValueError::new_err(message)) };
    is_in(!kinds.is_empty(), "occlusion: expected at least one method".to_owned())?;
    is_in(
        !occluders.is_empty() && occluders.iter().all(|count| (1..=4096).contains(count)),
        format!("occluders: expected numbers from 1 to 4096; found {occluders:?}"),
    )?;
    is_in((1..=MOST_VIEWS).contains(&views), format!("views: expected 1 to {MOST_VIEWS}; found {views}"))?;
    is_in(
        PIXELS.contains(&width) && PIXELS.contains(&height),
        format!("pixels: expected two numbers from 16 to 16384; found {pixels:?}"),
    )?;
    let config = VerifyConfig {
        kinds,
        occluders,
        pool: PoolConfig::default(),
        select: SelectConfig::default(),
        cull: CullConfig::default(),
        oracle: OracleConfig { width, height },
        repeats: 1,
    };
    let (pace, camera) = (self::pace(pace)?, names::camera(camera)?);
    let options = options(lenient, max_polygons)?;
    let settings = Settings { path, config, views, whole, pace, camera, options };
    let verifier = py.detach(|| verify(&settings))?;
    Ok((methods(py, &verifier)?, seen(py, &verifier)?))
}

fn verify(settings: &Settings) -> PyResult<Verifier> {
    let Settings { path, config, views, whole, pace, camera, options } = settings;
    let failed = |error| errors::of_recording(&error);
    let (summary, _, read) = summarize(open(path, options).map_err(failed)?, *pace);
    read.map_err(failed)?;
    let session = open(path, options).map_err(failed)?;
    let camera = CameraPath::new(*camera, session.header.camera, &summary.bounds);
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let root = root_cube(&session.header, &summary.bounds);
    let index = IndexKind::Osp.create(&IndexConfig { root, capacity });
    let mut verifier = Verifier::new(index, config.clone(), StageClock::default());
    let mut player = Player::new(session, *pace);
    let mut signals = Signals::new();
    let (mut moments, mut looked) = (Vec::new(), 0);
    while player.step().map_err(failed)? {
        verifier.follow(player.scene(), player.changes());
        let moment = Moment { frame: player.frames(), ..player.moment() };
        // The tested frames are evenly spaced and include the last frame.
        if moment.frame * views / summary.frames.max(1) > looked {
            looked += 1;
            match whole {
                true => moments.push(moment),
                false => verifier.verify_view(player.scene(), &camera.view(&moment)),
            }
        }
        signals.check()?;
    }
    for moment in &moments {
        verifier.verify_view(player.scene(), &camera.view(moment));
        signals.check()?;
    }
    Ok(verifier)
}

fn methods<'py>(py: Python<'py>, verifier: &Verifier) -> PyResult<Bound<'py, PyDict>> {
    let trials = verifier.trials();
    let table = PyDict::new(py);
    let names = trials.iter().map(Trial::name).collect::<Vec<_>>();
    table.set_item("occlusion", py.import("numpy")?.call_method1("array", (names, "str"))?)?;
    let is_conservative = |trial: &Trial| trial.soundness() == Soundness::Conservative;
    table
        .set_item("conservative", trials.iter().map(is_conservative).collect::<Vec<_>>().into_pyarray(py))?;
    type Count = fn(&Trial) -> u64;
    let counts: [(&str, Count); 10] = [
        ("occluders", |trial| trial.occluders() as u64),
        ("views", |trial| trial.totals().views),
        ("false_culls", |trial| trial.totals().false_culls),
        ("misreported", |trial| trial.totals().misreported),
        ("hidden", |trial| trial.totals().hidden),
        ("hidden_culled", |trial| trial.totals().hidden_culled),
        ("drawn", |trial| trial.totals().drawn),
        ("select_ns", |trial| trial.totals().select_ns),
        ("build_ns", |trial| trial.totals().build_ns),
        ("query_ns", |trial| trial.totals().query_ns),
    ];
    for (name, count) in counts {
        table.set_item(name, trials.iter().map(count).collect::<Vec<_>>().into_pyarray(py))?;
    }
    let percent = |trial: &Trial| trial.totals().hidden_culled_percent();
    table
        .set_item("hidden_culled_percent", trials.iter().map(percent).collect::<Vec<_>>().into_pyarray(py))?;
    table.set_item("failed", trials.iter().map(Trial::failed).collect::<Vec<_>>().into_pyarray(py))?;
    Ok(table)
}

fn seen<'py>(py: Python<'py>, verifier: &Verifier) -> PyResult<Bound<'py, PyDict>> {
    let views = verifier.views();
    let totals = PyDict::new(py);
    for (name, count) in [
        ("views", views.views),
        ("in_view", views.in_view),
        ("visible", views.visible),
        ("hidden", views.hidden),
        ("lost", views.lost),
    ] {
        totals.set_item(name, count)?;
    }
    Ok(totals)
}
