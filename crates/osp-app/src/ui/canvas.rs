use egui::{Event, MouseWheelUnit, PointerButton, Rect, Response, TouchPhase, Ui};
use glam::{Vec2, Vec3};

use crate::{
    fingers::Fingers,
    gestures::{Button, Held, Input},
    studio::Studio,
};

/// Distance of smooth scrolling, points, that equals one step of a wheel.
const POINTS_A_STEP: f32 = 50.0;

/// The pointer's events over the model during a layout, in order.
#[derive(Debug)]
pub(super) struct PointerInput {
    events: Vec<Event>,
    area: Rect,
    size_px: Vec2,
    held: Held,
    is_over: bool,
    fingers: Option<Fingers>,
    time_secs: f64,
}

impl PointerInput {
    /// Copies the pointer's input of this frame. `response` belongs to the model's part of the window.
    pub(super) fn read(ui: &Ui, response: &Response) -> Self {
        let area = response.rect;
        let size_px = Vec2::new(area.width(), area.height()) * ui.ctx().pixels_per_point();
        let is_over = response.contains_pointer();
        ui.input(|input| Self {
            events: input.events.clone(),
            area,
            size_px,
            held: Held {
                shift: input.modifiers.shift,
                alt: input.modifiers.alt,
                space: input.key_down(egui::Key::Space),
            },
            is_over,
            time_secs: input.time,
            fingers: input.multi_touch().map(|touch| Fingers {
                count: touch.num_touches,
                moved: Vec2::new(touch.translation_delta.x, touch.translation_delta.y)
                    / area.height().max(1.0),
                spread: touch.zoom_delta,
            }),
        })
    }

    pub(super) fn give(self, studio: &mut Studio) {
        let Self { events, area, size_px, held, is_over, fingers, time_secs } = self;
        studio.take_fingers(fingers.filter(|_| is_over || studio.has_fingers()));
        let has_fingers = studio.has_fingers();
        studio.set_frame_time(time_secs);
        for event in events {
            match event {
                Event::PointerMoved(at) if !has_fingers => {
                    studio.press_touch(Some(place(area, at)), false, held, size_px);
                    studio.input(Input::Move(place(area, at)), held, size_px);
                }
                Event::PointerButton { pos, button, pressed, .. } => {
                    let Some(button) = button_of(button) else { continue };
                    let at = place(area, pos);
                    if pressed && studio.touch((is_over && !has_fingers).then_some(at)) {
                        continue;
                    }
                    if !pressed && !has_fingers {
                        studio.press_touch(Some(at), true, held, size_px);
                    }
                    studio.input(Input::Move(at), held, size_px);
                    if !pressed {
                        studio.input(Input::Release(button), held, size_px);
                    } else if is_over {
                        studio.input(Input::Press(button), held, size_px);
                    }
                }
                Event::PointerGone => studio.input(Input::Leave, held, size_px),
                Event::Touch { phase, force, .. } => {
                    studio.note_finger(phase == TouchPhase::Start);
                    if phase == TouchPhase::Cancel {
                        studio.cancel_touch();
                    }
                    if let Some(force) = force {
                        studio.input(Input::Pressure(force), held, size_px);
                    }
                }
                Event::MouseWheel { unit, delta, .. } if is_over => {
                    // Shift makes a wheel scroll sideways on some systems.
                    let turn = if delta.y == 0.0 { delta.x } else { delta.y };
                    let steps = if unit == MouseWheelUnit::Point { turn / POINTS_A_STEP } else { turn };
                    studio.input(Input::Wheel(steps), held, size_px);
                }
                Event::WindowFocused(false) => {
                    studio.finish_gestures();
                    studio.set_flight(Vec3::ZERO);
                    return;
                }
                _ => {}
            }
        }
        if !has_fingers {
            studio.press_touch(None, false, held, size_px);
        }
        if !is_over && !studio.is_dragging() {
            studio.input(Input::Leave, held, size_px);
        }
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
