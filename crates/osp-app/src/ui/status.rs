//! The bottom line of the window: the latest message for a while, then a hint for the tool.

use std::time::Duration;

use egui::{Label, RichText, Ui};

use crate::{
    studio::Studio,
    tool::{Span, ToolChoice},
};

/// Time for which a message is shown, and more for each letter, seconds.
const SHOWN_S: f32 = 15.0;
const SHOWN_A_LETTER_S: f32 = 0.05;

pub(super) fn show(ui: &mut Ui, studio: &Studio) {
    let earlier = studio.messages().join("\n");
    let latest = studio.messages().last().zip(studio.message_age());
    let shown = latest.and_then(|(message, age)| {
        let time = Duration::from_secs_f32(SHOWN_S + SHOWN_A_LETTER_S * message.len() as f32);
        Some((message, time.checked_sub(age)?))
    });
    ui.horizontal(|ui| {
        let line = match shown {
            Some((message, rest)) => {
                ui.ctx().request_repaint_after(rest);
                ui.add(Label::new(message).truncate())
            }
            None => ui.add(Label::new(RichText::new(hint(studio)).weak()).truncate()),
        };
        if !earlier.is_empty() {
            line.on_hover_text(earlier);
        }
    });
}

fn hint(studio: &Studio) -> String {
    if studio.session().is_replay() {
        return "Space: play    left button: orbit    wheel button: move    wheel: nearer    F: whole model    F1: all keys"
            .to_owned();
    }
    let use_of_tool = match studio.tool() {
        ToolChoice::Look => {
            return "left button: orbit    wheel button: move    wheel: nearer    F: whole model    H: artist's view    1: draw    F1: all keys"
                .to_owned();
        }
        ToolChoice::Draw(_) => "draw",
        ToolChoice::Erase => "erase",
        ToolChoice::Select => "select and move",
        ToolChoice::Span(Span::Distance) => "measure a distance",
        ToolChoice::Span(Span::Box) => "select in a box",
        ToolChoice::Span(Span::Sphere) => "select in a sphere",
    };
    format!(
        "left button: {use_of_tool}    right button: orbit    wheel button: move    wheel: nearer    Ctrl+Z: undo    F1: all keys"
    )
}
