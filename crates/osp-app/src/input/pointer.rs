//! The pointer draws, erases, selects and moves strokes, and turns the camera.

use glam::{Vec2, Vec3};

use crate::{
    altering::Altering,
    command::Command,
    gestures::{Button, Gesture, Held, Input},
    handles::dragged,
    navigator::on_plane_through,
    pen::{Pen, PenPoint, Snap},
    studio::Studio,
    tool::ToolChoice,
};
use osp::view::View;
use osp_session::{
    recording::{Author, Event, Motion, StrokeId},
    scene::Stroke,
};

/// Largest movement of the pointer during a click, heights of the window.
const CLICK: f32 = 0.006;

/// Largest distance at which the pointer touches a stroke, pixels. Strokes can be thinner than a pixel.
const TOUCH_PX: f32 = 4.0;
/// Largest number of points tested along one movement of the eraser. Fast movements are long.
const MAX_TOUCHES: f32 = 256.0;

impl Studio {
    /// Handles an input of the pointer, for a window of this size in pixels.
    pub fn input(&mut self, input: Input, held: Held, size_px: Vec2) {
        if self.is_reading() {
            return;
        }
        let aspect = size_px.x / size_px.y.max(1.0);
        match input {
            Input::Pressure(pressure) => self.input.gestures.pressure = Some(pressure.clamp(0.0, 1.0)),
            Input::Wheel(steps) if held.shift => {
                self.input.brush.widen(steps);
                self.take_width();
            }
            Input::Wheel(steps) => {
                let point = self.point_to_turn_about(aspect);
                self.leave_replay_camera();
                if steps > 0.0 || self.is_model_large() {
                    self.navigator.zoom_to(point, steps);
                }
            }
            Input::Leave => {
                if self.input.gestures.gesture.is_none() {
                    self.input.gestures.pointer = None;
                }
            }
            Input::Press(button) => self.press(button, held, size_px, aspect),
            Input::Move(at) => {
                let before = self.input.gestures.pointer.replace(at).unwrap_or(at);
                // In heights of the window, y downwards.
                let by = Vec2::new((at.x - before.x) * 0.5 * aspect, (before.y - at.y) * 0.5);
                self.drag(before, by, held, size_px, aspect);
            }
            Input::Release(_) => self.release(held, size_px),
        }
        self.apply_events();
    }

    fn press(&mut self, button: Button, held: Held, size_px: Vec2, aspect: f32) {
        // The event of a pen's pressure arrives before the event of its press.
        let pressure = self.input.gestures.pressure;
        self.finish_gestures();
        self.input.gestures.pressure = pressure;
        let Some(at) = self.input.gestures.pointer else { return };
        self.input.gestures.pressed_at = at;
        self.input.gestures.is_touch = false;
        let gesture = match (button, held) {
            (Button::Primary, Held { space: true, .. }) => Some(Gesture::Pan),
            (Button::Primary, Held { alt: false, .. }) if self.has_tool() => {
                self.press_tool(at, size_px, aspect)
            }
            (Button::Middle, _) | (_, Held { shift: true, .. }) => Some(Gesture::Pan),
            (Button::Primary, _) => Some(Gesture::Orbit(self.point_to_turn_about(aspect))),
            (Button::Secondary, Held { alt: true, .. }) => Some(Gesture::Look),
            (Button::Secondary, _) => Some(Gesture::Orbit(self.point_to_turn_about(aspect))),
        };
        if matches!(gesture, Some(Gesture::Pan | Gesture::Orbit(_) | Gesture::Look)) {
            self.leave_replay_camera();
        }
        self.input.gestures.gesture = gesture;
    }

    /// Whether the left button uses a tool. Nothing can be drawn or erased in a replay.
    fn has_tool(&self) -> bool {
        match self.input.tool {
            ToolChoice::Look => false,
            ToolChoice::Draw(_) | ToolChoice::Erase => !self.session.is_replay(),
            ToolChoice::Select | ToolChoice::Span(_) => true,
        }
    }

    /// A camera that the user moves follows the recorded one no longer.
    pub(crate) fn leave_replay_camera(&mut self) {
        self.follows_replay_camera = false;
    }

    fn press_tool(&mut self, at: Vec2, size_px: Vec2, aspect: f32) -> Option<Gesture> {
        match self.input.tool {
            ToolChoice::Look => None,
            ToolChoice::Draw(_) => {
                let (view, on_screen) = self.view_at(at, aspect)?;
                let surface = self.surface_under(&view, on_screen);
                if !self.may_draw_on_layer() {
                    return None;
                }
                let stroke = self.new_stroke()?;
                let t = self.now_secs();
                let point = self.pen_point(&view, on_screen, size_px.y, surface);
                let brush = self.brush_at(&view, Pen::aim(&point, self.input.snap), size_px.y);
                self.input.pen.press(t, stroke, brush, self.input.snap, &point, &mut self.events);
                Some(Gesture::Draw)
            }
            ToolChoice::Erase => {
                self.input.gestures.gesture = Some(Gesture::Erase { is_step_open: false });
                self.erase_along(at, at, size_px);
                self.input.gestures.gesture
            }
            ToolChoice::Select => match self.stroke_under(at, size_px) {
                _ if let Some((handle, ring, from)) = self.handle_under(at, size_px) => {
                    Some(Gesture::Handle { handle, ring, from, motion: Motion::STAY })
                }
                Some((stroke, from)) if self.input.selection.has(stroke) => {
                    Some(Gesture::Move { from, by: Vec3::ZERO })
                }
                _ => Some(Gesture::Click),
            },
            ToolChoice::Span(span) => {
                let from = self.span_point(at, size_px, None)?;
                Some(Gesture::Span { span, from, to: from })
            }
        }
    }

    fn drag(&mut self, before: Vec2, by: Vec2, held: Held, size_px: Vec2, aspect: f32) {
        let (Some(gesture), Some(at)) = (self.input.gestures.gesture, self.input.gestures.pointer) else {
            return;
        };
        match gesture {
            Gesture::Draw => {
                let Some((view, on_screen)) = self.view_at(at, aspect) else { return };
                let surface = if self.input.snap == Snap::Surface {
                    self.surface_under(&view, on_screen)
                } else {
                    None
                };
                let t = self.now_secs();
                let point = self.pen_point(&view, on_screen, size_px.y, surface);
                let (is_straight, first) = (held.shift || self.input.aids.straight, self.events.len());
                self.input.pen.drag(t, self.input.snap, is_straight, &point, &mut self.events);
                self.mirror_events(first);
            }
            Gesture::Erase { .. } => self.erase_along(before, at, size_px),
            Gesture::Orbit(pivot) => self.navigator.orbit_about(pivot, by),
            Gesture::Look => self.navigator.look(by),
            Gesture::Pan => self.navigator.pan(by),
            Gesture::Move { from, .. } => {
                let Some((view, on_screen)) = self.view_at(at, aspect) else { return };
                let to = on_plane_through(&view, on_screen, from);
                self.input.gestures.gesture = Some(Gesture::Move { from, by: to - from });
            }
            Gesture::Handle { handle, ring, from, .. } => {
                let Some((view, on_screen)) = self.view_at(at, aspect) else { return };
                let to = on_plane_through(&view, on_screen, ring.middle);
                let motion = dragged(handle, &ring, from, to, held.shift);
                self.input.gestures.gesture = Some(Gesture::Handle { handle, ring, from, motion });
            }
            Gesture::Span { span, from, .. } => {
                let Some(to) = self.span_point(at, size_px, Some(from)) else { return };
                self.input.gestures.gesture = Some(Gesture::Span { span, from, to });
            }
            Gesture::Click => {}
        }
    }

    fn release(&mut self, held: Held, size_px: Vec2) {
        let Some(gesture) = self.input.gestures.gesture else { return };
        let at = self.input.gestures.pointer.unwrap_or(self.input.gestures.pressed_at);
        let wandered =
            (at - self.input.gestures.pressed_at) * Vec2::new(0.5 * size_px.x / size_px.y.max(1.0), 0.5);
        let is_click = wandered.length() <= CLICK;
        match gesture {
            Gesture::Click | Gesture::Move { .. } | Gesture::Handle { .. } if is_click => {
                self.input.gestures.gesture = None;
                match self.stroke_under(at, size_px) {
                    Some((stroke, _)) if held.shift => self.input.selection.toggle(stroke),
                    Some((stroke, _)) => self.input.selection.set([stroke]),
                    None if held.shift => {}
                    None => self.input.selection.clear(),
                }
            }
            Gesture::Span { span, from, to } => {
                self.input.gestures.gesture = None;
                self.end_span(span, from, to, held.shift);
            }
            _ => {}
        }
        self.finish_gestures();
    }

    /// Ends the gesture of the pointer. Drawn and moved strokes stay.
    pub fn finish_gestures(&mut self) {
        let t = self.now_secs();
        let first = self.events.len();
        self.input.pen.release(t, &mut self.events);
        self.mirror_events(first);
        let gesture = self.input.gestures.gesture.take();
        if gesture == Some(Gesture::Erase { is_step_open: true }) {
            self.end_step();
        }
        if let Some(Gesture::Handle { motion, .. }) = gesture
            && motion != Motion::STAY
        {
            self.alter_selection(Altering::Motion(motion));
        }
        if let Some(Gesture::Move { by, .. }) = gesture
            && by != Vec3::ZERO
            && !self.input.selection.is_empty()
        {
            if let Some(placed) = self.placed_group(&Motion::by(by)) {
                self.events.push(placed);
            } else {
                // One edit, or several if one line of the file cannot list all strokes.
                let parts = self.input.selection.strokes().chunks(Event::MAX_STROKES_NAMED);
                self.events.extend(parts.map(|strokes| Event::Move {
                    author: Author::SOLE,
                    t,
                    strokes: strokes.to_vec(),
                    by,
                }));
            }
        }
        self.input.gestures.pressure = None;
        self.apply_events();
    }

    /// Ends the gesture of the pointer without a trace in the model. A stroke or an erasure can be had back by a redo.
    pub(crate) fn cancel_gesture(&mut self) {
        let is_undone = match self.input.gestures.gesture {
            Some(Gesture::Draw) => self.input.pen.drop_line(),
            Some(Gesture::Erase { is_step_open }) => is_step_open,
            _ => {
                self.input.gestures.gesture = None;
                false
            }
        };
        self.finish_gestures();
        if is_undone {
            self.command(Command::Undo);
        }
    }

    fn end_step(&mut self) {
        if self.session.may_have_open_step() {
            let t = self.now_secs();
            self.events.push(Event::Step { author: Author::SOLE, t, edits: 0 });
            self.apply_events();
        }
    }

    /// Ends the eraser's undo step, because an edit of another author follows.
    pub(crate) fn part_eraser_step(&mut self) {
        if let Some(Gesture::Erase { is_step_open: is_open @ true }) = &mut self.input.gestures.gesture {
            *is_open = false;
            self.end_step();
        }
    }

    /// Sets the flight direction: right, up, back, each -1 to 1; zero stands still.
    pub fn set_flight(&mut self, direction: Vec3) {
        if direction != Vec3::ZERO {
            self.leave_replay_camera();
        }
        self.input.gestures.flight = direction;
    }

    /// Whether the model is more than a speck, so that the camera may still go farther away.
    pub(crate) fn is_model_large(&self) -> bool {
        /// Largest distance of the camera, in sizes of the model.
        const FARTHEST: f32 = 20.0;
        /// Least size of the model that counts, metres.
        const LEAST_M: f32 = 1.0;
        let bounds = self.session.bounds();
        let size_m = if bounds.is_empty() { 0.0 } else { bounds.extent().length() };
        self.navigator.distance_m() < FARTHEST * size_m.max(LEAST_M)
    }

    /// Rotates about the eye. `turn` is in heights of the window.
    pub fn look(&mut self, turn: Vec2) {
        self.leave_replay_camera();
        self.navigator.look(turn);
    }

    pub(crate) fn fly(&mut self, frame_secs: f32) {
        /// Flight speed, as a fraction of the distance to the centre of the view per second.
        const SPEED: f32 = 0.9;
        // After a very long frame the eye must not leave the model.
        self.navigator.fly(self.input.gestures.flight * (SPEED * frame_secs.clamp(0.0, 0.1)));
    }

    /// The view under the pointer, and the point where a stroke would begin.
    pub(crate) fn aim(&mut self, at: Vec2, height_px: f32, aspect: f32) -> Option<(View, Vec3)> {
        let (view, on_screen) = self.view_at(at, aspect)?;
        let surface = self.surface_under(&view, on_screen);
        let point = self.pen_point(&view, on_screen, height_px, surface);
        let aim = match self.input.pen.anchor() {
            Some(anchor) if self.input.snap != Snap::Surface || surface.is_none() => {
                on_plane_through(&view, on_screen, anchor)
            }
            _ => Pen::aim(&point, self.input.snap),
        };
        Some((view, aim))
    }

    fn pen_point<'v>(&self, view: &'v View, at: Vec2, height_px: f32, surface: Option<Vec3>) -> PenPoint<'v> {
        let pressure = self.input.gestures.pressure.unwrap_or(1.0);
        PenPoint { view, at, height_px, surface, target: self.navigator.target(), pressure }
    }

    /// The point of the model under a point of a screen. The unfinished stroke is ignored; otherwise it would be drawn
    /// on its own surface, ever closer to the eye.
    fn surface_under(&mut self, view: &View, at: Vec2) -> Option<Vec3> {
        if self.input.snap == Snap::Off {
            return None;
        }
        let ray = view.ray_through(at);
        let without = self.input.pen.stroke();
        let twin = self.twin_of(without);
        let (_, point) = self.pick(&ray, |stroke| {
            without.is_none() || stroke.id() != without && (twin.is_none() || stroke.id() != twin)
        })?;
        Some(point)
    }

    /// The stroke under or close to a point of the window, and the point on the stroke. Ignores strokes on locked
    /// layers.
    pub(crate) fn stroke_under(&mut self, at: Vec2, size_px: Vec2) -> Option<(StrokeId, Vec3)> {
        /// Offsets to try: the point itself, then the points around it.
        const TOUCH_OFFSETS: [(f32, f32); 9] = [
            (0.0, 0.0),
            (1.0, 0.0),
            (0.0, 1.0),
            (-1.0, 0.0),
            (0.0, -1.0),
            (0.7, 0.7),
            (-0.7, 0.7),
            (-0.7, -0.7),
            (0.7, -0.7),
        ];
        let aspect = size_px.x / size_px.y.max(1.0);
        let layers = self.scene().layer_states().keys().copied();
        let locked: Vec<u32> = layers.filter(|&layer| self.is_layer_held(layer)).collect();
        // The coordinates of the window go from -1 to 1.
        let touch = 2.0 * TOUCH_PX / size_px.max(Vec2::ONE);
        TOUCH_OFFSETS.iter().find_map(|&offset| {
            let (view, on_screen) = self.view_at(at + touch * Vec2::from(offset), aspect)?;
            let is_free = |stroke: &Stroke| !locked.contains(&stroke.layer());
            let (id, point) = self.pick(&view.ray_through(on_screen), is_free)?;
            Some((self.scene().stroke_of(id).id()?, point))
        })
    }

    /// Erases the strokes along a line from one point of the window to another.
    fn erase_along(&mut self, from: Vec2, to: Vec2, size_px: Vec2) {
        let steps = ((to - from) * 0.5 * size_px).length() / TOUCH_PX;
        let steps = steps.ceil().clamp(1.0, MAX_TOUCHES);
        for step in 1..=steps as u32 {
            let at = from.lerp(to, step as f32 / steps);
            if let Some((stroke, _)) = self.stroke_under(at, size_px)
                && !self.session.is_erasing(stroke)
            {
                let t = self.now_secs();
                // All strokes of one gesture are one step of undo, which ends with the gesture.
                if let Some(Gesture::Erase { is_step_open: is_open @ false }) =
                    &mut self.input.gestures.gesture
                {
                    *is_open = true;
                    self.events.push(Event::Step { author: Author::SOLE, t, edits: u32::MAX });
                }
                self.events.push(Event::Erase { author: Author::SOLE, t, stroke });
                self.apply_events();
            }
        }
    }

    pub(crate) fn look_at_pointer(&mut self, aspect: f32) {
        if let Some(point) = self.point_under_pointer(aspect) {
            self.navigator.look_at(point);
        }
    }

    /// The point of the model under the pointer, world space.
    fn point_under_pointer(&mut self, aspect: f32) -> Option<Vec3> {
        let (view, on_screen) = self.input.gestures.pointer.and_then(|at| self.view_at(at, aspect))?;
        self.pick(&view.ray_through(on_screen), |_| true).map(|(_, point)| point)
    }

    /// The point of the model under the pointer; if there is none, the centre of the view.
    fn point_to_turn_about(&mut self, aspect: f32) -> Vec3 {
        self.point_under_pointer(aspect).unwrap_or(self.navigator.target())
    }
}
