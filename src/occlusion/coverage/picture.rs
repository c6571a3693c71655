//! The picture that corners are projected to, and its precision.

use glam::{DVec2, DVec3};

use super::super::raster::Raster;
use crate::view::ViewWindow;

/// Steps of a pixel to which corners are rounded.
pub(super) const STEPS: f64 = 64.0;

/// Largest error of a corner's picture, across and up, pixels: half a step, and [`KNOWN`].
pub(super) const MARGIN: f64 = 1.0 / 64.0;

/// Largest error of a corner's picture before it is rounded to steps, pixels.
const KNOWN: f64 = 0.004;

/// Largest coordinate of a corner's picture, pixels: steps fit into `i32`, products of their differences into `i64`.
const FARTHEST_PX: f64 = (1 << 23) as f64;

/// A picture shows a part of the window only if the part is smaller than this share of it.
const LARGEST_PART: f64 = 0.8;

/// A part is at least this share of the window each way, because the corners of a smaller part would be too imprecise.
const SMALLEST_PART: f64 = 1.0 / 16.0;

/// Border around the occluders, as a share of the part of the window that they fill.
const BORDER: f64 = 0.01;

/// The picture that corners are projected to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture {
    pub(super) raster: Raster,
    /// Nearest depth that is drawn; positive.
    pub(super) near: f64,
    /// Largest size of a corner, by its depth, for which its picture is [`KNOWN`].
    pub(super) most_tangent: f64,
    /// The lowest and highest pixels, to the right and up, within which the picture decides. Infinite where its border is
    /// that of the window, because nothing beyond is seen.
    known: [DVec2; 2],
}

impl Picture {
    pub(super) fn new(window: &ViewWindow, raster: &Raster, usual_m: f64) -> Self {
        // With `u = 2^-53`, a corner of size `s` (the sum of its coordinates from the eye) at depth `z`, and a tangent `t`
        // of at most `s / z`: its picture is wrong by less than `96 (1 + s / z)^2 u` times the pixels of a unit, as
        // [`super::super::depth`] shows. A corner at the near plane is wrong by no more, with the size of its edge.
        const U: f64 = 0.5 * f64::EPSILON;
        let pixels = raster.pixels_a_unit().max_element();
        let known = (KNOWN / (96.0 * U * pixels)).sqrt() - 1.0;
        let most_tangent = known.min(FARTHEST_PX / pixels);
        // A cut only makes less occlude.
        let near = window.near_m() * (1.0 + 1.0e-9);
        let near = if near > 0.0 { near } else { usual_m / most_tangent };
        Self { raster: *raster, near, most_tangent, known: [DVec2::NEG_INFINITY, DVec2::INFINITY] }
    }

    /// The picture of the part of the window that contains these lowest and highest tangents, with this many pixels
    /// across and up. If the part is large, the result is the picture itself, which must show the whole window.
    pub(super) fn zoomed(
        self,
        window: &ViewWindow,
        usual_m: f64,
        [low, high]: [DVec2; 2],
        pixels: [f64; 2],
    ) -> Self {
        let [window_low, window_high] = self.raster.tangents();
        let window_size = window_high - window_low;
        let (middle, size) = ((low + high) * 0.5, (high - low).max(window_size * SMALLEST_PART));
        let half = size * (0.5 + BORDER);
        let (low, high) = ((middle - half).max(window_low), (middle + half).min(window_high));
        let part = high - low;
        let is_small = part.element_product() < LARGEST_PART * window_size.element_product();
        if !(is_small && part.cmpgt(DVec2::ZERO).all()) {
            return self;
        }
        let raster = self.raster.part([low, high], pixels[0], pixels[1]);
        let known_low = DVec2::select(low.cmpgt(window_low), DVec2::ZERO, DVec2::NEG_INFINITY);
        let known_high = DVec2::select(high.cmplt(window_high), DVec2::from(pixels), DVec2::INFINITY);
        Self { known: [known_low, known_high], ..Self::new(window, &raster, usual_m) }
    }

    /// Whether a range of pixels, from the lowest to the highest, lies where the picture decides.
    #[inline(always)]
    pub(super) fn shows(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        let [known_low, known_high] = self.known;
        DVec2::from(low).cmpge(known_low).all() && DVec2::from(high).cmple(known_high).all()
    }

    /// The picture of a point, and its reciprocal depth.
    #[inline(always)]
    pub(super) fn project(&self, eye: DVec3) -> ([i32; 2], f64) {
        let nearness = 1.0 / eye.z;
        let size = eye.x.abs() + eye.y.abs();
        if !(eye.z >= self.near && size * nearness <= self.most_tangent) {
            return ([0; 2], 0.0);
        }
        let px = self.raster.flat_in_pixels(eye.x / eye.z, eye.y / eye.z) * STEPS;
        ([px.x, px.y].map(rounded), nearness)
    }
}

/// Rounds to the nearest whole number. `v` lies between -2^30 and 2^30.
#[inline(always)]
fn rounded(v: f64) -> i32 {
    // Below 0, a cast rounds up.
    const POSITIVE: i64 = 1 << 30;
    ((v + (POSITIVE as f64 + 0.5)) as i64 - POSITIVE) as i32
}
