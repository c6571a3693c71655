//! `osp verify --occlusion hzb`: which share of the hidden polygons a method that culls while drawing finds.

use std::{collections::HashSet, sync::Arc};

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

use super::{parsers::Size, verify_method::NamedMethod};
use osp::{
    index::DrawList,
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_lab::{
    Method,
    report::thousands,
    verify::{AtRest, Totals, Verifier},
};
use osp_render::{DrawTimes, DrawnCounts, Gpu, Layer, Offscreen, PassTimes, RendererConfig};
use osp_session::scene::Scene;

/// One method over all views so far.
struct Trial {
    name: &'static str,
    drawer: Offscreen,
    totals: Totals,
    counts: DrawnCounts,
    /// Sums over the views of the medians of their frames, and of the means.
    draw_ns: u64,
    draw_mean_ns: u64,
    passes: PassTimes,
    differing_pixels: u64,
    /// The measured frames of the current view.
    times: Vec<DrawTimes>,
}

/// The result of a frame without culling.
fn all_drawn(in_view: usize) -> DrawnCounts {
    DrawnCounts { in_view: in_view as u64, second_pass: in_view as u64, ..DrawnCounts::default() }
}

/// The median.
fn median(values: impl Iterator<Item = u64>) -> u64 {
    let mut values: Vec<u64> = values.collect();
    values.sort_unstable();
    values.get(values.len() / 2).copied().unwrap_or(0)
}

impl Trial {
    /// Those of these polygons that the last frame drew.
    fn drawn(&self, scene: &Scene, ids: &[PolygonId]) -> anyhow::Result<DrawList> {
        let mut drawn = DrawList::new();
        match self.drawer.drawn()? {
            None => drawn.extend_from_slice(ids),
            Some(opaque) => {
                drawn.extend_from_slice(&opaque);
                // The drawer does not say which transparent polygons it left out.
                let is_transparent = |id: &&_| scene.stroke_of(**id).color().3 < 1.0;
                let mut others: Vec<_> = ids.iter().filter(is_transparent).copied().collect();
                let listed: HashSet<_> = opaque.iter().collect();
                others.retain(|id| !listed.contains(id));
                drawn.extend_from_slice(&others);
            }
        }
        Ok(drawn)
    }

    /// Adds up the frames of a view.
    fn end_view(&mut self) {
        let times = std::mem::take(&mut self.times);
        let passes = || times.iter().map(|times| times.passes.unwrap_or_default());
        self.draw_ns += median(times.iter().map(|times| times.draw.ns));
        self.draw_mean_ns += times.iter().map(|times| times.draw.ns).sum::<u64>() / times.len().max(1) as u64;
        self.passes = self.passes
            + PassTimes {
                total_ns: median(passes().map(|passes| passes.total_ns)),
                depth_ns: median(passes().map(|passes| passes.depth_ns)),
                test_ns: median(passes().map(|passes| passes.test_ns)),
                color_ns: median(passes().map(|passes| passes.color_ns)),
            };
        self.totals.views += 1;
    }
}

/// Draws each view with every method, and without.
pub(super) struct DrawnTrials {
    trials: Vec<Trial>,
    size: Size,
    at_rest: AtRest,
    adapter: String,
}

impl DrawnTrials {
    /// A trial for each method that culls while drawing; `None` if there is no such method.
    pub(super) fn new(methods: &[NamedMethod], size: Size, at_rest: AtRest) -> anyhow::Result<Option<Self>> {
        let drawn: Vec<_> = methods.iter().copied().filter(NamedMethod::is_drawn).collect();
        if drawn.is_empty() {
            return Ok(None);
        }
        let gpu = Arc::new(Gpu::headless()?);
        let mut trials = Vec::new();
        // The picture without culling comes first: all others are compared with it.
        for method in std::iter::once(NamedMethod::new(Method::NONE)).chain(drawn) {
            let NamedMethod { name, occlusion, .. } = method;
            let mut drawer =
                Offscreen::on(Arc::clone(&gpu), size.width, size.height, &RendererConfig::default())?;
            drawer.set_occlusion_with(occlusion.while_drawing(), method.hzb())?;
            trials.push(Trial {
                name,
                drawer,
                totals: Totals::default(),
                counts: DrawnCounts::default(),
                draw_ns: 0,
                draw_mean_ns: 0,
                passes: PassTimes::default(),
                differing_pixels: 0,
                times: Vec::new(),
            });
        }
        Ok(Some(Self { trials, size, at_rest, adapter: gpu.name() }))
    }

    /// Follows the scene by one frame's changes.
    pub(super) fn follow(&mut self, changes: &[Change]) {
        for trial in &mut self.trials {
            trial.drawer.follow(changes);
        }
    }

    /// Draws the view that the verifier has just verified.
    pub(super) fn look(&mut self, scene: &Scene, view: &View, verifier: &mut Verifier) -> anyhow::Result<()> {
        let ids = verifier.in_view().to_vec();
        let polygons: VisibleBlocks = ids.iter().copied().collect();
        let mut whole = None;
        for frame in 0..self.at_rest.settle + self.at_rest.frames {
            // In turns, so that whatever else the machine does falls on all.
            for trial in &mut self.trials {
                let times = trial.drawer.draw(scene, view, &[Layer::plain(&polygons)])?;
                let picture = trial.drawer.image()?;
                // The first trial is the picture without culling.
                trial.differing_pixels +=
                    picture.differing_pixels(whole.get_or_insert_with(|| picture.clone())) as u64;
                if frame >= self.at_rest.settle {
                    trial.times.push(times);
                    trial.counts = trial.counts + times.occlusion.unwrap_or_else(|| all_drawn(ids.len()));
                    verifier.judge(&trial.drawn(scene, &ids)?, &mut trial.totals);
                }
            }
        }
        self.trials.iter_mut().for_each(Trial::end_view);
        Ok(())
    }

    /// The methods whose picture differs from the one without culling, with the number of pixels that differ.
    pub(super) fn failed(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        let failed = self.trials.iter().filter(|trial| trial.differing_pixels > 0);
        failed.map(|trial| (trial.name, trial.differing_pixels))
    }

    /// The table.
    pub(super) fn text(&self) -> String {
        let mut table = Table::new();
        table.load_preset(presets::ASCII_MARKDOWN);
        table.set_header([
            "method (GPU)",
            "pixels that differ",
            "hidden %",
            "below a sample",
            "groups tested",
            "depth pass",
            "colour pass",
            "draw ms",
            "mean",
            "GPU ms: depth",
            "test",
            "colours",
        ]);
        for run in self.runs() {
            let count = |n: f64| thousands(n.round() as u64);
            let [depth, test, colors] = run.gpu_ms;
            table.add_row([
                run.occlusion.to_owned(),
                thousands(run.differing_pixels),
                format!("{:.1}", run.hidden_culled_percent),
                count(run.below_a_sample),
                count(run.groups_tested),
                count(run.first_pass),
                count(run.second_pass),
                format!("{:.2}", run.draw_ms),
                format!("{:.2}", run.draw_mean_ms),
                format!("{depth:.2}"),
                format!("{test:.2}"),
                format!("{colors:.2}"),
            ]);
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        let Size { width, height } = self.size;
        format!("drawn by {}, {width} x {height} pixels\n{table}", self.adapter)
    }

    /// The same for programs.
    pub(super) fn runs(&self) -> Vec<DrawnRun> {
        self.trials.iter().map(DrawnRun::new).collect()
    }
}

/// The results of a method, as means over the measured frames.
#[derive(Serialize)]
pub(super) struct DrawnRun {
    occlusion: &'static str,
    differing_pixels: u64,
    hidden_culled_percent: f64,
    /// Polygons that were not drawn because they cover no sample of a pixel, though a ray of the oracle reaches them.
    below_a_sample: f64,
    groups_tested: f64,
    first_pass: f64,
    second_pass: f64,
    draw_ms: f64,
    draw_mean_ms: f64,
    gpu_ms: [f64; 3],
}

impl DrawnRun {
    fn new(trial: &Trial) -> Self {
        let totals = &trial.totals;
        // There is one time for each view.
        let ms = |ns: u64| ns as f64 / totals.views.max(1) as f64 * 1.0e-6;
        Self {
            occlusion: trial.name,
            differing_pixels: trial.differing_pixels,
            hidden_culled_percent: totals.hidden_culled_percent(),
            below_a_sample: totals.mean(totals.false_culls),
            groups_tested: totals.mean(trial.counts.groups_tested),
            first_pass: totals.mean(trial.counts.first_pass),
            second_pass: totals.mean(trial.counts.second_pass),
            draw_ms: ms(trial.draw_ns),
            draw_mean_ms: ms(trial.draw_mean_ns),
            gpu_ms: [trial.passes.depth_ns, trial.passes.test_ns, trial.passes.color_ns].map(ms),
        }
    }
}
