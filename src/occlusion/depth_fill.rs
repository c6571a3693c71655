//! Fills convex outlines into the tiles of a [`super::DepthBuffer`]. Eight rows of pixels, and eight blocks of a tile, are
//! computed at once by plain loops over arrays, which the compiler vectorises.

use std::ops::Range;

use super::{
    MAX_SIDES, ShadowVolume,
    depth_tile::{BLOCK, DEPTH_SLACK, LANES, TILE_WIDTH, Tile, block_masks, row_mask},
    raster::Raster,
};
use crate::index::simd::{Kernel, WithKernel};

/// The rule that decides which pixels a polygon covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// Pixels whose whole square lies in the polygon. Conservative.
    WholePixels,
    /// Pixels whose centre lies in the polygon. A visible part narrower than half a pixel may be reported as hidden.
    PixelCenters,
}

/// Least distance of a covered pixel from a side plane, as a sine. The error of the planes is below 1e-9: 2e-16 over
/// [`super::END_ON_SINE`], and some twenty roundings in the conversion to pixels.
const SIDE_SLACK: f64 = 1.0e-8;

/// Number of rows of pixels whose intervals are computed at once: two rows of blocks.
const STRIP: usize = 8;

/// A side plane that changes by less than this from pixel to pixel along a row counts as constant in the row. Over all
/// pixels of the row, the change is far below [`SIDE_SLACK`].
const LEAST_SLOPE: f64 = 1.0e-30;

/// Fills outlines into the tiles of a buffer, in the given order.
pub(super) struct Fill<'a> {
    pub(super) raster: &'a Raster,
    pub(super) coverage: Coverage,
    /// Size in pixels, multiples of a tile.
    pub(super) width: i32,
    pub(super) height: i32,
    pub(super) tiles: &'a mut [Tile],
    pub(super) outlines: &'a [ShadowVolume],
    pub(super) order: &'a [(f64, u32)],
}

impl WithKernel for Fill<'_> {
    /// Number of tiles touched.
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

/// A side plane as a function of pixels, set up for rows. A pixel is inside where `a x + b y + c >= 0`.
#[derive(Clone, Copy, Default)]
struct Edge {
    b: f64,
    /// `c` at the height in a pixel where the function is least, or at the centre; see [`Coverage`].
    c: f64,
    /// `-1 / a`; 0 if the plane is the same for the whole row.
    by: f64,
}

/// A polygon, prepared for filling.
struct Filling {
    edges: [Edge; MAX_SIDES],
    len: usize,
    /// Reciprocal depth `w[0] + w[1] x + w[2] y`.
    depth: [f64; 3],
    /// The farthest reciprocal depth of the polygon itself.
    farthest: f64,
    /// Upper bound of all filled reciprocal depths.
    nearest: f32,
    rows: Range<i32>,
}

impl Fill<'_> {
    #[inline(always)]
    fn set_up(&self, occluder: &ShadowVolume) -> Filling {
        let raster = self.raster;
        // The edges are the side planes, not lines between projected corners, because corners near the eye's plane project
        // imprecisely.
        let mut edges = [Edge::default(); MAX_SIDES];
        // This is [`SIDE_SLACK`] for the longest direction to a pixel; pixels lie at distance 1 from the eye.
        let slack = SIDE_SLACK * (1.0 + 1.5 * raster.largest_tangent());
        for (edge, side) in edges.iter_mut().zip(occluder.sides()) {
            let [a, b, c] = raster.in_pixels(*side);
            let c = match self.coverage {
                Coverage::WholePixels => c + b.min(0.0) - slack,
                Coverage::PixelCenters => c + b * 0.5,
            };
            *edge = Edge { b, c, by: if a.abs() < LEAST_SLOPE { 0.0 } else { -1.0 / a } };
        }
        let (mut near_m, mut far_m) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for corner in occluder.corners() {
            let away_m = raster.forward.dot(*corner);
            (near_m, far_m) = (near_m.min(away_m), far_m.max(away_m));
            let y = raster.project_up(*corner, away_m);
            (low, high) = (low.min(y), high.max(y));
        }
        // If the polygon reaches the eye's plane, only the plane of the polygon bounds its depth.
        let is_in_front = near_m > 0.0;
        let farthest = if is_in_front { 1.0 / far_m } else { f64::NEG_INFINITY };
        // The factor exceeds the rounding errors here and in `depths`.
        let nearest = if is_in_front { (1.0 / near_m * (1.0 + DEPTH_SLACK)) as f32 } else { f32::INFINITY };
        // On the cap plane n.p = d, p = z (forward + X right + Y up): 1/z is linear in X and Y, and so in pixels.
        let [by_x, by_y, at_corner] =
            raster.in_pixels(occluder.cap_normal()).map(|v| v / occluder.cap_distance_m());
        // `as` saturates, so an outline far outside the window has an empty or a full range of rows.
        let rows = (low.floor() as i32).max(0)..(high.ceil() as i32).min(self.height);
        let len = occluder.sides().len();
        Filling { edges, len, depth: [at_corner, by_x, by_y], farthest, nearest, rows }
    }

    /// The covered pixels in the rows from `first_row` on: begin and end of each interval.
    #[inline(always)]
    fn intervals(&self, filling: &Filling, first_row: i32) -> ([i32; STRIP], [i32; STRIP]) {
        let width = f64::from(self.width);
        let (mut from, mut to) = ([0.0_f64; STRIP], [width; STRIP]);
        // The positions across a pixel at which the function of a side plane has to be at least 0.
        let (left, right) = match self.coverage {
            Coverage::WholePixels => (0.0, 1.0),
            Coverage::PixelCenters => (0.5, 0.5),
        };
        for Edge { b, c, by } in &filling.edges[..filling.len] {
            let rest: [f64; STRIP] = std::array::from_fn(|k| c + b * f64::from(first_row + k as i32));
            if *by == 0.0 {
                for k in 0..STRIP {
                    to[k] = if rest[k] < 0.0 { 0.0 } else { to[k] };
                }
                continue;
            }
            if *by < 0.0 {
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

    /// Fills a polygon into the buffer. Returns the number of tiles touched.
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
                    touched += 1;
                    let x = tile_column * TILE_WIDTH;
                    let tile = &mut self.tiles[(y / BLOCK[1] * across + tile_column) as usize];
                    // Because outlines are filled front to back, most of the last tiles lie behind filled ones.
                    if tile.hides(filling.nearest) {
                        continue;
                    }
                    let masks = block_masks(rows.map(|k| row_mask(from[k] - x, to[k] - x)));
                    tile.add(&masks, &filling.depths(x, y));
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
        // Large terms may cancel, so the slack is a part of the largest term.
        let slack = DEPTH_SLACK * (base.abs() + (by_x * f64::from(x)).abs() + (by_y * f64::from(y)).abs());
        let farthest = self.farthest * (1.0 - DEPTH_SLACK);
        std::array::from_fn(|i| {
            let depth = first + by_x * f64::from(BLOCK[0] * i as i32) - slack;
            depth.max(farthest) as f32
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat, Vec3};

    use super::*;
    use crate::{
        index::simd::Backend,
        view::{Projection, View},
    };

    /// Outlines one behind the other; some cross others, and a few are large.
    fn outlines(view: &View) -> Vec<ShadowVolume> {
        let window = view.window().expect("a pointed cone");
        let mut outlines = Vec::new();
        for i in 0..400 {
            let part = |step: usize| (i * step % 101) as f32 / 101.0 - 0.5;
            let away = 2.0 + (i * 61 % 97) as f32 * 0.1;
            let size = if i % 16 == 0 { 0.8 } else { 0.05 } * away * 0.3;
            let turn = Quat::from_euler(glam::EulerRot::XYZ, part(13), part(29), part(37));
            let middle = Vec3::new(part(17) * away, part(23) * away * 0.6, -away);
            let corner = |x: f32, y: f32| middle + turn * Vec3::new(x, y, 0.0) * size;
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            ShadowVolume::push_polygon(&corners, &window, &mut outlines);
        }
        outlines
    }

    /// Fills without skipping any tile, and counts the tiles that [`Fill`] would have skipped.
    struct FillAll<'a>(Fill<'a>, u32);

    impl WithKernel for FillAll<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<K: Kernel>(mut self, _: K) -> u32 {
            for k in 0..self.0.order.len() {
                let mut filling = self.0.set_up(&self.0.outlines[self.0.order[k].1 as usize]);
                self.1 += self.0.tiles.iter().filter(|tile| tile.hides(filling.nearest)).count() as u32;
                filling.nearest = f32::INFINITY;
                self.0.fill(&filling);
            }
            self.1
        }
    }

    #[test]
    fn tiles_that_are_left_out_would_stay_as_they_are() {
        let view =
            View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 100.0));
        let raster = Raster::new(&view.window().expect("a pointed cone"), 1024.0, 576.0);
        let outlines = outlines(&view);
        assert!(outlines.len() > 350, "{}", outlines.len());
        let away =
            |o: &ShadowVolume| o.corners().iter().map(|v| v.length_squared()).fold(f64::INFINITY, f64::min);
        let mut order: Vec<(f64, u32)> = outlines.iter().zip(0..).map(|(o, i)| (away(o), i)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        for coverage in [Coverage::WholePixels, Coverage::PixelCenters] {
            let mut tiles = [(); 2].map(|()| vec![Tile::EMPTY; 1024 / 64 * 576 / 4]);
            let fill = |tiles| Fill {
                raster: &raster,
                coverage,
                width: 1024,
                height: 576,
                tiles,
                outlines: &outlines,
                order: &order,
            };
            let [some, all] = &mut tiles;
            let touched = Backend::detect().run(fill(some));
            let hidden = Backend::detect().run(FillAll(fill(all), 0));
            assert!(touched > 1000 && hidden > 1000, "{touched} {hidden}");
            assert!(some == all, "{coverage:?}");
        }
    }

    /// A filling without tiles, to test the preparation of outlines.
    fn fill_without_tiles(raster: &Raster) -> Fill<'_> {
        Fill {
            raster,
            coverage: Coverage::WholePixels,
            width: 1024,
            height: 576,
            tiles: &mut [],
            outlines: &[],
            order: &[],
        }
    }

    /// In a block that an outline touches, the plane of the outline may be far beyond the corners of the outline.
    #[test]
    fn an_outline_is_set_up_between_its_nearest_and_its_farthest_corner() {
        let view =
            View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 100.0));
        let raster = Raster::new(&view.window().expect("a pointed cone"), 1024.0, 576.0);
        let outlines = outlines(&view);
        let fill = fill_without_tiles(&raster);
        for outline in &outlines {
            let filling = fill.set_up(outline);
            let nearness = || outline.corners().iter().map(|corner| 1.0 / raster.forward.dot(*corner));
            let farthest = nearness().fold(f64::INFINITY, f64::min);
            let nearest = nearness().fold(0.0, f64::max);
            assert!((filling.farthest / farthest - 1.0).abs() < 1.0e-12, "{outline:?}");
            let more = f64::from(filling.nearest) / nearest - 1.0;
            assert!(more > 0.5 * DEPTH_SLACK && more < 1.5 * DEPTH_SLACK, "{outline:?}");
            // The plane continues outside the outline; the depths stay between those of the corners.
            for (x, y) in [(0, 0), (960, 0), (0, 572), (960, 572)] {
                let least = (farthest * (1.0 - 2.0 * DEPTH_SLACK)) as f32;
                assert!(filling.depths(x, y).iter().all(|depth| *depth >= least), "{outline:?}");
            }
        }
    }

    /// A corner in the plane through the eye, parallel to the picture, has neither a projection nor a reciprocal depth.
    #[test]
    fn of_an_outline_with_a_corner_in_the_eyes_plane_only_its_own_plane_is_known() {
        let view =
            View::look_at(Vec3::ZERO, Vec3::NEG_Z, Projection::symmetric(60.0, 16.0 / 9.0, 0.1, 100.0));
        let raster = Raster::new(&view.window().expect("a pointed cone"), 1024.0, 576.0);
        let fill = fill_without_tiles(&raster);
        for (nearest_m, is_known) in [(1.0e-3, true), (0.0, false), (-1.0e-3, false)] {
            // A wall beside the eye.
            let corners = [(-1.0, nearest_m), (1.0, nearest_m), (1.0, 4.0), (-1.0, 4.0)];
            let corners = corners.map(|(y, away_m)| DVec3::new(1.0, y, 0.0) + raster.forward * away_m);
            let outline = ShadowVolume::of_outline(&corners, DVec3::X).expect("an outline");
            let filling = fill.set_up(&outline);
            assert_eq!(filling.farthest != f64::NEG_INFINITY, is_known, "{nearest_m}");
            assert_eq!(filling.nearest != f32::INFINITY, is_known, "{nearest_m}");
        }
    }

    /// Even if the terms of a depth cancel, the depth is rounded away from the eye by a part of the largest term.
    #[test]
    fn depths_are_rounded_by_a_part_of_their_largest_term() {
        for i in 0..3000 {
            let part = |step: usize| (i * step % 1009) as f64 / 1009.0 - 0.5;
            let (x, y) = ((i * 7 % 16) as i32 * TILE_WIDTH, (i * 13 % 144) as i32 * BLOCK[1]);
            let (base, by_x, by_y) = (part(101), part(211) * 0.02, part(307) * 0.02);
            let filling = Filling {
                edges: [Edge::default(); MAX_SIDES],
                len: 0,
                depth: [base, by_x, by_y],
                farthest: f64::NEG_INFINITY,
                nearest: f32::INFINITY,
                rows: 0..0,
            };
            let terms = [base, by_x * f64::from(x), by_y * f64::from(y)].map(f64::abs);
            let largest = terms.into_iter().fold(0.0, f64::max);
            for (block, depth) in filling.depths(x, y).into_iter().enumerate() {
                let x = x + BLOCK[0] * block as i32;
                let at = |dx: i32, dy: i32| base + by_x * f64::from(x + dx) + by_y * f64::from(y + dy);
                let [width, height] = BLOCK;
                let farthest = at(0, 0).min(at(width, 0)).min(at(0, height)).min(at(width, height));
                let away = (farthest - f64::from(depth)) / DEPTH_SLACK;
                // `f32` rounds by less than a tenth of the slack.
                let (least, most) = (0.9 * largest, 3.1 * largest + 0.1 * farthest.abs());
                assert!(away >= least - 0.1 * farthest.abs() && away <= most, "{i}: {away}, {terms:?}");
            }
        }
    }
}
