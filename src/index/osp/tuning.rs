//! The constants of the tree, each with its unit and the effect of changing it.

/// Octree levels of the root cube that are preallocated at most: `8^0 + ... + 8^6` nodes of 4 bytes. More: faster placing of
/// polygons far smaller than the root, eight times the memory.
pub(super) const FLAT_LEVELS: u32 = 6;

/// Preallocated levels for so many polygons: about as many cells as there will be leaves, so that they take some bytes a
/// polygon at most.
pub(super) const fn flat_levels(polygons: usize) -> u32 {
    match polygons {
        0..0x8000 => 4,
        0x8000..0x4_0000 => 5,
        _ => FLAT_LEVELS,
    }
}

/// Runs that a leaf holds before it is split, and the whole tree before it has leaves. More: fewer nodes and longer lists
/// of runs to test in a leaf that a plane cuts.
pub(super) const LEAF_RUNS: u32 = 256;

/// A node with no more runs than this below it becomes a leaf again. Less than half of [`LEAF_RUNS`], so that erasing
/// and drawing at the border does not split and merge in turn.
pub(super) const MERGE_RUNS: u32 = 96;

/// A run may be this many times as long as a cell before it counts as a straddler, which stays a level higher.
/// More: fewer straddlers, looser boxes.
pub(super) const CELL_STRETCH: f32 = 1.0;

/// A polygon joins a run if the run is then no longer than this times the sum of its polygons' own lengths: pieces
/// of a stroke touch each other, so theirs never is. More: runs that jump across gaps.
pub(super) const RUN_STRETCH: f32 = 1.5;

/// Runs that a frame's upkeep looks at even if nothing was taken out in it.
pub(super) const UPKEEP_PER_COMMIT: u32 = 16;

/// Blocks of sixteen ids that are kept as a plain list before there is a tree. More: small models are answered and changed
/// faster, up to where the tree leaves more out than the list takes; and the one change that moves all of them to the tree
/// takes longer.
pub(super) const LINEAR_BLOCKS: usize = 96;

/// A list of scattered polygons that come a few in each frame may be this many times as long: to test all costs less than to
/// insert into a tree and to pack it. More: longer frames where the tree leaves most out.
pub(super) const LONGER: usize = 7;

/// Commits that a polygon rests at least before it goes back to the tree.
pub(super) const REST: u32 = 32;

/// Runs of a leaf that is packed, at most. More: fewer leaves and fuller pages, and frames that pack one are longer.
pub(super) const MOST_TAKEN: usize = 4 * LEAF_RUNS as usize;

/// Runs of a leaf of scattered polygons when it is first put in the order of space: four full pages. More: wider pages in small
/// leaves. Fewer: more of the time that polygons take to come goes into packing.
pub(super) const PACKED_FIRST: u32 = 64;
