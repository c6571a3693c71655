//! `osp verify --occlusion hzb`: what culling while drawing finds of what really cannot be seen.

use std::{collections::HashSet, sync::Arc};

use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

use super::{render::Size, verify_method::Method};
use crate::{
    index::DrawList,
    render::{
        DrawTimes, DrawnCounts, DrawnOcclusion, Gpu, HzbBound, HzbConfig, HzbFine, HzbGroup, Layer,
        Offscreen, PassTimes, RendererConfig,
    },
    report::thousands,
    scene::{Change, Scene},
    visibility::{
        View,
        verify::{Totals, Verifier},
    },
};

/// Ways to find while drawing what is hidden, by name.
pub(super) fn drawn_methods() -> impl Iterator<Item = (&'static str, DrawnOcclusion)> {
    let coarse = |group, bound| HzbConfig { group, bound, fine: HzbFine::Off };
    [
        ("hzb", HzbConfig::default()),
        ("hzb-16", coarse(HzbGroup::Sixteen, HzbBound::Corners)),
        ("hzb-4", coarse(HzbGroup::Four, HzbBound::Corners)),
        ("hzb-1", coarse(HzbGroup::One, HzbBound::Corners)),
        ("hzb-16-box", coarse(HzbGroup::Sixteen, HzbBound::Box)),
        ("hzb-4-box", coarse(HzbGroup::Four, HzbBound::Box)),
        ("hzb-1-box", coarse(HzbGroup::One, HzbBound::Box)),
        ("hzb-16-fine", HzbConfig { group: HzbGroup::Sixteen, ..HzbConfig::default() }),
        ("hzb-4-fine", HzbConfig { group: HzbGroup::Four, ..HzbConfig::default() }),
    ]
    .into_iter()
    .map(|(name, config)| (name, DrawnOcclusion::Hzb(config)))
    .chain([("queries", DrawnOcclusion::Queries), ("auto", DrawnOcclusion::Auto)])
}

/// How each view is drawn by a camera at rest.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(super) struct DrawnArgs {
    /// Width and height of what is drawn for hzb, pixels.
    #[arg(long, default_value = "1920x1080")]
    size: Size,
    /// Frames of each view that are drawn with each method and whose times count.
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    frames: u32,
    /// Frames that are drawn of each view before; the first has nothing to go by, and `auto` tries the other way after 16.
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    settle: u32,
}

/// One method over all views so far.
struct Trial {
    name: &'static str,
    drawer: Offscreen,
    totals: Totals,
    counts: DrawnCounts,
    draw_ns: u64,
    draw_mean_ns: u64,
    passes: PassTimes,
    differing_pixels: u64,
}

/// Draws each view with every method, and without.
pub(super) struct DrawnTrials {
    trials: Vec<Trial>,
    args: DrawnArgs,
    adapter: String,
}

impl DrawnTrials {
    /// Trials of those of the methods that work while drawing; `None` if there is none.
    pub(super) fn new(methods: &[Method], args: DrawnArgs) -> anyhow::Result<Option<Self>> {
        let drawn = methods.iter().filter_map(|method| match *method {
            Method::Drawn(name, occlusion) => Some((name, occlusion)),
            Method::Culler(_) | Method::Last => None,
        });
        let drawn: Vec<_> = drawn.collect();
        if drawn.is_empty() {
            return Ok(None);
        }
        let DrawnArgs { size, .. } = args;
        let gpu = Arc::new(Gpu::headless()?);
        let mut trials = Vec::new();
        // The picture without culling comes first: all others are compared with it.
        for (name, occlusion) in std::iter::once(("none", DrawnOcclusion::None)).chain(drawn) {
            let mut drawer =
                Offscreen::on(Arc::clone(&gpu), size.width, size.height, &RendererConfig::default())?;
            drawer.set_occlusion(occlusion)?;
            trials.push(Trial {
                name,
                drawer,
                totals: Totals::default(),
                counts: DrawnCounts::default(),
                draw_ns: 0,
                draw_mean_ns: 0,
                passes: PassTimes::default(),
                differing_pixels: 0,
            });
        }
        Ok(Some(Self { trials, args, adapter: gpu.name() }))
    }

    /// Follows the scene by one frame's changes.
    pub(super) fn follow(&mut self, changes: &[Change]) {
        for trial in &mut self.trials {
            trial.drawer.follow(changes);
        }
    }

    /// Looks as the verifier has just looked.
    pub(super) fn look(&mut self, scene: &Scene, view: &View, verifier: &mut Verifier) -> anyhow::Result<()> {
        let ids = verifier.in_view().to_vec();
        let mut times = vec![Vec::<DrawTimes>::new(); self.trials.len()];
        // In turns, so that whatever else the machine does falls on all.
        for _ in 0..self.args.settle + self.args.frames {
            for (trial, times) in self.trials.iter_mut().zip(&mut times) {
                times.push(trial.drawer.draw(scene, view, &[Layer::plain(&ids)])?);
            }
        }
        let whole = self.trials[0].drawer.image()?;
        for (trial, times) in self.trials.iter_mut().zip(&mut times) {
            let times = &mut times[self.args.settle as usize..];
            times.sort_unstable_by_key(|times| times.draw.ns);
            let median = times[times.len() / 2];
            trial.draw_ns += median.draw.ns;
            trial.draw_mean_ns += times.iter().map(|times| times.draw.ns).sum::<u64>() / times.len() as u64;
            trial.passes = trial.passes + median.passes.unwrap_or_default();
            trial.counts = trial.counts + median.occlusion.unwrap_or_default();
            trial.differing_pixels += trial.drawer.image()?.differing_pixels(&whole) as u64;
            let mut drawn = DrawList::new();
            match trial.drawer.drawn()? {
                None => drawn.extend_from_slice(&ids),
                Some(opaque) => {
                    drawn.extend_from_slice(&opaque);
                    // Which transparent ones were left out is not told.
                    let is_transparent = |id: &&_| scene.stroke_of(**id).color().3 < 1.0;
                    let mut others: Vec<_> = ids.iter().filter(is_transparent).copied().collect();
                    let listed: HashSet<_> = opaque.iter().collect();
                    others.retain(|id| !listed.contains(id));
                    drawn.extend_from_slice(&others);
                }
            }
            verifier.judge(&drawn, &mut trial.totals);
        }
        Ok(())
    }

    /// The names of the methods whose picture was another than without, with the number of pixels.
    pub(super) fn failed(&self) -> impl Iterator<Item = (&'static str, u64)> + '_ {
        let failed = self.trials.iter().filter(|trial| trial.differing_pixels > 0);
        failed.map(|trial| (trial.name, trial.differing_pixels))
    }

    /// The table.
    pub(super) fn text(&self) -> String {
        let mut table = Table::new();
        table.load_preset(presets::ASCII_MARKDOWN);
        table.set_header([
            "while drawing",
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
        let Size { width, height } = self.args.size;
        format!("drawn by {}, {width} x {height} pixels\n{table}", self.adapter)
    }

    /// The same for programs.
    pub(super) fn runs(&self) -> Vec<DrawnRun> {
        self.trials.iter().map(DrawnRun::new).collect()
    }
}

/// What a method did, means of the views.
#[derive(Serialize)]
pub(super) struct DrawnRun {
    occlusion: &'static str,
    differing_pixels: u64,
    hidden_culled_percent: f64,
    /// Polygons of which something can be seen, but nothing on any sample of a pixel, and which were left out.
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
        let ms = |ns: u64| totals.mean(ns) * 1.0e-6;
        let drawn = match trial.counts.in_view {
            0 => totals.mean(totals.drawn),
            _ => totals.mean(trial.counts.second_pass),
        };
        Self {
            occlusion: trial.name,
            differing_pixels: trial.differing_pixels,
            hidden_culled_percent: totals.hidden_culled_percent(),
            below_a_sample: totals.mean(totals.false_culls),
            groups_tested: totals.mean(trial.counts.groups_tested),
            first_pass: totals.mean(trial.counts.first_pass),
            second_pass: drawn,
            draw_ms: ms(trial.draw_ns),
            draw_mean_ms: ms(trial.draw_mean_ns),
            gpu_ms: [trial.passes.depth_ns, trial.passes.test_ns, trial.passes.color_ns].map(ms),
        }
    }
}
