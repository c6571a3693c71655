//! The picture to which corners are projected, and the precision of their positions.

use glam::{DVec2, DVec3};

use super::super::raster::Raster;
use crate::view::ViewWindow;

/// Corners are rounded to this fraction of a pixel.
pub(super) const STEPS: f64 = 64.0;

/// Largest error of a corner's position in the picture, across and up, pixels: half a step, and [`KNOWN`]. It exceeds
/// their sum by more than `f32` errs at an edge, or at a box.
pub(super) const MARGIN: f64 = 1.0 / 64.0;

const _: () = assert!(0.5 / STEPS + KNOWN + 0.003 < MARGIN);

/// Largest error of a corner's position before it is rounded to steps, pixels.
pub(super) const KNOWN: f64 = 0.004;

/// Largest coordinate of a corner in the picture, pixels. So steps fit into `i32`, and products of their differences
/// into `i64`.
const FARTHEST_PX: f64 = (1 << 23) as f64;

/// The picture shows only a part of the window if the part's area is less than this fraction of the window's
/// area.
const LARGEST_PART: f64 = 0.8;

/// Least width and height of the shown part, as a fraction of the window's. In a smaller part more corners would be too
/// imprecise, and [`Picture::project`] would omit them.
const SMALLEST_PART: f64 = 1.0 / 16.0;

/// Width of the border around the occluders, as a fraction of their extent. Without it, fewer objects lie wholly in the
/// picture, and the others count as visible.
const BORDER: f64 = 0.01;

/// The transform to the picture, and the limits of its precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture {
    pub(super) raster: Raster,
    /// Nearest depth that is drawn; positive.
    pub(super) near: f64,
    /// A corner is projected only if its size, the sum of its coordinates across and up, is at most this
    /// multiple of its depth. Farther to the side, the error exceeds [`KNOWN`].
    pub(super) most_tangent: f64,
    /// The lowest and highest pixel coordinates of objects that the picture may report as hidden. Infinite where the
    /// picture ends at the window's border, because nothing beyond is visible.
    known: [DVec2; 2],
}

impl Picture {
    pub(super) fn new(window: &ViewWindow, raster: &Raster, usual_m: f64) -> Self {
        // Let `u = 2^-53`. A corner `p` has the size `s` (the sum of its coordinates from the eye), the depth `z`, and a
        // tangent of at most `r = s / z`.
        // - Each coordinate of `p` is a sum of at most four rounded terms, none larger than `s`: it errs by `4 u s`.
        // - So `z`, `right . p` and `up . p` err by `8 u s`: `4 u s` from `p`, `3 u s` from the products and their sum.
        // - Their quotient errs by `(8 + 9 r) u r`.
        // - The directions are orthonormal only up to `4 u`, which changes a quotient by `4 u (1 + r) (1 + 2 r)`.
        // - The conversion to pixels rounds three times more: `6 u (1 + r)`.
        // The sum is less than `96 (1 + r)^2 u` times the pixels of a unit. For a corner at the near plane the same bound
        // holds, if `s` is the sum of the sizes of its edge's ends.
        const U: f64 = 0.5 * f64::EPSILON;
        let pixels = raster.pixels_a_unit().max_element();
        let known = (KNOWN / (96.0 * U * pixels)).sqrt() - 1.0;
        let most_tangent = known.min(FARTHEST_PX / pixels);
        // A larger distance only cuts off more of the occluders.
        let near = window.near_m() * (1.0 + 1.0e-9);
        let near = if near > 0.0 { near } else { usual_m / most_tangent };
        Self { raster: *raster, near, most_tangent, known: [DVec2::NEG_INFINITY, DVec2::INFINITY] }
    }

    /// The picture of the part of the window between the tangents `low` and `high`, with `pixels` pixels across and
    /// up. `self` must show the whole window; it is returned if the part is large.
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

    /// Whether objects in this range of pixel coordinates may be reported as hidden.
    #[inline(always)]
    pub(super) fn shows(&self, low: [f64; 2], high: [f64; 2]) -> bool {
        let [known_low, known_high] = self.known;
        DVec2::from(low).cmpge(known_low).all() && DVec2::from(high).cmple(known_high).all()
    }

    /// Whether an object with corners in these ranges of coordinates, in steps, may be reported as hidden.
    #[inline(always)]
    pub(super) fn shows_corners(&self, ends: [[i32; 2]; 2]) -> bool {
        let px = |steps: i32| f64::from(steps) * (1.0 / STEPS);
        self.shows(ends.map(|[low, _]| px(low) - MARGIN), ends.map(|[_, high]| px(high) + MARGIN))
    }

    /// Projects a point: its position in steps, and its reciprocal depth. The depth is 0 if the point is too
    /// near or too far to the side.
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

/// Number of bits of a corner's coordinate that are below the pixel.
pub(super) const STEP_BITS: u32 = (STEPS as u32).trailing_zeros();

/// The pixels in a range of coordinates in steps, widened by [`MARGIN`], which is one step. The high end does not need it: an
/// error below one step takes no coordinate up to the next pixel.
#[inline(always)]
pub(super) fn pixels_between([low, high]: [i32; 2]) -> [i32; 2] {
    [(low - 1) >> STEP_BITS, ((high + 1) >> STEP_BITS) + 1]
}

/// Rounds to the nearest whole number. `v` lies between -2^30 and 2^30.
#[inline(always)]
fn rounded(v: f64) -> i32 {
    // Below 0, a cast rounds up.
    const POSITIVE: i64 = 1 << 30;
    ((v + (POSITIVE as f64 + 0.5)) as i64 - POSITIVE) as i32
}
