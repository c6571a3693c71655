//! The tested indexes: each as it is used, and some with settings with which small scenes reach all of their code.

use osp::index::{IndexConfig, Osp, SpatialIndex};
use osp_rivals::{
    Bsp, BspConfig, BvhTwoLevel, HlbvhConfig, IndexKind, KdTreeConfig, LbvhConfig, LooseOctree,
    LooseOctreeConfig, MedianConfig, MidpointConfig, OctreeBvhConfig, OctreeConfig, OctreePaper,
    OctreePaperConfig, OspGrid, OspPaper, QuadtreeConfig, SahConfig, SweepSahConfig, TwoLevelConfig,
    bvh_median, bvh_midpoint, bvh_sah, bvh_sah_sweep, hlbvh, kd_tree, lbvh, octree_bvh, octree_every_child,
    octree_rebuild, quadtree,
};

type Make = Box<dyn Fn(&IndexConfig) -> Box<dyn SpatialIndex>>;

pub(crate) struct Subject {
    pub(crate) name: &'static str,
    pub(crate) make: Make,
}

pub(crate) fn subjects() -> Vec<Subject> {
    let mut subjects: Vec<Subject> = IndexKind::ALL
        .iter()
        .map(|&kind| Subject { name: kind.name(), make: Box::new(move |config| kind.create(config)) })
        .collect();
    let mut add = |name, make: Make| subjects.push(Subject { name, make });
    let sah = SahConfig { leaf_capacity: 2, buckets: 3, ..SahConfig::default() };
    add("osp, no linear form", Box::new(|config| Box::new(Osp::new(config).with_linear_blocks(0))));
    add("osp, 4 blocks linear", Box::new(|config| Box::new(Osp::new(config).with_linear_blocks(4))));
    add(
        "osp-paper, 7 levels",
        Box::new(|config| {
            let size_m = config.root.extent().max_element();
            Box::new(OspPaper::new(OspGrid::new(config.root.center(), size_m, 7), 0))
        }),
    );
    add(
        "octree-paper, leaf 1",
        Box::new(|config| {
            Box::new(OctreePaper::new(OctreePaperConfig { leaf_capacity: 1, max_depth: 40 }, config))
        }),
    );
    add(
        "octree-rebuild, leaf 1",
        Box::new(|config| octree_rebuild(&OctreeConfig { leaf_capacity: 1, max_depth: 200 }, config)),
    );
    add(
        "octree-every-child, leaf 1",
        Box::new(|config| octree_every_child(&OctreeConfig { leaf_capacity: 1, max_depth: 200 }, config)),
    );
    add(
        "octree-bvh, cells of 8",
        Box::new(move |config| {
            octree_bvh(&OctreeBvhConfig { cell_capacity: 8, max_depth: 200, sah }, config)
        }),
    );
    add(
        "bvh-midpoint, leaf 1",
        Box::new(|config| bvh_midpoint(&MidpointConfig { leaf_capacity: 1 }, config)),
    );
    add("bvh-median, leaf 1", Box::new(|config| bvh_median(&MedianConfig { leaf_capacity: 1 }, config)));
    add("bvh-sah, leaf 2", Box::new(move |config| bvh_sah(&sah, config)));
    add(
        "bvh-sah-sweep, leaf 2",
        Box::new(|config| {
            bvh_sah_sweep(&SweepSahConfig { leaf_capacity: 2, ..SweepSahConfig::default() }, config)
        }),
    );
    add(
        "lbvh, leaf 1",
        Box::new(|config| lbvh(&LbvhConfig { leaf_capacity: 1, ..LbvhConfig::default() }, config)),
    );
    add(
        "hlbvh, leaf 2",
        Box::new(move |config| {
            hlbvh(&HlbvhConfig { treelet_bits: 6, sah, ..HlbvhConfig::default() }, config)
        }),
    );
    add(
        "bvh-two-level, often one",
        Box::new(move |config| {
            let two = TwoLevelConfig { max_share: 0.3, min_changed: 4, sah };
            Box::new(BvhTwoLevel::new(two, config))
        }),
    );
    add(
        "loose-octree, 2 levels",
        Box::new(|config| Box::new(LooseOctree::new(LooseOctreeConfig { max_depth: 2 }, config))),
    );
    add(
        "kd-tree, leaf 4",
        Box::new(|config| kd_tree(&KdTreeConfig { leaf_capacity: 4, max_share: 0.6 }, config)),
    );
    add(
        "quadtree, leaf 4",
        Box::new(|config| quadtree(&QuadtreeConfig { leaf_capacity: 4, max_depth: 9 }, config)),
    );
    add(
        "bsp, few pieces",
        Box::new(|config| {
            let few = BspConfig { candidates: 1, cut_weight: 0.0, max_pieces_per_polygon: 1 };
            Box::new(Bsp::new(few, config))
        }),
    );
    subjects
}
