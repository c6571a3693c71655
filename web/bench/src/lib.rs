//! `osp bench` and `osp race` in workers of the pages: a page ends its worker to cancel.
//!
//! ```text
//! page.js ─> bench.js ─> bench_worker.js ─> measure   ─> osp_lab::bench ─> the report as a page of its own
//!            race.js ──> race_worker.js ──> Race::step ─> osp_lab::bench ─> the figures of a frame
//! ```

mod files;
mod race;

pub use files::put;
pub use race::{Race, clock_step_ns, most_ns, picture_width, structures};

use std::path::Path;

use osp::{
    index::IndexConfig,
    occlusion::{Occlusion, OcclusionConfig},
};
use osp_lab::bench::{
    self, BenchReport, Contender, GrowthConfig, Machine, MovingConfig, RaysConfig, RaysModel, SessionInput,
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::Pace,
    replay::{CameraChoice, CameraPath, root_cube, summarize},
};
use wasm_bindgen::prelude::*;

use files::open;

/// The settings of `osp bench --quick`.
const SIZES: [u32; 2] = [1000, 10_000];
const SESSION_SECS: f64 = 0.1;
const GROWTH_SECS: f64 = 0.15;
const RAYS_SECS: f64 = 0.004;
const MOVING_SECS: f64 = 0.01;
const QUERIES: usize = 64;
const BATCH: u32 = 8;
const FLIGHT_FRAMES: u64 = 360;
/// Number of frames between two progress reports.
const SAID_EVERY: u64 = 64;

/// Measures all structures on a session, as `osp bench FILE --quick` does. The report names `browser` in place of a
/// processor. `say` gets the progress as text. Returns the report, a whole page of HTML.
///
/// # Errors
/// The session cannot be read.
#[wasm_bindgen]
pub fn measure(path: &str, browser: &str, say: &js_sys::Function) -> Result<String, JsError> {
    let tell = |text: &str| {
        // If nobody receives the report, the measurement continues.
        let _ = say.call1(&JsValue::NULL, &text.into());
    };
    Ok(bench::page(&run(path, browser, &tell)?))
}

fn run(path: &str, browser: &str, tell: &dyn Fn(&str)) -> Result<BenchReport, JsError> {
    let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned();
    let (pace, reference, kinds) = (Pace::Samples(1), IndexKind::Osp, Contender::usual());
    tell("reading");
    let session = open(path)?;
    let header = session.header.clone();
    let (summary, scene, read) = summarize(session, pace);
    read?;
    let camera =
        |choice: CameraChoice| (CameraPath::new(choice, header.camera, &summary.bounds), choice.name());
    let root = root_cube(&header, &summary.bounds);
    let input = SessionInput {
        recording: name.clone(),
        summary,
        pace,
        camera: camera(CameraChoice::Auto),
        root,
        kinds: kinds.clone(),
        reference,
        budget_secs: SESSION_SECS,
    };
    let mut frame = 0;
    let mut rows = bench::run_session(&input, open(path)?, || {
        frame += 1;
        if frame % SAID_EVERY == 0 {
            tell(&format!("frame {frame} of {}", summary.frames));
        }
    })?;
    tell("flight");
    let config = IndexConfig { root, capacity: scene.polygon_count() };
    let occlusion = (Occlusion::Msvbsp, OcclusionConfig::default());
    for choice in [CameraChoice::Inside, CameraChoice::Orbit] {
        rows.append(bench::fly(&name, &scene, config, camera(choice), occlusion, FLIGHT_FRAMES));
    }
    let growth = GrowthConfig {
        sizes: SIZES.to_vec(),
        kinds: kinds.clone(),
        reference,
        batch: BATCH,
        budget_secs: GROWTH_SECS,
    };
    rows.append(bench::grow(&growth, |what| tell(what))?);
    let rays = RaysConfig { kinds: kinds.clone(), reference, queries: QUERIES, budget_secs: RAYS_SECS };
    let mut models = vec![RaysModel::of_scene(&name, &scene, root)];
    for size in SIZES {
        models.push(RaysModel::synthetic(size)?);
    }
    for model in &models {
        rows.append(bench::cast_rays(&rays, model, |what| tell(&format!("rays, {what}"))));
    }
    let moving = MovingConfig { sizes: SIZES.to_vec(), kinds, reference, budget_secs: MOVING_SECS };
    rows.append(bench::move_things(&moving, |what| tell(what))?);
    Ok(BenchReport {
        machine: Machine { processor: browser.to_owned(), ..Machine::here(option_env!("OSP_COMMIT")) },
        command: format!("the page's benchmark; outside of a browser: osp bench {name} --quick"),
        reference: reference.name().to_owned(),
        rows,
    })
}
