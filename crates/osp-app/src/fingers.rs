//! Fingers on a touch screen. One finger acts as the pointer. Two fingers orbit the camera around the centre of the
//! view and change its distance. Three fingers pan the camera.

use glam::Vec2;

use crate::{
    gestures::{Button, Held, Input},
    studio::Studio,
};

/// Motion of the fingers on the window since the previous frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fingers {
    /// Number of fingers, at least two.
    pub count: usize,
    /// Motion of the fingers' centroid, in heights of the window, y downwards.
    pub moved: Vec2,
    /// Distance between the fingers, divided by their distance in the previous frame.
    pub spread: f32,
}

/// A finger that has touched the screen and has had no effect yet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Resting {
    pub(super) at: Vec2,
    pub(super) since_secs: f64,
}

/// Time after which a resting finger uses the tool, because no second finger followed, seconds.
const ALONE_SECS: f64 = 0.3;
/// Distance after which a moving finger uses the tool, in heights of the window.
const ALONE_BY: f32 = 0.012;

impl Studio {
    /// Whether several fingers are on the window.
    pub fn has_fingers(&self) -> bool {
        self.input.gestures.has_fingers
    }

    /// Moves the camera with several fingers; `None` as soon as fewer than two are left. While a mouse or a pen draws,
    /// fingers are ignored, because they belong to the hand that draws.
    pub fn take_fingers(&mut self, fingers: Option<Fingers>) {
        let is_other = self.is_dragging() && !self.input.gestures.is_touch;
        let Some(Fingers { count, moved, spread }) = fingers.filter(|_| !is_other && !self.is_reading())
        else {
            self.input.gestures.has_fingers = false;
            return;
        };
        if !self.input.gestures.has_fingers {
            self.input.gestures.has_fingers = true;
            self.input.gestures.resting = None;
            // The stroke of the first finger stays.
            self.finish_gestures();
        }
        self.leave_replay_camera();
        match count {
            2 => self.navigator.orbit(moved),
            _ => self.navigator.pan(moved),
        }
        if spread.is_finite() && (spread > 1.0 || spread > 0.0 && self.is_model_large()) {
            self.navigator.spread(spread);
        }
    }

    /// Records whether a finger has touched the screen. The window system reports a touch first, and then the same
    /// finger as the pointer.
    pub fn note_finger(&mut self, has_come: bool) {
        self.input.gestures.finger_came = has_come;
    }

    /// Tells the time of the window system's frame, by which a finger rests, seconds.
    pub fn set_frame_time(&mut self, secs: f64) {
        self.input.gestures.frame_secs = secs;
    }

    /// If a finger causes the press of the pointer at `at`, delays the press until it is clear that no second finger
    /// follows. Returns whether a finger caused the press.
    pub fn touch(&mut self, at: Option<Vec2>) -> bool {
        let is_finger = std::mem::take(&mut self.input.gestures.finger_came);
        if is_finger && let Some(at) = at {
            self.input.gestures.resting = Some(Resting { at, since_secs: self.input.gestures.frame_secs });
        }
        is_finger
    }

    /// Ends a touch that the window system cancelled for its own gesture. The stroke stays.
    pub fn cancel_touch(&mut self) {
        self.input.gestures.resting = None;
        if self.input.gestures.is_touch {
            self.finish_gestures();
        }
    }

    /// Presses the pointer where a single finger touched the screen, once it has moved to `at`, was lifted, or has
    /// rested long enough.
    pub fn press_touch(&mut self, at: Option<Vec2>, is_lifted: bool, held: Held, size_px: Vec2) {
        let Some(resting) = self.input.gestures.resting else { return };
        let aspect = size_px.x / size_px.y.max(1.0);
        let by = at.map_or(Vec2::ZERO, |at| (at - resting.at) * Vec2::new(0.5 * aspect, 0.5));
        let has_rested = self.input.gestures.frame_secs - resting.since_secs > ALONE_SECS;
        if is_lifted || has_rested || by.length() > ALONE_BY {
            self.input.gestures.resting = None;
            self.input(Input::Move(resting.at), held, size_px);
            self.input(Input::Press(Button::Primary), held, size_px);
            self.input.gestures.is_touch = true;
        }
    }
}
