//! Options and counts of the OSP paper's trees as they are printed.

/// Treatment of the polygons of a node that the frustum's planes cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CutNodes {
    /// The index tests the box of each polygon. Its result then equals that of every other index.
    #[default]
    Tested,
    /// All of them are drawn, as in the paper's Fig. 6: more than the frustum may see, never less.
    Drawn,
}

/// Work of inserting polygons into a tree, since the beginning.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FilingCounts {
    /// Number of polygons; in a tree that is rebuilt, each one again in every build.
    pub polygons: u64,
    /// Nodes that a polygon was compared with, one by one (the eight children of a node of an octree).
    pub nodes: u64,
    /// Planes that a polygon was compared with.
    pub planes: u64,
}
