//! A software depth buffer with masked layers.
//!
//! J. Hasselgren, M. Andersson, T. Akenine-Möller, "Masked Software Occlusion Culling", 2016.
//!
//! Coordinates: a pixel is a square of the plane at distance 1 from the eye, x to the right, y up. Depth is the
//! reciprocal of the distance along the direction of view: larger is nearer, and 0 is infinitely far.
//!
//! # Differences from the paper
//! * Occluders are few convex polygons, not meshes. In a row of pixels, a polygon covers an interval. Eight intervals are
//!   computed at once, and eight blocks of 8 x 4 pixels are updated at once.
//! * [`Coverage::WholePixels`] counts a pixel only if the polygon covers all of its square. The buffer keeps the farthest
//!   depth within a block, and rounds every number towards "visible". So it is conservative without a tolerance: each ray
//!   through a covered square is blocked. The price is a row of uncovered pixels along each edge that two polygons share.
//! * [`Coverage::PixelCenters`] is the paper's rule: a polygon covers a pixel if it covers the pixel's centre. So a visible
//!   part narrower than half a pixel may be reported as hidden.

use glam::{DVec2, DVec3};

use super::{
    BuildCounts, OcclusionCuller, ShadowVolume, Tested, Verdict, cone,
    depth_fill::{Coverage, Fill},
    depth_tile::{BLOCK, DEPTH_SLACK, TILE_WIDTH, Tile, block_masks, row_mask},
    raster::Raster,
    tree::{EyeBox, EyeSphere, Volume},
};
use crate::{
    index::simd::Backend,
    math::{Aabb, Sphere},
    view::ViewWindow,
};

/// Largest error of pixel coordinates from rounding, pixels, for volumes that [`nearest_sine`] admits.
const PIXEL_SLACK: f64 = 1.0e-6;
/// Largest tangent of the angle between the direction of view and the border of the window for which pixels are exact
/// enough. The relative error of depth is `4 u` times the tangent over [`super::EDGE_ON_SINE`], and has to stay below
/// [`DEPTH_SLACK`].
const LARGEST_TANGENT: f64 = 1.0e4;

/// Least distance of a volume in front of the eye's plane, as a fraction of the volume's size. The eye's plane passes
/// through the eye, parallel to the picture. The size is the sum of the centre's coordinates, relative to the eye, and
/// of the half sides. Nearer volumes are not projected, so they count as partly hidden.
///
/// # Why pixels are then exact to [`PIXEL_SLACK`]
/// Let `u = 2^-53`, and let `s` be the size of a volume. Let `p` be its corner at distance `z` in front of the eye's plane,
/// and `t` the largest tangent in the window.
/// * Each coordinate of `p` is a sum of at most four rounded terms, none larger than `s`. So its error is at most `4 u
///   s`.
/// * So the errors of `z = forward . p`, `right . p` and `up . p` are below `8 u s`: `4 u s` from `p`, and `3 u s` from
///   the three products and their sum.
/// * A quotient such as `up . p / z` of at most `t` then has an error of at most `(8 + 8 t + t) u s / z`. A point with
///   a larger quotient is outside the window, and the error does not move it into the window.
/// * The three directions are orthonormal only up to `4 u`. This changes a quotient by at most `4 u (1 + t) (1 + t + s
///   / z)`, because no part of the volume has a tangent above `s / z`. If the volume reaches the tangent `t`, `1 + t`
///   is at most `2 s / z`. So the change is at most `12 u (1 + t) s / z`.
/// * The conversion of quotients to pixels rounds three times more, which adds `6 u t`.
///
/// The sum of these errors is less than `32 (1 + t) u s / z` times the number of pixels of one unit. `s / z` is at most
/// the reciprocal of the returned value, so the sum is at most [`PIXEL_SLACK`]. Without this bound, the slack of the
/// queries permits `s / z` up to 1e9. A box was then reported as hidden although its lower edge was visible by 1e-5
/// pixels. This is the test `a_box_that_reaches_the_eyes_plane_is_not_hidden_by_rounding`.
fn nearest_sine(raster: &Raster) -> f64 {
    const U: f64 = 0.5 * f64::EPSILON;
    let tangent = raster.largest_tangent();
    let pixels = 32.0 * (1.0 + tangent) * U * raster.pixels_a_unit().max_element();
    if tangent <= LARGEST_TANGENT { (pixels / PIXEL_SLACK).max(1.0e-6) } else { f64::INFINITY }
}

/// Settings of [`DepthBuffer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthConfig {
    /// Pixels across; rounded up to a multiple of 64.
    pub width: u32,
    /// Pixels down; rounded up to a multiple of 4.
    pub height: u32,
}

impl Default for DepthConfig {
    /// 1024 x 576 pixels.
    fn default() -> Self {
        Self { width: 1024, height: 576 }
    }
}

/// A software depth buffer with masked layers (Hasselgren, Andersson, Akenine-Möller, "Masked Software Occlusion Culling",
/// 2016), filled with the occluders.
#[derive(Clone, Debug)]
pub struct DepthBuffer {
    coverage: Coverage,
    /// Size in pixels, multiples of a tile.
    width: i32,
    height: i32,
    raster: Option<Raster>,
    /// See [`nearest_sine`].
    nearest_sine: f64,
    tiles: Vec<Tile>,
    order: Vec<(f64, u32)>,
    backend: Backend,
}

/// Position of a volume in the picture, and its distances.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// The lower left corner of the volume's rectangle, pixels.
    low: DVec2,
    high: DVec2,
    /// Smallest distance along the direction of view, metres.
    near: f64,
    far: f64,
}

impl Extent {
    const NOTHING: Self =
        Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, near: f64::INFINITY, far: 0.0 };

    #[inline]
    fn add(&mut self, at: DVec2) {
        self.low = self.low.min(at);
        self.high = self.high.max(at);
    }
}

impl DepthBuffer {
    /// An empty buffer; allocates its memory now.
    pub fn new(config: DepthConfig) -> Self {
        Self::with_coverage(config, Coverage::WholePixels)
    }

    /// An empty buffer with this definition of covered pixels. It is conservative only for [`Coverage::WholePixels`].
    #[doc(hidden)]
    pub fn with_coverage(config: DepthConfig, coverage: Coverage) -> Self {
        let up = |n: u32, step: i32| n.clamp(1, 8192).next_multiple_of(step as u32) as i32;
        let (width, height) = (up(config.width, TILE_WIDTH), up(config.height, BLOCK[1]));
        let count = (width / TILE_WIDTH * (height / BLOCK[1])) as usize;
        Self {
            coverage,
            width,
            height,
            raster: None,
            nearest_sine: f64::INFINITY,
            tiles: vec![Tile::EMPTY; count],
            order: Vec::new(),
            backend: Backend::detect(),
        }
    }

    fn test<V: Volume>(&self, volume: &V, corners: &[DVec3; 8]) -> Tested {
        let Some(raster) = &self.raster else { return Tested { verdict: Verdict::Unoccluded, steps: 0 } };
        let (near, far) = volume.reach(raster.forward);
        // The corners may be nearer than the volume: the corners of a sphere are those of its box.
        let (nearest_corner, _) = cone::reach(raster.forward, corners);
        // A volume that reaches the eye's plane has no outline, and neither has a volume with a corner that is NaN.
        if !(nearest_corner.min(near) > self.nearest_sine * volume.size() && far.is_finite()) {
            return Tested { verdict: Verdict::PartlyHidden, steps: 0 };
        }
        let mut extent = Extent { near, far, ..Extent::NOTHING };
        corners.iter().for_each(|corner| extent.add(raster.project(*corner)));
        self.test_outline_of(&extent)
    }

    /// Tests an object that covers a rectangle of pixels, between two distances along the direction of view.
    fn test_outline_of(&self, extent: &Extent) -> Tested {
        let mixed = Tested { verdict: Verdict::PartlyHidden, steps: 0 };
        let Extent { low, high, near, far, .. } = *extent;
        if !(low.is_finite() && high.is_finite()) {
            return mixed;
        }
        let floor = |v: f64, end: i32| ((v - PIXEL_SLACK).floor().max(0.0) as i32).min(end);
        let ceil = |v: f64, end: i32| ((v + PIXEL_SLACK).ceil().min(f64::from(end)) as i32).max(0);
        let (x0, x1) = (floor(low.x, self.width), ceil(high.x, self.width));
        let (y0, y1) = (floor(low.y, self.height), ceil(high.y, self.height));
        // The nearest and the farthest reciprocal depth, each rounded so that the verdict stays conservative.
        let nearest = (1.0 / near * (1.0 + DEPTH_SLACK)) as f32;
        let farthest = (1.0 / far * (1.0 - DEPTH_SLACK)) as f32;
        self.test_pixels([x0, x1], [y0, y1], nearest, farthest)
    }

    fn test_pixels(&self, x: [i32; 2], y: [i32; 2], nearest: f32, farthest: f32) -> Tested {
        let across = self.width / TILE_WIDTH;
        let (mut steps, mut any_unoccluded, mut any_shadow) = (0, false, false);
        if x[0] >= x[1] || y[0] >= y[1] {
            return Tested { verdict: Verdict::Unoccluded, steps };
        }
        for block_row in y[0] / BLOCK[1]..(y[1] + BLOCK[1] - 1) / BLOCK[1] {
            let mut rows = [0u64; BLOCK[1] as usize];
            for tile_column in x[0] / TILE_WIDTH..(x[1] + TILE_WIDTH - 1) / TILE_WIDTH {
                steps += 1;
                let left = tile_column * TILE_WIDTH;
                for (k, row) in rows.iter_mut().enumerate() {
                    let inside = (y[0]..y[1]).contains(&(block_row * BLOCK[1] + k as i32));
                    *row = if inside { row_mask(x[0] - left, x[1] - left) } else { 0 };
                }
                let wanted = block_masks(rows);
                let tile = &self.tiles[(block_row * across + tile_column) as usize];
                let (lit, shadow) = tile.test(&wanted, nearest, farthest);
                any_unoccluded |= lit;
                any_shadow |= shadow;
                if any_unoccluded && any_shadow {
                    return Tested { verdict: Verdict::PartlyHidden, steps };
                }
            }
        }
        Tested { verdict: if any_unoccluded { Verdict::Unoccluded } else { Verdict::Hidden }, steps }
    }
}

impl OcclusionCuller for DepthBuffer {
    fn name(&self) -> &'static str {
        "depth"
    }

    fn build(&mut self, window: &ViewWindow, occluders: &[ShadowVolume]) -> BuildCounts {
        let raster = Raster::new(window, f64::from(self.width), f64::from(self.height));
        self.raster = Some(raster);
        self.nearest_sine = nearest_sine(&raster);
        self.tiles.fill(Tile::EMPTY);
        // Occluders are filled front to back, so that near layers close before farther occluders come.
        self.order.clear();
        self.order.extend(occluders.iter().enumerate().map(|(i, o)| {
            let nearest = o.corners().iter().map(|v| v.length_squared()).fold(f64::INFINITY, f64::min);
            (nearest, i as u32)
        }));
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let touched = self.backend.run(Fill {
            raster: &raster,
            coverage: self.coverage,
            width: self.width,
            height: self.height,
            tiles: &mut self.tiles,
            outlines: occluders,
            order: &self.order,
        });
        let covered = self.tiles.iter().filter(|tile| tile.is_covered()).count();
        BuildCounts {
            occluders: occluders.len() as u32,
            nodes: covered as u32,
            depth: 0,
            pieces: touched,
            left_out: 0,
        }
    }

    fn test_box(&self, bounds: &Aabb) -> Tested {
        let eye = self.raster.map_or(DVec3::ZERO, |r| r.eye_in_world);
        let volume = EyeBox::new(bounds, eye);
        self.test(&volume, &volume.corners())
    }

    fn test_sphere(&self, sphere: &Sphere) -> Tested {
        let eye = self.raster.map_or(DVec3::ZERO, |r| r.eye_in_world);
        let volume = EyeSphere::new(sphere, eye);
        // The sphere's box bounds its outline; the sphere itself bounds its depth.
        self.test(&volume, &volume.bounds().corners())
    }
}

#[cfg(test)]
mod tests {
    use super::{super::depth_tile::LANES, *};

    #[test]
    fn volumes_stay_away_from_the_eyes_plane_by_what_the_proof_says() {
        for (tangent, pixels) in [(1.0, 512.0), (3.0, 4096.0), (0.01, 1024.0)] {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            let corners = corners.map(|(x, y)| DVec3::new(x * tangent, y * tangent, 1.0));
            let window = ViewWindow::new(DVec3::ZERO, DVec3::Z, corners, 0.1).expect("a window");
            let raster = Raster::new(&window, pixels, pixels * 0.5);
            let wanted = 32.0 * (1.0 + tangent) * 1.11e-16 * (pixels / (2.0 * tangent)) / PIXEL_SLACK;
            let found = nearest_sine(&raster);
            assert!((found / wanted.max(1.0e-6) - 1.0).abs() < 0.01, "{found:e} {wanted:e}");
        }
    }

    /// Occluders are sorted by their nearest corners, so the farther layer of a block may be filled first or second.
    #[test]
    fn a_block_that_two_layers_fill_hides_from_the_farther_one_on() {
        let masks = [[0x0F0F_0F0F; LANES], [0xF0F0_F0F0; LANES]];
        for depths in [[0.2, 0.25], [0.25, 0.2]] {
            let mut tile = Tile::EMPTY;
            for (mask, depth) in masks.iter().zip(depths) {
                tile.add(mask, &[depth; LANES]);
            }
            assert!(tile.hides(0.2) && !tile.hides(0.21), "{depths:?}: {tile:?}");
        }
    }
}
