//! `osp verify --occlusion hzb`: measures the share of the hidden polygons that a method culls while drawing.

use std::{collections::HashSet, sync::Arc};

use super::{parsers::Size, verify_method::NamedMethod};
use osp::{
    polygon::{Change, PolygonId, VisibleBlocks},
    view::View,
};
use osp_lab::{
    Method,
    rows::Rows,
    verify::{AtRest, Totals, Verifier},
};
use osp_render::{DrawTimes, DrawnCounts, Gpu, Layer, Offscreen, PassTimes, RendererConfig};
use osp_session::scene::Scene;

const PART: &str = "verify-drawn";

/// Results of one method over all views so far.
struct Trial {
    name: &'static str,
    drawer: Offscreen,
    totals: Totals,
    counts: DrawnCounts,
    /// Sum over the views of the median drawing time of a view's frames.
    draw_ns: u64,
    /// Sum over the views of the mean drawing time of a view's frames.
    draw_mean_ns: u64,
    passes: PassTimes,
    differing_pixels: u64,
    /// The measured frames of the current view.
    times: Vec<DrawTimes>,
}

/// Returns the counts of a frame without culling.
fn all_drawn(in_view: usize) -> DrawnCounts {
    DrawnCounts { in_view: in_view as u64, second_pass: in_view as u64, ..DrawnCounts::default() }
}

fn median(values: impl Iterator<Item = u64>) -> u64 {
    let mut values: Vec<u64> = values.collect();
    values.sort_unstable();
    values.get(values.len() / 2).copied().unwrap_or(0)
}

impl Trial {
    /// Returns the polygons among `ids` that the last frame drew.
    fn drawn(&self, scene: &Scene, ids: &[PolygonId]) -> anyhow::Result<Vec<PolygonId>> {
        let mut drawn = Vec::new();
        match self.drawer.drawn()? {
            None => drawn.extend_from_slice(ids),
            Some(opaque) => {
                drawn.extend_from_slice(&opaque);
                // The drawer's list has no transparent polygons, so all of them count as drawn.
                let is_transparent = |id: &&_| scene.stroke_of(**id).color().3 < 1.0;
                let mut others: Vec<_> = ids.iter().filter(is_transparent).copied().collect();
                let listed: HashSet<_> = opaque.iter().collect();
                others.retain(|id| !listed.contains(id));
                drawn.extend_from_slice(&others);
            }
        }
        Ok(drawn)
    }

    /// Adds the medians and the mean of a view's frames to the sums.
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

/// Draws each view with every method, and without culling.
pub(super) struct DrawnTrials {
    trials: Vec<Trial>,
    size: Size,
    at_rest: AtRest,
    adapter: String,
}

impl DrawnTrials {
    /// Creates a trial for each method that culls while drawing. `None` if there is no such method.
    pub(super) fn new(methods: &[NamedMethod], size: Size, at_rest: AtRest) -> anyhow::Result<Option<Self>> {
        let drawn: Vec<_> = methods.iter().copied().filter(NamedMethod::is_drawn).collect();
        if drawn.is_empty() {
            return Ok(None);
        }
        let gpu = Arc::new(Gpu::headless()?);
        let mut trials = Vec::new();
        // The picture without culling comes first, because all other pictures are compared with it.
        for method in std::iter::once(NamedMethod::new(Method::NONE)).chain(drawn) {
            let NamedMethod { name, occlusion, .. } = method;
            let mut drawer =
                Offscreen::on(Arc::clone(&gpu), size.width, size.height, &RendererConfig::default())?;
            drawer.set_occlusion(occlusion.while_drawing())?;
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

    pub(super) fn follow(&mut self, changes: &[Change]) {
        for trial in &mut self.trials {
            trial.drawer.renderer.follow(changes);
        }
    }

    /// Draws the view that the verifier has just verified.
    pub(super) fn draw_view(
        &mut self,
        scene: &Scene,
        view: &View,
        verifier: &mut Verifier,
    ) -> anyhow::Result<()> {
        let ids = verifier.in_view().to_vec();
        let polygons: VisibleBlocks = ids.iter().copied().collect();
        let mut whole = None;
        for frame in 0..self.at_rest.settle + self.at_rest.frames {
            // The trials take turns, so that other processes affect all of them equally.
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

    /// Adds rows of means over the measured frames. Reports pixels that differ from the picture without culling as
    /// faults.
    pub(super) fn add_to(&self, rows: &mut Rows, recording: &str) {
        let Size { width, height } = self.size;
        rows.part(PART, "Occlusion culling while drawing");
        rows.note(PART, format!("Drawn by {}, {width} x {height} pixels.", self.adapter));
        rows.note(
            PART,
            "below a sample: polygons that are visible by ray but cover no sample of a pixel, so they were not drawn.",
        );
        for trial in &self.trials {
            let Trial { name, totals, counts, passes, differing_pixels, .. } = trial;
            // Divides by the number of views, because the sums have one value for each view.
            let ms = |ns: u64| ns as f64 / totals.views.max(1) as f64 * 1.0e-6;
            if *differing_pixels > 0 {
                rows.faults.push(format!("{recording}: {name} changed {differing_pixels} pixels"));
            }
            rows.of(PART, recording, *name)
                .value("pixels_that_differ", "", *differing_pixels as f64)
                .value("hidden", "%", totals.hidden_culled_percent())
                .value("below_a_sample", "polygons", totals.mean(totals.false_culls))
                .value("groups_tested", "", totals.mean(counts.groups_tested))
                .value("depth_pass", "polygons", totals.mean(counts.first_pass))
                .value("colour_pass", "polygons", totals.mean(counts.second_pass))
                .value("draw", "ms", ms(trial.draw_ns))
                .value("draw_mean", "ms", ms(trial.draw_mean_ns))
                .value("gpu_depth", "ms", ms(passes.depth_ns))
                .value("gpu_test", "ms", ms(passes.test_ns))
                .value("gpu_colours", "ms", ms(passes.color_ns));
        }
    }
}
