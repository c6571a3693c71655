use gilrs::{Axis, Button as Key, GamepadId, Gilrs};
use glam::{Vec2, Vec3};

use super::{
    command::Command,
    gestures::{Button, Held, Input},
    studio::Studio,
    tool::ToolChoice,
};
use osp_session::recording::Tool;

/// Largest deflection of a stick that counts as rest.
const REST: f32 = 0.15;
/// Smallest deflection of a trigger that counts as pressed.
const PRESSED: f32 = 0.05;

/// Input from a gamepad. Sticks fly and look. The right trigger draws in the middle of the view; its deflection is the
/// pressure.
pub(super) struct Gamepad {
    gilrs: Gilrs,
    is_drawing: bool,
}

impl Gamepad {
    /// The system's gamepads; `None` if the system cannot read them.
    pub(super) fn open() -> Option<Self> {
        Some(Self { gilrs: Gilrs::new().ok()?, is_drawing: false })
    }

    /// Applies the gamepad's input to the studio.
    pub(super) fn steer(&mut self, studio: &mut Studio, size_px: Vec2, frame_secs: f32) {
        while let Some(event) = self.gilrs.next_event() {
            if let gilrs::EventType::ButtonPressed(key, _) = event.event {
                press(studio, key);
            }
        }
        let Some(id) = self.first() else { return };
        let pad = self.gilrs.gamepad(id);
        let axis = |axis| {
            let value = pad.value(axis);
            if value.abs() < REST { 0.0 } else { value }
        };
        let move_by = Vec3::new(axis(Axis::LeftStickX), 0.0, -axis(Axis::LeftStickY));
        if move_by != Vec3::ZERO {
            studio.set_flight(move_by);
        }
        let look = Vec2::new(axis(Axis::RightStickX), -axis(Axis::RightStickY)) * frame_secs.min(0.1);
        if look != Vec2::ZERO {
            studio.look(look);
        }
        let pull = pad.button_data(Key::RightTrigger2).map_or(0.0, |trigger| trigger.value());
        let mut forward = |input| studio.input(input, Held::default(), size_px);
        if pull > PRESSED {
            forward(Input::Pressure(pull));
            forward(Input::Move(Vec2::ZERO));
            if !std::mem::replace(&mut self.is_drawing, true) {
                forward(Input::Press(Button::Primary));
            }
        } else if std::mem::take(&mut self.is_drawing) {
            forward(Input::Release(Button::Primary));
        }
    }

    fn first(&self) -> Option<GamepadId> {
        self.gilrs.gamepads().next().map(|(id, _)| id)
    }
}

fn press(studio: &mut Studio, key: Key) {
    let command = match key {
        Key::South => Command::Tool(ToolChoice::Draw(Tool::Ribbon)),
        Key::East => Command::Tool(ToolChoice::Erase),
        Key::West => Command::Tool(ToolChoice::Draw(Tool::Tube)),
        Key::North => Command::Tool(ToolChoice::Select),
        Key::LeftTrigger => Command::Undo,
        Key::RightTrigger => Command::Redo,
        Key::DPadUp => Command::Widen(1.0),
        Key::DPadDown => Command::Widen(-1.0),
        Key::Start => Command::ShowAll,
        _ => return,
    };
    studio.command(command);
}
