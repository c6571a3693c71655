//! The figures of a replay as rows.

use super::{ReplayReport, RunReport, run::Measured};
use crate::rows::Rows;
use osp::frame::OcclusionRecord;

const PART: &str = "replay";
const VIEWS: &str = "replay/views";

impl ReplayReport {
    /// The figures of the runs, the important ones first; with a rig also those of each screen and eye. Ratios are
    /// relative to the fastest run, see [`ReplayReport::fastest`].
    pub fn rows(&self) -> Rows {
        let mut rows = Rows::default();
        rows.part(PART, "Replay");
        let fastest = self.fastest();
        for run in &self.runs {
            let ratios = fastest.map_or(Vec::new(), |fastest| ratios(fastest, run));
            run.add_to(&mut rows, &self.recording, ratios);
        }
        let Some(rig) = &self.rig else { return rows };
        for run in &self.runs {
            let mut figures = rows.of(VIEWS, &*self.recording, run.name());
            if let Some(of) = run.against_one_view() {
                figures
                    .value("all_views_mean", "µs", of.all_views_us)
                    .value("views_x_one_mean", "µs", of.views_times_one_us)
                    .value("all_against_one", "", of.ratio);
            }
            for (number, view) in rig.views.iter().enumerate() {
                let means = run.view_means(number);
                let name = view.name().replacen(", ", " ", 1);
                figures
                    .maybe(&format!("{name} in view"), "polygons", means.map(|means| means.in_view))
                    .maybe(&format!("{name} drawn"), "polygons", means.map(|means| means.drawn));
            }
        }
        rows
    }

    /// The run with the shortest median frame time. `None` if there is only one run, or if a run has occlusion culling
    /// or draws, because the drawing time then matters, too.
    pub fn fastest(&self) -> Option<&RunReport> {
        let runs = || self.runs.iter().filter(|run| run.measured_frames() > 0);
        if runs().count() < 2 || runs().any(|run| run.occlusion.is_some() || run.draw.is_some()) {
            return None;
        }
        // A run that did not complete all frames cannot be the fastest.
        let complete = runs().filter(|run| run.is_complete());
        complete.min_by(|a, b| a.frame_us(0.5).total_cmp(&b.frame_us(0.5)))
    }
}

impl RunReport {
    fn add_to(&self, rows: &mut Rows, recording: &str, ratios: Vec<f64>) {
        let mut figures = rows.of(PART, recording, self.name());
        figures
            .value("insert", "ns/polygon", self.insert_ns_per_polygon())
            .value("cull", "µs", self.cull_us())
            .value("frame_p50", "µs", self.frame_us(0.5))
            .value("p99", "µs", self.frame_us(0.99));
        if let Some(occlusion) = &self.occlusion {
            let is_stage = !self.draw.as_ref().is_some_and(|draw| draw.has_culling());
            figures
                .value("occluded", "polygons", self.occluded_mean())
                .value("occlusion", "µs", self.occlusion_total_us())
                // Methods of the graphics adapter run while drawing, not as a stage of the frame.
                .maybe("used", "%", is_stage.then(|| self.occlusion_used_percent()))
                .value("with_drawing", "µs", self.drawn_frame_us(0.5, occlusion.polygon_ns));
        }
        if let Some(draw) = &self.draw {
            figures.value("draw_p50", "µs", draw.draw_us(0.5)).value("draw_p99", "µs", draw.draw_us(0.99));
            if draw.has_culling() {
                figures
                    .value("groups_tested", "", draw.culling_mean(|drawn| drawn.groups_tested))
                    .value("depth_pass", "polygons", draw.culling_mean(|drawn| drawn.first_pass))
                    .value("colour_pass", "polygons", draw.culling_mean(|drawn| drawn.second_pass));
                let passes = draw.gpu_us().unwrap_or_default();
                for (figure, us) in ["gpu_depth", "gpu_test", "gpu_colours"].into_iter().zip(passes) {
                    figures.value(figure, "µs", us);
                }
            }
        }
        figures
            .value("max", "µs", self.frame_us(1.0))
            .median("ratio", "", ratios)
            .value("p95", "µs", self.frame_us(0.95))
            .value("visible", "polygons", self.visible_mean())
            .value("culled", "polygons", self.culled_mean())
            .value("memory", "KiB", (self.bytes / 1024) as f64)
            .value("frames_measured", "", self.measured_frames() as f64)
            .value("input", "µs", self.input_us());
        let stage = |of: fn(&OcclusionRecord) -> u64| self.has_run(of).then(|| self.occlusion_us(of));
        figures
            .maybe("occluders", "µs", stage(|o| o.select.ns))
            .maybe("build", "µs", stage(|o| o.build.ns))
            .maybe("tests", "µs", stage(|o| o.query.ns))
            .maybe("send", "µs", self.draw.as_ref().map(|draw| draw.send_us(0.5)));
    }
}

/// The ratios of two runs' times: one for each frame that was measured in both.
fn ratios(fastest: &RunReport, other: &RunReport) -> Vec<f64> {
    let mut all = fastest.curve().iter().peekable();
    let ratio = |of_other: &Measured| {
        while all.next_if(|of_fastest| of_fastest.frame < of_other.frame).is_some() {}
        let of_fastest = all.next_if(|of_fastest| of_fastest.frame == of_other.frame)?;
        Some(of_other.total_ns as f64 / of_fastest.total_ns.max(1) as f64)
    };
    other.curve().iter().filter_map(ratio).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::frame::{FrameRecord, Stage};
    use osp_session::replay::LaneFrame;

    /// A run with these frames (number, microseconds).
    fn run(name: &str, session_frames: u64, frames: &[(u64, u64)]) -> RunReport {
        let mut run = RunReport::new(name, session_frames);
        for &(frame, us) in frames {
            let cull = Stage { ns: us * 1000, allocations: 0 };
            let mut record = FrameRecord::default();
            record.frame = frame;
            record.cull = cull;
            run.add(&LaneFrame {
                applying: Stage::default(),
                record,
                in_view: 0,
                drawn: 0,
                catches_up: false,
            });
        }
        run
    }

    fn report(runs: Vec<RunReport>) -> ReplayReport {
        ReplayReport {
            recording: "r".to_owned(),
            strokes: 0,
            points: 0,
            polygons: 0,
            frames: 4,
            pace: String::new(),
            camera: String::new(),
            rig: None,
            load: Default::default(),
            runs,
        }
    }

    #[test]
    fn times_are_compared_over_the_frames_that_both_were_measured_in() {
        let fast = run("fast", 4, &[(1, 10), (2, 10), (3, 30), (4, 30)]);
        let slow = run("slow", 4, &[(1, 40), (2, 40), (3, 60), (4, 60)]);
        // Measured on the short frames only, so its median is too small.
        let partial = run("partial", 4, &[(1, 15), (2, 15)]);
        let report = report(vec![slow, partial, fast]);
        assert_eq!(report.fastest().map(RunReport::name).as_deref(), Some("fast"));
        let rows = report.rows();
        let said = "On r fast takes the least time; the next (partial) takes 1.50 times as long.";
        assert_eq!(rows.verdict("fast").as_deref(), Some(said));
        assert_eq!(rows.value(PART, "r", "slow", "ratio"), Some(3.0));
        assert!(ReplayReport { runs: vec![run("alone", 4, &[(1, 10)])], ..report }.fastest().is_none());
    }
}
