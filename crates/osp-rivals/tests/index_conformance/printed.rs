//! The paper's trees as printed: they draw more polygons, never fewer. Also the number of tests of an insertion.

use osp::{
    index::{BruteForce, IndexConfig, SpatialIndex, Visit, Visitor},
    polygon::PolygonId,
};
use osp_rivals::{CutNodes, OctreePaper, OctreePaperConfig, OspGrid, OspPaper};

use crate::scenes::{around, frusta, scattered};

struct All(Vec<u32>);

impl Visitor for All {
    fn node(&mut self, _: &osp::index::Node<'_>) -> Visit {
        Visit::Descend
    }

    fn polygons(&mut self, ids: &[PolygonId], _: Visit) {
        self.0.extend(ids.iter().map(|id| id.0));
    }
}

#[test]
fn a_cut_node_draws_all_its_polygons_as_in_figure_6() {
    let room = around(glam::Vec3::ZERO, 4.0);
    let boxes = scattered(2000, &room, 0.2, 5);
    let config = IndexConfig { root: room, capacity: 2000 };
    let grid = OspGrid::new(room.center(), 4.0, 9);
    let octree = OctreePaper::new(OctreePaperConfig::default(), &config);
    let mut trees: [Box<dyn SpatialIndex>; 2] = [
        Box::new(OspPaper::new(grid, 0).with_cut_nodes(CutNodes::Drawn)),
        Box::new(octree.with_cut_nodes(CutNodes::Drawn)),
    ];
    let mut exact = BruteForce::with_capacity(2000);
    for (i, bounds) in boxes.iter().enumerate() {
        let id = PolygonId(i as u32);
        exact.insert(id, bounds).expect("a box");
        for tree in &mut trees {
            tree.insert(id, bounds).expect("a box");
        }
    }
    let mut over_drawn = [0; 2];
    for frustum in frusta(&boxes) {
        let mut in_view = Vec::new();
        exact.frustum_cull(&frustum, &mut in_view);
        for (tree, over_drawn) in trees.iter_mut().zip(&mut over_drawn) {
            tree.commit();
            let mut drawn = Vec::new();
            let work = tree.frustum_cull(&frustum, &mut drawn);
            assert_eq!(work.reported as usize, drawn.len());
            let mut drawn: Vec<u32> = drawn.iter().map(|id| id.0).collect();
            drawn.sort_unstable();
            assert!(drawn.windows(2).all(|w| w[0] < w[1]), "{}: twice the same", tree.name());
            for id in &in_view {
                assert!(drawn.binary_search(&id.0).is_ok(), "{}: {} is in view", tree.name(), id.0);
            }
            let mut walked = All(Vec::new());
            tree.traverse(&frustum, &mut walked);
            walked.0.sort_unstable();
            assert_eq!(walked.0, drawn, "{}", tree.name());
            *over_drawn += drawn.len() - in_view.len();
        }
    }
    assert!(over_drawn.iter().all(|&more| more > 100), "{over_drawn:?}");
}

/// Section 2.1: a level of the OSP tree takes three planes, a level of the octree three for each of eight children.
#[test]
fn insertion_into_an_octree_tests_eight_times_as_many_planes_a_level() {
    let room = around(glam::Vec3::ZERO, 4.0);
    // The boxes lie in the middle of an octant, of an octant of this octant, and so on, so no plane cuts them.
    let at = |level: i32| glam::Vec3::splat(2.0 - 2.0f32.powi(-level));
    let config = IndexConfig { root: room, capacity: 0 };
    let mut osp = OspPaper::new(OspGrid::new(room.center(), 4.0, 12), 0);
    let one_each = OctreePaperConfig { leaf_capacity: 0, max_depth: 4 };
    let mut octree = OctreePaper::new(one_each, &config);
    // Two boxes in opposite corners span the cube, so that the octree has the OSP tree's root.
    let corners = [-1.99, 1.99].map(|x| around(glam::Vec3::splat(x), 0.02));
    for (i, bounds) in corners.iter().enumerate() {
        osp.insert(PolygonId(i as u32), bounds).expect("a box");
        octree.insert(PolygonId(i as u32), bounds).expect("a box");
    }
    octree.commit();
    let (osp_before, octree_before) = (osp.insertions(), octree.insertions());
    assert_eq!((osp_before.polygons, osp_before.planes, osp_before.nodes), (2, 2 * 12, 0));
    assert_eq!((octree_before.polygons, octree_before.nodes), (2, 2 * 4 * 8));
    assert_eq!(octree_before.planes, 3 * octree_before.nodes);
    // For a third box, the OSP tree inserts only this box, the octree all three again.
    let third = around(at(4), 1.0e-3);
    osp.insert(PolygonId(2), &third).expect("a box");
    octree.insert(PolygonId(2), &third).expect("a box");
    octree.commit();
    assert_eq!(osp.insertions().planes - osp_before.planes, 12);
    assert_eq!(octree.insertions().planes - octree_before.planes, 3 * 4 * 8 * 3);
    octree.commit();
    assert_eq!(octree.insertions().polygons, 5, "nothing has changed: nothing is built");
}
