use super::PaperResult;
use crate::bench::csv::Lines;

impl PaperResult {
    /// Adds a line for each figure; names with a comma are in quotes.
    pub(in crate::bench) fn add_to_csv(&self, lines: &mut Lines) {
        let name = self.recording.replace('"', "\"\"");
        for row in &self.growing {
            let part = format!("paper-growing {}", row.part);
            let of = format!("\"{part}\",\"{name}\",{},{},{}", row.tree, self.polygons, row.frames.len());
            lines.estimate(&of, "insert", "us", &row.insert_us);
            lines.estimate(&of, "cull", "us", &row.cull_us);
            if let Some(draw_us) = &row.draw_us {
                lines.estimate(&of, "draw", "us", draw_us);
            }
            lines.estimate(&of, "frame", "us", &row.frame_us);
            lines.value(&of, "frame_p99", "us", row.frame_p99_us);
            if let Some(planes) = row.planes_per_polygon {
                lines.value(&of, "planes", "1/polygon", planes);
            }
            lines.value(&of, "drawn", "polygons", row.drawn);
            lines.value(&of, "in_view", "polygons", row.in_view);
        }
        for row in &self.flight {
            let of =
                format!("paper-flight,\"{name}\",\"{}\",{},{}", row.way, self.polygons, row.frames.len());
            lines.estimate(&of, "cull", "us", &row.cull_us);
            if let Some(draw_us) = &row.draw_us {
                lines.estimate(&of, "draw", "us", draw_us);
            }
            lines.estimate(&of, "frame", "us", &row.frame_us);
            lines.value(&of, "drawn", "polygons", row.drawn);
            if let Some(wrong) = row.wrong {
                lines.value(&of, "visible_culled", "polygons", wrong as f64);
            }
            lines.value(&of, "slower_than_frustum", "%", row.slower_percent);
        }
        for row in &self.cubes {
            let tree = format!("osp-paper cube {} depth {}", row.cube, row.depth);
            let of = format!("paper-cube,\"{name}\",{tree},{},{}", self.polygons, row.cull_us.values);
            lines.value(&of, "planes", "1/polygon", row.planes_per_polygon);
            lines.value(&of, "outside", "polygons", row.outside as f64);
            lines.value(&of, "boxes", "1/frame", row.tests);
            lines.estimate(&of, "cull", "us", &row.cull_us);
            lines.value(&of, "drawn", "polygons", row.drawn);
            lines.value(&of, "in_view", "polygons", row.in_view);
            lines.value(&of, "memory", "bytes", row.bytes as f64);
        }
    }
}
