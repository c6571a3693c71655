use glam::{Vec2, Vec3};

use super::{
    fingers::Resting,
    handles::{Handle, Ring},
    tool::Span,
};
use osp_session::recording::Motion;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// Left button, or the tip of a pen.
    Primary,
    /// Right button.
    Secondary,
    /// The wheel, pressed.
    Middle,
}

/// Modifier keys that are held down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    pub shift: bool,
    /// Alt, which turns the left button into the right one, for pens without buttons.
    pub alt: bool,
    /// Space, which turns the left button into the wheel's button.
    pub space: bool,
}

/// An input event of the pointer on the window. Positions range from -1 to 1, from left to right and from the lower to
/// the upper border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// The pointer moved to a position.
    Move(Vec2),
    /// The pointer left the window.
    Leave,
    /// A button went down.
    Press(Button),
    /// A button came up.
    Release(Button),
    /// Pressure of a pen, 0 to 1.
    Pressure(f32),
    /// The wheel was turned by this number of steps, positive away from the hand.
    Wheel(f32),
}

/// The action of the pointer while a button is pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Gesture {
    Draw,
    /// Erases strokes; stores whether an undo step is open.
    Erase {
        is_step_open: bool,
    },
    /// Orbits around this point.
    Orbit(Vec3),
    Look,
    Pan,
    /// Drags the selected strokes: the point of a stroke where the drag began, and the translation so far.
    Move {
        from: Vec3,
        by: Vec3,
    },
    /// Drags a handle of the selection: the point where the drag began, and the motion of the selection so far.
    Handle {
        handle: Handle,
        ring: Ring,
        from: Vec3,
        motion: Motion,
    },
    /// Chooses two points of the model: the point at the press, and the point under the pointer.
    Span {
        span: Span,
        from: Vec3,
        to: Vec3,
    },
    /// A button is pressed on empty space and the pointer has not moved.
    Click,
}

/// The state of the pointer and of modifier keys.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gestures {
    /// Position of the pointer, if it is over the window.
    pub(super) pointer: Option<Vec2>,
    pub(super) pressed_at: Vec2,
    /// Whether a finger has touched the screen. The window system then also reports a press of the pointer.
    pub(super) finger_came: bool,
    /// Whether a finger causes the gesture, not a mouse or a pen.
    pub(super) is_touch: bool,
    pub(super) frame_secs: f64,
    /// A finger that may become the first of several fingers.
    pub(super) resting: Option<Resting>,
    pub(super) has_fingers: bool,
    pub(super) gesture: Option<Gesture>,
    pub(super) pressure: Option<f32>,
    /// Flight direction: right, up, back, each -1 to 1.
    pub(super) flight: Vec3,
}

impl Gestures {
    pub(super) fn is_dragging(&self) -> bool {
        self.gesture.is_some()
    }

    /// The two points that are being chosen.
    pub(super) fn span(&self) -> Option<(Span, Vec3, Vec3)> {
        match self.gesture {
            Some(Gesture::Span { span, from, to }) => Some((span, from, to)),
            _ => None,
        }
    }

    pub(super) fn motion(&self) -> Motion {
        match self.gesture {
            Some(Gesture::Move { by, .. }) => Motion::by(by),
            Some(Gesture::Handle { motion, .. }) => motion,
            _ => Motion::STAY,
        }
    }
}
