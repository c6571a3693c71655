//! The walk in the order of the ids alone, the tree alone, and both: every query finds the same.

use super::{Both, assert_same, backends, config, cull};
use glam::Vec3;
use osp::{
    index::{BruteForce, IndexError, Node, Osp, SpatialIndex, Visit, Visitor},
    math::{Aabb, Frustum, Plane, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_testkit::boxes::{Place, Rng, drawn, root, shuffled, views};

/// Hides what lies in a half of the root cube, as nodes and one by one.
struct HalfHidden;

impl HalfHidden {
    fn hides(bounds: &Aabb) -> bool {
        bounds.max.x < root().center().x
    }
}

impl Visitor for HalfHidden {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        if Self::hides(node.bounds) { Visit::Skip } else { Visit::Descend }
    }

    fn polygons(&mut self, _ids: &[PolygonId], _decision: Visit) {}

    fn tests_polygons(&self) -> bool {
        true
    }

    fn hidden_of(&mut self, boxes: &[Aabb]) -> u16 {
        boxes.iter().enumerate().fold(0, |hidden, (i, bounds)| hidden | u16::from(Self::hides(bounds)) << i)
    }
}

/// Every query, against brute force.
pub(crate) fn assert_all_same(osp: &Osp, reference: &BruteForce, boxes: &[Aabb], seed: u64) {
    osp.validate().expect("a sound index");
    let mut frusta = views(&root(), 2, Place::Outside, seed);
    frusta.extend(views(&root(), 3, Place::Inside, seed + 1));
    assert_same(osp, reference, &frusta);
    let mut rng = Rng(seed);
    for frustum in &frusta {
        let expected = cull(reference, frustum);
        let mut visible = VisibleBlocks::new();
        let work = osp.frustum_cull_blocks(frustum, &mut visible);
        assert!(visible.ids().map(|id| id.0).eq(expected.iter().copied()));
        assert_eq!(work.reported as usize, expected.len());
        assert!(osp.thin_out(frustum, &mut visible, &mut HalfHidden));
        let left = expected.iter().filter(|&&id| !HalfHidden::hides(&boxes[id as usize]));
        assert!(visible.ids().map(|id| id.0).eq(left.copied()), "thinned out");

        let (point, direction) = (rng.point(&root()), rng.direction());
        let ray = Ray::new(point, direction);
        let mut hit = |id: PolygonId| ray.enter_box(&boxes[id.index()], f32::INFINITY);
        assert_eq!(osp.ray_nearest(&ray, 10.0, &mut hit), reference.ray_nearest(&ray, 10.0, &mut hit));
        assert_eq!(
            osp.ray_any(&ray, 10.0, &mut hit).is_some(),
            reference.ray_any(&ray, 10.0, &mut hit).is_some()
        );
        let (mut near, mut expected) = (Vec::new(), Vec::new());
        let mut distance_m = |id: PolygonId| boxes[id.index()].distance_squared(point).sqrt();
        osp.nearest(point, 9, &mut distance_m, &mut near);
        reference.nearest(point, 9, &mut distance_m, &mut expected);
        assert_eq!(near, expected);
        let sphere = Sphere { center: point, radius_m: 0.5 };
        let around = Aabb::cube(point, 0.8);
        let (mut found, mut expected) = (Vec::new(), Vec::new());
        osp.sphere_query(&sphere, &mut |_| true, &mut found);
        // Boxes alone decide where the polygons are not asked: the index may ask about more.
        found.retain(|id| boxes[id.index()].distance_squared(point) <= 0.25);
        reference.sphere_query(&sphere, &mut |_| true, &mut expected);
        expected.retain(|id: &PolygonId| boxes[id.index()].distance_squared(point) <= 0.25);
        osp.box_query(&around, &mut found);
        reference.box_query(&around, &mut expected);
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected);
    }
}

/// Draws, moves and erases, in several orders and on every instruction set.
#[test]
fn every_query_finds_the_same_by_the_walk_and_by_the_tree() {
    for (round, backend) in backends().into_iter().enumerate() {
        for (kind, mut boxes) in [drawn(4_000, 51), shuffled(drawn(4_000, 52), 53)].into_iter().enumerate() {
            let seed = (round * 10 + kind) as u64 * 100;
            let mut rng = Rng(seed + 7);
            let osp = Osp::with_backend(&config(), backend);
            let mut osp = if round % 2 == kind { osp } else { osp.with_most_in_order(0) };
            let mut reference = BruteForce::new();
            for turn in 0..2 {
                for i in 0..boxes.len() {
                    let id = PolygonId(i as u32);
                    osp.insert(id, &boxes[i]).unwrap();
                    reference.insert(id, &boxes[i]).unwrap();
                    assert_eq!(osp.insert(id, &boxes[i]), Err(IndexError::Duplicate(id)));
                    if i % 9 == 8 {
                        // One of those before moves, or goes and comes back.
                        let other = rng.below(i + 1);
                        let id = PolygonId(other as u32);
                        let by = rng.direction() * 0.1;
                        boxes[other] = Aabb::new(boxes[other].min + by, boxes[other].max + by);
                        if i % 2 == 0 {
                            osp.update(id, &boxes[other]).unwrap();
                            reference.update(id, &boxes[other]).unwrap();
                        } else {
                            osp.remove(id).unwrap();
                            assert_eq!(osp.bounds(id), None);
                            assert_eq!(osp.remove(id), Err(IndexError::Unknown(id)));
                            osp.insert(id, &boxes[other]).unwrap();
                            reference.update(id, &boxes[other]).unwrap();
                        }
                        assert_eq!(osp.bounds(id), Some(boxes[other]));
                        osp.commit();
                    }
                    if i % 401 == 0 {
                        assert_all_same(&osp, &reference, &boxes, seed + i as u64);
                    }
                }
                let mut ids: Vec<u32> = (0..boxes.len() as u32).collect();
                if turn == 1 {
                    for i in (1..ids.len()).rev() {
                        ids.swap(i, rng.below(i + 1));
                    }
                }
                for (i, &id) in ids.iter().enumerate() {
                    osp.remove(PolygonId(id)).unwrap();
                    reference.remove(PolygonId(id)).unwrap();
                    osp.commit();
                    if i % 401 == 0 || i > 3_960 && i % 13 == 0 {
                        assert_all_same(&osp, &reference, &boxes, seed + i as u64);
                    }
                }
                assert_eq!(osp.len(), 0);
            }
        }
    }
}

/// The commit after an import files all its polygons. A drawn block is filed when it has not changed for a while.
#[test]
fn polygons_are_filed_when_they_rest() {
    let boxes = drawn(6_000, 56);
    let mut both = Both::of(Osp::new(&config()).with_most_in_order(0));
    both.fill(&boxes, 6_000);
    assert_eq!(both.osp.moving(), 0);
    let mut both = Both::of(Osp::new(&config()).with_most_in_order(0));
    both.fill(&boxes, 16);
    assert!((1..=16 * 80).contains(&both.osp.moving()), "{} wait", both.osp.moving());
    (0..80).for_each(|_| both.osp.commit());
    assert_eq!(both.osp.moving(), 0);
    assert_all_same(&both.osp, &both.reference, &boxes, 58);
    // No query of a small model uses the tree.
    let mut both = Both::of(Osp::new(&config()));
    both.fill(&boxes, 16);
    (0..80).for_each(|_| both.osp.commit());
    assert_eq!(both.osp.moving(), 6_000);
}

/// Few groups are cut from inside a drawn model, and none if all of it is in view: no node of the tree is read.
#[test]
fn the_walk_in_order_answers_if_few_groups_are_cut() {
    let boxes = drawn(30_000, 59);
    let most = |groups: usize| {
        let mut osp = Osp::new(&config()).with_most_in_order(groups);
        boxes.iter().enumerate().for_each(|(i, b)| osp.insert(PolygonId(i as u32), b).unwrap());
        osp.commit();
        osp
    };
    let (by_tree, by_order) = (most(0), most(usize::MAX));
    let nodes = |osp: &Osp, frustum: &Frustum| osp.frustum_cull(frustum, &mut Vec::new()).nodes;
    let slab = |axis: Vec3| [Plane { normal: axis, d: 90.0 }, Plane { normal: -axis, d: 90.0 }];
    let [[a, b], [c, d], [e, f]] = [Vec3::X, Vec3::Y, Vec3::Z].map(slab);
    assert_eq!(nodes(&by_tree, &Frustum::new([a, b, c, d, e, f])), 1, "all in view");
    let frustum = &views(&root(), 1, Place::Inside, 60)[0];
    assert_ne!(nodes(&by_tree, frustum), nodes(&by_order, frustum));
    assert_eq!(nodes(&most(1_000), frustum), nodes(&by_order, frustum));
}

/// Whole blocks come and go while commits compute the boxes around them.
#[test]
fn the_boxes_above_hold_blocks_that_come_and_go() {
    let mut rng = Rng(60);
    let (mut both, mut there) = (Both::of(Osp::new(&config())), Vec::new());
    for frame in 0..6_000 {
        // Few lie far out, so that the boxes above depend on single blocks.
        let far = if rng.below(30) == 0 { 40.0 } else { 1.0 };
        let bounds = Aabb::cube(rng.point(&root()) * far, 0.02);
        let most = if frame < 2_000 { 25 } else { 90 };
        match rng.below(4) {
            0 if there.len() > most / 2 => both.remove(there.swap_remove(rng.below(there.len()))),
            1 | 2 if !there.is_empty() => both.update(there[rng.below(there.len())], &bounds),
            _ if there.len() < most => {
                let id = 16 * frame;
                there.push(id);
                both.insert(id, &bounds);
            }
            _ => {}
        }
        both.osp.commit();
        both.osp.validate().expect("valid");
        if frame % 8 == 0 {
            assert_same(&both.osp, &both.reference, &views(&root(), 1, Place::Outside, frame.into()));
        }
    }
}

/// The world outgrows the cells of a tree that has nodes already, again and again.
#[test]
fn a_tree_grows_above_its_nodes() {
    let boxes = drawn(6_000, 61);
    let mut both = Both::new();
    both.fill(&boxes, 16);
    for (i, far) in [9.0, 90.0, -4.0e3, 7.0e7].into_iter().enumerate() {
        for k in 0..400 {
            let id = 16 * (1_000 + 400 * i as u32 + k);
            let aside = Vec3::new((k % 20) as f32, (k / 20) as f32, 0.0);
            both.insert(id, &Aabb::cube(Vec3::splat(far) + aside * far.abs() * 0.1, far.abs() * 0.001));
            both.osp.commit();
        }
        both.osp.validate().expect("valid");
        assert_same(&both.osp, &both.reference, &views(&root(), 2, Place::Outside, i as u64));
    }
    (0..6_000).for_each(|id| both.remove(id));
    (0..600).for_each(|_| both.osp.commit());
    both.osp.validate().expect("valid");
}
