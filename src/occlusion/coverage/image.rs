//! An image of 8 x 8 tiles: the depths beyond which its pixels are covered. Each tile has a linear bound of the depth
//! beyond which all of it is covered. If some of its pixels are covered at nearer depths, the tile also has a depth for
//! each pixel.

use super::{
    picture::{STEP_BITS, STEPS, pixels_between},
    slope::{ROWS, SIDE, Slope},
};
use crate::{index::simd::Kernel, occlusion::Needed};

const TILE_STEPS: i32 = SIDE as i32 * STEPS as i32 - 1;

/// Number of groups of rows of a tile.
pub(super) const GROUPS: usize = SIDE * SIDE / ROWS;

/// A number for each pixel of a tile, from the lowest row up.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Depths(pub(super) [[f32; ROWS]; GROUPS]);

impl Depths {
    /// The smallest and the largest depth of the tile.
    #[inline(always)]
    pub(super) fn ends(&self) -> [f32; 2] {
        let (mut low, mut high) = ([f32::INFINITY; ROWS], [0.0; ROWS]);
        for depths in &self.0 {
            for k in 0..ROWS {
                low[k] = if depths[k] < low[k] { depths[k] } else { low[k] };
                high[k] = if depths[k] > high[k] { depths[k] } else { high[k] };
            }
        }
        for step in [8, 4, 2, 1] {
            for k in 0..step {
                low[k] = if low[k + step] < low[k] { low[k + step] } else { low[k] };
                high[k] = if high[k + step] > high[k] { high[k + step] } else { high[k] };
            }
        }
        [low[0], high[0]]
    }
}

/// See the [module](self).
#[derive(Clone, Debug, Default)]
pub(super) struct Image {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// For each tile, from the lowest row up: the reciprocal depth at which all its pixels are covered; 0 if
    /// some are not.
    pub(super) all: Vec<f32>,
    /// For each tile, the same depth as a linear bound, which is more precise.
    pub(super) slopes: Vec<Slope>,
    /// For each tile, the nearest depth at which any pixel is covered.
    pub(super) nearest: Vec<f32>,
    /// For each tile, whether some pixels are covered nearer than by the linear bound, and the reciprocal depth at which
    /// each pixel is covered. The depths are valid only in these tiles.
    pub(super) is_fine: Vec<bool>,
    pub(super) depths: Vec<Depths>,
}

impl Image {
    pub(super) fn new(columns: usize, rows: usize) -> Self {
        let count = columns * rows;
        Self {
            columns,
            rows,
            all: vec![0.0; count],
            slopes: vec![Slope::default(); count],
            nearest: vec![0.0; count],
            is_fine: vec![false; count],
            depths: vec![Depths([[0.0; ROWS]; GROUPS]); count],
        }
    }

    /// Empties the image.
    pub(super) fn clear(&mut self) {
        self.all.fill(0.0);
        self.slopes.fill(Slope::default());
        self.nearest.fill(0.0);
        self.is_fine.fill(false);
    }

    /// Covers pixels of a tile from this reciprocal depth on.
    #[inline(always)]
    pub(super) fn raise<K: Kernel>(&mut self, kernel: K, tile: usize, pixels: u64, level: f32) {
        let all = self.all[tile];
        if level <= all {
            return;
        }
        self.nearest[tile] = if level > self.nearest[tile] { level } else { self.nearest[tile] };
        if pixels == u64::MAX && !self.is_fine[tile] {
            self.all[tile] = level;
            return;
        }
        let was_fine = std::mem::replace(&mut self.is_fine[tile], true);
        let mut least = [level; ROWS];
        for (group, depths) in self.depths[tile].0.iter_mut().enumerate() {
            let before = if was_fine { *depths } else { [all; ROWS] };
            let mut raised = [0.0; ROWS];
            for k in 0..ROWS {
                raised[k] = if level > before[k] { level } else { before[k] };
            }
            *depths = kernel.select((pixels >> (group * ROWS)) as u32 & 0xFFFF, &raised, &before);
            for k in 0..ROWS {
                least[k] = if depths[k] < least[k] { depths[k] } else { least[k] };
            }
        }
        let least = least.into_iter().fold(level, |least, depth| if depth < least { depth } else { least });
        self.all[tile] = if least > all { least } else { all };
    }

    /// Number of tiles with a covered pixel.
    pub(super) fn covered(&self) -> usize {
        self.nearest.iter().filter(|depth| **depth > 0.0).count()
    }

    /// Whether a single bound covers the whole tile in front of the upper bound `near` of an object's reciprocal
    /// depth.
    #[inline(always)]
    pub(super) fn hides_all(&self, tile: usize, near: &Slope) -> bool {
        let (all, slope) = (self.all[tile], &self.slopes[tile]);
        all > 0.0 && (all >= near.end || slope.end > 0.0 && slope.is_in_front_of(near))
    }

    /// Whether these pixels of a tile are covered in front of the upper bound `near`. Call it only if
    /// [`Image::hides_all`] fails.
    #[inline(always)]
    pub(super) fn hides<K: Kernel>(&self, kernel: K, tile: usize, pixels: u64, near: &Slope) -> bool {
        if !self.is_fine[tile] {
            return false;
        }
        let mut hidden = 0;
        for group in 0..GROUPS {
            let (depths, bound) = (&self.depths[tile].0[group], near.most_in_pixels(group));
            let mut margin = [0.0; ROWS];
            for k in 0..ROWS {
                margin[k] = depths[k] - bound[k];
            }
            hidden |= u64::from(kernel.not_negative(&margin)) << (group * ROWS);
        }
        pixels & !hidden == 0
    }

    /// Whether these pixels of a tile are covered in front of the reciprocal depth `near`.
    #[inline(always)]
    fn hides_level<K: Kernel>(&self, kernel: K, tile: usize, pixels: u64, near: f32) -> bool {
        if self.all[tile] >= near || !self.is_fine[tile] {
            return self.all[tile] >= near;
        }
        let mut hidden = 0;
        for group in 0..GROUPS {
            let (depths, mut margin) = (&self.depths[tile].0[group], [0.0; ROWS]);
            for k in 0..ROWS {
                margin[k] = depths[k] - near;
            }
            hidden |= u64::from(kernel.not_negative(&margin)) << (group * ROWS);
        }
        pixels & !hidden == 0
    }

    /// Whether the pixel of a polygon's corner may be covered in front of the corner. `at` is the corner's position in
    /// steps, `nearness` its reciprocal depth.
    ///
    /// A bound is the farthest depth of a covering surface in a tile or in a pixel. The polygon touches this pixel, so it is
    /// visible if no bound of the pixel is nearer than the corner. A bound that hides the polygon is nearer in the whole
    /// pixel. A corner that was rounded into the pixel is an exception. The polygon then counts as visible, which is safe.
    #[inline(always)]
    pub(super) fn may_hide_corner(&self, at: [i32; 2], nearness: f64) -> bool {
        let [x, y] = at.map(|v| v >> STEP_BITS);
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return true };
        if x >= self.columns * SIDE || y >= self.rows * SIDE {
            return true;
        }
        let tile = y / SIDE * self.columns + x / SIDE;
        let bit = y % SIDE * SIDE + x % SIDE;
        let [u, v] = at.map(|v| (v & TILE_STEPS) as f32 * (1.0 / (TILE_STEPS + 1) as f32));
        let near = nearness as f32;
        let is_in_front = |bound: &Slope| bound.end >= near || bound.at(u, v) >= near;
        self.all[tile] > 0.0 && (self.all[tile] >= near || is_in_front(&self.slopes[tile]))
            || self.is_fine[tile] && self.depths[tile].0[bit / ROWS][bit % ROWS] >= near
    }

    /// Whether a pixel of the picture is covered in front of the reciprocal depth `near`, which is positive.
    #[inline(always)]
    pub(super) fn hides_pixel(&self, [x, y]: [usize; 2], near: f32) -> bool {
        let tile = y / SIDE * self.columns + x / SIDE;
        let bit = y % SIDE * SIDE + x % SIDE;
        self.all[tile] >= near || self.is_fine[tile] && self.depths[tile].0[bit / ROWS][bit % ROWS] >= near
    }

    /// Whether all pixels in a range of corners are covered in front of the reciprocal depth `near`. The range is in steps,
    /// across and up.
    #[inline(always)]
    pub(super) fn hides_between<K: Kernel>(&self, kernel: K, ends: [[i32; 2]; 2], near: f32) -> bool {
        let [x, y] = ends.map(pixels_between);
        let within = |[from, end]: [i32; 2], tiles: usize| [from.max(0), end.min((tiles * SIDE) as i32)];
        let (x, y) = (within(x, self.columns), within(y, self.rows));
        x[0] >= x[1] || y[0] >= y[1] || self.test(kernel, x, y, near, 0.0, Needed::Hidden).0
    }

    /// Tests the pixels in these columns and rows; both ranges lie in the picture and are not empty. Returns whether
    /// all are covered in front of the reciprocal depth `near`, whether any may hide something at `far`, and the number
    /// of tiles read. The second result is computed only if `needed` includes it.
    #[inline(always)]
    pub(super) fn test<K: Kernel>(
        &self,
        kernel: K,
        x: [i32; 2],
        y: [i32; 2],
        near: f32,
        far: f32,
        needed: Needed,
    ) -> (bool, bool, u32) {
        let side = SIDE as i32;
        let (mut is_hidden, mut may_hide, mut steps) = (true, needed == Needed::Hidden, 0);
        let columns = (x[0] / side) as usize..((x[1] - 1) / side) as usize + 1;
        for row in y[0] / side..(y[1] - 1) / side + 1 {
            let first = row as usize * self.columns;
            let tiles = first + columns.start..first + columns.end;
            steps += columns.len() as u32;
            if is_hidden && !self.all[tiles.clone()].iter().all(|&depth| depth >= near) {
                for column in columns.clone() {
                    let pixels = pixels_within(x, y, column as i32 * side, row * side);
                    is_hidden = self.hides_level(kernel, first + column, pixels, near);
                    if !is_hidden {
                        break;
                    }
                }
            }
            may_hide = may_hide || self.nearest[tiles].iter().any(|&depth| depth > far);
            if !is_hidden && may_hide {
                break;
            }
        }
        (is_hidden, may_hide, steps)
    }
}

/// The pixels of a tile that lie in these columns and rows, as a mask. The tile begins at pixel (`left`,
/// `low`).
#[inline(always)]
pub(super) fn pixels_within(x: [i32; 2], y: [i32; 2], left: i32, low: i32) -> u64 {
    let within = |v: i32, at: i32| (v - at).clamp(0, SIDE as i32) as u32;
    let (from, to) = (within(x[0], left), within(x[1], left));
    let row = ((1_u64 << to) - 1) & !((1_u64 << from) - 1);
    // The product has a copy of `row` in each row of the tile.
    let rows = |end: u32| if end == 8 { u64::MAX } else { (1 << (8 * end)) - 1 };
    let (from, to) = (within(y[0], low), within(y[1], low));
    row.wrapping_mul(0x0101_0101_0101_0101) & rows(to) & !rows(from)
}
