//! The constants of the tree, each with its unit and the effect of changing it.

/// Largest number of preallocated octree levels below the root cube: `8^0 + ... + 8^6` links of 4 bytes. One level more
/// makes the insertion of polygons far smaller than the root faster, and takes eight times the memory.
pub(super) const FLAT_LEVELS: u32 = 6;

/// Number of preallocated levels for `polygons` polygons. The lowest level has about as many cells as the tree will have
/// leaves, so the levels take at most some bytes for each polygon.
pub(super) const fn flat_levels(polygons: usize) -> u32 {
    match polygons {
        0..0x8000 => 4,
        0x8000..0x4_0000 => 5,
        _ => FLAT_LEVELS,
    }
}

/// Largest number of runs of a leaf before it is split. If it is larger, the tree
/// has fewer nodes, and a leaf that a plane cuts has more runs to test.
pub(super) const LEAF_RUNS: u32 = 256;

/// A node with at most this number of runs below it becomes a leaf again. It is less than half of [`LEAF_RUNS`], so that
/// erasing and drawing at the limit does not split and merge again and again.
pub(super) const MERGE_RUNS: u32 = 96;

/// Largest length of a run in a cell, in edges of the cell. A longer run is a straddler and stays a level higher. With a
/// larger value, the tree has fewer straddlers and looser boxes.
pub(super) const CELL_STRETCH: f32 = 1.0;

/// A polygon joins a run if the run is then at most this many times as long as the sum of its polygons' lengths. Runs of a
/// stroke never exceed this limit, because the pieces of a stroke touch each other. With a larger value, runs extend
/// across gaps.
pub(super) const RUN_STRETCH: f32 = 1.5;

/// Number of pages that a commit's upkeep processes even if nothing was removed.
pub(super) const UPKEEP_PER_COMMIT: u32 = 16;

/// Largest number of groups of 256 ids that a plane cuts, for a query by the walk in the order of the ids. If it is larger,
/// polygons that are not drawn in the order of space take longer; if it is smaller, drawn polygons do.
pub(super) const MOST_IN_ORDER: usize = 128;

/// The same if the polygons are scattered. Then a cut group is tested block by block.
pub(super) const MOST_IN_ORDER_SCATTERED: usize = 16;

/// Largest number of runs of a leaf that is packed. If it is larger, the tree has fewer leaves and fuller pages, and frames
/// that pack a leaf take longer.
pub(super) const MOST_TAKEN: usize = 4 * LEAF_RUNS as usize;

/// Number of runs at which a leaf of scattered polygons is first packed: four full pages. If it is larger, small leaves
/// have wider pages. If it is smaller, insertion spends more time on packing.
pub(super) const PACKED_FIRST: u32 = 64;
