use egui::{CollapsingHeader, Color32, Sense, Ui, Vec2};

use super::{fields::switch, panel_commands::PanelCommands};
use crate::{command::Command, layers::LayerChoice, studio::Studio};
use osp_session::recording::Author;

/// Largest number of authors in the list.
const MOST_SHOWN: usize = 100;
/// Largest number of bytes of a name that are shown.
const MOST_BYTES: usize = 40;

/// The authors of a shared session, with their colours; nothing for a session without authors.
pub(super) fn show(ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
    let scene = studio.scene();
    let count = scene.authors().count();
    if count == 0 {
        return;
    }
    CollapsingHeader::new(format!("Authors ({count})")).id_salt("authors").default_open(true).show(
        ui,
        |ui| {
            let layers = studio.layers();
            let hint = "show every stroke in the colour of its author";
            let shown = switch(ui, layers.authors, "colour by author", hint);
            let show = |authors| Command::Layers(LayerChoice { authors, ..layers });
            panel_commands.commands.extend(shown.map(show));
            for (author, info) in scene.authors().take(MOST_SHOWN) {
                ui.horizontal(|ui| {
                    swatch(ui, color_of(studio, author));
                    let name = if info.name.is_empty() { "(no name)" } else { shortened(&info.name) };
                    let row = match info.left_secs {
                        None => ui.label(name),
                        Some(_) => ui.weak(name),
                    };
                    row.on_hover_text(match info.left_secs {
                        None => format!("joined at {:.0} s", info.joined_secs),
                        Some(left) => format!("joined at {:.0} s, left at {left:.0} s", info.joined_secs),
                    });
                });
            }
            if count > MOST_SHOWN {
                ui.weak(format!("… {count} authors in all"));
            }
        },
    );
    ui.separator();
}

pub(super) fn shortened(name: &str) -> &str {
    &name[..name.floor_char_boundary(MOST_BYTES)]
}

pub(super) fn color_of(studio: &Studio, author: Author) -> Color32 {
    let (r, g, b) = studio.scene().author_color(author);
    let [r, g, b] = [r, g, b].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
    Color32::from_rgb(r, g, b)
}

fn swatch(ui: &mut Ui, color: Color32) {
    let (area, _) = ui.allocate_exact_size(Vec2::splat(12.0), Sense::hover());
    ui.painter().rect_filled(area, 2.0, color);
}
