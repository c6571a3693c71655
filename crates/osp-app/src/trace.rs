use std::{
    io::{self, Write},
    path::Path,
};

use serde_json::json;

use super::{
    question::Question,
    session::Replay,
    stats::{FrameStage, FrameTimes},
    studio::Studio,
    tool::ToolChoice,
};
use osp_session::{atomic_file::open_stream, platform::fs::File};

/// Writes one line of JSON for each frame, for measurements, and for tests that control the window from outside.
#[derive(Debug)]
pub(super) struct Trace {
    out: File,
    frame: u64,
}

impl Trace {
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        Ok(Self { out: open_stream(path)?, frame: 0 })
    }

    pub(super) fn write(
        &mut self,
        studio: &Studio,
        times: &FrameTimes,
        is_shown: bool,
        window: (u32, u32),
    ) -> io::Result<()> {
        let report = studio.report();
        let counts = studio.scene().counts();
        let session = studio.session();
        let (events, position) = (session.event_count(), session.replay().map_or(0, Replay::position));
        let trouble = session.journal().trouble().map(ToString::to_string);
        let tool = match studio.tool() {
            ToolChoice::Draw(tool) => format!("{tool:?}").to_lowercase(),
            ToolChoice::Look => "look".to_owned(),
            ToolChoice::Erase => "erase".to_owned(),
            ToolChoice::Select => "select".to_owned(),
            ToolChoice::Span(span) => format!("{span:?}").to_lowercase(),
        };
        let while_drawing = studio.while_drawing().map(|(counts, times)| {
            json!({
                "groups_tested": counts.groups_tested,
                "in_view": counts.in_view,
                "first_pass": counts.first_pass,
                "second_pass": counts.second_pass,
                "hidden": counts.hidden(),
                "gpu_ms": times.map(|times| {
                    let passes = [times.depth_ns, times.test_ns, times.color_ns];
                    passes.map(|ns| ns as f64 * 1.0e-6)
                }),
            })
        });
        let ms = |stage| times.get(stage) as f64 * 1.0e-6;
        let stages: serde_json::Map<String, serde_json::Value> =
            FrameStage::ALL.iter().map(|&stage| (stage.name().to_owned(), json!(ms(stage)))).collect();
        let line = json!({
            "frame": self.frame,
            "shown": is_shown,
            "window": [window.0, window.1],
            "events": events,
            "position": position,
            "samples": report.samples,
            "strokes": counts.strokes,
            "polygons": report.record.polygons,
            "inserted": report.record.inserted,
            "removed": report.record.removed,
            "visible": report.record.visible,
            "occluded": report.record.occlusion.occluded,
            "drawn": report.drawn,
            "views": studio.views().len(),
            "index": studio.culling().plan.kind.name(),
            "occlusion": studio.culling().plan.occlusion.name(),
            "polygon_ns": studio.culling().polygon_ns(),
            "drawings_measured": studio.culling().drawings_measured(),
            "while_drawing": while_drawing,
            "reading": studio.is_reading(),
            "frozen": studio.is_frozen(),
            "tool": tool,
            "selected": studio.selection().strokes().len(),
            "measured_m": studio.measured().map(|(from, to)| from.distance(to)),
            "message": studio.messages().last(),
            "question": studio.question().map(Question::title),
            "trouble": trouble,
            "ms": stages,
        });
        self.frame += 1;
        // Each line is written in one write, so that a program that follows the file reads complete lines.
        self.out.write_all(format!("{line}\n").as_bytes())
    }
}
