use egui::{ComboBox, Grid, RichText, Slider, Ui};

use super::{
    fields::{choice, switch},
    panel_commands::PanelCommands,
    plot::{frame_plot, stage_color},
};
use crate::{
    command::Command,
    stats::{FrameStage, History},
    studio::Studio,
};
use osp::occlusion::{Occlusion, Soundness};
use osp_lab::Method;
use osp_render::{DrawnCounts, PassTimes};
use osp_rivals::IndexKind;

/// Times of the last frames for the panel, and the resolution of their clock.
#[derive(Debug)]
pub(super) struct Measured<'a> {
    pub(super) history: &'a History,
    pub(super) passes: Option<PassTimes>,
    /// Resolution of the clock, nanoseconds; 0 if the clock stands still.
    pub(super) clock_step_ns: u64,
    pub(super) adapter: &'a str,
}

fn ms(ns: u64) -> String {
    format!("{:.2} ms", ns as f64 * 1.0e-6)
}

/// A time in a suitable unit, with two significant digits.
fn short(ns: u64) -> String {
    match ns {
        0..1_000 => format!("{ns} ns"),
        // A value that rounds up to the next unit is shown in that unit.
        1_000..9_950 => format!("{:.1} µs", ns as f64 * 1.0e-3),
        9_950..999_500 => format!("{:.0} µs", ns as f64 * 1.0e-3),
        999_500..9_950_000 => format!("{:.1} ms", ns as f64 * 1.0e-6),
        _ => format!("{:.0} ms", ns as f64 * 1.0e-6),
    }
}

/// A single measured time. Below the clock's resolution only the resolution is shown.
fn once(ns: u64, clock_step_ns: u64, text: impl Fn(u64) -> String) -> String {
    if ns < clock_step_ns { format!("less than {}", short(clock_step_ns)) } else { text(ns) }
}

/// A line with the clock's resolution and its effect on the times above.
fn clock_line(clock_step_ns: u64, frames: usize) -> String {
    let of = frames.min(History::MEAN_OF);
    match clock_step_ns {
        0 => "the clock stands still: no times can be measured".to_owned(),
        step_ns => format!("times: means of {of} frames; resolution of the clock: {}", short(step_ns)),
    }
}

/// A count with thousands separators.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

pub(super) fn show(
    ui: &mut Ui,
    studio: &Studio,
    measured: &Measured<'_>,
    panel_commands: &mut PanelCommands,
) {
    ui.add_space(4.0);
    ui.heading("Culling");
    index(ui, studio, measured.clock_step_ns, panel_commands);
    switches(ui, studio, panel_commands);
    ui.separator();
    times(ui, measured);
    ui.separator();
    counts(ui, studio, measured.passes);
    ui.separator();
    layers(ui, studio, panel_commands);
    ui.label(RichText::new(measured.adapter).weak().small());
}

fn times(ui: &mut Ui, measured: &Measured<'_>) {
    let history = measured.history;
    let mean = history.mean();
    let median_ns = history.percentile_ns(0.5);
    let rate = if median_ns == 0 { 0.0 } else { 1.0e9 / median_ns as f64 };
    ui.horizontal(|ui| {
        ui.label(RichText::new(ms(mean.total_ns())).strong());
        ui.label(RichText::new(format!("a frame; {rate:.0} frames/s possible")).weak());
    });
    frame_plot(ui, history, 84.0);
    // Columns have a fixed width, because a grid that resizes with its numbers would request a frame for each change.
    Grid::new("percentiles").num_columns(4).min_col_width(58.0).spacing([4.0, 0.0]).show(ui, |ui| {
        let parts = [
            ("50 %", median_ns),
            ("95 %", history.percentile_ns(0.95)),
            ("99 %", history.percentile_ns(0.99)),
            ("max", history.slowest_ns()),
        ];
        for (name, _) in parts {
            ui.label(RichText::new(name).weak().small());
        }
        ui.end_row();
        for (_, ns) in parts {
            ui.label(format!("{:.2}", ns as f64 * 1.0e-6));
        }
    });
    Grid::new("stages").num_columns(3).min_col_width(78.0).spacing([4.0, 0.0]).show(ui, |ui| {
        for stage in FrameStage::ALL {
            ui.horizontal(|ui| {
                let (area, _) = ui.allocate_exact_size(egui::Vec2::splat(9.0), egui::Sense::hover());
                ui.painter().rect_filled(area, 2.0, stage_color(stage));
                ui.label(stage.name());
            });
            ui.label(ms(mean.get(stage)));
            ui.label(RichText::new(format!("{:.1} %", history.share(stage) * 100.0)).weak());
            ui.end_row();
        }
    });
    let line = clock_line(measured.clock_step_ns, history.frames().len());
    ui.label(RichText::new(line).weak().small());
}

fn table(ui: &mut Ui, id: &str, rows: &[(&str, String)]) {
    // Two columns fit into the panel, even indented under a header; a wider table would shift the whole panel.
    Grid::new(id).num_columns(2).min_col_width(110.0).spacing([4.0, 1.0]).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(*name);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn counts(ui: &mut Ui, studio: &Studio, passes: Option<PassTimes>) {
    let report = studio.report();
    let scene = studio.scene().counts();
    let while_drawing = studio.while_drawing();
    let hidden = while_drawing.map_or(report.record.occlusion.occluded, |(counts, _)| counts.hidden());
    let drawn = while_drawing.map_or(report.drawn, |(counts, _)| counts.second_pass);
    table(
        ui,
        "counts",
        &[
            ("strokes", count(scene.strokes - scene.erased_strokes)),
            ("polygons", count(report.record.polygons)),
            ("in view", count(report.record.visible)),
            ("hidden by others", count(hidden)),
            ("occluders", count(report.record.occlusion.occluders)),
            ("split planes", count(report.record.occlusion.nodes)),
            ("drawn", count(drawn)),
            ("new, erased, moved", {
                let record = report.record;
                format!("{} {} {}", count(record.inserted), count(record.removed), count(record.updated))
            }),
            ("boxes tested", count(report.record.work.boxes)),
            ("tree nodes visited", count(report.record.work.nodes)),
            ("index memory", format!("{:.1} MB", studio.culling().pipeline().bytes() as f64 / 1.0e6)),
        ],
    );
    let is_auto = studio.culling().plan.occlusion == Occlusion::Auto.into();
    let polygon_ns = studio.culling().polygon_ns().filter(|_| is_auto);
    let on_gpu = |of: fn(&DrawnCounts) -> u64| while_drawing.map(|(counts, _)| count(of(&counts)));
    let pass = |of: fn(&PassTimes) -> u64| passes.as_ref().map(|times| ms(of(times)));
    // The rows are always the same, so that the layout does not change with the method.
    let rows = [
        ("draw time per polygon (auto)", polygon_ns.map(|ns| format!("{ns:.0} ns"))),
        ("tested on the GPU", on_gpu(|counts| counts.groups_tested)),
        ("drawn in depth pass", on_gpu(|counts| counts.first_pass)),
        ("GPU: depth pass", pass(|times| times.depth_ns)),
        ("GPU: Hi-Z test", pass(|times| times.test_ns)),
        ("GPU: colour pass", pass(|times| times.color_ns)),
    ];
    table(ui, "only some methods", &rows.map(|(name, value)| (name, value.unwrap_or("–".to_owned()))));
}

fn index(ui: &mut Ui, studio: &Studio, clock_step_ns: u64, panel_commands: &mut PanelCommands) {
    let culling = studio.culling();
    let (list, kinds) = (ComboBox::from_label("index (I)"), IndexKind::ALL.iter().copied());
    let chosen = choice(ui, list, culling.plan.kind, kinds, |kind| kind.name().to_owned());
    panel_commands.commands.extend(chosen.map(Command::Index));
    let line = culling.reindexed().map_or("–".to_owned(), |done| {
        let took_ns = u64::try_from(done.took.as_nanos()).unwrap_or(u64::MAX);
        format!("{} polygons inserted in {}", count(done.polygons), once(took_ns, clock_step_ns, ms))
    });
    ui.label(RichText::new(line).weak().small());
}

fn switches(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let culling = studio.culling();
    let list = ComboBox::from_label("occlusion (O)");
    let chosen =
        choice(ui, list, culling.plan.occlusion, sound_occlusion(), |method| method.name().to_owned());
    panel_commands.commands.extend(chosen.map(Command::Occlusion));
    let most = culling.most_occluders();
    let mut wanted = most.unwrap_or(1);
    let slider = Slider::new(&mut wanted, 1..=256).logarithmic(true).text("max. occluders");
    if ui.add_enabled(most.is_some(), slider).changed() {
        panel_commands.commands.push(Command::Occluders(Some(wanted)));
    }
    let culls = switch(ui, culling.culls_by_frustum, "frustum culling", "");
    panel_commands.commands.extend(culls.map(Command::FrustumCulling));
    let hint = "then move the camera away to see what is culled";
    let freezes = switch(ui, studio.is_frozen(), "freeze the culling camera (C)", hint);
    panel_commands.commands.extend(freezes.map(Command::Freeze));
}

/// The conservative occlusion culling methods. Other methods are available only in `osp replay` and `osp verify`.
pub(super) fn sound_occlusion() -> Vec<Method> {
    Method::all().filter(|choice| choice.soundness() == Soundness::Conservative).collect()
}

fn layers(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let mut layers = studio.layers();
    ui.checkbox(&mut layers.grid, "floor");
    ui.checkbox(&mut layers.culled, "show culled polygons (while frozen)");
    ui.checkbox(&mut layers.nodes, "bounding boxes of the index");
    if layers.nodes {
        ui.add(Slider::new(&mut layers.node_depth, 0..=16).text("deepest level"));
    }
    ui.checkbox(&mut layers.shadows, "occluders and shadow volumes");
    ui.checkbox(&mut layers.cut, "polygons that the frustum cuts");
    if let Some((inside, cut)) = studio.inside_and_cut() {
        ui.weak(format!("{} inside, {} cut", count(inside), count(cut)));
    }
    ui.checkbox(&mut layers.pyramid, "depth pyramid (F3)");
    if layers.pyramid {
        ui.add(Slider::new(&mut layers.pyramid_level, 1..=13).text("level"));
        if studio.culling().plan.occlusion != Method::Hzb {
            ui.weak("only hzb has a pyramid: choose hzb under occlusion");
        }
    }
    if layers != studio.layers() {
        panel_commands.commands.push(Command::Layers(layers));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_below_a_step_of_the_clock_have_no_number_and_large_counts_are_grouped() {
        assert_eq!([41, 4_999, 99_999, 999_999].map(short), ["41 ns", "5.0 µs", "100 µs", "1.0 ms"]);
        assert_eq!([0, 100_000].map(|ns| once(ns, 100_000, ms)), ["less than 100 µs", "0.10 ms"]);
        assert_eq!([999, 12_345_678].map(count), ["999", "12\u{202f}345\u{202f}678"]);
    }
}
