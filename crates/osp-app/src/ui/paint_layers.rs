use egui::{
    Button, CollapsingHeader, Painter, Pos2, Rect, RichText, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui,
    Vec2, WidgetInfo,
};

use super::{
    authors,
    fields::{NameField, switch},
    panel_commands::PanelCommands,
};
use crate::{
    command::Command,
    paint_layers::{LayerEdit, LayerRow, name_or_number},
    studio::Studio,
};

/// Largest height of the list before it scrolls, points.
const LIST_HEIGHT: f32 = 132.0;

/// The list of layers, and the name that is being typed.
#[derive(Debug, Default)]
pub(super) struct LayerList(NameField<u32>);

impl LayerList {
    pub(super) fn show(&mut self, ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
        let rows = studio.session_layers();
        let chosen = studio.chosen_layer();
        let shown = CollapsingHeader::new(format!("Layers ({})", rows.len())).id_salt("layers");
        shown.default_open(rows.len() > 1).show(ui, |ui| {
            ScrollArea::vertical().id_salt("layer list").max_height(LIST_HEIGHT).show(ui, |ui| {
                // The last layer is at the top, as in other programs.
                for row in rows.iter().rev() {
                    ui.horizontal(|ui| self::row(ui, studio, row, row.layer == chosen, panel_commands));
                }
            });
            ui.add_enabled_ui(studio.can_draw(), |ui| {
                if let Some(row) = rows.iter().find(|row| row.layer == chosen) {
                    ui.add_enabled_ui(!studio.is_layer_of_others(chosen), |ui| {
                        let (field, name) = self.0.show(ui, row.layer, &row.name);
                        field.widget_info(|| WidgetInfo::labeled(Role::TextInput, true, "name of the layer"));
                        let renamed = name.map(|name| Command::Layer(LayerEdit::Name(row.layer, name)));
                        panel_commands.commands.extend(renamed);
                    });
                    close(ui, studio, row, panel_commands);
                }
                ui.horizontal(|ui| {
                    let buttons = [
                        ("New layer", LayerEdit::New, "draw on a new layer (Ctrl+Shift+N)"),
                        (
                            "Move selection here",
                            LayerEdit::TakeSelection,
                            "move the selection to the current layer (Ctrl+L)",
                        ),
                    ];
                    for (name, edit, hint) in buttons {
                        let command = Command::Layer(edit);
                        let button = ui.add_enabled(studio.can(&command), Button::new(name));
                        if button.on_hover_text(hint).clicked() {
                            panel_commands.commands.push(command);
                        }
                    }
                });
            });
        });
    }
}

fn close(ui: &mut Ui, studio: &Studio, row: &LayerRow, panel_commands: &mut PanelCommands) {
    if studio.can_close_layer(row.layer) {
        let hint = "nobody else may draw on this layer or change it while you are here";
        let closed = switch(ui, row.is_closed, "only I may edit", hint);
        let close = |is_closed| Command::Layer(LayerEdit::Close(row.layer, is_closed));
        panel_commands.commands.extend(closed.map(close));
    }
}

/// Owner of a layer, as text.
fn owner_of(row: &LayerRow) -> Option<String> {
    let (author, name) = row.owner.as_ref()?;
    let name = name_or_number(*author, authors::shortened(name));
    Some(if row.is_closed { format!("editable only by {name}") } else { name })
}

fn row(ui: &mut Ui, studio: &Studio, row: &LayerRow, is_chosen: bool, panel_commands: &mut PanelCommands) {
    ui.spacing_mut().item_spacing.x = 3.0;
    let name = &row.name;
    let switches = [
        (eye as Sign, row.is_hidden, ["hide", "show"], LayerEdit::Hide(row.layer, !row.is_hidden)),
        (padlock as Sign, !row.is_locked, ["unlock", "lock"], LayerEdit::Lock(row.layer, !row.is_locked)),
    ];
    for (sign, is_off, what, edit) in switches {
        let what = format!("{} {name}", what[usize::from(is_off)]);
        let sense = if studio.can(&Command::Layer(edit.clone())) { Sense::click() } else { Sense::hover() };
        let (rect, response) = ui.allocate_exact_size(Vec2::new(20.0, 18.0), sense);
        let color = match () {
            () if response.hovered() => ui.visuals().strong_text_color(),
            () if is_off => ui.visuals().weak_text_color().gamma_multiply(0.6),
            () => ui.visuals().text_color(),
        };
        sign(ui.painter(), rect.center(), is_off, Stroke::new(1.2, color));
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &what));
        if response.on_hover_text(&what).clicked() {
            panel_commands.commands.push(Command::Layer(edit));
        }
    }
    let owner = owner_of(row);
    let shown = owner.as_ref().map_or_else(|| name.clone(), |owner| format!("{name} ({owner})"));
    let hint =
        owner.map_or_else(|| "draw on this layer".to_owned(), |_| format!("draw on this layer: {shown}"));
    let text = if row.is_hidden { RichText::new(shown).weak() } else { RichText::new(shown) };
    let label = Button::selectable(is_chosen, text).truncate();
    if ui.add_enabled(studio.can_draw(), label).on_hover_text(hint).clicked() {
        panel_commands.commands.push(Command::Layer(LayerEdit::Choose(row.layer)));
    }
}

/// Draws a symbol around a point. The flag states whether the symbol is switched off.
type Sign = fn(&Painter, Pos2, bool, Stroke);

fn eye(painter: &Painter, at: Pos2, is_off: bool, stroke: Stroke) {
    let lid = |height: f32| {
        let points = (0..=8).map(|i| {
            let x = i as f32 / 4.0 - 1.0;
            at + Vec2::new(x * 7.0, height * (1.0 - x * x))
        });
        points.collect::<Vec<Pos2>>()
    };
    painter.line(lid(-4.5), stroke);
    painter.line(lid(4.5), stroke);
    painter.circle_filled(at, 2.0, stroke.color);
    if is_off {
        painter.line_segment([at + Vec2::new(-6.0, 5.0), at + Vec2::new(6.0, -5.0)], stroke);
    }
}

fn padlock(painter: &Painter, at: Pos2, is_off: bool, stroke: Stroke) {
    let body = Rect::from_min_max(at + Vec2::new(-4.5, -0.5), at + Vec2::new(4.5, 6.0));
    let aside = if is_off { 5.0 } else { 0.0 };
    let bow = (0..=8).map(|i| {
        let angle = std::f32::consts::PI * (1.0 + i as f32 / 8.0);
        at + Vec2::new(aside + 3.0 * angle.cos(), -3.0 + 3.5 * angle.sin())
    });
    let mut bow: Vec<Pos2> = bow.collect();
    bow.insert(0, at + Vec2::new(aside - 3.0, -0.5));
    if !is_off {
        bow.push(at + Vec2::new(3.0, -0.5));
    }
    painter.line(bow, stroke);
    if is_off {
        painter.rect_stroke(body, 1.0, stroke, StrokeKind::Middle);
    } else {
        painter.rect_filled(body, 1.0, stroke.color);
    }
}
