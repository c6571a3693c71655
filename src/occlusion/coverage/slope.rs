//! Bounds of the depths in a tile.

/// Pixels of a tile's side.
pub(super) const SIDE: usize = 8;

/// A bound of the reciprocal depths in a tile: linear, and the end of its values there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slope {
    /// At the corner from which both coordinates grow.
    pub(super) from: f32,
    /// Increase on the way to the other end, across and up.
    pub(super) across: [f32; 2],
    /// For a lower bound the least value, or less; for an upper bound the largest, or more.
    pub(super) end: f32,
}

impl Slope {
    pub(super) fn level(end: f32) -> Self {
        Self { from: end, across: [0.0; 2], end }
    }

    /// Its value at these parts of the way across and up.
    #[inline(always)]
    pub(super) fn at(&self, x: f32, y: f32) -> f32 {
        self.from + self.across[0] * x + self.across[1] * y
    }

    /// Largest amount by which this one exceeds the other, if it does.
    #[inline(always)]
    fn excess(&self, other: &Self) -> f32 {
        let [x, y] = [0, 1].map(|axis| (self.across[axis] - other.across[axis]).max(0.0));
        (self.from - other.from) + x + y
    }

    /// Whether the object with this lower bound lies before the object with the other, an upper bound.
    #[inline(always)]
    pub(super) fn is_before(&self, other: &Self) -> bool {
        self.end >= other.end || other.excess(self) <= 0.0
    }

    /// A lower bound of both.
    #[inline(always)]
    pub(super) fn behind_both(&self, other: &Self) -> Self {
        let lower = self.excess(other).max(0.0) * (1.0 + 4.0 * f32::EPSILON);
        let end = self.end.min(other.end);
        let from = self.from - lower;
        let least = from + self.across[0].min(0.0) + self.across[1].min(0.0);
        // The bound that is better in the middle.
        if from + 0.5 * (self.across[0] + self.across[1]) > end {
            Self { from, across: self.across, end: end.max(least) }
        } else {
            Self::level(end)
        }
    }
}
