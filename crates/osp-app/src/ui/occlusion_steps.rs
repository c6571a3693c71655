use egui::{Align2, Color32, ComboBox, FontId, Rect, RichText, Slider, Ui, Vec2};

use super::{
    numbers::count,
    wishes::{ALARM, Wishes},
};
use crate::{
    command::Command,
    occlusion_steps::{OcclusionSteps, StepsEdit},
    studio::Studio,
};
use osp_lab::shadows::ShadowForm;

/// Shows the buttons to go from step to step, what the step does, and the occluders.
pub(super) fn show(ui: &mut Ui, steps: &OcclusionSteps, wishes: &mut Wishes) {
    let mut wish = |edit| wishes.commands.push(Command::Steps(edit));
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
        ComboBox::from_label("form").selected_text(steps.form().name()).show_ui(ui, |ui| {
            for form in ShadowForm::ALL {
                if ui.selectable_label(steps.form() == form, form.name()).clicked() {
                    wish(StepsEdit::Form(form));
                }
            }
        });
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
        None if steps.is_stale() => "waits until the view and the model rest".to_owned(),
        None => "the camera has no view".to_owned(),
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
                ui.colored_label(ALARM, format!("the eye sees {} of them", count(visible)));
            }
        }
        let hint = match steps.is_stale() {
            true => "of an earlier view or model, until both rest",
            false => "freeze the culling camera (C) to look at the planes from aside",
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

/// Writes the occluders' names on the model's part of the window.
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
