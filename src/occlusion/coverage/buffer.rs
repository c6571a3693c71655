//! Tests boxes and polygons against the picture.

use glam::DVec3;

use super::{
    boxes::{DEPTH_SLACK, TestBoxes},
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
        self.backend.run(TestBoxes { image: &self.tiles, picture, boxes, needed, each });
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

/// A cube around a sphere, a little larger, for the rounding of its corners.
pub(in crate::occlusion) fn cube_around(sphere: &Sphere) -> Aabb {
    let rounding = f32::EPSILON * sphere.center.abs().max_element();
    Aabb::cube(sphere.center, 2.0 * (sphere.radius_m.abs() * (1.0 + f32::EPSILON) + rounding))
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
        self.test_box(&cube_around(sphere))
    }
}
