use egui::{Event, MouseWheelUnit, PointerButton, Rect, Response, Ui};
use glam::{Vec2, Vec3};

use crate::app::{
    fingers::Fingers,
    gestures::{Button, Held, Input},
    studio::Studio,
};

/// Points of a smooth wheel for a step of a notched one.
const POINTS_A_STEP: f32 = 50.0;

/// Passes the pointer's events over the model to the studio, in their order. All of them become part of
/// the current frame.
pub(super) fn take_pointer(ui: &Ui, response: &Response, pixels_per_point: f32, studio: &mut Studio) {
    let area = response.rect;
    let size_px = Vec2::new(area.width(), area.height()) * pixels_per_point;
    let events = ui.input(|input| input.events.clone());
    let modifiers = ui.input(|input| input.modifiers);
    let held = Held { shift: modifiers.shift, alt: modifiers.alt };
    let is_over = response.contains_pointer();
    let fingers = ui.input(|input| input.multi_touch()).filter(|_| is_over || studio.has_fingers());
    studio.take_fingers(fingers.map(|touch| Fingers {
        count: touch.num_touches,
        moved: Vec2::new(touch.translation_delta.x, touch.translation_delta.y) / area.height().max(1.0),
        spread: touch.zoom_delta,
    }));
    if fingers.is_some() {
        return;
    }
    let mut forward = |input| studio.input(input, held, size_px);
    for event in events {
        match event {
            Event::PointerMoved(at) => forward(Input::Move(place(area, at))),
            Event::PointerButton { pos, button, pressed, .. } => {
                let Some(button) = button_of(button) else { continue };
                forward(Input::Move(place(area, pos)));
                if !pressed {
                    forward(Input::Release(button));
                } else if is_over {
                    forward(Input::Press(button));
                }
            }
            Event::PointerGone => forward(Input::Leave),
            Event::Touch { force: Some(force), .. } => forward(Input::Pressure(force)),
            Event::MouseWheel { unit, delta, .. } if is_over => {
                // Shift turns a wheel's turn sideways on some systems.
                let turn = if delta.y == 0.0 { delta.x } else { delta.y };
                let steps = if unit == MouseWheelUnit::Point { turn / POINTS_A_STEP } else { turn };
                forward(Input::Wheel(steps));
            }
            Event::WindowFocused(false) => {
                studio.finish_gestures();
                studio.set_flight(Vec3::ZERO);
                return;
            }
            _ => {}
        }
    }
    if !is_over && !studio.is_dragging() {
        studio.input(Input::Leave, held, size_px);
    }
}

fn place(area: Rect, at: egui::Pos2) -> Vec2 {
    let part = (at - area.min) / area.size().max(egui::Vec2::splat(1.0));
    Vec2::new(part.x * 2.0 - 1.0, 1.0 - part.y * 2.0)
}

fn button_of(button: PointerButton) -> Option<Button> {
    match button {
        PointerButton::Primary => Some(Button::Primary),
        PointerButton::Secondary => Some(Button::Secondary),
        PointerButton::Middle => Some(Button::Middle),
        PointerButton::Extra1 | PointerButton::Extra2 => None,
    }
}
