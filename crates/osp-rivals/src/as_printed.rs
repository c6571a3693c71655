//! Options and counts of the OSP paper's trees as the paper prints them.

/// Treatment of the polygons of a node that a plane of the frustum cuts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CutNodes {
    /// The index tests the box of each polygon. The result then equals the result of every other index.
    #[default]
    Tested,
    /// All polygons are drawn, as in the paper's Fig. 6: also polygons that are not in view.
    Drawn,
}

impl CutNodes {
    /// Both treatments.
    pub const ALL: [Self; 2] = [Self::Tested, Self::Drawn];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tested => "tested",
            Self::Drawn => "drawn",
        }
    }
}

/// Counts of the work of inserting polygons into a tree, since the tree was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InsertionCounts {
    /// Number of insertions. A tree that is rebuilt counts each polygon again in every build.
    pub polygons: u64,
    /// Number of nodes that a polygon was compared with: in an octree, all eight children of each visited node.
    pub nodes: u64,
    /// Number of planes that a polygon was compared with.
    pub planes: u64,
}
