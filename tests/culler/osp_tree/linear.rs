//! The linear form: few polygons are a plain list, and the change to a tree and back loses nothing.

use super::{Both, assert_same, backends, config, cull, life::depth, tree};
use glam::Vec3;
use osp::{
    index::{BruteForce, IndexError, Osp, SpatialIndex, Thinner, Visit},
    math::{Aabb, Frustum, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_testkit::boxes::{Place, Rng, drawn, root, shuffled, views};

/// Whether the index is a plain list now: no node is above a block.
fn is_linear(osp: &Osp) -> bool {
    depth(osp) == 0
}

/// Hides what lies in a half of the root cube, as nodes and one by one.
struct HalfHidden;

impl HalfHidden {
    fn hides(bounds: &Aabb) -> bool {
        bounds.max.x < root().center().x
    }
}

impl Thinner for HalfHidden {
    fn least_polygons(&self) -> usize {
        1
    }

    fn tests_polygons(&self) -> bool {
        true
    }

    fn node(&mut self, bounds: &Aabb, _polygons: usize) -> Visit {
        if Self::hides(bounds) { Visit::Skip } else { Visit::Descend }
    }

    fn is_hidden(&mut self, bounds: &Aabb) -> bool {
        Self::hides(bounds)
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

/// Draws until there is a tree, erases until there is none, in several orders and on every instruction set.
#[test]
fn a_list_becomes_a_tree_and_a_list_again() {
    for (round, backend) in backends().into_iter().enumerate() {
        for (kind, mut boxes) in [drawn(4_000, 51), shuffled(drawn(4_000, 52), 53)].into_iter().enumerate() {
            let seed = (round * 10 + kind) as u64 * 100;
            let mut rng = Rng(seed + 7);
            // A list of scattered polygons may be longer.
            let blocks = if kind == 0 { 96 } else { 24 };
            let (mut osp, mut reference) = (tree(backend).with_linear_blocks(blocks), BruteForce::new());
            let (mut was_linear, mut was_tree) = (false, false);
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
                    if i % 401 == 0 || (1_500..1_600).contains(&i) && i % 16 < 2 {
                        assert_all_same(&osp, &reference, &boxes, seed + i as u64);
                        (was_linear, was_tree) =
                            (was_linear || is_linear(&osp), was_tree || !is_linear(&osp));
                    }
                }
                assert!(was_linear && was_tree, "drawing has not crossed the border");
                (was_linear, was_tree) = (false, false);
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
                    if i % 401 == 0 || i > 3_000 && i % 50 == 0 || i > 3_960 && i % 13 == 0 {
                        assert_all_same(&osp, &reference, &boxes, seed + i as u64);
                        (was_linear, was_tree) =
                            (was_linear || is_linear(&osp), was_tree || !is_linear(&osp));
                    }
                }
                assert!(was_linear && was_tree, "erasing has not crossed the border");
                assert_eq!(osp.len(), 0);
            }
        }
    }
}

/// Drawing and erasing at the border does not move everything back and forth.
#[test]
fn the_border_is_crossed_once() {
    let boxes = drawn(4_000, 54);
    let mut osp = Osp::new(&config());
    let mut border = 0;
    while is_linear(&osp) {
        osp.insert(PolygonId(border as u32), &boxes[border]).unwrap();
        osp.commit();
        border += 1;
    }
    for _ in 0..100 {
        for i in (border - 20..border).rev() {
            osp.remove(PolygonId(i as u32)).unwrap();
            osp.commit();
            assert!(!is_linear(&osp));
        }
        for (i, bounds) in boxes.iter().enumerate().take(border).skip(border - 20) {
            osp.insert(PolygonId(i as u32), bounds).unwrap();
            osp.commit();
        }
    }
    osp.validate().unwrap();
}

/// Scattered polygons that come a few in each frame stay a list for longer, and become a tree when no more come.
#[test]
fn scattered_polygons_become_a_tree_when_no_more_come() {
    let boxes = shuffled(drawn(6_000, 56), 57);
    let mut both = Both::of(Osp::new(&config()));
    both.fill(&boxes, 16);
    let Both { mut osp, reference, .. } = both;
    assert!(is_linear(&osp) && osp.moving() == 0);
    assert_all_same(&osp, &reference, &boxes, 58);
    for frame in 0..1_200 {
        osp.commit();
        if frame % 50 == 0 {
            assert_all_same(&osp, &reference, &boxes, 59 + frame);
        }
    }
    assert!(!is_linear(&osp) && osp.moving() == 0);
    // Those drawn in order are a tree at once.
    let mut both = Both::of(Osp::new(&config()));
    both.fill(&drawn(6_000, 56), 16);
    assert!(!is_linear(&both.osp));
}

/// Few polygons whose numbers lie far apart are many blocks; those of one stroke are few.
#[test]
fn the_limit_counts_blocks() {
    let boxes = drawn(300, 55);
    let (mut near, mut apart) = (Osp::new(&config()), Osp::new(&config()));
    for (i, bounds) in boxes.iter().enumerate() {
        near.insert(PolygonId(1_000_000 + i as u32), bounds).unwrap();
        apart.insert(PolygonId(i as u32 * 1_000), bounds).unwrap();
    }
    assert!(is_linear(&near) && !is_linear(&apart));
    let nodes = near.frustum_cull(&Frustum::everything(), &mut Vec::new()).nodes;
    assert!(nodes <= 2 + 300 / 8, "300 polygons: {nodes} nodes and pages");
    near.validate().unwrap();
    apart.validate().unwrap();
    // A new limit for an index that has polygons already.
    let mut near = near.with_linear_blocks(3);
    assert_eq!(near.moving(), 300);
    near.validate().unwrap();
    let mut list = Vec::new();
    near.frustum_cull(&Frustum::everything(), &mut list);
    assert_eq!(list.len(), 300);
    near.clear();
    near.insert(PolygonId(5), &Aabb::cube(Vec3::ZERO, 1.0)).unwrap();
    assert!(is_linear(&near));
    near.validate().unwrap();
}

/// The blocks of a full list go to the tree a few in each frame.
#[test]
fn a_full_list_becomes_a_tree_step_by_step() {
    let mut osp = Osp::new(&config());
    let (mut most, mut commits) = (0, 0);
    for (frame, came) in drawn(6_000, 58).chunks(16).enumerate() {
        for (lane, bounds) in came.iter().enumerate() {
            osp.insert(PolygonId((16 * frame + lane) as u32), bounds).unwrap();
        }
        let waiting = osp.moving();
        osp.commit();
        osp.validate().unwrap();
        most = most.max(waiting - osp.moving());
        commits += usize::from(waiting > 0);
    }
    assert!((16..=256).contains(&most), "a commit moves {most} polygons");
    assert!((20..=120).contains(&commits), "{commits} commits");
    assert_eq!(osp.moving(), 0);
}

/// Whole blocks go while the list measures the box around everything, a group of blocks a commit.
#[test]
fn the_box_around_a_list_holds_blocks_that_change_their_place() {
    let mut rng = Rng(60);
    let (mut both, mut there) = (Both::of(Osp::new(&config())), Vec::new());
    for frame in 0..6_000 {
        // Few lie far out, so that the box around everything depends on single blocks.
        let far = if rng.below(30) == 0 { 40.0 } else { 1.0 };
        let bounds = Aabb::cube(rng.point(&root()) * far, 0.02);
        // First so few blocks that no block is tested, then several groups of blocks.
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
    assert!(is_linear(&both.osp));
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
