//! Tests boxes and polygons against the picture.

use glam::DVec3;

use super::{
    facet::Facet,
    facets::Facets,
    fill::{Fill, is_hidden},
    picture::Picture,
    slope::SIDE,
    surfaces::{SIDES, Surfaces},
    table::NONE,
    tiles::Tiles,
};
use crate::{
    index::simd::{Backend, Kernel, WithKernel},
    math::{Aabb, Sphere},
    occlusion::{
        BuildCounts, Cell, Needed, OcclusionCuller, ShadowVolume, Tested, TestedBoxes, Verdict,
        raster::Raster,
    },
    polygon::{BLOCK, ConvexPolygon, Geometry, PolygonId},
    view::ViewWindow,
};

/// Number of boxes that are tested at once.
const LANES: usize = 16;

/// Bound of the relative error of a box's or corner's depth from rounding. Leaving it out hides nothing more: the facets'
/// slack exceeds their own errors by more than this one rounding.
const DEPTH_SLACK: f64 = 1.0e-6;

/// Least distance of a box in front of the eye's plane, relative to the box's size, at which the test is exact enough: the
/// distances of its corners then err by less than a hundredth in `f32`.
const NEAREST_SINE: f64 = 1.0e-4;

/// A picture of the surfaces in front of the eye: the pixels that they cover wholly, and their largest distance.
#[derive(Clone, Debug)]
pub struct CoverageBuffer {
    mean_distance_m: f64,
    facets: Facets,
    tiles: Tiles,
    backend: Backend,
}

impl CoverageBuffer {
    /// An empty buffer of this many pixels, rounded up to multiples of 8; at most 8,192 each way. Allocates its memory
    /// now.
    pub fn new(width: u32, height: u32) -> Self {
        let tiles = |pixels: u32| (pixels.clamp(1, 8192) as usize).div_ceil(SIDE);
        Self {
            mean_distance_m: 0.0,
            facets: Facets::default(),
            tiles: Tiles::new(tiles(width), tiles(height)),
            backend: Backend::detect(),
        }
    }

    #[cfg(test)]
    pub(super) fn set_backend(&mut self, backend: Backend) {
        self.backend = backend;
    }

    #[cfg(test)]
    pub(super) fn parts(&self) -> Option<(&Raster, &Picture, &Tiles)> {
        let picture = self.facets.picture()?;
        Some((&picture.raster, picture, &self.tiles))
    }

    #[cfg(test)]
    pub(super) fn facets(&self) -> usize {
        self.facets.with_area()
    }

    /// Makes room for surfaces of this many polygons, and for `filled` polygons in a frame.
    pub(in crate::occlusion) fn reserve(&mut self, polygons: usize, filled: usize) {
        self.facets.reserve(polygons, filled);
        self.tiles.reserve(2 * filled);
    }

    /// Empties the picture, and returns the raster of the whole window.
    fn begin(&mut self, window: &ViewWindow) -> Raster {
        self.tiles.clear();
        let [width, height] = self.pixels();
        Raster::new(window, width, height)
    }

    fn pixels(&self) -> [f64; 2] {
        [self.tiles.columns, self.tiles.rows].map(|tiles| (tiles * SIDE) as f64)
    }

    fn fill(&mut self) -> BuildCounts {
        self.backend.run(Fill { facets: self.facets.all(), tiles: &mut self.tiles });
        let (occluders, nodes) = (self.facets.drawn() as u32, self.tiles.covered() as u32);
        BuildCounts { occluders, nodes, ..BuildCounts::default() }
    }

    /// Draws a new picture of these polygons.
    pub(in crate::occlusion) fn build_of(
        &mut self,
        window: &ViewWindow,
        surfaces: &Surfaces,
        polygons: impl Iterator<Item = PolygonId>,
    ) -> BuildCounts {
        let raster = self.begin(window);
        self.mean_distance_m = self.facets.take(surfaces, polygons, &raster);
        let whole = Picture::new(window, &raster, self.mean_distance_m);
        let picture = match self.facets.tangents(whole.near) {
            Some(tangents) => whole.zoomed(window, self.mean_distance_m, tangents, self.pixels()),
            None => whole,
        };
        self.facets.project(surfaces, picture);
        self.fill()
    }

    /// Mean distance of the last build's corners from the eye, metres. A distance is the sum of the absolute
    /// coordinates along the axes of the view.
    pub(in crate::occlusion) fn mean_distance_m(&self) -> f64 {
        self.mean_distance_m
    }

    /// The polygons of the last build, each with a flag that is true if the polygon hides anything.
    pub(in crate::occlusion) fn filled(&self) -> impl Iterator<Item = (PolygonId, bool)> + '_ {
        self.facets.taken().iter().enumerate().map(|(i, facet)| {
            let half = facet.half as usize;
            let is_useful = self.tiles.is_useful(i) || (facet.half != NONE && self.tiles.is_useful(half));
            (PolygonId(facet.polygon), is_useful)
        })
    }

    /// Tests the first `count` boxes. Calls `each` with the position and the result of each box.
    #[inline(always)]
    fn test_seen<K: Kernel>(
        &self,
        kernel: K,
        seen: &SeenBoxes,
        count: usize,
        picture: &Picture,
        needed: Needed,
        mut each: impl FnMut(usize, Tested),
    ) {
        let [width, height] = self.pixels().map(|pixels| pixels as f32);
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
                && !self.tiles.hides_pixel([x, y].map(|[from, end]| (from + end) as usize / 2), near)
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
            let (is_hidden, may_hide, steps) = self.tiles.test(kernel, x, y, near, far, needed);
            let found = match (is_hidden, may_hide) {
                (true, _) => Verdict::Hidden,
                (false, true) => Verdict::PartlyHidden,
                (false, false) => Verdict::Unoccluded,
            };
            each(lane, verdict(found, steps));
        }
    }

    /// Whether all pixels that a polygon touches are covered in front of its nearest depth. The test finds nearly every
    /// polygon hidden whose box it finds hidden.
    pub fn hides_polygon(&self, polygon: &ConvexPolygon) -> bool {
        let Some(picture) = self.facets.picture() else { return false };
        self.backend.run(TestPolygon { tiles: &self.tiles, picture, polygon })
    }

    /// The polygons of a block that [`CoverageBuffer::hides_polygon`] finds hidden. The corners in the surfaces are projected
    /// once in a frame.
    pub(in crate::occlusion) fn hidden_of_block(
        &mut self,
        surfaces: &Surfaces,
        geometry: &dyn Geometry,
        block: usize,
        [tested, whole]: [u16; 2],
    ) -> u16 {
        let Self { facets, tiles, backend, .. } = self;
        let Some(picture) = facets.picture().copied() else { return 0 };
        backend.run(TestBlock { facets, tiles, picture: &picture, surfaces, geometry, block, tested, whole })
    }

    fn test_all(&self, boxes: &[Aabb], needed: Needed, each: impl FnMut(usize, Tested)) {
        let Some(picture) = self.facets.picture() else { return };
        self.backend.run(TestBoxes { buffer: self, picture, boxes, needed, each });
    }
}

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

/// Tests at most sixteen boxes.
struct TestBoxes<'a, F> {
    buffer: &'a CoverageBuffer,
    picture: &'a Picture,
    boxes: &'a [Aabb],
    needed: Needed,
    each: F,
}

impl<F: FnMut(usize, Tested)> WithKernel for TestBoxes<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) {
        let seen = SeenBoxes::new(self.boxes, &self.picture.raster);
        let count = self.boxes.len().min(LANES);
        self.buffer.test_seen(kernel, &seen, count, self.picture, self.needed, self.each);
    }
}

/// Tests one polygon.
struct TestPolygon<'a> {
    tiles: &'a Tiles,
    picture: &'a Picture,
    polygon: &'a ConvexPolygon,
}

impl WithKernel for TestPolygon<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> bool {
        let Self { tiles, picture, polygon } = self;
        let raster = &picture.raster;
        let mut corners = TestedCorners::NONE;
        for p in polygon.vertices() {
            let eye = raster.in_axes(p.as_dvec3() - raster.eye_in_world);
            if !corners.push(eye, picture.project(eye), tiles) {
                return false;
            }
        }
        corners.are_hidden(kernel, tiles, picture)
    }
}

/// Tests polygons of one block.
struct TestBlock<'a> {
    facets: &'a mut Facets,
    tiles: &'a Tiles,
    picture: &'a Picture,
    surfaces: &'a Surfaces,
    geometry: &'a dyn Geometry,
    block: usize,
    tested: u16,
    /// The polygons whose corners the surfaces contain.
    whole: u16,
}

impl WithKernel for TestBlock<'_> {
    type Output = u16;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> u16 {
        let Self { facets, tiles, picture, surfaces, geometry, block, tested, whole } = self;
        let (mut hidden, mut left) = (0, tested);
        while left != 0 {
            let bit = left & left.wrapping_neg();
            left ^= bit;
            let id = PolygonId((block * BLOCK) as u32 + bit.trailing_zeros());
            let corners_of = if whole & bit != 0 { surfaces.corners_of(id) } else { &[] };
            let is_hidden = if corners_of.is_empty() {
                match geometry.polygon(id) {
                    Some(polygon) => TestPolygon { tiles, picture, polygon: &polygon }.run(kernel),
                    None => false,
                }
            } else {
                let mut corners = TestedCorners::NONE;
                let may_be = corners_of.iter().all(|&corner| {
                    let (eye, seen) = facets.see(surfaces, corner, picture);
                    corners.push(eye, seen, tiles)
                });
                may_be && corners.are_hidden(kernel, tiles, picture)
            };
            hidden |= if is_hidden { bit } else { 0 };
        }
        hidden
    }
}

/// The corners of a tested polygon.
struct TestedCorners {
    eyes: [DVec3; SIDES],
    seen: [([i32; 2], f64); SIDES],
    len: usize,
}

impl TestedCorners {
    const NONE: Self = Self { eyes: [DVec3::ZERO; SIDES], seen: [([0; 2], 0.0); SIDES], len: 0 };

    /// Adds a corner. Returns `false` if the polygon is visible there. Most tested polygons are visible, and most of
    /// these have a visible corner.
    #[inline(always)]
    fn push(&mut self, eye: DVec3, seen: ([i32; 2], f64), tiles: &Tiles) -> bool {
        (self.eyes[self.len], self.seen[self.len]) = (eye, seen);
        self.len += 1;
        seen.1 != 0.0 && tiles.may_hide_corner(seen.0, seen.1)
    }

    #[inline(always)]
    fn are_hidden<K: Kernel>(&self, kernel: K, tiles: &Tiles, picture: &Picture) -> bool {
        let seen = &self.seen[..self.len];
        let (mut low, mut high, mut nearest) = ([i32::MAX; 2], [i32::MIN; 2], 0.0_f64);
        for &(at, nearness) in seen {
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
            nearest = nearest.max(nearness);
        }
        let ends = [0, 1].map(|axis| [low[axis], high[axis]]);
        if !picture.shows_corners(ends) {
            return false;
        }
        // Most hidden polygons lie behind a rectangle that hides their nearest corner.
        let near = (nearest * (1.0 + DEPTH_SLACK)) as f32;
        if tiles.hides_between(kernel, ends, near) {
            return true;
        }
        match Facet::of_tested(&self.eyes[..self.len], seen, picture) {
            Some(facet) => is_hidden(kernel, &facet, tiles),
            None => false,
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

impl OcclusionCuller for CoverageBuffer {
    fn name(&self) -> &'static str {
        "depth"
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        let raster = self.begin(window);
        self.facets.take_shadows(occluders, window, &raster);
        self.fill()
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        let mut tested = Tested { verdict: Verdict::Unoccluded, steps: 0 };
        self.test_all(&[*bounds], Needed::Verdict, |_, found| tested = found);
        tested
    }

    fn test_boxes(&self, boxes: &[Aabb], _: Cell, needed: Needed) -> TestedBoxes {
        let mut all = TestedBoxes::default();
        self.test_all(boxes, needed, |lane, Tested { verdict, steps }| {
            all.hidden |= u16::from(verdict == Verdict::Hidden) << lane;
            all.unoccluded |= u16::from(verdict == Verdict::Unoccluded) << lane;
            all.steps += steps;
            all.planes += steps;
        });
        all
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        // A little larger, for the rounding of the cube's corners.
        let rounding = f32::EPSILON * sphere.center.abs().max_element();
        self.test_box(&Aabb::cube(
            sphere.center,
            2.0 * (sphere.radius_m.abs() * (1.0 + f32::EPSILON) + rounding),
        ))
    }
}
