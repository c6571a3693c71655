use serde::{Serialize, Serializer};

use super::{AgainstOneView, DrawReport, ReplayReport, RigReport, RigViewReport, RunReport};

#[derive(Serialize)]
struct JsonReport<'a> {
    recording: &'a str,
    strokes: u64,
    points: u64,
    polygons: u64,
    frames: u64,
    pace: &'a str,
    camera: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    rig: Option<&'a RigReport>,
    indexes_agree: bool,
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
    frames_fingerprinted: usize,
    refused: u64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    occlusion: Option<JsonOcclusion>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    draw: Option<JsonDraw>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    views: Option<JsonViews>,
}

/// The keys that a run has where drawing was asked for.
#[derive(Serialize)]
struct JsonDraw {
    draw_us: JsonQuantiles,
    send_us: JsonQuantiles,
    frames_drawn: u64,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    culling: Option<JsonDrawnWhileCulling>,
}

/// The keys that a run has where hidden polygons were looked for while drawing.
#[derive(Serialize)]
struct JsonDrawnWhileCulling {
    groups_tested_mean: f64,
    first_pass_mean: f64,
    second_pass_mean: f64,
    hidden_mean: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    gpu_us: Option<JsonGpu>,
}

/// Median times of the passes.
#[derive(Serialize)]
struct JsonGpu {
    depth: f64,
    test: f64,
    colors: f64,
}

impl JsonDrawnWhileCulling {
    fn of(draw: &DrawReport) -> Option<Self> {
        draw.has_culling().then(|| Self {
            groups_tested_mean: draw.culling_mean(|drawn| drawn.groups_tested),
            first_pass_mean: draw.culling_mean(|drawn| drawn.first_pass),
            second_pass_mean: draw.culling_mean(|drawn| drawn.second_pass),
            hidden_mean: draw.culling_mean(|drawn| drawn.hidden),
            gpu_us: draw.gpu_us().map(|[depth, test, colors]| JsonGpu { depth, test, colors }),
        })
    }
}

impl JsonDraw {
    fn of(draw: &DrawReport) -> Self {
        Self {
            draw_us: JsonQuantiles::of(|quantile| draw.draw_us(quantile)),
            send_us: JsonQuantiles::of(|quantile| draw.send_us(quantile)),
            frames_drawn: draw.frames(),
            culling: JsonDrawnWhileCulling::of(draw),
        }
    }
}

/// The keys that a run has where occlusion was asked for.
#[derive(Serialize)]
struct JsonOcclusion {
    occlusion: &'static str,
    node_test: &'static str,
    score: &'static str,
    occluded_mean: f64,
    occlusion_used_percent: f64,
    /// The polygons visible in the last frame: `depth-last`, and `auto` where that takes least time.
    occlusion_by_last_percent: f64,
    occlusion_us: f64,
    occlusion_select_us: f64,
    occlusion_build_us: f64,
    occlusion_query_us: f64,
    polygon_ns: f64,
    frame_drawn_us: JsonQuantiles,
    drawn_fingerprint: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    false_culls: Option<u64>,
}

impl JsonOcclusion {
    fn of(run: &RunReport) -> Option<Self> {
        let occlusion = run.occlusion.as_ref()?;
        let drawn = |quantile| run.drawn_frame_us(quantile, occlusion.polygon_ns);
        Some(Self {
            occlusion: occlusion.method,
            node_test: occlusion.tests.0.name(),
            score: occlusion.tests.1.name(),
            occluded_mean: run.occluded_mean(),
            occlusion_used_percent: run.occlusion_used_percent(),
            occlusion_by_last_percent: run.occlusion_by_last_percent(),
            occlusion_us: run.occlusion_total_us(),
            occlusion_select_us: run.occlusion_us(|o| o.select.ns),
            occlusion_build_us: run.occlusion_us(|o| o.build.ns),
            occlusion_query_us: run.occlusion_us(|o| o.query.ns),
            polygon_ns: occlusion.polygon_ns,
            frame_drawn_us: JsonQuantiles::of(drawn),
            drawn_fingerprint: format!("{:016x}", occlusion.fingerprint.value()),
            false_culls: occlusion.false_culls,
        })
    }
}

/// The keys that a run has on a rig.
#[derive(Serialize)]
struct JsonViews {
    views: Vec<JsonView>,
    #[serde(skip_serializing_if = "Option::is_none")]
    against_one_view: Option<AgainstOneView>,
}

#[derive(Serialize)]
struct JsonView {
    screen: String,
    eye: &'static str,
    in_view_mean: Option<f64>,
    drawn_mean: Option<f64>,
}

impl JsonViews {
    fn of(rig: Option<&RigReport>, run: &RunReport) -> Option<Self> {
        let view = |(number, view): (usize, &RigViewReport)| {
            let means = run.view_means(number);
            JsonView {
                screen: view.screen.clone(),
                eye: view.eye,
                in_view_mean: means.map(|means| means.in_view),
                drawn_mean: means.map(|means| means.drawn),
            }
        };
        Some(Self {
            views: rig?.views.iter().enumerate().map(view).collect(),
            against_one_view: run.against_one_view(),
        })
    }
}

#[derive(Serialize)]
struct JsonQuantiles {
    p50: f64,
    p95: f64,
    p99: f64,
    max: f64,
}

impl JsonQuantiles {
    fn of(quantile: impl Fn(f64) -> f64) -> Self {
        Self { p50: quantile(0.5), p95: quantile(0.95), p99: quantile(0.99), max: quantile(1.0) }
    }
}

impl Serialize for ReplayReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let runs = self
            .runs
            .iter()
            .map(|run| JsonRun {
                index: &run.index,
                insert_ns_per_polygon: run.insert_ns_per_polygon(),
                cull_us: run.cull_us(),
                frame_us: JsonQuantiles::of(|quantile| run.frame_us(quantile)),
                visible_mean: run.visible_mean(),
                culled_mean: run.culled_mean(),
                fingerprint: format!("{:016x}", run.fingerprint()),
                bytes: run.bytes,
                allocations_steady: run.allocations_steady(),
                frames_measured: run.measured_frames(),
                frames_fingerprinted: run.frames().len(),
                refused: run.refused,
                occlusion: JsonOcclusion::of(run),
                draw: run.draw.as_ref().map(JsonDraw::of),
                views: JsonViews::of(self.rig.as_ref(), run),
            })
            .collect();
        let report = JsonReport {
            recording: &self.recording,
            strokes: self.strokes,
            points: self.points,
            polygons: self.polygons,
            frames: self.frames,
            pace: &self.pace,
            camera: &self.camera,
            rig: self.rig.as_ref(),
            indexes_agree: self.first_disagreement().is_none(),
            runs,
        };
        report.serialize(serializer)
    }
}
