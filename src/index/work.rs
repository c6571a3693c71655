use std::ops::AddAssign;

/// Counts of a query's work. Unlike times, they do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct WorkCounts {
    /// Number of nodes visited.
    pub nodes: u64,
    /// Number of boxes, of nodes or polygons, that were tested against at least one plane.
    pub boxes: u64,
    /// Number of tests of one box against one plane; a SIMD test counts each of its boxes.
    pub planes: u64,
    /// Number of polygons reported without a test of their own box.
    pub taken_whole: u64,
    /// Number of polygons reported.
    pub reported: u64,
}

impl AddAssign for WorkCounts {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.boxes += other.boxes;
        self.planes += other.planes;
        self.taken_whole += other.taken_whole;
        self.reported += other.reported;
    }
}

/// Counts of the work that changes have caused since the index was made. They explain the time that moving polygons
/// take.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Upkeep {
    /// Number of new boxes of polygons that stayed in the same node of the structure.
    pub adjusted: u64,
    /// Number of insertions of polygons. Counts new polygons, moved polygons, and all polygons in rebuilt parts.
    pub inserted: u64,
    /// Number of boxes around several polygons that were computed again, refitted or widened.
    pub boxes: u64,
}

impl AddAssign for Upkeep {
    fn add_assign(&mut self, other: Self) {
        self.adjusted += other.adjusted;
        self.inserted += other.inserted;
        self.boxes += other.boxes;
    }
}
