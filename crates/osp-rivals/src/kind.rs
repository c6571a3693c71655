use super::{
    BruteSimd, Bsp, BspConfig, BvhTwoLevel, DynamicBvh, IndexSetting, IndexSettings, LooseOctree,
    OctreePaper, OspPaper, TimeOrder, TwoLevelConfig,
    bucket_tree::BucketTree,
    bvh::{
        BinnedSahBuilder, HlbvhBuilder, LbvhBuilder, Median, Midpoint, SweepSahBuilder,
        top_down::InPlaceBuilder,
    },
    kd_tree::KdPartition,
    lagging::Lagging,
    octree_bvh::OctreeBvhBuilder,
    octree_every_child::OctreeEveryChild,
    octree_rebuild::{DEEPEST, OctreeBuilder},
    quadtree::QuadPartition,
    rebuilt::{Rebuilt, TreeBuilder},
};
use osp::index::{BruteForce, IndexConfig, Osp, SpatialIndex};

/// The indexes, by name. Those that are rebuilt do so in every commit that follows a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum IndexKind {
    BruteForce,
    BruteSimd,
    TimeOrder,
    OspPaper,
    Osp,
    /// The octree that the paper compares its tree with, in its best form: rebuilt once in a frame with changes.
    OctreeRebuild,
    /// The same octree, rebuilt for each inserted polygon, as in the paper.
    OctreeRebuildInsert,
    /// The same octree, rebuilt by another thread, with a list of the polygons that it lacks.
    OctreeRebuildThread,
    /// The same octree, rebuilt by every 16th commit, with a list of the polygons that it lacks.
    OctreeRebuildNth,
    OctreePaper,
    /// An octree that stores a polygon in every child that it touches, rebuilt.
    OctreeEveryChild,
    /// An octree with a hierarchy in each of its cells, rebuilt.
    OctreeBvh,
    /// A hierarchy halved in the middle of space, rebuilt.
    BvhMidpoint,
    /// A hierarchy halved by number of polygons, rebuilt.
    BvhMedian,
    /// A hierarchy split by the surface area heuristic over a few buckets, rebuilt.
    BvhSah,
    /// A hierarchy split by the surface area heuristic over all positions, rebuilt.
    BvhSahSweep,
    /// A hierarchy along the Morton curve, rebuilt.
    Lbvh,
    /// A hierarchy along the Morton curve whose top is made by the surface area heuristic, rebuilt.
    Hlbvh,
    BvhTwoLevel,
    DynamicBvh,
    LooseOctree,
    /// A k-d tree that inserts polygons one at a time.
    KdTree,
    /// A quadtree over the ground that inserts polygons one at a time.
    Quadtree,
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
        Self::OctreeRebuildInsert,
        Self::OctreeRebuildThread,
        Self::OctreeRebuildNth,
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
            Self::OctreeRebuildInsert => "octree-rebuild-insert",
            Self::OctreeRebuildThread => "octree-rebuild-thread",
            Self::OctreeRebuildNth => "octree-rebuild-nth",
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

    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }

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
                    | Self::OctreeRebuildInsert
                    | Self::OctreeRebuildThread
                    | Self::OctreeRebuildNth
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

    /// An empty index of this kind with the default settings.
    pub fn create(self, config: &IndexConfig) -> Box<dyn SpatialIndex> {
        self.create_with(config, &IndexSettings::default())
    }

    /// An empty index of this kind. `osp-paper` takes time and memory proportional to 2 to the power of its depth; the
    /// others reserve room for the capacity alone.
    pub fn create_with(self, config: &IndexConfig, settings: &IndexSettings) -> Box<dyn SpatialIndex> {
        fn rebuilt(builder: impl TreeBuilder, config: &IndexConfig) -> Box<dyn SpatialIndex> {
            Box::new(Rebuilt::new(builder, config.room()))
        }
        let leaf = settings.leaf();
        match self {
            Self::BruteForce => Box::new(BruteForce::with_capacity(config.room())),
            Self::BruteSimd => Box::new(BruteSimd::new(config)),
            Self::TimeOrder => Box::new(TimeOrder::new(config)),
            Self::OspPaper => {
                let tree = OspPaper::new(settings.osp_grid(config), config.room());
                Box::new(tree.with_cut_nodes(settings.cut_nodes))
            }
            Self::Osp => Box::new(Osp::new(config)),
            Self::OctreeRebuild => rebuilt(OctreeBuilder::<false>::new(leaf, DEEPEST), config),
            Self::OctreeRebuildInsert => rebuilt(OctreeBuilder::<true>::new(leaf, DEEPEST), config),
            Self::OctreeRebuildThread => Box::new(Lagging::on_thread(leaf, config)),
            Self::OctreeRebuildNth => Box::new(Lagging::every_nth(leaf, config)),
            Self::OctreePaper => {
                let tree = OctreePaper::new(settings.octree_paper(), config);
                Box::new(tree.with_cut_nodes(settings.cut_nodes))
            }
            Self::OctreeEveryChild => Box::new(OctreeEveryChild::new(leaf, config)),
            Self::OctreeBvh => rebuilt(OctreeBvhBuilder::new(settings.sah()), config),
            Self::BvhMidpoint => rebuilt(InPlaceBuilder::new(Midpoint(leaf)), config),
            Self::BvhMedian => rebuilt(InPlaceBuilder::new(Median(leaf)), config),
            Self::BvhSah => rebuilt(BinnedSahBuilder::new(settings.sah()), config),
            Self::BvhSahSweep => rebuilt(SweepSahBuilder::new(leaf), config),
            Self::Lbvh => rebuilt(LbvhBuilder::new(leaf, settings.morton_bits), config),
            Self::Hlbvh => rebuilt(HlbvhBuilder::new(settings.morton_bits, settings.sah()), config),
            Self::BvhTwoLevel => Box::new(BvhTwoLevel::by(settings.sah(), TwoLevelConfig::default(), config)),
            Self::DynamicBvh => Box::new(DynamicBvh::new(config)),
            Self::LooseOctree => Box::new(LooseOctree::new(config)),
            Self::KdTree => Box::new(BucketTree::new(KdPartition, leaf, config)),
            Self::Quadtree => Box::new(BucketTree::new(QuadPartition::new(&config.root), leaf, config)),
            Self::Bsp => Box::new(Bsp::new(BspConfig::default(), config)),
        }
    }
}

/// When `octree-rebuild` builds its tree again, by the name on the command line: the index that does.
pub const REBUILDS: [(&str, IndexKind); 4] = [
    ("frame", IndexKind::OctreeRebuild),
    ("insert", IndexKind::OctreeRebuildInsert),
    ("thread", IndexKind::OctreeRebuildThread),
    ("nth", IndexKind::OctreeRebuildNth),
];
