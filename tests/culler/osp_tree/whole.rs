//! What is answered as a whole: a small tree, which is one list, and a tree that lies in view altogether.

use super::{Both, backends, config, cull, tree};
use glam::Vec3;
use osp::{
    index::{Osp, SpatialIndex},
    math::{Aabb, Frustum, Plane},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_testkit::boxes::drawn;

/// A frustum with much room around the origin.
fn around_everything() -> Frustum {
    let plane = |normal: Vec3| Plane { normal, d: 1.0e4 };
    Frustum::new([Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(plane))
}

/// Nodes that a query looks at, and the ids that it appends to a list that has one already.
fn ask(osp: &Osp, frustum: &Frustum) -> (u64, Vec<u32>) {
    let mut list = Vec::new();
    list.push(PolygonId(u32::MAX));
    let work = osp.frustum_cull(frustum, &mut list);
    let mut ids: Vec<u32> = list.iter().map(|id| id.0).collect();
    assert_eq!(ids.remove(0), u32::MAX, "what was in the list stays");
    assert_eq!(work.reported, ids.len() as u64);
    (work.nodes, ids)
}

#[test]
fn a_tree_in_view_altogether_is_listed_by_id() {
    let everything = around_everything();
    for backend in backends() {
        for first in [0, 1 << 20] {
            let mut both = Both::of(tree(backend));
            (first..).zip(&drawn(9_000, 31)).for_each(|(id, bounds)| both.insert(id, bounds));
            both.osp.commit();
            assert_eq!(both.osp.moving(), 0);
            // Single polygons, a part of a block, and 2,500 consecutive polygons are removed.
            let gone =
                (0..9_000).filter(|i| i % 83 == 0 || (900..905).contains(i) || (4_000..6_500).contains(i));
            gone.for_each(|i| both.remove(first + i));
            both.osp.commit();
            let Both { mut osp, reference, .. } = both;
            let (nodes, mut ids) = ask(&osp, &everything);
            assert_eq!(nodes, 1, "the tree was looked through");
            assert!(ids.is_sorted(), "listed by id");
            ids.sort_unstable();
            assert_eq!(ids, cull(&reference, &everything));

            // The same as blocks.
            let mut found = VisibleBlocks::new();
            osp.frustum_cull_blocks(&everything, &mut found);
            assert_eq!(found.to_vec().len(), ids.len());
            assert_eq!(found.len(), ids.len());

            // A polygon outside, and it is not all in view any more.
            let outside = PolygonId(first + 20_000);
            let far = Aabb::cube(Vec3::new(2.0e4, 0.0, 0.0), 1.0);
            osp.insert(outside, &far).unwrap();
            osp.insert(PolygonId(first + 30_000), &far).unwrap();
            let (_, mut with_outside) = ask(&osp, &everything);
            with_outside.sort_unstable();
            assert_eq!(with_outside, ids);
        }
    }
}

/// A list of nine pages, of which only the last one holds something outside.
#[test]
fn a_list_is_in_view_altogether_only_if_its_last_page_is() {
    let everything = around_everything();
    for inside in [135, 150] {
        let mut both = Both::new();
        for pair in 0..150_u32 {
            let at = Vec3::new(pair as f32 * if pair < inside { 0.01 } else { 1.0e3 }, 0.0, 0.0);
            for id in [2 * pair, 2 * pair + 1] {
                both.insert(id, &Aabb::cube(at + Vec3::Y * (id % 2) as f32 * 0.001, 0.001));
            }
        }
        both.osp.commit();
        let Both { osp, reference, .. } = both;
        let (nodes, mut ids) = ask(&osp, &everything);
        ids.sort_unstable();
        assert_eq!(ids, cull(&reference, &everything));
        assert_eq!(nodes == 1, inside == 150, "{nodes} nodes");
    }
}

/// Some polygons of the first block are in the tree, others are not.
#[test]
fn a_block_that_is_partly_filed_is_in_view_with_both_parts() {
    for backend in backends() {
        let mut osp = tree(backend);
        let boxes = drawn(600, 40);
        for id in (0..600).filter(|id| !(8..16).contains(id)).chain(8..12) {
            osp.insert(PolygonId(id), &boxes[id as usize]).unwrap();
        }
        let mut found = VisibleBlocks::new();
        osp.frustum_cull_blocks(&around_everything(), &mut found);
        let expected = (0..600).filter(|id| !(12..16).contains(id));
        assert!(found.ids().map(|id| id.0).eq(expected) && found.len() == osp.len());
    }
}

/// The block that is being drawn is the first with numbers so high.
#[test]
fn what_is_drawn_now_may_have_the_highest_number() {
    for backend in backends() {
        let mut osp = tree(backend);
        for (id, bounds) in [0, 16, 4096, 1 << 20].into_iter().zip(&drawn(4, 39)) {
            osp.insert(PolygonId(id), bounds).unwrap();
            let mut found = VisibleBlocks::new();
            osp.frustum_cull_blocks(&around_everything(), &mut found);
            assert!(found.contains(PolygonId(id)) && found.len() == osp.len());
            let mut both = [VisibleBlocks::new(), VisibleBlocks::new()];
            osp.frustum_cull_views(&[around_everything(); 2], &mut both);
            assert!(both.iter().all(|found| found.contains(PolygonId(id)) && found.len() == osp.len()));
        }
    }
}

#[test]
fn few_polygons_far_apart_in_their_numbers_are_not_looked_for_by_number() {
    let mut osp = Osp::new(&config());
    let boxes = drawn(600, 32);
    for (i, bounds) in boxes.iter().enumerate() {
        osp.insert(PolygonId(i as u32 * 5_000), bounds).unwrap();
    }
    let (_, mut ids) = ask(&osp, &around_everything());
    ids.sort_unstable();
    assert_eq!(ids, (0..600).map(|i| i * 5_000).collect::<Vec<u32>>());
}
