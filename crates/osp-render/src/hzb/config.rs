use std::ops::Add;

/// Number of polygons that are tested together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbGroup {
    /// Sixteen polygons.
    Sixteen,
    /// Four polygons.
    Four,
    /// Each polygon separately.
    #[default]
    One,
}

impl HzbGroup {
    /// Number of polygons.
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
    /// The rectangle, and a depth beyond the farthest corner. This is wrong on purpose, for a test that must detect it.
    #[cfg(test)]
    Farthest,
}

/// Whether the polygons of a group that is not hidden are tested one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbFine {
    /// They are tested, triangle by triangle: in each texel that a triangle touches, the depth of the triangle's plane is
    /// compared.
    #[default]
    Triangles,
    /// They are drawn without a test.
    Off,
}

/// Settings of culling by a hierarchical depth buffer. They affect the number of hidden polygons found, never the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HzbConfig {
    /// Number of polygons that are tested together. If groups are larger, fewer tests are made, and fewer hidden polygons
    /// are found.
    pub group: HzbGroup,
    /// The bound that represents a group.
    pub bound: HzbBound,
    /// The finer test of a group that is not hidden.
    pub fine: HzbFine,
}

/// Counts of a frame that is culled on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawnCounts {
    /// Number of tested groups of opaque polygons, plus tested transparent polygons.
    pub groups_tested: u64,
    /// Number of polygons in view.
    pub in_view: u64,
    /// Number of polygons drawn in the depth pass: visible in the last frame and in view in this frame.
    pub first_pass: u64,
    /// Number of polygons drawn in the colour pass.
    pub second_pass: u64,
}

impl DrawnCounts {
    /// Number of polygons in view that were found to be hidden.
    pub fn hidden(&self) -> u64 {
        self.in_view - self.second_pass.min(self.in_view)
    }
}

impl Add for DrawnCounts {
    type Output = Self;

    /// The sum of two counts.
    fn add(self, other: Self) -> Self {
        Self {
            groups_tested: self.groups_tested + other.groups_tested,
            in_view: self.in_view + other.in_view,
            first_pass: self.first_pass + other.first_pass,
            second_pass: self.second_pass + other.second_pass,
        }
    }
}
