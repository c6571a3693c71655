use glam::{Quat, Vec2, Vec3};

use osp::{
    math::{Aabb, rotate},
    view::{Projection, View},
};
use osp_session::recording::Camera;

/// Vertical field of view if the session's file has no camera, degrees.
const FOV_DEGREES: f32 = 55.0;
/// Limits of the vertical field of view, degrees. A file may contain an unusable value.
const FOVS_DEGREES: (f32, f32) = (10.0, 120.0);
/// Steepest angle up or down, radians, slightly less than vertical, so that "up" stays defined.
const STEEPEST: f32 = 1.55;
/// Near distance as a fraction of the distance to the centre of the view.
const NEAR_PART: f32 = 0.01;
/// The near distance of a session's camera is at most this fraction of the distance to the centre of the view.
const CAMERA_NEAR_PART: f32 = 0.2;
/// Limits of the distance to the centre of the view, metres.
const DISTANCES_M: (f32, f32) = (1.0e-4, 1.0e7);

/// An orbit camera: centre of the view, two angles, and distance of the eye from the centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Navigator {
    target: Vec3,
    /// Rotation about +y, radians; 0 looks along -z.
    yaw: f32,
    /// Angle of the view above the horizontal, radians.
    pitch: f32,
    distance_m: f32,
    /// Vertical field of view.
    fov_degrees: f32,
    /// Near distance of the session's camera, if its file has one.
    camera_near_m: Option<f32>,
}

impl Default for Navigator {
    /// The eye of a standing person, 2.5 m from a point 1.2 m above the floor.
    fn default() -> Self {
        let target = Vec3::new(0.0, 1.2, 0.0);
        Self {
            target,
            yaw: 0.35,
            pitch: -0.2,
            distance_m: 2.5,
            fov_degrees: FOV_DEGREES,
            camera_near_m: None,
        }
    }
}

impl Navigator {
    /// Takes over the vertical field of view and the near distance of a session's camera. `None` sets the defaults.
    pub(super) fn set_lens(&mut self, camera: Option<Camera>) {
        let fov_degrees = camera.map_or(FOV_DEGREES, |camera| camera.fov_degrees);
        self.fov_degrees = fov_degrees.clamp(FOVS_DEGREES.0, FOVS_DEGREES.1);
        self.camera_near_m = camera.and_then(|camera| camera.near_m);
    }

    fn near_m(&self) -> f32 {
        match self.camera_near_m {
            Some(near_m) => near_m.min(CAMERA_NEAR_PART * self.distance_m),
            None => NEAR_PART * self.distance_m,
        }
    }

    /// Rotation from view space to world space.
    pub fn world_from_view(&self) -> Quat {
        (Quat::from_rotation_y(self.yaw) * Quat::from_rotation_x(self.pitch)).normalize()
    }

    /// The centre of the view, around which the camera orbits; it lies on the drawing plane.
    pub fn target(&self) -> Vec3 {
        self.target
    }

    pub fn eye(&self) -> Vec3 {
        self.target + rotate(self.world_from_view(), Vec3::Z) * self.distance_m
    }

    /// Distance from the eye to the centre of the view, metres.
    pub fn distance_m(&self) -> f32 {
        self.distance_m
    }

    /// The view for a window of this aspect ratio, width divided by height. `bounds` is the box of the model, which the
    /// far plane does not clip.
    pub fn view(&self, aspect: f32, bounds: &Aabb) -> View {
        let eye_in_world = self.eye();
        let near_m = self.near_m();
        let farthest_m = if bounds.is_empty() {
            0.0
        } else {
            bounds.corners().map(|p| p.distance(eye_in_world)).into_iter().fold(0.0, f32::max)
        };
        let far_m = (farthest_m * 1.05).max(self.distance_m * 100.0).min(f32::MAX * 0.25);
        View {
            eye_in_world,
            world_from_view: self.world_from_view(),
            projection: Projection::symmetric(self.fov_degrees, aspect, near_m, far_m),
        }
    }

    /// Orbits around a point in world space, which keeps its position on the screen. `turn` is in heights of the
    /// window.
    pub fn orbit_about(&mut self, pivot: Vec3, turn: Vec2) {
        let before = self.world_from_view();
        self.orbit(turn);
        let turned = self.world_from_view() * before.inverse();
        self.target = pivot + rotate(turned, self.target - pivot);
    }

    /// Moves towards a point in world space (positive `steps`) or away from it, in steps of the wheel. The point keeps
    /// its position on the screen.
    pub fn zoom_to(&mut self, point: Vec3, steps: f32) {
        let before_m = self.distance_m;
        self.zoom(steps);
        self.target = point.lerp(self.target, self.distance_m / before_m);
    }

    /// Orbits around the centre of the view. `turn` is in heights of the window.
    pub fn orbit(&mut self, turn: Vec2) {
        self.yaw = (self.yaw - turn.x * 3.0) % std::f32::consts::TAU;
        self.pitch = (self.pitch - turn.y * 3.0).clamp(-STEEPEST, STEEPEST);
    }

    /// Rotates about the eye. `turn` is in heights of the window.
    pub fn look(&mut self, turn: Vec2) {
        let eye = self.eye();
        self.orbit(turn * 0.5);
        self.target = eye - rotate(self.world_from_view(), Vec3::Z) * self.distance_m;
    }

    /// Pans the camera, so that the centre of the view follows the hand. `by` is in heights of the window.
    pub fn pan(&mut self, by: Vec2) {
        let height_m = 2.0 * half_height(self.fov_degrees) * self.distance_m;
        let q = self.world_from_view();
        self.target += (rotate(q, Vec3::NEG_X) * by.x + rotate(q, Vec3::Y) * by.y) * height_m;
    }

    /// Changes the distance by steps of a wheel. Positive steps decrease the distance.
    pub fn zoom(&mut self, steps: f32) {
        self.distance_m = (self.distance_m * 0.88f32.powf(steps)).clamp(DISTANCES_M.0, DISTANCES_M.1);
    }

    /// Changes the distance by a pinch of two fingers; `by` is the ratio of the fingers' distances.
    pub fn spread(&mut self, by: f32) {
        self.distance_m = (self.distance_m / by).clamp(DISTANCES_M.0, DISTANCES_M.1);
    }

    /// Moves the eye and the centre of the view. `by` is in view space (right, up, back), in units of the distance to
    /// the centre.
    pub fn fly(&mut self, by: Vec3) {
        self.target += rotate(self.world_from_view(), by) * self.distance_m;
    }

    /// Rotates the camera towards a point.
    pub fn look_at(&mut self, point: Vec3) {
        let eye = self.eye();
        let back = eye - point;
        let distance_m = back.length();
        if distance_m.is_finite() && distance_m > DISTANCES_M.0 {
            let back = back / distance_m;
            self.yaw = back.x.atan2(back.z);
            self.pitch = (-back.y).asin().clamp(-STEEPEST, STEEPEST);
            self.distance_m = distance_m.min(DISTANCES_M.1);
            self.target = point;
        }
    }

    /// Moves the camera back until the whole box is in view.
    pub fn show_all(&mut self, bounds: &Aabb) {
        if bounds.is_empty() || !bounds.is_valid() {
            return;
        }
        let radius_m = bounds.extent().length() * 0.5;
        self.target = bounds.center();
        let narrower = half_height(FOV_DEGREES) / half_height(self.fov_degrees);
        self.distance_m = (radius_m * 2.0 * narrower).clamp(DISTANCES_M.0, DISTANCES_M.1).max(0.2);
    }

    /// Goes to a view whose centre is at `distance_m` from the eye.
    pub fn go_to_from(&mut self, eye: Vec3, world_from_view: Quat, distance_m: f32) {
        self.distance_m = distance_m.clamp(DISTANCES_M.0, DISTANCES_M.1);
        self.go_to(eye, world_from_view);
    }

    /// Goes to a view; the distance to the centre does not change.
    pub fn go_to(&mut self, eye: Vec3, world_from_view: Quat) {
        let back = rotate(world_from_view, Vec3::Z);
        self.yaw = back.x.atan2(back.z);
        self.pitch = (-back.y).clamp(-1.0, 1.0).asin().clamp(-STEEPEST, STEEPEST);
        self.target = eye - rotate(self.world_from_view(), Vec3::Z) * self.distance_m;
    }
}

/// Half the height of the view, divided by the distance.
fn half_height(fov_degrees: f32) -> f32 {
    (fov_degrees.to_radians() * 0.5).tan()
}

/// Size of a pixel at this distance along the view, metres, in a window of `height_px` pixels height.
pub(super) fn pixel_m(view: &View, distance_m: f32, height_px: f32) -> f32 {
    (view.projection.top - view.projection.bottom) * distance_m / height_px.max(1.0)
}

/// The point under a position on the screen (-1 to 1), on the plane through `anchor` parallel to the screen.
pub(crate) fn on_plane_through(view: &View, at: Vec2, anchor: Vec3) -> Vec3 {
    let ray = view.ray_through(at);
    // The ray's parameter is the distance along the view direction.
    let distance_m = (anchor - ray.origin).dot(view.forward_in_world()).max(view.projection.near_m * 2.0);
    ray.origin + ray.direction * distance_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_the_window_looks_at_the_target() {
        let mut navigator = Navigator::default();
        for _ in 0..20 {
            navigator.orbit(Vec2::new(0.21, 0.08));
            navigator.pan(Vec2::new(0.05, -0.02));
            navigator.zoom(0.7);
            let view = navigator.view(1.6, &Aabb::EMPTY);
            let ray = view.ray_through(Vec2::ZERO);
            let there = ray.origin + ray.direction * navigator.distance_m();
            assert!(there.distance(navigator.target()) < 1.0e-4 * navigator.distance_m().max(1.0));
        }
    }

    #[test]
    fn looking_around_leaves_the_eye_and_orbiting_leaves_the_target() {
        let mut navigator = Navigator::default();
        let eye = navigator.eye();
        navigator.look(Vec2::new(0.3, 0.1));
        assert!(navigator.eye().distance(eye) < 1.0e-5);
        let target = navigator.target();
        navigator.orbit(Vec2::new(0.3, 5.0));
        assert_eq!(navigator.target(), target);
        assert!(navigator.view(1.0, &Aabb::EMPTY).forward_in_world().is_finite());
    }

    #[test]
    fn what_is_orbited_and_zoomed_to_stays_on_the_screen() {
        let mut navigator = Navigator::default();
        let point = Vec3::new(0.7, 1.5, -0.4);
        let place = |navigator: &Navigator| {
            let clip = navigator.view(1.5, &Aabb::EMPTY).clip_from_world() * point.extend(1.0);
            Vec2::new(clip.x, clip.y) / clip.w
        };
        let (start, distance_m) = (place(&navigator), navigator.eye().distance(point));
        navigator.orbit_about(point, Vec2::new(0.4, -0.1));
        assert!(place(&navigator).distance(start) < 1.0e-4);
        assert!((navigator.eye().distance(point) - distance_m).abs() < 1.0e-4);
        navigator.zoom_to(point, 3.0);
        assert!(place(&navigator).distance(start) < 1.0e-4);
        assert!(navigator.eye().distance(point) < 0.7 * distance_m);
    }

    #[test]
    fn going_to_a_view_gives_that_view() {
        let mut a = Navigator::default();
        a.orbit(Vec2::new(1.3, 0.2));
        let mut b = Navigator::default();
        b.go_to(a.eye(), a.world_from_view());
        assert!(b.eye().distance(a.eye()) < 1.0e-5);
        let (forward_a, forward_b) =
            (a.view(1.0, &Aabb::EMPTY).forward_in_world(), b.view(1.0, &Aabb::EMPTY).forward_in_world());
        assert!(forward_a.distance(forward_b) < 1.0e-5);
        b.look_at(Vec3::new(3.0, 2.0, 1.0));
        let ray = b.view(1.0, &Aabb::EMPTY).ray_through(Vec2::ZERO);
        assert!((ray.origin + ray.direction * b.distance_m()).distance(Vec3::new(3.0, 2.0, 1.0)) < 1.0e-4);
    }

    #[test]
    fn everything_is_in_view_and_nothing_is_cut_off() {
        let bounds = Aabb::new(Vec3::new(-40.0, 3.0, 10.0), Vec3::new(-20.0, 5.0, 300.0));
        let mut navigator = Navigator::default();
        navigator.show_all(&bounds);
        let view = navigator.view(1.5, &bounds);
        for corner in bounds.corners() {
            let clip = view.clip_from_world() * corner.extend(1.0);
            assert!(clip.z > 0.0 && clip.z < clip.w, "{corner}");
        }
        let huge = Aabb::cube(Vec3::ZERO, 1.0e15);
        assert!(navigator.view(1.5, &huge).projection.far_m > 1.0e14);
    }
}
