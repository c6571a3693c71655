//! Scattered polygons that rest: what is in view as a whole is copied, and a change makes no copy wrong.

use super::{Both, backends, config, linear::assert_all_same};
use osp::{
    index::{Osp, SpatialIndex},
    polygon::PolygonId,
};
use osp_testkit::boxes::{Place, Rng, drawn, root, shuffled, views};

const POLYGONS: usize = 12_000;

/// Nodes that some queries look at.
fn looked_at(osp: &Osp) -> u64 {
    let frusta = views(&root(), 8, Place::Outside, 5);
    frusta.iter().map(|frustum| osp.frustum_cull(frustum, &mut Vec::new()).nodes).sum()
}

fn rest(osp: &mut Osp) {
    for _ in 0..300 {
        osp.commit();
    }
}

#[test]
fn what_rests_is_copied_and_what_changes_is_not() {
    for (round, backend) in backends().into_iter().enumerate() {
        let mut boxes = shuffled(drawn(POLYGONS, 61), 62);
        let mut both = Both::of(Osp::with_backend(&config(), backend).with_linear_blocks(0));
        both.fill(&boxes, 64);
        let Both { mut osp, mut reference, .. } = both;
        // Polygons in flat rows return first.
        let returns = (0..10_000).find(|_| {
            osp.commit();
            osp.moving() == 0
        });
        assert!(returns.is_some(), "{} polygons have not returned", osp.moving());
        osp.remove(PolygonId(0)).unwrap();
        osp.insert(PolygonId(0), &boxes[0]).unwrap();
        let before = looked_at(&osp);
        rest(&mut osp);
        let at_rest = looked_at(&osp);
        assert!(at_rest * 5 < before * 4, "{before} nodes looked at, and {at_rest} when it rests");
        let mut rng = Rng(round as u64 + 63);
        for turn in 0..12 {
            for _ in 0..[1, 40, 700][turn % 3] {
                let at = rng.below(POLYGONS);
                let id = PolygonId(at as u32);
                match rng.below(3) {
                    0 => {
                        osp.remove(id).unwrap();
                        osp.insert(id, &boxes[at]).unwrap();
                    }
                    1 => {
                        // Some go far away, where the tree has to grow.
                        let by = rng.direction() * [0.01, 0.3, 40.0][rng.below(3)];
                        (boxes[at].min, boxes[at].max) = (boxes[at].min + by, boxes[at].max + by);
                        osp.update(id, &boxes[at]).unwrap();
                        reference.update(id, &boxes[at]).unwrap();
                    }
                    _ => osp.commit(),
                }
            }
            assert_all_same(&osp, &reference, &boxes, turn as u64);
            // Changes come before the copies are complete, or after.
            for _ in 0..[3, 18, 300][rng.below(3)] {
                osp.commit();
            }
            assert_all_same(&osp, &reference, &boxes, turn as u64 + 50);
        }
        // Nothing but what lay far away is left, and the tree loses its levels.
        for at in 0..POLYGONS - 50 {
            osp.remove(PolygonId(at as u32)).unwrap();
            reference.remove(PolygonId(at as u32)).unwrap();
            if at % 500 == 0 {
                osp.commit();
            }
        }
        rest(&mut osp);
        assert_all_same(&osp, &reference, &boxes, 99);
    }
}
