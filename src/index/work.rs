use std::ops::AddAssign;

/// Counts of a query's work. They are compared before times, because they do not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCounts {
    /// Nodes visited.
    pub nodes: u64,
    /// Boxes, of nodes or polygons, tested against at least one plane.
    pub boxes: u64,
    /// Single box-plane tests; a wide test counts each of its boxes.
    pub planes: u64,
    /// Polygons taken without a test of their own.
    pub taken_whole: u64,
    /// Polygons reported.
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

/// Counts of an index's work to follow changes since it was made. They explain the time of moving polygons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Upkeep {
    /// Polygons that got another box without a change of their place.
    pub adjusted: u64,
    /// Polygons inserted: new ones, moved ones, or those of a part that was rebuilt.
    pub filed: u64,
    /// Boxes around several polygons computed again, refitted or widened.
    pub boxes: u64,
}

impl AddAssign for Upkeep {
    fn add_assign(&mut self, other: Self) {
        self.adjusted += other.adjusted;
        self.filed += other.filed;
        self.boxes += other.boxes;
    }
}
