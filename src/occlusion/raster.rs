//! Converts between directions from the eye and pixels of an image that covers a [`ViewWindow`].

use glam::{DVec2, DVec3};

use crate::view::ViewWindow;

/// The transform from the eye's space (world axes, the eye as origin) to pixels.
#[derive(Clone, Copy, Debug)]
pub struct Raster {
    pub(crate) eye_in_world: DVec3,
    pub(crate) forward: DVec3,
    right: DVec3,
    up: DVec3,
    corner: DVec2,
    /// The corner opposite to `corner`.
    far_corner: DVec2,
    pixels_a_unit: DVec2,
    /// Change of the direction from one pixel to the next, to the right and up.
    step: [DVec3; 2],
    /// The direction to pixel (0, 0), at distance 1 in front of the eye.
    first: DVec3,
}

impl Raster {
    /// A transform to a picture of the window with `width` x `height` pixels.
    pub fn new(window: &ViewWindow, width: f64, height: f64) -> Self {
        let forward = window.forward();
        let flat = window.corners().map(|c| c / c.dot(forward) - forward);
        let right = (flat[1] - flat[0]).normalize_or(forward.any_orthonormal_vector());
        let right = (right - forward * forward.dot(right)).normalize_or_zero();
        let up = right.cross(forward);
        let at = flat.map(|p| DVec2::new(right.dot(p), up.dot(p)));
        let low = at.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
        let high = at.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
        let raster = Self {
            eye_in_world: window.eye_in_world(),
            forward,
            right,
            up,
            corner: low,
            far_corner: high,
            pixels_a_unit: DVec2::ONE,
            step: [right, up],
            first: forward,
        };
        raster.part([low, high], width, height)
    }

    /// A picture of a part of the window with this many pixels across and down. The part is given by its lowest and
    /// highest tangents, to the right and up.
    pub(crate) fn part(&self, [low, high]: [DVec2; 2], width: f64, height: f64) -> Self {
        let pixels_a_unit = DVec2::new(width, height) / (high - low);
        Self {
            corner: low,
            far_corner: high,
            pixels_a_unit,
            step: [self.right / pixels_a_unit.x, self.up / pixels_a_unit.y],
            first: self.forward + self.right * low.x + self.up * low.y,
            ..*self
        }
    }

    /// The lowest and highest tangents of the picture, to the right and up.
    pub(crate) fn tangents(&self) -> [DVec2; 2] {
        [self.corner, self.far_corner]
    }

    /// Position of a point in front of the eye, pixels. `p` is relative to the eye.
    #[inline]
    pub fn project(&self, p: DVec3) -> DVec2 {
        let flat = DVec2::new(self.right.dot(p), self.up.dot(p)) / self.forward.dot(p);
        (flat - self.corner) * self.pixels_a_unit
    }

    /// The coordinates of a vector along `right`, `up` and `forward`.
    #[inline]
    pub(crate) fn in_axes(&self, v: DVec3) -> DVec3 {
        DVec3::new(self.right.dot(v), self.up.dot(v), self.forward.dot(v))
    }

    /// Unit vectors to the right, up, and along the direction of view.
    #[inline]
    pub(crate) fn axes(&self) -> [DVec3; 3] {
        [self.right, self.up, self.forward]
    }

    /// Position of the point at distance 1 from the eye, `right` to the right and `up` up, pixels.
    #[inline]
    pub(crate) fn flat_in_pixels(&self, right: f64, up: f64) -> DVec2 {
        (DVec2::new(right, up) - self.corner) * self.pixels_a_unit
    }

    /// Does the same as [`Raster::in_pixels`] for a normal given [in axes](Raster::in_axes).
    #[inline]
    pub(crate) fn axes_in_pixels(&self, normal: DVec3) -> [f64; 3] {
        let [x, y] = [normal.x / self.pixels_a_unit.x, normal.y / self.pixels_a_unit.y];
        [x, y, normal.x * self.corner.x + normal.y * self.corner.y + normal.z]
    }

    /// Number of pixels of one unit at distance 1 from the eye, across and up.
    pub(crate) fn pixels_a_unit(&self) -> DVec2 {
        self.pixels_a_unit
    }

    /// A plane through the eye as a function `f` of pixels: `f[0] x + f[1] y + f[2]` is the scalar product of the normal
    /// and the direction to pixel (x, y) at distance 1 from the eye.
    #[inline]
    pub fn in_pixels(&self, normal: DVec3) -> [f64; 3] {
        [normal.dot(self.step[0]), normal.dot(self.step[1]), normal.dot(self.first)]
    }
}
