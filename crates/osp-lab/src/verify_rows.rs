//! The results of a verification as rows.

use crate::{
    report::thousands,
    rows::{Figures, Rows},
    verify::{Totals, Trial, Verifier},
};
use osp::occlusion::Soundness;

const PART: &str = "verify";

impl Trial {
    /// The trial's name in the rows: the method, its number of occluders, and a note if it is not conservative.
    fn row_name(&self) -> String {
        let sure = if self.soundness() == Soundness::Conservative { "" } else { " (not conservative)" };
        format!("{}, {} occluders{sure}", self.name(), self.occluders())
    }
}

impl Verifier {
    /// Adds a verified session; the rows are the part `verify`. Faults are polygons that were lost, culled although
    /// visible, or reported twice.
    pub fn add_to(&self, rows: &mut Rows, recording: &str, polygons: u64) {
        rows.part(PART, "Occlusion culling against what can be seen");
        let views = self.views();
        let mean = |sum: u64| sum as f64 / views.views.max(1) as f64;
        let truth = |sum: u64| self.has_truth().then(|| mean(sum));
        rows.of(PART, recording, "")
            .value("polygons", "polygons", polygons as f64)
            .value("views", "views", views.views as f64)
            .value("in_view", "polygons", mean(views.in_view))
            .maybe("visible", "polygons", truth(views.visible))
            .maybe("hidden", "polygons", truth(views.hidden))
            .value("lost", "polygons", views.lost as f64)
            .value("frustum", "µs", mean(views.frustum_ns) / 1000.0);
        if !self.has_truth() {
            rows.note(PART, "Which polygons are visible was not determined.");
        } else if views.lost == 0 && !self.trials().iter().any(Trial::failed) {
            let views = match views.views {
                1 => "1 view".to_owned(),
                views => format!("{} views", thousands(views)),
            };
            rows.note(
                PART,
                format!("{recording}: no conservative method culled a visible polygon in {views}."),
            );
            rows.note(
                PART,
                "In view, visible, hidden: means of a view. A polygon in view that is neither visible nor hidden is outside the picture.",
            );
        }
        if let Some((view, id)) = views.first_lost {
            rows.faults.push(format!(
                "{recording}: frustum culling removed {} polygons that reach into the view; the first is polygon {} in view {view}",
                views.lost, id.0
            ));
        }
        for trial in self.trials() {
            let totals = trial.totals();
            let us = |ns: u64| totals.mean(ns) / 1000.0;
            let mut figures = rows.of(PART, recording, trial.row_name());
            figures.value("used", "", totals.mean(totals.occluders));
            found(&mut figures, totals);
            figures
                .value("nodes_tested", "1/view", totals.mean(totals.node_tests))
                .value("polygons_tested", "1/view", totals.mean(totals.polygon_tests))
                .value("planes", "", totals.mean(totals.planes))
                .value("select", "µs", us(totals.select_ns))
                .value("build", "µs", us(totals.build_ns))
                .value("query", "µs", us(totals.query_ns));
            if trial.failed() {
                let first = totals.first_false.map_or(String::new(), |(view, id)| {
                    format!("; the first is polygon {} in view {view}", id.0)
                });
                rows.faults.push(format!(
                    "{recording}: {} with {} occluders culled {} visible polygons and misreported {}{first}",
                    trial.name(),
                    trial.occluders(),
                    totals.false_culls,
                    totals.misreported,
                ));
            }
        }
        if let Some((pvs, totals)) = self.pvs() {
            let mut figures = rows.of(PART, recording, "pvs (sampled)");
            found(&mut figures, totals);
            figures.value("query", "µs", totals.mean(totals.query_ns) / 1000.0);
            let (cells, side_m, samples) = (pvs.cells.len(), pvs.cells.side_m, &pvs.samples);
            let bytes = pvs.bytes();
            rows.note(
                PART,
                format!("pvs: {cells} cells of {side_m:.2} m, {samples} samples each, {bytes} bytes."),
            );
        }
    }
}

/// Adds the counts of a method's polygons.
fn found(figures: &mut Figures<'_>, totals: &Totals) {
    figures
        .value("wrong", "polygons", totals.false_culls as f64)
        .value("misreported", "polygons", totals.misreported as f64)
        .value("hidden", "%", totals.hidden_culled_percent());
}
