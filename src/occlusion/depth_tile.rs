//! Tiles of a depth buffer. A tile is eight blocks of 8 x 4 pixels, side by side.

/// Size of a block: 8 pixels wide, 4 high, one bit a pixel.
pub(super) const BLOCK: [i32; 2] = [8, 4];
/// Number of blocks of a tile, which are updated at once.
pub(super) const LANES: usize = 8;
/// Width of a tile, pixels.
pub(super) const TILE_WIDTH: i32 = BLOCK[0] * LANES as i32;

/// Largest relative error of `f32` depths from rounding, with a margin.
pub(super) const DEPTH_SLACK: f64 = 1.0e-6;
/// Eight blocks side by side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tile {
    /// For each block, the farthest reciprocal depth of its pixels: everything beyond is hidden.
    all: [f32; LANES],
    /// For each block, the farthest reciprocal depth of the pixels in `mask`, the layer that is being filled.
    part: [f32; LANES],
    mask: [u32; LANES],
}

impl Tile {
    pub(super) const EMPTY: Self = Self { all: [0.0; LANES], part: [0.0; LANES], mask: [0; LANES] };

    /// Whether any pixel of the tile is covered.
    pub(super) fn is_covered(&self) -> bool {
        self.all != [0.0; LANES] || self.mask != [0; LANES]
    }

    /// Whether every pixel of the tile is covered at the reciprocal depth `nearest` or nearer.
    #[inline(always)]
    pub(super) fn hides(&self, nearest: f32) -> bool {
        self.all.iter().all(|all| *all >= nearest)
    }

    /// Adds the pixels of a polygon, with its reciprocal depth in each block.
    #[inline(always)]
    pub(super) fn add(&mut self, masks: &[u32; LANES], depths: &[f32; LANES]) {
        for i in 0..LANES {
            let (mask, depth) = (masks[i], depths[i]);
            let (all, part, filled) = (self.all[i], self.part[i], self.mask[i]);
            // A polygon farther than the depth that hides the whole block adds nothing.
            let useful = depth > all && mask != 0;
            // The layer is dropped if the gap from polygon to layer exceeds the gap from layer to background.
            let restart = filled == 0 || part <= all || depth - part > part - all;
            let new_part = if restart { depth } else { part.min(depth) };
            let new_mask = if restart { mask } else { filled | mask };
            let full = new_mask == u32::MAX;
            let covers_alone = mask == u32::MAX;
            let new_all = if covers_alone {
                depth
            } else if full {
                new_part
            } else {
                all
            };
            // A polygon that covers the whole block leaves a nearer layer unchanged.
            let keep = !useful || (covers_alone && part > depth);
            self.all[i] = if useful { new_all } else { all };
            self.part[i] = if keep {
                part
            } else if full {
                0.0
            } else {
                new_part
            };
            self.mask[i] = if keep {
                filled
            } else if full {
                0
            } else {
                new_mask
            };
        }
    }

    /// Tests the pixels `wanted` of a volume between two reciprocal depths. Returns whether some pixels are not hidden at
    /// `nearest`, and whether any block could hide a part of the volume up to `farthest`.
    #[inline]
    pub(super) fn test(&self, wanted: &[u32; LANES], nearest: f32, farthest: f32) -> (bool, bool) {
        let (mut lit, mut shadow) = (0u32, 0u32);
        for (i, &wanted) in wanted.iter().enumerate() {
            let open = if nearest < self.part[i] { wanted & !self.mask[i] } else { wanted };
            let open = if nearest < self.all[i] { 0 } else { open };
            lit |= open;
            let shade = self.all[i].max(if self.mask[i] != 0 { self.part[i] } else { 0.0 });
            shadow |= if farthest < shade { wanted } else { 0 };
        }
        (lit != 0, shadow != 0)
    }
}

/// The bits `from..to` of a row of a tile; both numbers may lie outside of the tile.
#[inline(always)]
pub(super) fn row_mask(from: i32, to: i32) -> u64 {
    let (from, to) = (from.clamp(0, 64), to.clamp(0, 64));
    if from >= to { 0 } else { (u64::MAX << from) & (u64::MAX >> (64 - to)) }
}

/// Converts four rows of 64 pixels to eight blocks of 8 x 4.
#[inline(always)]
pub(super) fn block_masks(rows: [u64; BLOCK[1] as usize]) -> [u32; LANES] {
    let rows = rows.map(u64::to_le_bytes);
    std::array::from_fn(|i| u32::from_le_bytes([rows[0][i], rows[1][i], rows[2][i], rows[3][i]]))
}
