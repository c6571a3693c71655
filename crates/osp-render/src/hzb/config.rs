use std::ops::Add;

/// Number of polygons that are tested together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbGroup {
    Sixteen,
    Four,
    #[default]
    One,
}

impl HzbGroup {
    pub fn polygons(self) -> u32 {
        match self {
            Self::Sixteen => 16,
            Self::Four => 4,
            Self::One => 1,
        }
    }
}

/// The bound that represents a group in a test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbBound {
    /// The rectangle around the group's corners on the picture, and the depth of the nearest corner.
    #[default]
    Corners,
    /// The same for the corners of the group's bounding box in world space.
    Box,
    /// The same rectangle, and a depth beyond the farthest corner. This bound is wrong on purpose: a test must detect
    /// it.
    #[cfg(test)]
    Farthest,
}

/// The test of single polygons in a group that is not proven hidden.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbFine {
    /// Each triangle is tested: in each texel that it touches, the test compares the depth of the triangle's plane.
    #[default]
    Triangles,
    /// The polygons are drawn without a test.
    Off,
}

/// Settings of culling by a hierarchical depth buffer. They affect the number of hidden polygons found, never the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HzbConfig {
    /// Number of polygons that are tested together. Larger groups need fewer tests, but hide fewer polygons.
    pub group: HzbGroup,
    pub bound: HzbBound,
    pub fine: HzbFine,
}

/// Counts of a frame that is culled on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawnCounts {
    /// Number of tested groups of opaque polygons, plus tested transparent polygons.
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
