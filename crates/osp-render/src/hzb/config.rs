use std::ops::Add;

/// Number of polygons that are tested together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbGroup {
    /// Sixteen.
    Sixteen,
    /// Four.
    Four,
    /// Each by itself.
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

/// Bound that represents a group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbBound {
    /// The rectangle around its corners on the picture, and the depth of the nearest corner.
    #[default]
    Corners,
    /// The same of the corners of its bounding box in world space.
    Box,
    /// Wrong on purpose, for a test that must detect it: the rectangle, and a depth beyond the farthest corner.
    #[cfg(test)]
    Farthest,
}

/// Whether the polygons of a group that is not hidden are tested one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HzbFine {
    /// They are tested, triangle by triangle: each texel that a triangle touches against the triangle's plane there.
    #[default]
    Triangles,
    /// They are drawn without a test.
    Off,
}

/// Settings of culling by a hierarchical depth buffer. They change how many hidden polygons are found, never the
/// picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HzbConfig {
    /// Number of polygons that are tested together. Larger groups make fewer tests, and fewer hidden polygons are
    /// found.
    pub group: HzbGroup,
    /// Bound that represents a group.
    pub bound: HzbBound,
    /// Finer test of a group that is not hidden.
    pub fine: HzbFine,
}

/// Counts of a frame that is culled on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawnCounts {
    /// Tested groups of opaque polygons, plus tested transparent polygons.
    pub groups_tested: u64,
    /// Polygons in view.
    pub in_view: u64,
    /// Polygons drawn in the depth pass: visible in the last frame and in view in this one.
    pub first_pass: u64,
    /// Polygons drawn in the colour pass.
    pub second_pass: u64,
}

impl DrawnCounts {
    /// Polygons in view that were found to be hidden.
    pub fn hidden(&self) -> u64 {
        self.in_view - self.second_pass.min(self.in_view)
    }
}

impl Add for DrawnCounts {
    type Output = Self;

    /// Sum over several views.
    fn add(self, other: Self) -> Self {
        Self {
            groups_tested: self.groups_tested + other.groups_tested,
            in_view: self.in_view + other.in_view,
            first_pass: self.first_pass + other.first_pass,
            second_pass: self.second_pass + other.second_pass,
        }
    }
}
