//! Several fingers on a touch screen: one draws, as the pointer does; two turn the camera around the centre of the view and
//! come nearer or go away; three move it along the screen.

use glam::Vec2;

use super::{command::Command, gestures::Gesture, studio::Studio};

/// A second finger that comes down this soon after the first shows that the camera was meant: what the first one has done by
/// then is taken back.
const SECOND_FINGER_SECS: f64 = 0.3;

/// What the fingers on the window did since the previous frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fingers {
    /// How many there are; at least two.
    pub count: usize,
    /// How far their middle went, heights of the window, y downwards.
    pub moved: Vec2,
    /// Their distance, as a multiple of the one before.
    pub spread: f32,
}

impl Studio {
    /// Whether several fingers are on the window.
    pub fn has_fingers(&self) -> bool {
        self.gestures.has_fingers
    }

    /// Takes what several fingers did; `None` as soon as fewer than two are left.
    pub fn take_fingers(&mut self, fingers: Option<Fingers>) {
        let Some(Fingers { count, moved, spread }) = fingers else {
            self.gestures.has_fingers = false;
            return;
        };
        if self.is_reading() {
            return;
        }
        if !self.gestures.has_fingers {
            self.gestures.has_fingers = true;
            self.end_first_finger();
        }
        match count {
            2 => self.navigator.orbit(moved),
            _ => self.navigator.pan(moved),
        }
        if spread.is_finite() && spread > 0.0 {
            self.navigator.spread(spread);
        }
    }

    fn end_first_finger(&mut self) {
        let changes = |gesture| matches!(gesture, Gesture::Draw | Gesture::Erase { is_step_open: true });
        let is_meant = self.now_secs() - self.gestures.pressed_at_secs > SECOND_FINGER_SECS;
        let takes_back = !is_meant && self.gestures.gesture.is_some_and(changes);
        let strokes = self.scene().strokes().len();
        let erases = matches!(self.gestures.gesture, Some(Gesture::Erase { .. }));
        if matches!(
            self.gestures.gesture,
            Some(Gesture::Span { .. } | Gesture::Move { .. } | Gesture::Handle { .. })
        ) && !is_meant
        {
            self.gestures.gesture = None;
        }
        self.finish_gestures();
        if takes_back && (erases || strokes > self.gestures.strokes_at_press) {
            self.command(Command::Undo);
        }
    }
}
