//! Views that see most of a model.

use super::{Both, backends, cull, tree};
use glam::Vec3;
use osp::{
    index::{BruteForce, IndexConfig, Osp, SpatialIndex},
    math::{Aabb, Frustum, Plane},
    polygon::{PolygonId, VisibleBlocks},
};
use osp_testkit::{
    allocations,
    boxes::{Place, Rng, drawn, root, shuffled, view, views},
};

/// Sees most of what is drawn in the root cube, but not the corners on one side.
fn most() -> Frustum {
    view(Vec3::new(0.4, 0.3, 5.2), Vec3::ZERO, 44.0, 1.1, 0.1, 20.0)
}

/// The ids of an answer as a list that had one already, and as blocks: the same.
fn ask(osp: &Osp, frustum: &Frustum, list: &mut Vec<PolygonId>, blocks: &mut VisibleBlocks) -> Vec<u32> {
    list.clear();
    list.push(PolygonId(u32::MAX));
    let work = osp.frustum_cull(frustum, list);
    let mut ids: Vec<u32> = list.iter().map(|id| id.0).collect();
    assert_eq!(ids.remove(0), u32::MAX, "what was in the list stays");
    assert_eq!(work.reported, ids.len() as u64);
    assert!(work.taken_whole <= work.reported);
    ids.sort_unstable();
    blocks.clear();
    let same = osp.frustum_cull_blocks(frustum, blocks);
    assert_eq!(same.reported, work.reported);
    assert!(same.taken_whole <= same.reported);
    assert_eq!(blocks.len(), ids.len());
    assert!(blocks.ids().map(|id| id.0).eq(ids.iter().copied()), "as blocks, another answer");
    ids
}

fn filled(ids: impl Fn(u32) -> u32, boxes: &[Aabb], osp: Osp) -> (Osp, BruteForce) {
    let mut both = Both::of(osp);
    for (i, bounds) in (0..).zip(boxes) {
        both.insert(ids(i), bounds);
        if i % 16 == 15 {
            both.osp.commit();
        }
    }
    (both.osp, both.reference)
}

#[test]
fn answers_do_not_depend_on_what_was_looked_for() {
    let mut rng = Rng(73);
    // Numbers from far up, with gaps between them, in one shelf after a wide gap, and few to a block.
    let numberings: [fn(u32) -> u32; 5] =
        [|i| i, |i| i + (1 << 20), |i| i * 7, |i| if i < 900 { i } else { i + 90_000 }, |i| i * 40];
    for backend in backends() {
        for (n, number) in numberings.into_iter().enumerate() {
            let boxes = shuffled(drawn(4_000, 74), 75 + n as u64);
            let (mut osp, mut reference) = filled(number, &boxes, tree(backend));
            let (mut list, mut blocks) = (Vec::new(), VisibleBlocks::new());
            let mut frusta = vec![most()];
            frusta.extend(views(&root(), 3, Place::Outside, 76));
            frusta.extend(views(&root(), 3, Place::Inside, 77));
            frusta.push(view(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 60.0, 1.0, 0.1, 3.2));
            for round in 0..4 {
                for frustum in &frusta {
                    let ids = ask(&osp, frustum, &mut list, &mut blocks);
                    assert_eq!(ids, cull(&reference, frustum), "{} {n} {round}", backend.name());
                }
                osp.validate().expect("valid");
                // Some go, one after the other and from everywhere.
                let first = rng.below(3_000) as u32;
                let gone = (first..first + 300).chain((0..300).map(|_| rng.below(4_000) as u32));
                for id in gone.map(|i| PolygonId(number(i))) {
                    if osp.remove(id).is_ok() {
                        reference.remove(id).expect("it was in both");
                    }
                }
                osp.commit();
            }
        }
    }
}

#[test]
fn a_set_that_is_not_empty_keeps_what_it_has() {
    let boxes = shuffled(drawn(6_000, 78), 79);
    let (osp, reference) = filled(|i| i, &boxes, Osp::new(&IndexConfig { root: root(), capacity: 6_000 }));
    let seen = cull(&reference, &most());
    let hidden = (0..6_000).find(|id| !seen.contains(id)).expect("something is hidden");
    let mut blocks = VisibleBlocks::new();
    blocks.insert(PolygonId(hidden));
    osp.frustum_cull_blocks(&most(), &mut blocks);
    assert_eq!(blocks.len(), seen.len() + 1);
    assert!(blocks.contains(PolygonId(hidden)));
}

#[test]
fn a_polygon_takes_few_bytes_and_room_once_reserved_is_kept() {
    const POLYGONS: usize = 60_000;
    let config = IndexConfig { root: root(), capacity: POLYGONS };
    let empty = Osp::new(&IndexConfig { capacity: 0, ..config }).bytes();
    assert!(empty <= 100_000, "{empty} bytes without polygons");
    let boxes = drawn(POLYGONS, 80);
    for (boxes, most_bytes) in [(boxes.clone(), 40), (shuffled(boxes, 81), 92)] {
        let mut osp = Osp::new(&config);
        for (i, bounds) in boxes.iter().enumerate() {
            osp.insert(PolygonId(i as u32), bounds).expect("finite boxes, each id once");
            if i % 16 == 15 {
                let before = allocations();
                osp.commit();
                assert_eq!(allocations() - before, 0, "with {i} polygons");
            }
        }
        let each = osp.bytes() as f64 / POLYGONS as f64;
        assert!(each <= f64::from(most_bytes), "{each} bytes a polygon");
        osp.validate().expect("valid");
    }
}

/// Six octants are filled, two of them lie before the near plane: each is an inner node that is hidden as a whole.
#[test]
fn inner_nodes_before_the_near_plane_are_not_seen() {
    let octants = [0, 1, 3, 5, 6, 7];
    let mut rng = Rng(82);
    let boxes: Vec<Aabb> = (0..octants.len() * 600)
        .map(|i| {
            let octant = octants[i % octants.len()];
            let middle = Vec3::from([0, 1, 2].map(|bit| if octant >> bit & 1 == 1 { 1.0 } else { -1.0 }));
            Aabb::cube(rng.point(&Aabb::cube(middle, 1.8)), 0.01)
        })
        .collect();
    let slab = |axis: Vec3| [Plane { normal: axis, d: 9.0 }, Plane { normal: -axis, d: 9.0 }];
    let [[_, far], [left, right], [below, above]] = [Vec3::X, Vec3::Y, Vec3::Z].map(slab);
    let near = Plane { normal: Vec3::X, d: 0.0 };
    let frustum = Frustum::new([left, right, below, above, near, far]);
    for backend in backends() {
        let osp = Osp::with_backend(&IndexConfig { root: root(), capacity: boxes.len() }, backend);
        let (osp, reference) = filled(|i| i, &boxes, osp);
        let (mut list, mut blocks) = (Vec::new(), VisibleBlocks::new());
        let ids = ask(&osp, &frustum, &mut list, &mut blocks);
        assert_eq!(ids.len(), 4 * 600, "{}", backend.name());
        assert_eq!(ids, cull(&reference, &frustum), "{}", backend.name());
    }
}
