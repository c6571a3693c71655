use egui::{Color32, Mesh, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2};

use crate::stats::{FrameStage, History};

pub(super) fn stage_color(stage: FrameStage) -> Color32 {
    match stage {
        FrameStage::Strokes => Color32::from_rgb(240, 200, 90),
        FrameStage::Insert => Color32::from_rgb(240, 110, 80),
        FrameStage::Cull => Color32::from_rgb(110, 200, 120),
        FrameStage::Occlusion => Color32::from_rgb(200, 120, 230),
        FrameStage::Send => Color32::from_rgb(90, 190, 220),
        FrameStage::Panel => Color32::from_rgb(130, 135, 150),
        FrameStage::Draw => Color32::from_rgb(85, 115, 205),
    }
}

/// A plot of the last frame times: one column per frame with stacked stages, and lines at 60 and 90 frames a second.
pub(super) fn frame_plot(ui: &mut Ui, history: &History, height: f32) {
    let (area, response) = ui.allocate_exact_size(Vec2::new(ui.available_width(), height), Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::GraphicsObject, true, "frame times"));
    let painter = ui.painter_at(area);
    painter.rect_filled(area, 3.0, ui.visuals().extreme_bg_color);
    // The scale adapts to slow frames but not to a single outlier.
    let top_ns = (history.percentile_ns(0.98) as f32 * 1.25).max(4.0e6);
    let y_of = |ns: f32| area.bottom() - (ns / top_ns).min(1.0) * area.height();
    let column = area.width() / History::LENGTH as f32;
    let first = History::LENGTH - history.frames().len();
    let mut mesh = Mesh::default();
    for (number, times) in history.frames().enumerate() {
        let left = area.left() + (first + number) as f32 * column;
        let mut below_ns = 0.0;
        for stage in FrameStage::ALL {
            let ns = times.get(stage) as f32;
            if ns > 0.0 {
                let upper = Pos2::new(left, y_of(below_ns + ns));
                let lower = Pos2::new(left + column, y_of(below_ns));
                mesh.add_colored_rect(Rect::from_min_max(upper, lower), stage_color(stage));
                below_ns += ns;
            }
        }
    }
    painter.add(Shape::mesh(mesh));
    let mut label_above = f32::MIN;
    for (rate, ns) in [(60, 1.0e9 / 60.0), (90, 1.0e9 / 90.0)] {
        if ns < top_ns {
            let y = y_of(ns);
            // Lines that are close together share the label of the first line.
            let has_room = y - label_above > 11.0;
            painter.hline(area.x_range(), y, Stroke::new(1.0, Color32::from_white_alpha(60)));
            if !has_room {
                continue;
            }
            label_above = y;
            let at = Pos2::new(area.left() + 3.0, y - 1.0);
            let font = egui::FontId::proportional(10.0);
            painter.text(
                at,
                egui::Align2::LEFT_BOTTOM,
                format!("{rate}/s"),
                font,
                Color32::from_white_alpha(120),
            );
        }
    }
}
