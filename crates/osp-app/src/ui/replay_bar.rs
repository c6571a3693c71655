use egui::{Rect, Response, RichText, Slider, Stroke, Ui};

use super::{fields::switch, panel_commands::PanelCommands};
use crate::{command::Command, session::Replay};

pub(super) fn show(ui: &mut Ui, replay: &Replay, follows_camera: bool, panel_commands: &mut PanelCommands) {
    ui.horizontal_wrapped(|ui| {
        let is_playing = replay.is_playing();
        if ui.button(if is_playing { "Pause" } else { "Play" }).on_hover_text("Space").clicked() {
            panel_commands.commands.push(Command::Play(!is_playing));
        }
        if ui.button("<").on_hover_text("previous frame (,)").clicked() {
            panel_commands.commands.push(Command::Step(-1));
        }
        if ui.button(">").on_hover_text("next frame (.)").clicked() {
            panel_commands.commands.push(Command::Step(1));
        }
        let finished = ui.button("Finished").on_hover_text("the finished model, as its artist last saw it");
        if finished.clicked() {
            panel_commands.commands.push(Command::ShowFinished);
        }
        let minute = replay.minute_speed();
        for (name, speed, hint) in [
            ("1 x", 1.0, "as fast as it was drawn, with the pauses spread evenly"),
            ("1 min", minute, "all of it in a minute; a shorter session as fast as it was drawn"),
        ] {
            if ui
                .selectable_label((replay.speed() / speed - 1.0).abs() < 0.02, name)
                .on_hover_text(hint)
                .clicked()
            {
                panel_commands.commands.push(Command::Speed(speed));
            }
        }
        let mut speed = replay.speed();
        let most = minute.max(100.0);
        let slider = Slider::new(&mut speed, 0.1..=most).logarithmic(true).suffix(" x").max_decimals(1);
        ui.spacing_mut().slider_width = 70.0;
        // A slider with its number does not begin a new row by itself.
        if ui.available_size_before_wrap().x < 150.0 {
            ui.end_row();
        }
        if ui.add(slider).on_hover_text("speed, as a multiple of the recorded speed").changed() {
            panel_commands.commands.push(Command::Speed(speed));
        }
        if replay.is_camera_useful {
            panel_commands.follow_camera = switch(ui, follows_camera, "recorded camera", "");
        }
    });
    ui.horizontal(|ui| {
        let mut position = replay.position();
        let count = replay.frame_count();
        // Frames play evenly. The label is the same share of the recorded time as the slider shows.
        let whole_secs = replay.secs_at(count);
        let secs = whole_secs * (position as f64 / count.max(1) as f64);
        let label = ui.label(format!("{} of {}", minutes(secs), minutes(whole_secs)));
        let frames = RichText::new(format!("frame {position} of {count}")).weak();
        let is_wide = ui.available_width() > 300.0;
        ui.spacing_mut().slider_width = (ui.available_width() - if is_wide { 150.0 } else { 10.0 }).max(60.0);
        let slider = ui.add(Slider::new(&mut position, 0..=count).show_value(false)).labelled_by(label.id);
        marks(ui, &slider, replay);
        if slider.on_hover_text("position in the session; a mark for each stroke").changed() {
            panel_commands.commands.push(Command::Seek(position));
        }
        if is_wide {
            ui.label(frames);
        }
    });
}

/// Draws marks below the slider at the beginnings of strokes; marks at the same point are merged.
fn marks(ui: &Ui, slider: &Response, replay: &Replay) {
    let Rect { min, max } = slider.rect;
    // The centre of the slider's handle stays one radius away from the ends.
    let radius = slider.rect.height() / 2.5;
    let (left, right) = (min.x + radius, max.x - radius);
    let count = replay.frame_count().max(1) as f32;
    let stroke = Stroke::new(1.0, ui.visuals().weak_text_color());
    let at = |frame: u64| left + (right - left) * (frame as f32 / count);
    let mut starts = &replay.stroke_starts[..];
    while let Some(&frame) = starts.first() {
        let x = at(frame);
        ui.painter().vline(x, max.y - 3.0..=max.y, stroke);
        // A session may have a million strokes; the bar has room for a few hundred marks.
        starts = &starts[starts.partition_point(|&frame| at(frame) - x < 2.0)..];
    }
}

/// A time as minutes and seconds, with hours if needed.
fn minutes(secs: f64) -> String {
    let whole = secs as u64;
    let (hours, minutes, secs) = (whole / 3600, whole / 60 % 60, whole % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{secs:02}") } else { format!("{minutes}:{secs:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_minutes_and_seconds() {
        assert_eq!([0.0, 59.9, 61.0, 3600.0, 1.0e300].map(minutes)[..4], ["0:00", "0:59", "1:01", "1:00:00"]);
    }
}
