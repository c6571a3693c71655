//! Tests boxes against an image.

use super::{image::Image, picture::Picture, slope::SIDE};
use crate::{
    index::simd::{Kernel, WithKernel},
    math::Aabb,
    occlusion::{Needed, Tested, Verdict, raster::Raster},
};

/// Number of boxes that are tested at once.
const LANES: usize = 16;

/// Bound of the relative error of a box's or corner's depth from rounding. Leaving it out hides nothing more: the facets'
/// slack exceeds their own errors by more than this one rounding.
pub(super) const DEPTH_SLACK: f64 = 1.0e-6;

/// Least distance of a box in front of the eye's plane, relative to the box's size, at which the test is exact enough: the
/// distances of its corners then err by less than a hundredth in `f32`.
const NEAREST_SINE: f64 = 1.0e-4;

/// Positions of some boxes relative to the eye, by lane.
struct SeenBoxes {
    /// Half of each side.
    half: [[f64; LANES]; 3],
    /// Centre of each box, along the axes of the view.
    middle: [[f64; LANES]; 3],
    /// Distance of the nearest corner along the direction of view.
    near: [f64; LANES],
    far: [f64; LANES],
    /// Bound on the coordinates of each box relative to the eye: the largest absolute x, y and z, added, metres.
    size: [f64; LANES],
}

/// Tests at most sixteen boxes. Calls `each` with the position and the result of each box.
pub(super) struct TestBoxes<'a, F> {
    pub(super) image: &'a Image,
    pub(super) picture: &'a Picture,
    pub(super) boxes: &'a [Aabb],
    pub(super) needed: Needed,
    pub(super) each: F,
}

impl<F: FnMut(usize, Tested)> WithKernel for TestBoxes<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let seen = SeenBoxes::new(self.boxes, &self.picture.raster);
        let count = self.boxes.len().min(LANES);
        self.test_seen(kernel, &seen, count);
    }
}

impl<F: FnMut(usize, Tested)> TestBoxes<'_, F> {
    #[inline(always)]
    fn test_seen<K: Kernel>(self, kernel: K, seen: &SeenBoxes, count: usize) {
        let Self { image, picture, needed, mut each, .. } = self;
        let [width, height] = [image.columns, image.rows].map(|tiles| (tiles * SIDE) as f32);
        let outlines = seen.outlines(&picture.raster);
        let (mut columns, mut rows) = ([[0; LANES]; 2], [[0; LANES]; 2]);
        for (axis, (range, end)) in [(&mut columns, width), (&mut rows, height)].into_iter().enumerate() {
            let [low, high] = &outlines[axis];
            for lane in 0..LANES {
                range[0][lane] = low[lane].clamp(0.0, end) as i32;
                // Rounded down, also below 0.
                range[1][lane] = (high[lane].clamp(-1.0, end - 1.0) + 1.0) as i32;
            }
        }
        for lane in 0..count {
            let verdict = |verdict, steps| Tested { verdict, steps };
            // A box that reaches back to the eye's plane, or is not finite, has no outline. NaN ends here, too.
            if !(seen.near[lane] > NEAREST_SINE * seen.size[lane] && seen.far[lane].is_finite()) {
                each(lane, verdict(Verdict::PartlyHidden, 0));
                continue;
            }
            let near = (1.0 / seen.near[lane] * (1.0 + DEPTH_SLACK)) as f32;
            let (x, y) = (columns.map(|ends| ends[lane]), rows.map(|ends| ends[lane]));
            if x[0] >= x[1] || y[0] >= y[1] {
                each(lane, verdict(Verdict::Unoccluded, 0));
                continue;
            }
            // Most tested polygons are visible, and so are the middles of their boxes.
            if needed == Needed::Hidden
                && !image.hides_pixel([x, y].map(|[from, end]| (from + end) as usize / 2), near)
            {
                each(lane, verdict(Verdict::PartlyHidden, 1));
                continue;
            }
            let [[x0, x1], [y0, y1]] = outlines.map(|ends| ends.map(|end| f64::from(end[lane])));
            if !picture.shows([x0, y0], [x1, y1]) {
                each(lane, verdict(Verdict::PartlyHidden, 0));
                continue;
            }
            let far = (1.0 / seen.far[lane] * (1.0 - DEPTH_SLACK)) as f32;
            let (is_hidden, may_hide, steps) = image.test(kernel, x, y, near, far, needed);
            let found = match (is_hidden, may_hide) {
                (true, _) => Verdict::Hidden,
                (false, true) => Verdict::PartlyHidden,
                (false, false) => Verdict::Unoccluded,
            };
            each(lane, verdict(found, steps));
        }
    }
}

impl SeenBoxes {
    #[inline(always)]
    fn new(boxes: &[Aabb], raster: &Raster) -> Self {
        let mut rows = [[0.0_f32; LANES]; 6];
        for (lane, bounds) in boxes.iter().take(LANES).enumerate() {
            let numbers = [bounds.min.to_array(), bounds.max.to_array()];
            for (row, number) in rows.iter_mut().zip(numbers.as_flattened()) {
                row[lane] = *number;
            }
        }
        let mut center = [[0.0_f64; LANES]; 3];
        let mut seen = Self {
            half: [[0.0; LANES]; 3],
            middle: [[0.0; LANES]; 3],
            near: [0.0; LANES],
            far: [0.0; LANES],
            size: [0.0; LANES],
        };
        for axis in 0..3 {
            let eye = raster.eye_in_world[axis];
            for lane in 0..LANES {
                let (low, high) = (f64::from(rows[axis][lane]) - eye, f64::from(rows[axis + 3][lane]) - eye);
                center[axis][lane] = (low + high) * 0.5;
                seen.half[axis][lane] = ((high - low) * 0.5).abs();
                seen.size[lane] += center[axis][lane].abs() + seen.half[axis][lane];
            }
        }
        let axes = raster.axes();
        for (middle, axis) in seen.middle.iter_mut().zip(axes) {
            for (lane, middle) in middle.iter_mut().enumerate() {
                *middle = axis.x * center[0][lane] + axis.y * center[1][lane] + axis.z * center[2][lane];
            }
        }
        let forward = raster.forward.abs();
        for lane in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|axis| seen.half[axis][lane]);
            let reach = forward.x * x + forward.y * y + forward.z * z;
            seen.near[lane] = seen.middle[2][lane] - reach;
            seen.far[lane] = seen.middle[2][lane] + reach;
        }
        seen
    }

    /// Ranges of the pixel coordinates of the boxes' corners, across and up: the lowest coordinates and the highest
    /// ones, widened by the rounding error. Only for boxes in front of the eye.
    ///
    /// With `u = 2^-24`, the size `s` and the nearest distance `z` of a box, `r = s / z`, and `m` pixels a unit: a
    /// corner's coordinate relative to the eye errs by at most `5 u s`, and so does its distance. So their ratio errs
    /// by less than `6 u r (1 + r)`. The conversion to the pixel `x` adds `2 u m r + 3 u (x + m r)`, as the origin lies
    /// within `m r` of `x`. The sum is less than `16 u m (1 + r)^2 + 3 u x`. The outline is not widened by `3 u x`: it is
    /// below 0.0015 pixels, which [`MARGIN`](super::picture::MARGIN) has to spare, and below the part of the facets' slack
    /// that grows with `x`.
    #[inline(always)]
    fn outlines(&self, raster: &Raster) -> [[[f32; LANES]; 2]; 2] {
        const U: f32 = 0.5 * f32::EPSILON;
        let pixels = raster.pixels_a_unit().as_vec2();
        let origin = raster.flat_in_pixels(0.0, 0.0).as_vec2();
        let axes = raster.axes().map(|axis| axis.as_vec3().to_array());
        let mut half = [[0.0_f32; LANES]; 3];
        let mut middle = [[0.0_f32; LANES]; 3];
        for axis in 0..3 {
            for lane in 0..LANES {
                half[axis][lane] = self.half[axis][lane] as f32;
                middle[axis][lane] = self.middle[axis][lane] as f32;
            }
        }
        let (mut low, mut high) = ([[f32::INFINITY; LANES]; 2], [[f32::NEG_INFINITY; LANES]; 2]);
        for corner in 0..8 {
            let sign = [0, 1, 2].map(|axis| if corner >> axis & 1 == 1 { 1.0_f32 } else { -1.0 });
            let [a, b, c] = axes.map(|axis| [axis[0] * sign[0], axis[1] * sign[1], axis[2] * sign[2]]);
            for lane in 0..LANES {
                let [x, y, z] = [half[0][lane], half[1][lane], half[2][lane]];
                let right = middle[0][lane] + (a[0] * x + a[1] * y + a[2] * z);
                let up = middle[1][lane] + (b[0] * x + b[1] * y + b[2] * z);
                let nearness = 1.0 / (middle[2][lane] + (c[0] * x + c[1] * y + c[2] * z));
                let (right, up) = (right * nearness, up * nearness);
                low[0][lane] = if right < low[0][lane] { right } else { low[0][lane] };
                low[1][lane] = if up < low[1][lane] { up } else { low[1][lane] };
                high[0][lane] = if right > high[0][lane] { right } else { high[0][lane] };
                high[1][lane] = if up > high[1][lane] { up } else { high[1][lane] };
            }
        }
        let most = pixels.max_element();
        for lane in 0..LANES {
            let ratio = 1.0 + (self.size[lane] / self.near[lane]) as f32;
            let slack = 16.0 * U * most * (ratio * ratio);
            for axis in 0..2 {
                low[axis][lane] = low[axis][lane] * pixels[axis] + origin[axis] - slack;
                high[axis][lane] = high[axis][lane] * pixels[axis] + origin[axis] + slack;
            }
        }
        [[low[0], high[0]], [low[1], high[1]]]
    }
}
