use egui::{Button, Ui};

use super::{
    fields::{degrees, number, percent},
    panel_commands::PanelCommands,
};
use crate::{
    altering::Altering,
    command::Command,
    studio::Studio,
    tool::{Span, ToolChoice},
};

#[derive(Debug, Default)]
pub(super) struct SelectionPanel {
    turn_degrees: f32,
    percent: Option<f32>,
    /// A change of the brush's colour or width while the pointer is pressed. The selection gets the change at the
    /// release.
    waiting: Option<Altering>,
}

impl SelectionPanel {
    pub(super) fn show(&mut self, ui: &mut Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
        self.follow_brush(ui, studio, panel_commands);
        if !studio.can(&Command::Duplicate) {
            (self.turn_degrees, self.percent) = (0.0, None);
            return;
        }
        let count = studio.selection().strokes().len();
        ui.label(format!("{count} selected"));
        ui.horizontal(|ui| {
            for (name, command) in
                [("Duplicate", Command::Duplicate), ("Mirror", Command::Alter(Altering::Mirror))]
            {
                if ui.add(Button::new(name)).clicked() {
                    panel_commands.commands.push(command);
                }
            }
        });
        // A whole group has its own number fields.
        if studio.selected_group().is_none() {
            self.numbers(ui, panel_commands);
        }
        ui.separator();
    }

    fn numbers(&mut self, ui: &mut Ui, panel_commands: &mut PanelCommands) {
        let mut part = self.percent.unwrap_or(100.0);
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 3.0;
            let turn = number(ui, "turn", degrees(&mut self.turn_degrees));
            if (turn.drag_stopped() || turn.lost_focus()) && self.turn_degrees != 0.0 {
                panel_commands.commands.push(Command::Alter(Altering::Turn(self.turn_degrees)));
                self.turn_degrees = 0.0;
            }
            let size = number(ui, "size", percent(&mut part));
            self.percent = Some(part);
            if (size.drag_stopped() || size.lost_focus()) && part != 100.0 {
                panel_commands.commands.push(Command::Alter(Altering::Scale(part / 100.0)));
                self.percent = None;
            }
        });
    }

    /// While strokes are selected, a new colour or width of the brush also changes the strokes, as one step at the
    /// pointer's release.
    fn follow_brush(&mut self, ui: &Ui, studio: &Studio, panel_commands: &mut PanelCommands) {
        let is_selecting =
            matches!(studio.tool(), ToolChoice::Select | ToolChoice::Span(Span::Box | Span::Sphere));
        if !is_selecting || studio.selection().is_empty() {
            self.waiting = None;
            return;
        }
        let chosen = panel_commands.commands.iter().rev().find_map(|command| match command {
            Command::Color(_) => Some(Altering::Color),
            Command::Width(_) => Some(Altering::Width),
            _ => None,
        });
        self.waiting = chosen.or(self.waiting);
        if !ui.input(|input| input.pointer.any_down())
            && let Some(altering) = self.waiting.take()
        {
            panel_commands.commands.push(Command::Alter(altering));
        }
    }
}
