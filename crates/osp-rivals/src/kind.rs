use super::{
    BruteSimd, Bsp, BspConfig, BvhTwoLevel, DynamicBvh, IndexSetting, IndexSettings, LooseOctree,
    LooseOctreeConfig, OctreePaper, OspPaper, TimeOrder, bvh, kd_tree, octree_bvh, octree_every_child,
    octree_rebuild, osp_paper::DEFAULT_MAX_DEPTH, quadtree,
};
use osp::index::{BruteForce, IndexConfig, Osp, SpatialIndex};

/// The indexes, by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IndexKind {
    /// [`BruteForce`].
    BruteForce,
    /// [`BruteSimd`].
    BruteSimd,
    /// [`TimeOrder`].
    TimeOrder,
    /// [`OspPaper`].
    OspPaper,
    /// [`Osp`].
    Osp,
    /// [`octree_rebuild`].
    OctreeRebuild,
    /// [`OctreePaper`].
    OctreePaper,
    /// [`octree_every_child`].
    OctreeEveryChild,
    /// [`octree_bvh`].
    OctreeBvh,
    /// [`bvh::bvh_midpoint`].
    BvhMidpoint,
    /// [`bvh::bvh_median`].
    BvhMedian,
    /// [`bvh::bvh_sah`].
    BvhSah,
    /// [`bvh::bvh_sah_sweep`].
    BvhSahSweep,
    /// [`bvh::lbvh`].
    Lbvh,
    /// [`bvh::hlbvh`].
    Hlbvh,
    /// [`BvhTwoLevel`].
    BvhTwoLevel,
    /// [`DynamicBvh`].
    DynamicBvh,
    /// [`LooseOctree`].
    LooseOctree,
    /// [`kd_tree`].
    KdTree,
    /// [`quadtree`].
    Quadtree,
    /// [`Bsp`].
    Bsp,
}

impl IndexKind {
    /// All indexes, the reference first.
    pub const ALL: &'static [Self] = &[
        Self::BruteForce,
        Self::BruteSimd,
        Self::TimeOrder,
        Self::OspPaper,
        Self::Osp,
        Self::OctreeRebuild,
        Self::OctreePaper,
        Self::OctreeEveryChild,
        Self::OctreeBvh,
        Self::BvhMidpoint,
        Self::BvhMedian,
        Self::BvhSah,
        Self::BvhSahSweep,
        Self::Lbvh,
        Self::Hlbvh,
        Self::BvhTwoLevel,
        Self::DynamicBvh,
        Self::LooseOctree,
        Self::KdTree,
        Self::Quadtree,
        Self::Bsp,
    ];

    /// The indexes that are compared by default: the reference, the paper's two structures, and `Osp`.
    pub const DEFAULT: &'static [Self] = &[Self::BruteForce, Self::OspPaper, Self::Osp, Self::OctreeRebuild];

    /// The name on the command line and in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::BruteForce => "brute-force",
            Self::BruteSimd => "brute-simd",
            Self::TimeOrder => "time-order",
            Self::OspPaper => "osp-paper",
            Self::Osp => "osp",
            Self::OctreeRebuild => "octree-rebuild",
            Self::OctreePaper => "octree-paper",
            Self::OctreeEveryChild => "octree-every-child",
            Self::OctreeBvh => "octree-bvh",
            Self::BvhMidpoint => "bvh-midpoint",
            Self::BvhMedian => "bvh-median",
            Self::BvhSah => "bvh-sah",
            Self::BvhSahSweep => "bvh-sah-sweep",
            Self::Lbvh => "lbvh",
            Self::Hlbvh => "hlbvh",
            Self::BvhTwoLevel => "bvh-two-level",
            Self::DynamicBvh => "dynamic-bvh",
            Self::LooseOctree => "loose-octree",
            Self::KdTree => "kd-tree",
            Self::Quadtree => "quadtree",
            Self::Bsp => "bsp",
        }
    }

    /// The kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

    /// Whether the indexes of this kind use a setting.
    pub fn has(self, setting: IndexSetting) -> bool {
        match setting {
            IndexSetting::MaxDepth | IndexSetting::CutNodes => {
                matches!(self, Self::OspPaper | Self::OctreePaper)
            }
            IndexSetting::Cube => self == Self::OspPaper,
            IndexSetting::Buckets => {
                matches!(self, Self::OctreeBvh | Self::BvhSah | Self::Hlbvh | Self::BvhTwoLevel)
            }
            IndexSetting::LeafCapacity => matches!(
                self,
                Self::OctreeRebuild
                    | Self::OctreePaper
                    | Self::OctreeEveryChild
                    | Self::OctreeBvh
                    | Self::BvhMidpoint
                    | Self::BvhMedian
                    | Self::BvhSah
                    | Self::BvhSahSweep
                    | Self::Lbvh
                    | Self::Hlbvh
                    | Self::BvhTwoLevel
                    | Self::KdTree
                    | Self::Quadtree
            ),
            IndexSetting::MortonBits => matches!(self, Self::Lbvh | Self::Hlbvh),
        }
    }

    /// The number of levels below the root with these settings; `None` for an index without this setting.
    pub fn max_depth(self, settings: &IndexSettings) -> Option<u32> {
        match self {
            Self::OspPaper => Some(settings.max_depth.unwrap_or(DEFAULT_MAX_DEPTH)),
            Self::OctreePaper => Some(settings.octree_paper().max_depth),
            _ => None,
        }
    }

    /// The largest number of polygons of a leaf with these settings; `None` for an index without this setting.
    pub fn leaf_capacity(self, settings: &IndexSettings) -> Option<usize> {
        Some(match self {
            Self::OctreeRebuild | Self::OctreeEveryChild => settings.octree().leaf_capacity,
            Self::OctreePaper => settings.octree_paper().leaf_capacity,
            Self::BvhMidpoint => settings.midpoint().leaf_capacity,
            Self::BvhMedian => settings.median().leaf_capacity,
            Self::OctreeBvh | Self::BvhSah | Self::Hlbvh | Self::BvhTwoLevel => settings.sah().leaf_capacity,
            Self::BvhSahSweep => settings.sweep_sah().leaf_capacity,
            Self::Lbvh => settings.lbvh().leaf_capacity,
            Self::KdTree => settings.kd_tree().leaf_capacity,
            Self::Quadtree => settings.quadtree().leaf_capacity,
            _ => return None,
        })
    }

    /// An empty index of this kind with the default settings.
    pub fn create(self, config: &IndexConfig) -> Box<dyn SpatialIndex> {
        self.create_with(config, &IndexSettings::default())
    }

    /// An empty index of this kind. `osp-paper` takes time and memory proportional to 2 to the power of its depth; the
    /// others reserve room for the capacity alone.
    pub fn create_with(self, config: &IndexConfig, settings: &IndexSettings) -> Box<dyn SpatialIndex> {
        match self {
            Self::BruteForce => Box::new(BruteForce::with_capacity(config.room())),
            Self::BruteSimd => Box::new(BruteSimd::new(config)),
            Self::TimeOrder => Box::new(TimeOrder::new(config)),
            Self::OspPaper => {
                let tree = OspPaper::new(settings.osp_grid(config), config.room());
                Box::new(tree.with_cut_nodes(settings.cut_nodes))
            }
            Self::Osp => Box::new(Osp::new(config)),
            Self::OctreeRebuild => octree_rebuild(&settings.octree(), config),
            Self::OctreePaper => {
                let tree = OctreePaper::new(settings.octree_paper(), config);
                Box::new(tree.with_cut_nodes(settings.cut_nodes))
            }
            Self::OctreeEveryChild => octree_every_child(&settings.octree(), config),
            Self::OctreeBvh => octree_bvh(&settings.octree_bvh(), config),
            Self::BvhMidpoint => bvh::bvh_midpoint(&settings.midpoint(), config),
            Self::BvhMedian => bvh::bvh_median(&settings.median(), config),
            Self::BvhSah => bvh::bvh_sah(&settings.sah(), config),
            Self::BvhSahSweep => bvh::bvh_sah_sweep(&settings.sweep_sah(), config),
            Self::Lbvh => bvh::lbvh(&settings.lbvh(), config),
            Self::Hlbvh => bvh::hlbvh(&settings.hlbvh(), config),
            Self::BvhTwoLevel => Box::new(BvhTwoLevel::new(settings.two_level(), config)),
            Self::DynamicBvh => Box::new(DynamicBvh::new(config)),
            Self::LooseOctree => {
                Box::new(LooseOctree::new(LooseOctreeConfig::for_capacity(config.room()), config))
            }
            Self::KdTree => kd_tree(&settings.kd_tree(), config),
            Self::Quadtree => quadtree(&settings.quadtree(), config),
            Self::Bsp => Box::new(Bsp::new(BspConfig::default(), config)),
        }
    }
}
