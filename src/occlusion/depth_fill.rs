//! Filling convex outlines into the tiles of a [`super::DepthBuffer`]: eight rows of pixels, and eight blocks of a tile, are
//! computed at once, as plain loops over arrays that the compiler turns into the vector instructions of the machine.

use std::ops::Range;

use super::{
    Coverage, MAX_SIDES, ShadowVolume,
    depth::{BLOCK, DEPTH_SLACK, LANES, TILE_WIDTH, Tile, block_masks, row_mask},
    raster::Raster,
};
use crate::index::simd::{Kernel, WithKernel};

/// How far before a side plane a pixel has to lie, as a sine. The planes' own error is below 1e-9: 2e-16 over
/// [`super::END_ON_SINE`], and some twenty roundings of terms no larger than the direction's length on the way to pixels.
const SIDE_SLACK: f64 = 1.0e-8;

/// Rows of pixels whose intervals are computed at once: two rows of blocks.
const STRIP: usize = 8;

/// A side plane that changes less than this from pixel to pixel along a row is the same for the whole row: over all rows that
/// is far below [`SIDE_SLACK`].
const LEAST_SLOPE: f64 = 1.0e-30;

/// Outlines, in this order, into the tiles of a buffer.
pub(super) struct Fill<'a> {
    pub(super) raster: &'a Raster,
    pub(super) coverage: Coverage,
    /// In pixels, multiples of a tile.
    pub(super) width: i32,
    pub(super) height: i32,
    pub(super) tiles: &'a mut [Tile],
    pub(super) outlines: &'a [ShadowVolume],
    pub(super) order: &'a [(f64, u32)],
}

impl WithKernel for Fill<'_> {
    /// Tiles touched.
    type Output = u32;

    #[inline(always)]
    fn run<K: Kernel>(mut self, _: K) -> u32 {
        let mut touched = 0;
        for k in 0..self.order.len() {
            let filling = self.set_up(&self.outlines[self.order[k].1 as usize]);
            touched += self.fill(&filling);
        }
        touched
    }
}

/// A polygon set up for filling.
struct Filling {
    /// `a x + b y + c >= 0` inside: the side planes, by pixels.
    edges: [[f64; 3]; MAX_SIDES],
    len: usize,
    /// Reciprocal depth `w[0] + w[1] x + w[2] y`.
    depth: [f64; 3],
    /// The farthest of the polygon itself.
    farthest: f64,
    rows: Range<i32>,
}

impl Fill<'_> {
    #[inline(always)]
    fn set_up(&self, occluder: &ShadowVolume) -> Filling {
        let raster = self.raster;
        // The side planes themselves, not lines between projected corners: those are badly known where a corner lies
        // near the eye's plane.
        let mut edges = [[0.0; 3]; MAX_SIDES];
        for (edge, side) in edges.iter_mut().zip(occluder.sides()) {
            *edge = raster.in_pixels(*side);
        }
        let (mut farthest, mut low, mut high) = (f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY);
        for corner in occluder.corners() {
            farthest = farthest.min(1.0 / raster.forward.dot(*corner));
            let y = raster.project(*corner).y;
            (low, high) = (low.min(y), high.max(y));
        }
        // On the cap plane n.p = d, p = z (forward + X right + Y up): 1/z is linear in X and Y, and so in pixels.
        let [by_x, by_y, at_corner] =
            raster.in_pixels(occluder.cap_normal()).map(|v| v / occluder.cap_distance_m());
        // `as` saturates, so an outline far outside the window gives an empty or a whole range.
        let rows = (low.floor() as i32).max(0)..(high.ceil() as i32).min(self.height);
        Filling { edges, len: occluder.sides().len(), depth: [at_corner, by_x, by_y], farthest, rows }
    }

    /// The covered pixels of the rows from this one on: from, to.
    #[inline(always)]
    fn intervals(&self, filling: &Filling, first_row: i32) -> ([i32; STRIP], [i32; STRIP]) {
        let width = f64::from(self.width);
        let (mut from, mut to) = ([0.0_f64; STRIP], [width; STRIP]);
        // [`SIDE_SLACK`] for the longest direction to a pixel, the eye's distance from the pixels being 1.
        let slack = SIDE_SLACK * (1.0 + 1.5 * self.raster.largest_tangent());
        for [a, b, c] in &filling.edges[..filling.len] {
            // The worst point of the pixels' height, and of their width.
            let (c, left, right) = match self.coverage {
                Coverage::WholePixels => (c + b.min(0.0) - slack, 0.0, 1.0),
                Coverage::PixelCenters => (c + b * 0.5, 0.5, 0.5),
            };
            let rest: [f64; STRIP] = std::array::from_fn(|k| c + b * f64::from(first_row + k as i32));
            if a.abs() < LEAST_SLOPE {
                for k in 0..STRIP {
                    to[k] = if rest[k] < 0.0 { 0.0 } else { to[k] };
                }
                continue;
            }
            let by = -1.0 / a;
            if *a > 0.0 {
                for k in 0..STRIP {
                    from[k] = from[k].max(rest[k] * by - left);
                }
            } else {
                for k in 0..STRIP {
                    to[k] = to[k].min(rest[k] * by - right + 1.0);
                }
            }
        }
        let first = std::array::from_fn(|k| from[k].ceil().min(width) as i32);
        let end = std::array::from_fn(|k| {
            let is_in = filling.rows.contains(&(first_row + k as i32));
            if is_in { to[k].floor().max(0.0) as i32 } else { 0 }
        });
        (first, end)
    }

    /// Fills a polygon into the buffer. Returns the tiles touched.
    #[inline(always)]
    fn fill(&mut self, filling: &Filling) -> u32 {
        let mut touched = 0;
        let across = self.width / TILE_WIDTH;
        let mut row = filling.rows.start / BLOCK[1] * BLOCK[1];
        while row < filling.rows.end {
            let (from, to) = self.intervals(filling, row);
            for half in [0, 1] {
                let y = row + half as i32 * BLOCK[1];
                let rows: [usize; 4] = std::array::from_fn(|k| half * 4 + k);
                let (mut first, mut last) = (i32::MAX, 0);
                for k in rows {
                    let (at, end) = (from[k], to[k]);
                    first = first.min(if at < end { at / TILE_WIDTH } else { i32::MAX });
                    last = last.max(if at < end { (end + TILE_WIDTH - 1) / TILE_WIDTH } else { 0 });
                }
                for tile_column in first.min(last)..last {
                    let x = tile_column * TILE_WIDTH;
                    let masks = block_masks(rows.map(|k| row_mask(from[k] - x, to[k] - x)));
                    let depths = filling.depths(x, y);
                    self.tiles[(y / BLOCK[1] * across + tile_column) as usize].add(&masks, &depths);
                    touched += 1;
                }
            }
            row += STRIP as i32;
        }
        touched
    }
}

impl Filling {
    /// The farthest reciprocal depth of the polygon's plane within each block of a tile, rounded away from the eye.
    #[inline(always)]
    fn depths(&self, x: i32, y: i32) -> [f32; LANES] {
        let [base, by_x, by_y] = self.depth;
        let corner = |at: i32, size: i32, by: f64| by * f64::from(if by < 0.0 { at + size } else { at });
        let first = base + corner(x, BLOCK[0], by_x) + corner(y, BLOCK[1], by_y);
        // Terms may cancel: the slack is that of the largest.
        let slack = DEPTH_SLACK * (base.abs() + (by_x * f64::from(x)).abs() + (by_y * f64::from(y)).abs());
        let farthest = self.farthest * (1.0 - DEPTH_SLACK);
        std::array::from_fn(|i| {
            let depth = first + by_x * f64::from(BLOCK[0] * i as i32) - slack;
            depth.max(farthest) as f32
        })
    }
}
