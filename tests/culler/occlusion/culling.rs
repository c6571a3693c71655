//! Culling an index: every index, every test, each polygon once.

use std::collections::BTreeSet;

use super::{
    guards::rectangle,
    random::Random,
    session::{Told, polygon, ribbon, view},
};
use glam::Vec3;
use osp::{
    index::{IndexConfig, Osp, SpatialIndex},
    occlusion::{
        CullConfig, NodeTest, OcclusionConfig, OcclusionStage, OcclusionVisitor, PolygonTest, ViewInput,
    },
    polygon::{Change, Geometry, PolygonId, VisibleBlocks},
    view::View,
};
use osp_lab::{
    Method,
    oracle::{Oracle, OracleConfig, Sight, Subject},
};
use osp_rivals::IndexKind;
use osp_session::scene::Scene;

fn inserted(kind: IndexKind, told: &Told) -> Box<dyn SpatialIndex> {
    let config = IndexConfig::default();
    // By default, queries of so few polygons do not use the tree.
    let mut index: Box<dyn SpatialIndex> = match kind {
        IndexKind::Osp => Box::new(Osp::new(&config).with_all_in_tree()),
        _ => kind.create(&config),
    };
    file(&mut *index, &told.scene, &told.changes);
    index
}

fn file(index: &mut dyn SpatialIndex, scene: &Scene, changes: &[Change]) {
    for change in changes {
        match *change {
            Change::Insert(id) => index.insert(id, &scene.bounds(id)),
            Change::Remove(id) => index.remove(id),
            Change::Repaint(_) | Change::Place(_) => Ok(()),
            Change::Update(id) => index.update(id, &scene.bounds(id)),
        }
        .expect("the index follows");
    }
    index.commit();
}

/// A wall of four by three metres at z = -1, some panels, and much behind and before it.
fn hall() -> Told {
    let mut random = Random::new(11);
    let mut events = vec![polygon(&rectangle(-1.0, [-2.0, 2.0], [-1.5, 1.5]), 1.0)];
    for stroke in 0..60 {
        events.extend(ribbon(stroke, 30, 0.03, &mut random));
    }
    Told::of(&events)
}

fn views() -> Vec<View> {
    let mut random = Random::new(12);
    let mut views =
        vec![view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO), view(Vec3::new(0.0, 0.0, -0.5), Vec3::NEG_Z)];
    views.extend((0..8).map(|_| view(random.direction().as_vec3() * 4.0, random.in_cube().as_vec3())));
    views
}

fn ids(list: &[PolygonId]) -> Vec<u32> {
    let mut ids: Vec<u32> = list.iter().map(|id| id.0).collect();
    ids.sort_unstable();
    ids
}

fn truth(told: &Told, view: &View, in_view: &[PolygonId]) -> Vec<(PolygonId, Sight)> {
    let subjects = in_view.iter().map(|&id| Subject {
        id,
        polygon: told.scene.polygon(id),
        occluder: Geometry::occluder(&told.scene, id),
    });
    let config = OracleConfig { width: 480, height: 320 };
    Oracle::new(&view.window().expect("a window"), subjects, config).answers().collect()
}

#[test]
fn every_index_and_culler_draws_each_visible_polygon_once() {
    let told = hall();
    let (mut culled, mut spared) = (0, 0);
    // Many combinations: fewer views where the tests themselves are slow.
    let count = if cfg!(debug_assertions) { 4 } else { usize::MAX };
    for view in views().into_iter().take(count) {
        let mut all = Vec::new();
        inserted(IndexKind::BruteForce, &told).frustum_cull(&view.frustum(), &mut all);
        let truth = truth(&told, &view, &all);
        let visible: BTreeSet<u32> =
            truth.iter().filter(|(_, sight)| *sight == Sight::Visible).map(|(id, _)| id.0).collect();
        for index_kind in IndexKind::ALL {
            let index = inserted(*index_kind, &told);
            for kind in Method::conservative_cullers() {
                for node_test in [NodeTest::Sphere, NodeTest::Box] {
                    for (polygon_test, least_polygons) in [
                        (PolygonTest::Never, 1),
                        (PolygonTest::InPartlyHiddenLeaves, 1),
                        (PolygonTest::Never, 40),
                    ] {
                        let cull = CullConfig { node_test, polygon_test, least_polygons };
                        let config = OcclusionConfig { cull, ..OcclusionConfig::default() };
                        let mut stage = OcclusionStage::with_culler(kind.create(64), config);
                        stage.follow(&told.scene, &told.changes);
                        let mut in_view = VisibleBlocks::new();
                        index.frustum_cull_blocks(&view.frustum(), &mut in_view);
                        let (input, mut left) =
                            (input(&*index, &told, &view, &in_view), VisibleBlocks::new());
                        let thinned = stage.cull(&input, &mut left).cull;
                        // A walk of the whole index.
                        let mut drawn = Vec::new();
                        let culler = stage.view().culler();
                        let mut visitor = OcclusionVisitor::new(culler, &told.scene, cull, &mut drawn);
                        index.traverse(&view.frustum(), &mut visitor);
                        let counts = visitor.counts();
                        let drawn = ids(&drawn);
                        let name = format!("{} {} {cull:?}", index_kind.name(), kind.name());
                        assert!(drawn.windows(2).all(|w| w[0] < w[1]), "{name}: twice the same");
                        let all = ids(&all);
                        assert!(
                            drawn.iter().all(|id| all.binary_search(id).is_ok()),
                            "{name}: outside the view"
                        );
                        for id in &visible {
                            assert!(drawn.binary_search(id).is_ok(), "{name}: {id} is visible; {counts:?}");
                        }
                        assert!(left.ids().map(|id| id.0).eq(drawn.iter().copied()), "{name}: thinned out");
                        assert!(thinned.node_tests <= counts.node_tests, "{name}: {thinned:?} {counts:?}");
                        culled += all.len() - drawn.len();
                        spared += counts.node_tests - thinned.node_tests;
                    }
                }
            }
        }
    }
    assert!(culled > 0 && spared > 0, "{culled} culled; {spared} tests fewer than a walk has");
}

fn input<'a>(
    index: &'a dyn SpatialIndex,
    told: &'a Told,
    view: &'a View,
    in_view: &'a VisibleBlocks,
) -> ViewInput<'a> {
    ViewInput { index, geometry: &told.scene, view, in_view, spaces: None }
}
