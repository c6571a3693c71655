use std::fmt::Write;

use super::{BenchReport, Estimate, moving, rays};

/// Names of the columns; see [`BenchReport::to_csv`].
const HEAD: &str = "part,recording,index,polygons,frames,figure,unit,value,low,high";

impl BenchReport {
    /// The report as CSV, one figure a line: the part of the report (`session`, `growth`, `flight`, `paper-...`, `rays`,
    /// `rays_moved`, `moving`), the session, size or flight, the figure with its unit, its value, and the ends of the interval
    /// where it has one.
    pub fn to_csv(&self) -> String {
        let mut lines = Lines(format!("{HEAD}\n"));
        for session in &self.sessions {
            for row in &session.rows {
                let name = session.recording.replace('"', "\"\"");
                let of =
                    format!("session,\"{name}\",{},{},{}", row.index, session.polygons, row.frames_measured);
                lines.estimate(&of, "insert", "ns/polygon", &row.insert_ns_per_polygon);
                lines.high(&of, "insert", &row.insert_us);
                lines.estimate(&of, "cull", "us", &row.cull_us);
                lines.estimate(&of, "frame", "us", &row.frame_us);
                lines.value(&of, "frame_p99", "us", row.frame_high_us[0]);
                lines.value(&of, "frame_max", "us", row.frame_high_us[1]);
                lines.estimate(&of, "frame_reference", "us", &row.reference_us);
                lines.estimate(&of, "frame_ratio", "", &row.ratio);
                lines.estimate(&of, "frame_against_fastest", "", &row.against_fastest);
                lines.value(&of, "nodes", "1/frame", row.nodes);
                lines.value(&of, "boxes", "1/frame", row.boxes);
                lines.value(&of, "planes", "1/frame", row.planes);
                lines.value(&of, "memory", "bytes/polygon", row.bytes_per_polygon);
                if let Some(views) = &row.views {
                    lines.value(&of, "views", "1/frame", views.views);
                    let against = &views.against_one_view;
                    lines.value(&of, "frame_with_all_views", "us", against.all_views_us);
                    lines.value(&of, "frame_with_one_view_times_views", "us", against.views_times_one_us);
                    lines.value(&of, "frame_against_views_times_one", "", against.ratio);
                }
            }
        }
        for row in &self.growth {
            let of = format!("growth,scribble,{},{},{}", row.index, row.polygons, row.frame_us.values);
            lines.value(&of, "fill", "ns/polygon", row.fill_ns_per_polygon);
            lines.high(&of, "insert", &row.insert_us);
            lines.estimate(&of, "frame", "us", &row.frame_us);
            lines.value(&of, "frame_p99", "us", row.frame_high_us[0]);
            lines.value(&of, "frame_max", "us", row.frame_high_us[1]);
            lines.estimate(&of, "frame_reference", "us", &row.reference_us);
            lines.estimate(&of, "frame_ratio", "", &row.ratio);
            lines.estimate(&of, "still", "us", &row.still_us);
            lines.estimate(&of, "still_reference", "us", &row.still_reference_us);
            lines.estimate(&of, "still_ratio", "", &row.still_ratio);
            lines.estimate(&of, "still_all", "us", &row.still_all_us);
            lines.estimate(&of, "still_all_reference", "us", &row.still_all_reference_us);
            lines.estimate(&of, "still_all_ratio", "", &row.still_all_ratio);
            lines.value(&of, "nodes", "1/frame", row.nodes);
            lines.value(&of, "boxes", "1/frame", row.boxes);
            lines.value(&of, "memory", "bytes/polygon", row.bytes_per_polygon);
        }
        for flight in &self.flights {
            let name = flight.recording.replace('"', "\"\"");
            let of =
                format!("flight,\"{name}\",{},{},{}", flight.index, flight.polygons, flight.frames.len());
            lines.estimate(&of, "frustum", "us", &flight.frustum_us);
            lines.estimate(&of, "frustum_and_occlusion", "us", &flight.both_us);
            lines.value(&of, "in_view", "polygons", flight.in_view);
            lines.value(&of, "drawn", "polygons", flight.drawn);
            if let Some(ns) = flight.break_even_ns_per_polygon {
                lines.value(&of, "break_even", "ns/polygon", ns);
            }
        }
        self.paper.iter().for_each(|paper| paper.add_to_csv(&mut lines));
        rays::show::csv(&self.rays, &mut lines);
        moving::show::csv(&self.moving, &mut lines);
        lines.0
    }
}

pub(super) struct Lines(String);

impl Lines {
    pub(super) fn value(&mut self, of: &str, figure: &str, unit: &str, value: f64) {
        // Writing to a string does not fail.
        let _ = writeln!(self.0, "{of},{figure},{unit},{value},,");
    }

    pub(super) fn estimate(&mut self, of: &str, figure: &str, unit: &str, estimate: &Estimate) {
        let Estimate { median, low, high, .. } = estimate;
        let _ = writeln!(self.0, "{of},{figure},{unit},{median},{low},{high}");
    }

    fn high(&mut self, of: &str, figure: &str, at: &[f64; 3]) {
        for (name, value) in ["p50", "p99", "max"].into_iter().zip(at) {
            self.value(of, &format!("{figure}_{name}"), "us", *value);
        }
    }
}
