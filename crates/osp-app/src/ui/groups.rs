use egui::{Button, DragValue, RichText, Ui};
use glam::Vec3;

use super::{
    fields::{NameField, degrees, number, percent},
    panel_commands::PanelCommands,
};
use crate::{command::Command, groups::Placing, studio::Studio};
use osp_session::{recording::GroupId, scene::GroupNode};

/// Largest number of groups in the list.
const MOST_SHOWN: usize = 200;
/// Indentation per level, points.
const INDENT: f32 = 8.0;

#[derive(Debug, Default)]
pub(super) struct GroupList {
    name: NameField<GroupId>,
    /// The change of a group's transform that is being entered.
    placing: Option<(GroupId, Placing)>,
    /// The axis of the next rotation; `None` is the default axis.
    axis: Option<Vec3>,
}

impl GroupList {
    pub(super) fn show(&mut self, ui: &mut Ui, studio: &mut Studio, panel_commands: &mut PanelCommands) {
        let groups = studio.group_tree();
        let can_group = studio.can(&Command::GroupSelected);
        if ui
            .add_enabled(can_group, Button::new("Group (Ctrl+G)"))
            .on_hover_text("make a group of the selection; select it in the list below, drag it, name it")
            .clicked()
        {
            panel_commands.commands.push(Command::GroupSelected);
        }
        let selected = studio.selected_group();
        for node in groups.iter().take(MOST_SHOWN) {
            ui.horizontal(|ui| {
                ui.add_space(INDENT * node.depth.min(8) as f32);
                let row = ui.selectable_label(selected == Some(node.id), name_of(node));
                let hint = format!("{} strokes, {} polygons", node.strokes, node.polygons);
                if row.on_hover_text(hint).clicked() {
                    panel_commands.commands.push(Command::SelectGroup(node.id));
                }
            });
        }
        if groups.len() > MOST_SHOWN {
            ui.label(RichText::new(format!("… {} groups in all", groups.len())).weak());
        }
        let node = groups.iter().find(|node| Some(node.id) == selected);
        if let Some(node) = node.filter(|_| studio.can_draw()) {
            let label = ui.label("name of the group");
            let (field, name) = self.name.show(ui, node.id, node.name.as_deref().unwrap_or_default());
            field.labelled_by(label.id);
            panel_commands.commands.extend(name.map(|name| Command::NameGroup(node.id, name)));
            self.place(ui, node, panel_commands);
        }
    }

    fn place(&mut self, ui: &mut Ui, node: &GroupNode, panel_commands: &mut PanelCommands) {
        let mut placing = match self.placing.take() {
            Some((of, placing)) if of == node.id => placing,
            _ => Placing::STAY,
        };
        let (mut is_done, mut is_changing) = (false, false);
        let mut note = |response: &egui::Response| {
            is_done |= response.drag_stopped() || response.lost_focus();
            is_changing |= response.dragged() || response.has_focus();
        };
        let mut size = placing.scale * 100.0;
        let Placing { by, turn_degrees, .. } = &mut placing;
        ui.horizontal_wrapped(|ui| {
            for (way, axis) in [(&mut by.x, "x"), (&mut by.y, "y"), (&mut by.z, "z")] {
                let value = DragValue::new(way).speed(0.01).range(-1.0e4..=1.0e4).max_decimals(2);
                note(&number(ui, axis, value.suffix(" m")));
            }
        });
        ui.horizontal(|ui| {
            note(&number(ui, "turn", degrees(turn_degrees)));
            note(&number(ui, "size", percent(&mut size)));
        });
        let axis = self.axis.get_or_insert(Placing::STAY.axis);
        ui.horizontal_wrapped(|ui| {
            ui.label("turn about")
                .on_hover_text("the axis of rotation: any direction in the space of the parent group");
            for (way, name) in [(&mut axis.x, "axis x"), (&mut axis.y, "axis y"), (&mut axis.z, "axis z")] {
                number(ui, name, DragValue::new(way).speed(0.01).range(-1.0..=1.0).max_decimals(2));
            }
        });
        placing.scale = size / 100.0;
        if is_done && placing != Placing::STAY {
            panel_commands.commands.push(Command::PlaceGroup(node.id, Placing { axis: *axis, ..placing }));
        } else if is_changing {
            self.placing = Some((node.id, placing));
        }
    }
}

fn name_of(node: &GroupNode) -> String {
    match &node.name {
        Some(name) => name.clone(),
        None => format!("group {}", node.id.0),
    }
}
