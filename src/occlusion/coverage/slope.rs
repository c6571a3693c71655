//! Linear bounds of the depths in a tile.

/// Width of a tile, pixels.
pub(super) const SIDE: usize = 8;

/// Number of pixels of two rows of a tile, a full register.
pub(super) const ROWS: usize = 2 * SIDE;

/// Width of a pixel, relative to a tile.
const PIXEL: f32 = 1.0 / SIDE as f32;

/// A bound of the reciprocal depths in a tile: a linear function, and a constant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slope {
    /// The bound at the tile's corner with the least x and y.
    pub(super) from: f32,
    /// Increase of the bound from one side of the tile to the other, across and up.
    pub(super) across: [f32; 2],
    /// A constant limit: a lower bound is at least `end` in every pixel, an upper bound at most `end`.
    pub(super) end: f32,
}

impl Slope {
    pub(super) fn level(end: f32) -> Self {
        Self { from: end, across: [0.0; 2], end }
    }

    /// The bound at a point of the tile; `x` and `y` go from 0 to 1.
    #[inline(always)]
    pub(super) fn at(&self, x: f32, y: f32) -> f32 {
        self.from + self.across[0] * x + self.across[1] * y
    }

    /// The values at the first corners of the pixels of a group of rows.
    #[inline(always)]
    fn first_in_pixels(&self, group: usize) -> [f32; ROWS] {
        let [x, y] = self.across.map(|across| across * PIXEL);
        let mut values = [0.0; ROWS];
        for (k, value) in values.iter_mut().enumerate() {
            *value = self.from + (x * (k % SIDE) as f32 + y * (group * (ROWS / SIDE) + k / SIDE) as f32);
        }
        values
    }

    /// A lower bound in each pixel of a group of rows.
    ///
    /// [`Facet::slack`](super::facet::Facet::slack) includes the rounding error: at most 2^-24 of the sum of the terms for
    /// each of the six operations.
    #[inline(always)]
    pub(super) fn least_in_pixels(&self, group: usize) -> [f32; ROWS] {
        let least = (self.across[0].min(0.0) + self.across[1].min(0.0)) * PIXEL;
        let mut bounds = self.first_in_pixels(group);
        for bound in &mut bounds {
            *bound = if *bound + least > self.end { *bound + least } else { self.end };
        }
        bounds
    }

    /// An upper bound in each pixel of a group of rows. Rounding: see [`Slope::least_in_pixels`].
    #[inline(always)]
    pub(super) fn most_in_pixels(&self, group: usize) -> [f32; ROWS] {
        let most = (self.across[0].max(0.0) + self.across[1].max(0.0)) * PIXEL;
        let mut bounds = self.first_in_pixels(group);
        for bound in &mut bounds {
            *bound = if *bound + most < self.end { *bound + most } else { self.end };
        }
        bounds
    }

    /// Largest amount by which this bound exceeds `other` in the tile; negative if it is always less.
    #[inline(always)]
    fn excess(&self, other: &Self) -> f32 {
        let [x, y] = [0, 1].map(|axis| larger(self.across[axis] - other.across[axis], 0.0));
        (self.from - other.from) + x + y
    }

    /// Whether an object with this lower bound lies in front of an object with the upper bound `other`, in
    /// the whole tile.
    #[inline(always)]
    pub(super) fn is_in_front_of(&self, other: &Self) -> bool {
        self.end >= other.end || other.excess(self) <= 0.0
    }

    /// A lower bound that is valid for both bounds, if they differ by at most this share in the whole tile.
    #[inline(always)]
    pub(super) fn joined(&self, other: &Self, share: f32) -> Option<Self> {
        let (most, excess) = (share * self.end, self.excess(other));
        (excess <= most && other.excess(self) <= most).then(|| self.lowered(other, excess))
    }

    /// A lower bound that is valid for both bounds.
    #[inline(always)]
    pub(super) fn farther_of(&self, other: &Self) -> Self {
        self.lowered(other, self.excess(other))
    }

    /// A lower bound that is valid for both bounds. `excess` is the [excess](Slope::excess) over the other one.
    #[inline(always)]
    fn lowered(&self, other: &Self, excess: f32) -> Self {
        let lower = larger(excess, 0.0) * (1.0 + 4.0 * f32::EPSILON);
        let end = if other.end < self.end { other.end } else { self.end };
        let from = self.from - lower;
        let least = from + smaller(self.across[0], 0.0) + smaller(self.across[1], 0.0);
        // Selects the bound that is better in the middle.
        if from + 0.5 * (self.across[0] + self.across[1]) > end {
            Self { from, across: self.across, end: larger(end, least) }
        } else {
            Self::level(end)
        }
    }
}

/// The larger number; the second one for NaN.
#[inline(always)]
fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller number; the second one for NaN.
#[inline(always)]
fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
