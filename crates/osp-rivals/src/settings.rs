use std::ops::RangeInclusive;

use super::{
    OctreePaperConfig, OspGrid,
    as_printed::CutNodes,
    bvh::{BinnedSah, MOST_MORTON_BITS, USUAL_BUCKETS, top_down::LEAF_CAPACITY},
    osp_paper::{DEFAULT_MAX_DEPTH, MAX_MAX_DEPTH},
};
use osp::index::IndexConfig;

/// Settings of the structures, for [`IndexKind::create_with`](super::IndexKind::create_with). A kind ignores the settings
/// that it does not have ([`IndexKind::has`](super::IndexKind::has)). A number out of a setting's range becomes the nearest
/// number in the range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexSettings {
    /// Number of levels below the root, at most [`MAX_MAX_DEPTH`](super::MAX_MAX_DEPTH). The default is 15 binary levels for
    /// `osp-paper`, and 10 levels of octants for `octree-paper`.
    pub max_depth: Option<u32>,
    /// Edge of the cube of `osp-paper`, as a multiple of the longest edge of [`IndexConfig::root`]. If the product is
    /// negative or not finite, the cube has the size 0: every polygon is then outside the cube, but queries still find
    /// it.
    pub cube: f32,
    /// Treatment of nodes that the frustum cuts. Only [`CutNodes::Drawn`] changes which polygons an index reports.
    pub cut_nodes: CutNodes,
    /// Number of buckets of an axis for the surface area heuristic, 2 to 32.
    pub buckets: usize,
    /// Largest number of polygons of a leaf, at least 1. The default is 16 for `octree-paper` and 64 for the others.
    pub leaf_capacity: Option<usize>,
    /// Number of bits of an axis in the Morton codes, 1 to 21.
    pub morton_bits: u32,
}

impl Default for IndexSettings {
    fn default() -> Self {
        Self {
            max_depth: None,
            cube: 1.0,
            cut_nodes: CutNodes::default(),
            buckets: USUAL_BUCKETS,
            leaf_capacity: None,
            morton_bits: MOST_MORTON_BITS,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IndexSetting {
    MaxDepth,
    Cube,
    CutNodes,
    Buckets,
    LeafCapacity,
    MortonBits,
}

impl IndexSetting {
    pub const ALL: [Self; 6] =
        [Self::MaxDepth, Self::Cube, Self::CutNodes, Self::Buckets, Self::LeafCapacity, Self::MortonBits];

    /// The name of the setting's option on the command line, without the dashes.
    pub fn name(self) -> &'static str {
        match self {
            Self::MaxDepth => "depth",
            Self::Cube => "cube",
            Self::CutNodes => "cut-nodes",
            Self::Buckets => "buckets",
            Self::LeafCapacity => "leaf",
            Self::MortonBits => "morton-bits",
        }
    }
}

/// The values that the program takes for a setting.
impl IndexSettings {
    /// Values of [`IndexSettings::max_depth`].
    pub const DEPTHS: RangeInclusive<u32> = 0..=MAX_MAX_DEPTH;
    /// Values of [`IndexSettings::cube`].
    pub const CUBES: RangeInclusive<f32> = 0.01..=100.0;
    /// Values of [`IndexSettings::buckets`].
    pub const BUCKETS: RangeInclusive<usize> = 2..=32;
    /// Values of [`IndexSettings::leaf_capacity`].
    pub const LEAF_CAPACITIES: RangeInclusive<usize> = 1..=4096;
    /// Values of [`IndexSettings::morton_bits`].
    pub const MORTON_BITS: RangeInclusive<u32> = 1..=MOST_MORTON_BITS;
}

impl IndexSettings {
    pub(super) fn leaf(&self) -> usize {
        self.leaf_capacity.unwrap_or(LEAF_CAPACITY).max(1)
    }

    pub(super) fn sah(&self) -> BinnedSah {
        BinnedSah { buckets: self.buckets, leaf_capacity: self.leaf() }
    }

    pub(super) fn osp_grid(&self, config: &IndexConfig) -> OspGrid {
        let size_m = config.root.extent().max_element() * self.cube;
        OspGrid::new(config.root.center(), size_m, self.max_depth.unwrap_or(DEFAULT_MAX_DEPTH))
    }

    pub(super) fn octree_paper(&self) -> OctreePaperConfig {
        let usual = OctreePaperConfig::default();
        OctreePaperConfig {
            leaf_capacity: self.leaf_capacity.unwrap_or(usual.leaf_capacity).max(1),
            max_depth: self.max_depth.unwrap_or(usual.max_depth),
        }
    }
}
