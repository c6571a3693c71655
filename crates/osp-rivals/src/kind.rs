use super::{
    BruteSimd, Bsp, BspConfig, BvhTwoLevel, DynamicBvh, KdTreeConfig, LooseOctree, LooseOctreeConfig,
    OctreeConfig, OctreePaper, OctreePaperConfig, OspPaper, QuadtreeConfig, TimeOrder, TwoLevelConfig, bvh,
    kd_tree, octree_rebuild, quadtree,
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

    /// An empty index of this kind.
    pub fn create(self, config: &IndexConfig) -> Box<dyn SpatialIndex> {
        match self {
            Self::BruteForce => Box::new(BruteForce::with_capacity(config.room())),
            Self::BruteSimd => Box::new(BruteSimd::new(config)),
            Self::TimeOrder => Box::new(TimeOrder::new(config)),
            Self::OspPaper => Box::new(OspPaper::from_config(config)),
            Self::Osp => Box::new(Osp::new(config)),
            Self::OctreeRebuild => octree_rebuild(&OctreeConfig::default(), config),
            Self::OctreePaper => Box::new(OctreePaper::new(OctreePaperConfig::default(), config)),
            Self::BvhMidpoint => bvh::bvh_midpoint(&bvh::MidpointConfig::default(), config),
            Self::BvhMedian => bvh::bvh_median(&bvh::MedianConfig::default(), config),
            Self::BvhSah => bvh::bvh_sah(&bvh::SahConfig::default(), config),
            Self::BvhSahSweep => bvh::bvh_sah_sweep(&bvh::SweepSahConfig::default(), config),
            Self::Lbvh => bvh::lbvh(&bvh::LbvhConfig::default(), config),
            Self::Hlbvh => bvh::hlbvh(&bvh::HlbvhConfig::default(), config),
            Self::BvhTwoLevel => Box::new(BvhTwoLevel::new(TwoLevelConfig::default(), config)),
            Self::DynamicBvh => Box::new(DynamicBvh::new(config)),
            Self::LooseOctree => {
                Box::new(LooseOctree::new(LooseOctreeConfig::for_capacity(config.room()), config))
            }
            Self::KdTree => kd_tree(&KdTreeConfig::default(), config),
            Self::Quadtree => quadtree(&QuadtreeConfig::default(), config),
            Self::Bsp => Box::new(Bsp::new(BspConfig::default(), config)),
        }
    }
}
