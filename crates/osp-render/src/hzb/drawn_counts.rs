use std::ops::Add;

/// Counts of a frame that is culled on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawnCounts {
    /// Number of tested opaque and transparent polygons; with hardware queries, clusters of opaque polygons.
    pub groups_tested: u64,
    /// Number of polygons in view. Includes opaque and additive polygons in view of the other eye, if both share a list.
    pub in_view: u64,
    /// Number of polygons drawn in the depth pass: visible in the last frame and in view in this frame.
    pub first_pass: u64,
    /// Number of polygons drawn in the colour pass.
    pub second_pass: u64,
}

impl DrawnCounts {
    /// Number of polygons in view that were proven hidden.
    pub fn hidden(&self) -> u64 {
        self.in_view - self.second_pass.min(self.in_view)
    }
}

impl Add for DrawnCounts {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            groups_tested: self.groups_tested + other.groups_tested,
            in_view: self.in_view + other.in_view,
            first_pass: self.first_pass + other.first_pass,
            second_pass: self.second_pass + other.second_pass,
        }
    }
}
