use glam::{DMat3, DVec3, Mat4, Quat, Vec2, Vec3, Vec4};

use crate::{
    math::{Corners, Frustum, Ray, rotate, rotate_exactly},
    view::ViewWindow,
};

/// The window for occlusion culling is wider than the screen by this fraction, about a tenth of a pixel. If it is larger,
/// less is hidden at the border of the screen and close to the eye.
pub const WINDOW_MARGIN: f64 = 1.0e-4;

/// The part of the space in front of an eye that a screen shows. It is stored as tangents of the angles to the screen's
/// four borders, negative to the left and below. Off-axis screens are treated like all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Tangent to the left border; less than `right`.
    pub left: f32,
    /// Tangent to the right border.
    pub right: f32,
    /// Tangent to the lower border; less than `top`.
    pub bottom: f32,
    /// Tangent to the upper border.
    pub top: f32,
    /// Nearest distance that is drawn, metres.
    pub near_m: f32,
    /// Farthest distance that is drawn, metres.
    pub far_m: f32,
}

impl Projection {
    /// A symmetric projection with a vertical field of view and an aspect ratio, width by height.
    pub fn symmetric(vertical_fov_degrees: f32, aspect: f32, near_m: f32, far_m: f32) -> Self {
        let half_angle = f64::from(vertical_fov_degrees.clamp(1.0, 170.0)).to_radians() * 0.5;
        let top = libm::tan(half_angle) as f32;
        let right = top * aspect;
        Self { left: -right, right, bottom: -top, top, near_m, far_m }
    }
}

/// An eye, its direction, and the projection of its screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The eye, world space, metres.
    pub eye_in_world: Vec3,
    /// Rotation from view space to world space. The view looks along -z of view space, with +y up.
    pub world_from_view: Quat,
    /// Projection of the screen.
    pub projection: Projection,
}

impl View {
    /// A view from `eye` towards `target`, with +y up. A view straight down has -z up, a view straight up has +z up.
    pub fn look_at(eye: Vec3, target: Vec3, projection: Projection) -> Self {
        // Farther than 1.8e19 m the square of a length is infinite.
        const SMALL: f32 = 1.0e-30;
        let back = (eye - target).normalize_or((eye * SMALL - target * SMALL).normalize_or(Vec3::Z));
        let right = Vec3::Y.cross(back);
        let right = if right.length_squared() < 1.0e-12 { Vec3::X } else { right.normalize() };
        let up = back.cross(right);
        let world_from_view = Quat::from_rotation_axes(right, up, back);
        Self { eye_in_world: eye, world_from_view, projection }
    }

    /// The same view on a screen with the ratio `aspect` of width to height. The height stays unchanged.
    #[must_use]
    pub fn with_aspect(&self, aspect: f32) -> Self {
        let Projection { left, right, bottom, top, .. } = self.projection;
        let factor = aspect * (top - bottom) / (right - left);
        let projection = Projection { left: left * factor, right: right * factor, ..self.projection };
        Self { projection, ..*self }
    }

    /// The direction of view, world space, unit length.
    pub fn forward_in_world(&self) -> Vec3 {
        rotate(self.world_from_view, Vec3::NEG_Z)
    }

    /// The directions from the eye to the window's corners, world space, at distance 1 along the direction of view: lower
    /// left, lower right, upper right, upper left.
    pub fn corner_directions(&self) -> [Vec3; 4] {
        let Projection { left, right, bottom, top, .. } = self.projection;
        [(left, bottom), (right, bottom), (right, top), (left, top)]
            .map(|(x, y)| rotate(self.world_from_view, Vec3::new(x, y, -1.0)))
    }

    /// The ray from the eye through a point of the window. The point's coordinates go from -1 to 1, from left to right and
    /// from the lower to the upper border. The ray's parameter is the distance along the direction of view, metres.
    pub fn ray_through(&self, at: Vec2) -> Ray {
        let Projection { left, right, bottom, top, .. } = self.projection;
        let x = left + (right - left) * (at.x * 0.5 + 0.5);
        let y = bottom + (top - bottom) * (at.y * 0.5 + 0.5);
        Ray::new(self.eye_in_world, rotate(self.world_from_view, Vec3::new(x, y, -1.0)))
    }

    /// The six planes, world space, normals inwards and of unit length: left, right, lower, upper, near, far.
    ///
    /// They lie outside the drawn frustum by the largest rounding error of a box test, a part in 10^7 of the
    /// coordinates. Renderers work relative to the eye, so far from the origin they are more exact than a box test.
    /// Without the margin a test could cull slivers that a renderer shows.
    pub fn frustum(&self) -> Frustum {
        let Projection { left, right, bottom, top, near_m, far_m } = self.projection;
        let [left, right, bottom, top, near_m, far_m] =
            [left, right, bottom, top, near_m, far_m].map(f64::from);
        let turn = |v: DVec3| rotate_exactly(self.world_from_view, v);
        // If the quaternion's length is not exactly 1, these planes still match the view's rays.
        let world_from_view = DMat3::from_cols(turn(DVec3::X), turn(DVec3::Y), turn(DVec3::Z));
        let normal_turn = world_from_view.inverse().transpose();
        let normal = |x, y, z| normal_turn * DVec3::new(x, y, z);
        let rays = [(left, bottom), (right, bottom), (right, top), (left, top)]
            .map(|(x, y)| world_from_view * DVec3::new(x, y, -1.0));
        let corners_at =
            |distance_m: f64| {
                rays.map(|ray| {
                    if distance_m.is_infinite() { ray.extend(0.0) } else { (ray * distance_m).extend(1.0) }
                })
            };
        let corners = Corners {
            origin: self.eye_in_world.as_dvec3(),
            near: corners_at(near_m),
            far: corners_at(far_m),
            depth: normal(0.0, 0.0, -1.0).extend(0.0),
        };
        Frustum::new(
            [
                normal(1.0, 0.0, left),
                normal(-1.0, 0.0, -right),
                normal(0.0, 1.0, bottom),
                normal(0.0, -1.0, -top),
                normal(0.0, 0.0, -1.0),
                normal(0.0, 0.0, 1.0),
            ]
            .map(|side| corners.plane(side)),
        )
    }

    /// The window for occlusion culling; `None` for a degenerate projection.
    ///
    /// The window is wider by [`WINDOW_MARGIN`], and its near plane farther by the same fraction. Rounding errors of a
    /// renderer can then neither show anything outside the window nor clip an occluder.
    #[doc(hidden)]
    pub fn window(&self) -> Option<ViewWindow> {
        let corners = self.corner_directions().map(|corner| corner.as_dvec3());
        let middle = corners.iter().sum::<DVec3>() * 0.25;
        let corners = corners.map(|corner| middle + (corner - middle) * (1.0 + WINDOW_MARGIN));
        let near_m = f64::from(self.projection.near_m) * (1.0 + WINDOW_MARGIN);
        ViewWindow::new(self.eye_in_world.as_dvec3(), self.forward_in_world().as_dvec3(), corners, near_m)
    }

    /// The matrix from world space to clip space with reversed depth (near 1, far 0), x and y from -1 to 1. Use it for
    /// drawing.
    pub fn clip_from_world(&self) -> Mat4 {
        let Projection { left, right, bottom, top, near_m, far_m } = self.projection;
        let (width, height, depth) = (right - left, top - bottom, far_m - near_m);
        let clip_from_view = Mat4::from_cols(
            Vec4::new(2.0 / width, 0.0, 0.0, 0.0),
            Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
            Vec4::new((right + left) / width, (top + bottom) / height, near_m / depth, -1.0),
            Vec4::new(0.0, 0.0, near_m * far_m / depth, 0.0),
        );
        let view_from_world =
            Mat4::from_rotation_translation(self.world_from_view, self.eye_in_world).inverse();
        clip_from_view * view_from_world
    }
}
