//! The tested indexes: each as it is used, and some with settings with which small scenes reach all of their code.

use osp::index::{Backend, IndexConfig, Osp, SpatialIndex};
use osp_rivals::{
    Bsp, BspConfig, BvhTwoLevel, CutNodes, IndexKind, IndexSetting, IndexSettings, OctreePaper,
    OctreePaperConfig, OspGrid, OspPaper, TwoLevelConfig,
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
    add("osp, all in the tree", Box::new(|config| Box::new(Osp::new(config).with_all_in_tree())));
    add("osp, the tree if it may", Box::new(|config| Box::new(Osp::new(config).with_most_in_order(0))));
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
        "bvh-two-level, often one",
        Box::new(move |config| {
            let two = TwoLevelConfig { max_share: 0.3, min_changed: 4 };
            Box::new(BvhTwoLevel::new(two, config))
        }),
    );
    add(
        "bsp, few pieces",
        Box::new(|config| {
            let few = BspConfig { candidates: 1, cut_weight: 0.0, max_pieces_per_polygon: 1 };
            Box::new(Bsp::new(few, config))
        }),
    );
    for backend in Backend::ALL.iter().copied().filter(|backend| backend.is_available()) {
        add(
            backend.name(),
            Box::new(move |config| Box::new(Osp::with_backend(config, backend).with_all_in_tree())),
        );
    }
    // Settings change the work, and no answer.
    let has_any = |&kind: &IndexKind| IndexSetting::ALL.iter().any(|&setting| kind.has(setting));
    for kind in IndexKind::ALL.iter().copied().filter(has_any) {
        for settings in unusual() {
            add(kind.name(), Box::new(move |config| kind.create_with(config, &settings)));
        }
    }
    subjects
}

/// The trees of other crates, if they are compiled in.
pub(crate) fn peers() -> Vec<Subject> {
    #[cfg(feature = "peers")]
    let of = |&kind: &osp_rivals::PeerKind| Subject {
        name: kind.name(),
        make: Box::new(move |config| kind.create(config)),
    };
    #[cfg(feature = "peers")]
    return osp_rivals::PeerKind::ALL.iter().map(of).collect();
    #[cfg(not(feature = "peers"))]
    Vec::new()
}

/// Settings far from the usual ones: many nodes, and numbers out of every range.
fn unusual() -> [IndexSettings; 2] {
    let of = |max_depth, cube, buckets, leaf_capacity, morton_bits| IndexSettings {
        max_depth: Some(max_depth),
        cube,
        cut_nodes: CutNodes::Tested,
        buckets,
        leaf_capacity: Some(leaf_capacity),
        morton_bits,
    };
    [of(11, 3.7, 32, 500, 20), of(0, f32::NAN, 0, 0, 0)]
}
