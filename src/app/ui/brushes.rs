use egui::{ComboBox, Ui};

use super::wishes::Wishes;
use crate::{
    app::{command::Command, studio::Studio},
    brush::{self, Brush, Draw, Family},
};

/// A heading of the list, and which brushes are under it.
type Kind = (&'static str, fn(&Brush) -> bool);

const KINDS: [Kind; 4] = [
    ("Paint", |brush| is_ribbon(brush) && !is_light(brush)),
    ("Solids", |brush| !is_ribbon(brush) && !is_light(brush) && !is_spray(brush)),
    ("Light", |brush| is_light(brush) && !is_spray(brush)),
    ("Particles and sprays", |brush| is_spray(brush)),
];

fn is_light(brush: &Brush) -> bool {
    brush.draw == Draw::Additive
}

fn is_ribbon(brush: &Brush) -> bool {
    matches!(brush.family, Family::QuadStrip(_) | Family::Welded { .. } | Family::ThickRibbon)
}

fn is_spray(brush: &Brush) -> bool {
    matches!(brush.family, Family::Particles | Family::Spray { .. })
}

/// The choice of what ribbons are painted with.
pub(super) fn show(ui: &mut Ui, studio: &Studio, wishes: &mut Wishes) {
    let chosen = studio.brush().paint();
    let name = chosen.map_or("plain", |brush| brush.name.as_str());
    let label = ui.label("brush");
    let choice = ComboBox::from_id_salt("brush").selected_text(name).width(140.0).height(420.0);
    let shown = choice.show_ui(ui, |ui| {
        if ui.selectable_label(chosen.is_none(), "plain").clicked() {
            wishes.commands.push(Command::Paint(None));
        }
        for (heading, is_of) in KINDS {
            ui.separator();
            ui.weak(heading);
            for brush in brush::all().iter().filter(|brush| brush.is_offered && is_of(brush)) {
                let is_chosen = chosen.is_some_and(|chosen| std::ptr::eq(chosen, brush));
                if ui.selectable_label(is_chosen, &brush.name).clicked() {
                    wishes.commands.push(Command::Paint(Some(brush)));
                }
            }
        }
    });
    shown.response.labelled_by(label.id);
}
