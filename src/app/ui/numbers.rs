use egui::{CollapsingHeader, ComboBox, Grid, RichText, Slider, Ui};

use super::{
    plot::{frame_plot, stage_color},
    wishes::Wishes,
};
use crate::{
    app::{
        command::Command,
        stats::{FrameStage, History},
        studio::Studio,
    },
    occlusion::Occlusion,
    occlusion::Soundness,
    render::{DrawnCounts, PassTimes},
    rivals::IndexKind,
};

fn ms(ns: u64) -> String {
    format!("{:.2} ms", ns as f64 * 1.0e-6)
}

/// A count with its thousands separated.
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

/// Times, counts and switches.
pub(super) fn show(ui: &mut Ui, studio: &Studio, history: &History, adapter: &str, wishes: &mut Wishes) {
    ui.add_space(4.0);
    ui.heading("Culling");
    switches(ui, studio, wishes);
    ui.separator();
    times(ui, history);
    ui.separator();
    counts(ui, studio);
    ui.separator();
    layers(ui, studio, wishes);
    CollapsingHeader::new("Picking").show(ui, |ui| picking(ui, studio));
    ui.label(RichText::new(adapter).weak().small());
}

fn times(ui: &mut Ui, history: &History) {
    let median_ns = history.percentile_ns(0.5);
    let rate = if median_ns == 0 { 0.0 } else { 1.0e9 / median_ns as f64 };
    ui.horizontal(|ui| {
        ui.label(RichText::new(ms(history.last().total_ns())).strong());
        ui.label(RichText::new(format!("a frame; {rate:.0} frames/s possible")).weak());
    });
    frame_plot(ui, history, 84.0);
    // Columns of fixed width: a grid that follows its numbers asks for another frame each time they change.
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
    let last = history.last();
    Grid::new("stages").num_columns(3).min_col_width(78.0).spacing([4.0, 0.0]).show(ui, |ui| {
        for stage in FrameStage::ALL {
            ui.horizontal(|ui| {
                let (area, _) = ui.allocate_exact_size(egui::Vec2::splat(9.0), egui::Sense::hover());
                ui.painter().rect_filled(area, 2.0, stage_color(stage));
                ui.label(stage.name());
            });
            ui.label(ms(last.get(stage)));
            ui.label(RichText::new(format!("{:.1} %", history.share(stage) * 100.0)).weak());
            ui.end_row();
        }
    });
}

fn table(ui: &mut Ui, id: &str, rows: &[(&str, String)]) {
    // Two columns fit into the panel, also where a header indents them: a wider table would shift the whole panel.
    Grid::new(id).num_columns(2).min_col_width(110.0).spacing([4.0, 1.0]).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(*name);
            ui.label(value);
            ui.end_row();
        }
    });
}

fn counts(ui: &mut Ui, studio: &Studio) {
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
    let is_auto = studio.culling().occlusion() == Occlusion::Auto;
    let polygon_ns = studio.culling().polygon_ns().filter(|_| is_auto);
    let on_gpu = |of: fn(&DrawnCounts) -> u64| while_drawing.map(|(counts, _)| count(of(&counts)));
    let times = while_drawing.and_then(|(_, times)| times);
    let pass = |of: fn(&PassTimes) -> u64| times.as_ref().map(|times| ms(of(times)));
    // Always as many rows, so that nothing moves when another method is chosen.
    let rows = [
        ("cost of a polygon (auto)", polygon_ns.map(|ns| format!("{ns:.0} ns"))),
        ("tested on the GPU", on_gpu(|counts| counts.groups_tested)),
        ("drawn in depth pass", on_gpu(|counts| counts.first_pass)),
        ("GPU: depth pass", pass(|times| times.depth_ns)),
        ("GPU: Hi-Z test", pass(|times| times.test_ns)),
        ("GPU: colour pass", pass(|times| times.color_ns)),
    ];
    table(ui, "of some methods", &rows.map(|(name, value)| (name, value.unwrap_or("–".to_owned()))));
}

fn switches(ui: &mut Ui, studio: &Studio, wishes: &mut Wishes) {
    let culling = studio.culling();
    ComboBox::from_label("index (I)").selected_text(culling.kind().name()).show_ui(ui, |ui| {
        for &kind in IndexKind::ALL {
            if ui.selectable_label(culling.kind() == kind, kind.name()).clicked() {
                wishes.commands.push(Command::Index(kind));
            }
        }
    });
    let line = culling.reindexed().map_or("–".to_owned(), |done| {
        let took_ms = done.took.as_secs_f64() * 1.0e3;
        format!("{} polygons inserted in {took_ms:.2} ms", count(done.polygons))
    });
    ui.label(RichText::new(line).weak().small());
    let now = culling.occlusion();
    ComboBox::from_label("occlusion (O)").selected_text(now.name()).show_ui(ui, |ui| {
        let sets = culling.has_pvs().then_some(Occlusion::Pvs);
        for choice in sound_occlusion().into_iter().chain(sets) {
            if ui.selectable_label(now == choice, choice.name()).clicked() {
                wishes.commands.push(Command::Occlusion(choice));
            }
        }
    });
    let most = culling.most_occluders();
    let mut wanted = most.unwrap_or(1);
    let slider = Slider::new(&mut wanted, 1..=256).logarithmic(true).text("max. occluders");
    if ui.add_enabled(most.is_some(), slider).changed() {
        wishes.commands.push(Command::Occluders(Some(wanted)));
    }
    let mut stages = culling.stages();
    ui.checkbox(&mut stages.frustum, "frustum culling");
    if stages != culling.stages() {
        wishes.commands.push(Command::Stages(stages));
    }
    let mut is_frozen = studio.is_frozen();
    let freeze = ui.checkbox(&mut is_frozen, "freeze the culling camera (C)");
    freeze.on_hover_text("then move the camera away to see what is culled");
    if is_frozen != studio.is_frozen() {
        wishes.commands.push(Command::Freeze(is_frozen));
    }
}

/// The conservative methods of occlusion culling; the others can be chosen in `osp replay` and `osp verify` only.
pub(super) fn sound_occlusion() -> Vec<Occlusion> {
    Occlusion::all().filter(|choice| choice.soundness() == Soundness::Conservative).collect()
}

fn layers(ui: &mut Ui, studio: &Studio, wishes: &mut Wishes) {
    let mut layers = studio.layers();
    ui.checkbox(&mut layers.grid, "floor");
    ui.checkbox(&mut layers.culled, "show culled polygons (while frozen)");
    ui.checkbox(&mut layers.nodes, "bounding boxes of the index");
    if layers.nodes {
        ui.add(Slider::new(&mut layers.node_depth, 0..=16).text("deepest level"));
    }
    ui.checkbox(&mut layers.shadows, "occluders and shadow volumes");
    ui.checkbox(&mut layers.straddlers, "polygons on the root's split planes");
    ui.checkbox(&mut layers.cut, "polygons that the view's sides cut");
    if let Some((inside, cut)) = studio.inside_and_cut() {
        ui.weak(format!("{} inside, {} cut", count(inside), count(cut)));
    }
    ui.checkbox(&mut layers.pyramid, "depth pyramid (F3)");
    if layers.pyramid {
        ui.add(Slider::new(&mut layers.pyramid_level, 1..=13).text("level"));
        if studio.culling().occlusion() != Occlusion::Hzb {
            ui.weak("there is one with hzb alone: choose it under occlusion");
        }
    }
    if layers != studio.layers() {
        wishes.commands.push(Command::Layers(layers));
    }
}

fn picking(ui: &mut Ui, studio: &Studio) {
    let picks = studio.culling().picks();
    let last = picks.last.map_or("nothing".to_owned(), |id| format!("polygon {}", count(u64::from(id.0))));
    table(
        ui,
        "picks",
        &[
            ("last pick", last),
            ("its time", format!("{:.1} µs", picks.last_ns as f64 * 1.0e-3)),
            ("rays", count(picks.rays)),
            ("polygons tested", count(picks.tests)),
            ("time of all picks", ms(picks.total_ns)),
        ],
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_counts_are_grouped() {
        let plain = |n| count(n).replace('\u{202f}', " ");
        assert_eq!(
            [plain(0), plain(999), plain(1000), plain(12_345_678)],
            ["0", "999", "1 000", "12 345 678"]
        );
    }
}
