//! Settings of the structures: they change the work of the kinds that they concern, and no answer.

use glam::Vec3;
use osp::{
    index::{IndexConfig, WorkCounts},
    polygon::PolygonId,
};
use osp_rivals::{CutNodes, IndexKind, IndexSetting, IndexSettings};

use crate::scenes::{around, frusta, scattered};

/// The work of a few frustum queries among many small boxes, after them all.
fn work_of(kind: IndexKind, settings: &IndexSettings) -> WorkCounts {
    let room = around(Vec3::ZERO, 4.0);
    let boxes = scattered(2000, &room, 0.2, 7);
    let mut index = kind.create_with(&IndexConfig { root: room, capacity: boxes.len() }, settings);
    for (id, bounds) in boxes.iter().enumerate() {
        index.insert(PolygonId(id as u32), bounds).expect("a box");
    }
    index.commit();
    let mut work = WorkCounts::default();
    for frustum in frusta(&boxes) {
        work += index.frustum_cull(&frustum, &mut Vec::new());
    }
    work
}

#[test]
fn a_setting_changes_the_work_of_the_kinds_that_it_concerns() {
    let usual = IndexSettings::default();
    let other = |setting| match setting {
        IndexSetting::MaxDepth => IndexSettings { max_depth: Some(2), ..usual },
        IndexSetting::Cube => IndexSettings { cube: 1.7, ..usual },
        IndexSetting::CutNodes => IndexSettings { cut_nodes: CutNodes::Drawn, ..usual },
        IndexSetting::Buckets => IndexSettings { buckets: 2, ..usual },
        IndexSetting::LeafCapacity => IndexSettings { leaf_capacity: Some(5), ..usual },
        IndexSetting::MortonBits => IndexSettings { morton_bits: 1, ..usual },
    };
    for &kind in IndexKind::ALL {
        let usually = work_of(kind, &usual);
        for setting in IndexSetting::ALL {
            let changes = work_of(kind, &other(setting)) != usually;
            assert_eq!(changes, kind.has(setting), "{setting:?} of {}", kind.name());
        }
    }
}
