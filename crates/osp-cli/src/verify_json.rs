//! The answer of `osp verify --json`.

use serde::Serialize;

use super::verify_drawn::{DrawnRun, DrawnTrials};
use osp::occlusion::Soundness;
use osp_lab::{
    pvs::Pvs,
    verify::{Totals, Trial, Verifier},
};

#[derive(Serialize)]
struct JsonVerify<'a> {
    recording: &'a str,
    polygons: u64,
    views: u64,
    in_view_mean: f64,
    visible_mean: f64,
    hidden_mean: f64,
    /// Polygons that reach into a view, but that its frustum has culled.
    lost: u64,
    /// Whether all that was compared with what can be seen.
    truth: bool,
    frustum_us: f64,
    node_test: &'a str,
    score: &'a str,
    runs: Vec<JsonRun>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    drawn: Vec<DrawnRun>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pvs: Option<JsonPvs>,
}

#[derive(Serialize)]
struct JsonPvs {
    cells: usize,
    cell_m: f32,
    samples: u32,
    bytes: usize,
    views: u64,
    false_culls: u64,
    misreported: u64,
    hidden_culled_percent: f64,
    query_us: f64,
}

impl JsonPvs {
    fn new((pvs, totals): &(Pvs, Totals)) -> Self {
        Self {
            cells: pvs.cells().len(),
            cell_m: pvs.cells().side_m,
            samples: pvs.samples(),
            bytes: pvs.bytes(),
            views: totals.views,
            false_culls: totals.false_culls,
            misreported: totals.misreported,
            hidden_culled_percent: totals.hidden_culled_percent(),
            query_us: totals.mean(totals.query_ns) / 1000.0,
        }
    }
}

#[derive(Serialize)]
struct JsonRun {
    occlusion: &'static str,
    sound: bool,
    occluders: usize,
    views: u64,
    occluders_used: f64,
    false_culls: u64,
    misreported: u64,
    hidden_culled_percent: f64,
    node_tests: f64,
    polygon_tests: f64,
    tree_nodes: f64,
    tree_depth: u32,
    select_us: f64,
    build_us: f64,
    query_us: f64,
}

impl JsonRun {
    fn new(trial: &Trial) -> Self {
        let totals = trial.totals();
        let micros = |ns: u64| totals.mean(ns) / 1000.0;
        Self {
            occlusion: trial.name(),
            sound: trial.soundness() == Soundness::Conservative,
            occluders: trial.occluders(),
            views: totals.views,
            occluders_used: totals.mean(u64::from(totals.select.chosen)),
            false_culls: totals.false_culls,
            misreported: totals.misreported,
            hidden_culled_percent: totals.hidden_culled_percent(),
            node_tests: totals.mean(totals.cull.node_tests),
            polygon_tests: totals.mean(totals.cull.polygon_tests),
            tree_nodes: totals.mean(u64::from(totals.build.nodes)),
            tree_depth: totals.build.depth,
            select_us: micros(totals.select_ns),
            build_us: micros(totals.build_ns),
            query_us: micros(totals.query_ns),
        }
    }
}

/// The results for a session, as one line of JSON.
pub(super) fn line(
    name: &str,
    polygons: u64,
    [node_test, score]: [&str; 2],
    verifier: &Verifier,
    drawn: Option<&DrawnTrials>,
) -> anyhow::Result<String> {
    let views = verifier.views();
    let mean = |sum: u64| sum as f64 / views.views.max(1) as f64;
    Ok(serde_json::to_string(&JsonVerify {
        recording: name,
        polygons,
        views: views.views,
        in_view_mean: mean(views.in_view),
        visible_mean: mean(views.visible),
        hidden_mean: mean(views.hidden),
        lost: views.lost,
        truth: verifier.has_truth(),
        frustum_us: mean(views.frustum_ns) / 1000.0,
        node_test,
        score,
        runs: verifier.trials().iter().map(JsonRun::new).collect(),
        pvs: verifier.pvs().map(JsonPvs::new),
        drawn: drawn.map(DrawnTrials::runs).unwrap_or_default(),
    })?)
}
