use glam::{Vec2, Vec3};

use super::{
    fingers::Resting,
    handles::{Handle, Ring},
    tool::Span,
};
use osp_session::recording::Motion;

/// A button of the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// Left, or the tip of a pen.
    Primary,
    /// Right.
    Secondary,
    /// The wheel.
    Middle,
}

/// Keys held while the pointer moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// Shift.
    pub shift: bool,
    /// Alt: turns the left button into the right one, for pens without buttons.
    pub alt: bool,
}

/// An event of the pointer on the window. Positions go from -1 to 1, left to right and from the lower to the upper border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// New position.
    Move(Vec2),
    /// It has left the window.
    Leave,
    /// A button went down.
    Press(Button),
    /// A button came up.
    Release(Button),
    /// Pressure of a pen, 0 to 1.
    Pressure(f32),
    /// The wheel was turned by this many steps, away from the hand.
    Wheel(f32),
}

/// The action of the pointer while a button is down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Gesture {
    Draw,
    /// Whether a step is open for the erased strokes.
    Erase {
        is_step_open: bool,
    },
    /// Orbits around this point.
    Orbit(Vec3),
    Look,
    Pan,
    /// Selected strokes are dragged: the point on them where the drag began, and the motion so far.
    Move {
        from: Vec3,
        by: Vec3,
    },
    /// A handle of the selection is dragged: the point where the drag began, and the motion of the selection so far.
    Handle {
        handle: Handle,
        ring: Ring,
        from: Vec3,
        motion: Motion,
    },
    /// Two points of the model: at the press, and under the pointer.
    Span {
        span: Span,
        from: Vec3,
        to: Vec3,
    },
    /// A button is down on empty space and the pointer has not moved.
    Click,
}

/// The state of the pointer and of held keys.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gestures {
    pub(super) pointer: Option<Vec2>,
    pub(super) pressed_at: Vec2,
    /// A finger has come down; if it moves the pointer, too, a press of the pointer follows.
    pub(super) finger_came: bool,
    /// The button that is down is a finger.
    pub(super) is_touch: bool,
    /// A finger that may be the first of several.
    pub(super) resting: Option<Resting>,
    /// Several fingers are on the window.
    pub(super) has_fingers: bool,
    pub(super) gesture: Option<Gesture>,
    pub(super) pressure: Option<f32>,
    /// Flying: right, up, back, -1 to 1 each.
    pub(super) flight: Vec3,
}

impl Gestures {
    /// Position of the pointer, if it is over the window.
    pub(super) fn pointer(&self) -> Option<Vec2> {
        self.pointer
    }

    /// Whether something is being dragged.
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

    /// The movement of the selected strokes so far.
    pub(super) fn motion(&self) -> Motion {
        match self.gesture {
            Some(Gesture::Move { by, .. }) => Motion::by(by),
            Some(Gesture::Handle { motion, .. }) => motion,
            _ => Motion::STAY,
        }
    }
}
