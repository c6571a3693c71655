use egui::{Align2, Color32, ComboBox, FontId, Rect, RichText, Sense, Slider, Stroke, Ui, Vec2};

use super::{
    fields::choice,
    numbers::count,
    panel_commands::{ALARM, PanelCommands},
};
use crate::{
    command::Command,
    occlusion_steps::{OcclusionSteps, StepsEdit},
    studio::Studio,
};
use osp_lab::{
    TreeLayout,
    shadows::{ShadowForm, ShadowHolds, ShadowStructure},
};

/// Size of the picture of the tree, points.
const TREE: (u32, u32) = (360, 84);

/// Shows buttons for the steps, the description of the step, the occluders and the tree.
pub(super) fn show(ui: &mut Ui, steps: &OcclusionSteps, is_frozen: bool, panel_commands: &mut PanelCommands) {
    ui.horizontal(|ui| {
        ui.vertical(|ui| rows(ui, steps, is_frozen, panel_commands));
        if let Some(tree) = steps.tree() {
            draw_tree(ui, tree);
        }
    });
}

/// Draws the tree. Circles are planes; the latest plane is bright. Filled squares are cells in a shadow; empty squares
/// are lit cells.
fn draw_tree(ui: &mut Ui, tree: &ShadowStructure) {
    let (response, painter) = ui.allocate_painter(Vec2::new(TREE.0 as f32, TREE.1 as f32), Sense::hover());
    response.widget_info(|| {
        let text = format!("tree of {} planes, {} levels", tree.planes, tree.levels());
        egui::WidgetInfo::labeled(egui::Role::GraphicsObject, true, text)
    });
    let nodes = &tree.nodes;
    let layout =
        TreeLayout::new(nodes.iter().map(|node| (node.parent.map(|of| of.0), node.depth)), TREE, 4.0);
    let place = |node: usize| {
        let (x, y) = layout.pixel(node);
        response.rect.min + Vec2::new(x as f32, y as f32)
    };
    let line = Stroke::new(1.0, ui.visuals().weak_text_color());
    for (i, node) in nodes.iter().enumerate() {
        if let Some((above, _)) = node.parent {
            painter.line_segment([place(above), place(i)], line);
        }
    }
    let radius = (layout.step_x() * 0.4).clamp(1.5, 4.5);
    for (i, node) in nodes.iter().enumerate() {
        let square = Rect::from_center_size(place(i), Vec2::splat(radius * 1.6));
        match &node.holds {
            ShadowHolds::Plane { number, .. } if number + 1 == tree.planes => {
                painter.circle_filled(place(i), radius + 1.0, Color32::from_rgb(120, 235, 255));
            }
            ShadowHolds::Plane { .. } => {
                painter.circle_filled(place(i), radius, Color32::from_rgb(230, 159, 0));
            }
            ShadowHolds::Leaf { occluders } if occluders.is_empty() => {
                painter.rect_filled(square, 0.0, ui.visuals().panel_fill);
                painter.rect_stroke(square, 0.0, line, egui::StrokeKind::Inside);
            }
            ShadowHolds::Leaf { .. } => {
                painter.rect_filled(square, 0.0, Color32::from_rgb(80, 140, 255));
            }
        }
    }
}

fn rows(ui: &mut Ui, steps: &OcclusionSteps, is_frozen: bool, panel_commands: &mut PanelCommands) {
    let mut wish = |edit| panel_commands.commands.push(Command::Steps(edit));
    ui.horizontal(|ui| {
        ui.strong("Occlusion, step by step");
        let (planes, all) = (steps.planes(), steps.planes_in_all());
        let back = ui.add_enabled(planes > 0, egui::Button::new("Back"));
        if back.on_hover_text("previous step (P)").clicked() {
            wish(StepsEdit::By(-1));
        }
        let next = ui.add_enabled(planes < all, egui::Button::new("Next"));
        if next.on_hover_text("next step (N)").clicked() {
            wish(StepsEdit::By(1));
        }
        let mut wanted = planes;
        if ui.add_enabled(all > 0, Slider::new(&mut wanted, 0..=all).text("planes")).changed() {
            wish(StepsEdit::To(wanted));
        }
        let list = ComboBox::from_label("form");
        let chosen = choice(ui, list, steps.form(), ShadowForm::ALL, |form| form.name().to_owned());
        chosen.map(StepsEdit::Form).into_iter().for_each(&mut wish);
        let mut most = steps.most_occluders();
        let slider = Slider::new(&mut most, 1..=OcclusionSteps::MOST_OCCLUDERS).logarithmic(true);
        if ui.add(slider.text("occluders")).changed() {
            wish(StepsEdit::Occluders(most));
        }
        if ui.button("Close").clicked() {
            wish(StepsEdit::Show(false));
        }
    });
    ui.label(match steps.line() {
        Some(line) => line,
        None if steps.is_stale() => "waits until the view and the model stop changing".to_owned(),
        None => "the view has no valid frustum".to_owned(),
    });
    ui.horizontal(|ui| {
        if let Some(counts) = steps.counts() {
            ui.label(format!(
                "hides {} of {} polygons in view, {} of them by this plane",
                count(counts.hidden),
                count(counts.in_view),
                count(counts.newly_hidden)
            ));
            if let Some(visible) = counts.visible.filter(|visible| *visible > 0) {
                ui.colored_label(ALARM, format!("{} visible polygons are wrongly culled", count(visible)));
            }
        }
        let hint = match (steps.is_stale(), is_frozen) {
            (true, _) => "out of date: updates when view and model stand still",
            (false, true) => "the culling camera is frozen (C): orbit to look at the planes from the side",
            (false, false) => "freeze the culling camera (C) to look at the planes from the side",
        };
        ui.weak(hint);
    });
    ui.horizontal(|ui| {
        ui.weak("occluders, with their shares of the window:");
        let occluders = steps.occluders();
        if occluders.is_empty() {
            ui.weak("none");
        }
        for occluder in occluders {
            let text = RichText::new(occluder.text);
            ui.label(if occluder.is_taken { text.strong() } else { text.weak() });
        }
    });
}

pub(super) fn show_names(ui: &Ui, area: Rect, studio: &Studio) {
    if area.width() < 1.0 || area.height() < 1.0 {
        return;
    }
    let painter = ui.painter_at(area);
    for label in studio.occluder_labels(area.width() / area.height()) {
        let at = area.min + area.size() * Vec2::new(label.at.x, 1.0 - label.at.y);
        let color =
            if label.is_taken { Color32::from_rgb(255, 190, 60) } else { Color32::from_rgb(150, 120, 60) };
        let text = painter.layout_no_wrap(label.text, FontId::proportional(13.0), color);
        let place = Align2::CENTER_CENTER.anchor_size(at, text.size());
        painter.rect_filled(place.expand(3.0), 3.0, Color32::from_black_alpha(150));
        painter.galley(place.min, text, color);
    }
}
