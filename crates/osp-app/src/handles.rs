//! Handles around the selection: a ring that rotates it, and a knob on the ring that scales it.

use glam::{Quat, Vec2, Vec3};

use crate::{
    layers::circle,
    navigator::{on_plane_through, pixel_m},
    studio::Studio,
    tool::ToolChoice,
};
use osp::{math::rotate, view::View};
use osp_render::{Depth, LineBatch, LineColor};
use osp_session::recording::Motion;

/// Largest distance from a handle at which the pointer grabs it, pixels.
const REACH_PX: f32 = 9.0;
/// Half the edge of the knob, pixels.
const KNOB_PX: f32 = 6.0;
/// Smallest radius of the ring, pixels.
const MIN_RADIUS_PX: f32 = 36.0;
/// Largest radius of the ring, as a fraction of the window's height.
const MAX_RADIUS_HEIGHTS: f32 = 0.42;
/// Step of rotations while Shift is held, degrees. Scale factors change in steps of 0.1.
const STEP_DEGREES: f32 = 15.0;
const COLOR: LineColor = [255, 220, 90, 255];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Handle {
    /// The ring.
    Turn,
    /// The knob.
    Scale,
}

/// The ring around the selection, perpendicular to the line of sight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ring {
    pub(super) middle: Vec3,
    right: Vec3,
    up: Vec3,
    radius_m: f32,
    pixel_m: f32,
}

impl Ring {
    pub(super) fn around(middle: Vec3, half_m: f32, view: &View, height_px: f32) -> Option<Self> {
        let distance_m = (middle - view.eye_in_world).dot(view.forward_in_world());
        if distance_m <= view.projection.near_m {
            return None;
        }
        let pixel_m = pixel_m(view, distance_m, height_px);
        let most_m = pixel_m * height_px * MAX_RADIUS_HEIGHTS;
        let radius_m = half_m.max(MIN_RADIUS_PX * pixel_m).min(most_m);
        let q = view.world_from_view;
        Some(Self { middle, right: rotate(q, Vec3::X), up: rotate(q, Vec3::Y), radius_m, pixel_m })
    }

    fn knob(&self) -> Vec3 {
        self.middle + (self.right + self.up) * (self.radius_m * std::f32::consts::FRAC_1_SQRT_2)
    }

    pub(super) fn handle_at(&self, p: Vec3) -> Option<Handle> {
        let reach_m = REACH_PX * self.pixel_m;
        if p.distance(self.knob()) <= reach_m {
            return Some(Handle::Scale);
        }
        ((p.distance(self.middle) - self.radius_m).abs() <= reach_m).then_some(Handle::Turn)
    }

    pub(super) fn draw(&self, out: &mut LineBatch) {
        let corners = circle::<64>(self.middle, self.right * self.radius_m, self.up * self.radius_m);
        out.outline(&corners, COLOR, Depth::Through);
        let (knob, half_m) = (self.knob(), KNOB_PX * self.pixel_m);
        let (x, y) = (self.right * half_m, self.up * half_m);
        let square = [knob - x - y, knob + x - y, knob + x + y, knob - x + y];
        out.outline(&square, COLOR, Depth::Through);
        out.outline(&square.map(|p| knob.lerp(p, 0.5)), COLOR, Depth::Through);
    }
}

/// Motion of the selection when a handle is dragged from one point in the ring's plane to another.
pub(super) fn dragged(handle: Handle, ring: &Ring, from: Vec3, to: Vec3, in_steps: bool) -> Motion {
    let (before, after) = (from - ring.middle, to - ring.middle);
    match handle {
        Handle::Turn => {
            let axis = ring.right.cross(ring.up);
            let mut angle = before.cross(after).dot(axis).atan2(before.dot(after));
            if in_steps {
                let step = STEP_DEGREES.to_radians();
                angle = (angle / step).round() * step;
            }
            Motion::about(ring.middle, Quat::from_axis_angle(axis.normalize(), angle), 1.0)
        }
        Handle::Scale => {
            let mut scale = (after.length() / before.length().max(f32::MIN_POSITIVE)).clamp(0.01, 100.0);
            if in_steps {
                scale = (scale * 10.0).round().max(1.0) / 10.0;
            }
            Motion::about(ring.middle, Quat::IDENTITY, scale)
        }
    }
}

impl Studio {
    /// The ring around the selection, while the user can grab it.
    fn ring(&self, view: &View, height_px: f32) -> Option<Ring> {
        if self.input.tool != ToolChoice::Select || !self.can_draw() {
            return None;
        }
        let bounds = self.input.shown_bounds.filter(|bounds| !bounds.is_empty())?;
        Ring::around(bounds.center(), bounds.extent().length() * 0.5, view, height_px)
    }

    /// The handle under a point of the window, its ring, and the point on the plane of the ring.
    pub(crate) fn handle_under(&self, at: Vec2, size_px: Vec2) -> Option<(Handle, Ring, Vec3)> {
        let (view, on_screen) = self.view_at(at, size_px.x / size_px.y.max(1.0))?;
        let ring = self.ring(&view, size_px.y)?;
        let p = on_plane_through(&view, on_screen, ring.middle);
        Some((ring.handle_at(p)?, ring, p))
    }

    /// Draws the handles, except while the selection is dragged.
    pub(crate) fn draw_handles(&mut self, view: &View, height_px: f32) {
        let is_stale =
            self.input.bounds_of.as_ref() != Some(&self.input.selection) || !self.changes.is_empty();
        if is_stale {
            self.input.shown_bounds = Some(self.selection_bounds());
            self.input.bounds_of = Some(self.input.selection.clone());
        }
        if self.input.gestures.is_dragging() {
            return;
        }
        if let Some(ring) = self.ring(view, height_px) {
            ring.draw(&mut self.shown.lines);
        }
    }
}
