//! A replay as JSON; docs/study.md describes the fields.

use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use super::{DrawReport, OcclusionReport, ReplayReport, RigReport, RunReport};

impl Serialize for ReplayReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let runs: Vec<Value> = self.runs.iter().map(|run| run.to_json(self.rig.as_ref())).collect();
        let mut report = json!({
            "recording": self.recording,
            "strokes": self.strokes,
            "points": self.points,
            "polygons": self.polygons,
            "frames": self.frames,
            "pace": self.pace,
            "camera": self.camera,
            "indexes_agree": self.first_disagreement().is_none(),
            "runs": runs,
        });
        if let Some(rig) = &self.rig {
            report["rig"] = json!(rig);
        }
        report.serialize(serializer)
    }
}

fn quantiles(at: impl Fn(f64) -> f64) -> Value {
    json!({ "p50": at(0.5), "p95": at(0.95), "p99": at(0.99), "max": at(1.0) })
}

fn extend(object: &mut Value, more: Value) {
    if let (Value::Object(object), Value::Object(more)) = (object, more) {
        object.extend(more);
    }
}

impl RunReport {
    fn to_json(&self, rig: Option<&RigReport>) -> Value {
        let mut run = json!({
            "index": self.index,
            "input_us": self.input_us(),
            "insert_ns_per_polygon": self.insert_ns_per_polygon(),
            "cull_us": self.cull_us(),
            "frame_us": quantiles(|quantile| self.frame_us(quantile)),
            "visible_mean": self.visible_mean(),
            "culled_mean": self.culled_mean(),
            "fingerprint": format!("{:016x}", self.fingerprint()),
            "bytes": self.bytes,
            "allocations_steady": self.allocations_steady,
            "frames_measured": self.measured_frames(),
            "frames_fingerprinted": self.frames.len(),
            "refused": self.refused,
        });
        if let Some(occlusion) = &self.occlusion {
            extend(&mut run, self.occlusion_json(occlusion));
        }
        if let Some(draw) = &self.draw {
            extend(&mut run, draw.to_json());
        }
        if let Some(rig) = rig {
            let view = |(number, view): (usize, &super::RigViewReport)| {
                let means = self.view_means(number);
                json!({
                    "screen": view.screen,
                    "eye": view.eye,
                    "in_view_mean": means.map(|means| means.in_view),
                    "drawn_mean": means.map(|means| means.drawn),
                })
            };
            run["views"] = rig.views.iter().enumerate().map(view).collect();
            if let Some(against) = self.against_one_view() {
                run["against_one_view"] = json!(against);
            }
        }
        run
    }

    fn occlusion_json(&self, occlusion: &OcclusionReport) -> Value {
        let mut keys = json!({
            "occlusion": occlusion.method,
            "node_test": occlusion.tests.0.name(),
            "score": occlusion.tests.1.name(),
            "occluded_mean": self.occluded_mean(),
            "occlusion_used_percent": self.occlusion_used_percent(),
            "occlusion_by_last_percent": self.occlusion_by_last_percent(),
            "occlusion_us": self.occlusion_total_us(),
            "occlusion_select_us": self.occlusion_us(|o| o.select.ns),
            "occlusion_build_us": self.occlusion_us(|o| o.build.ns),
            "occlusion_query_us": self.occlusion_us(|o| o.query.ns),
            "polygon_ns": occlusion.polygon_ns,
            "frame_drawn_us": quantiles(|quantile| self.drawn_frame_us(quantile, occlusion.polygon_ns)),
            "drawn_fingerprint": format!("{:016x}", occlusion.fingerprint.value()),
        });
        if let Some(false_culls) = occlusion.false_culls {
            keys["false_culls"] = json!(false_culls);
        }
        keys
    }
}

impl DrawReport {
    fn to_json(&self) -> Value {
        let mut keys = json!({
            "draw_us": quantiles(|quantile| self.draw_us(quantile)),
            "send_us": quantiles(|quantile| self.send_us(quantile)),
            "frames_drawn": self.frames(),
        });
        if self.has_culling() {
            let culling = json!({
                "groups_tested_mean": self.culling_mean(|drawn| drawn.groups_tested),
                "first_pass_mean": self.culling_mean(|drawn| drawn.first_pass),
                "second_pass_mean": self.culling_mean(|drawn| drawn.second_pass),
                "hidden_mean": self.culling_mean(|drawn| drawn.hidden),
            });
            extend(&mut keys, culling);
            if let Some([depth, test, colors]) = self.gpu_us() {
                keys["gpu_us"] = json!({ "depth": depth, "test": test, "colors": colors });
            }
        }
        keys
    }
}
