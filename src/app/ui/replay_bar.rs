use egui::{RichText, Slider, Ui};

use super::wishes::Wishes;
use crate::app::{command::Command, player::Player};

/// Play, pause, step, and the position in the session.
pub(super) fn show(ui: &mut Ui, player: &Player, follows_camera: bool, wishes: &mut Wishes) {
    ui.horizontal(|ui| {
        let is_playing = player.is_playing();
        if ui.button(if is_playing { "Pause" } else { "Play" }).on_hover_text("Space").clicked() {
            wishes.commands.push(Command::Play(!is_playing));
        }
        if ui.button("<").on_hover_text("previous frame (,)").clicked() {
            wishes.commands.push(Command::Step(-1));
        }
        if ui.button(">").on_hover_text("next frame (.)").clicked() {
            wishes.commands.push(Command::Step(1));
        }
        let mut speed = player.speed();
        let slider = Slider::new(&mut speed, 0.1..=50.0).logarithmic(true).suffix(" x").max_decimals(1);
        ui.spacing_mut().slider_width = 70.0;
        if ui.add(slider).on_hover_text("number of recorded frames for each frame shown").changed() {
            wishes.commands.push(Command::Speed(speed));
        }
        let mut follows = follows_camera;
        if ui.checkbox(&mut follows, "recorded camera").changed() {
            wishes.follow_camera = Some(follows);
        }
        let mut position = player.position();
        let count = player.frame_count();
        let label = ui.label("frame");
        ui.spacing_mut().slider_width = (ui.available_width() - 130.0).max(60.0);
        if ui.add(Slider::new(&mut position, 0..=count).show_value(false)).labelled_by(label.id).changed() {
            wishes.commands.push(Command::Seek(position));
        }
        ui.label(RichText::new(format!("{position} of {count}")).weak());
    });
}
