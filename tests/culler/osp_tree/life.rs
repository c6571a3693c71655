//! A long life: polygons that are erased, moved, drawn again, far away, tiny or all in one place. Compared by work
//! counts, which do not depend on the machine.

use super::Both;
use glam::Vec3;
use osp::{
    index::{
        BruteForce, IndexConfig, Node, Osp, SpatialIndex, Visit, Visitor, WorkCounts, kernels::ROOM_BEHIND,
    },
    math::{Aabb, Frustum},
    polygon::PolygonId,
};
use osp_testkit::boxes::{Place, Rng, drawn, root, shuffled, views};

fn tree_of(boxes: &[(PolygonId, Aabb)], root: Aabb) -> Osp {
    let mut osp = Osp::new(&IndexConfig { root, capacity: boxes.len() }).with_all_in_tree();
    for chunk in boxes.chunks(16) {
        for (id, bounds) in chunk {
            osp.insert(*id, bounds).expect("finite boxes, each id once");
        }
        osp.commit();
    }
    osp
}

fn numbered(boxes: &[Aabb]) -> Vec<(PolygonId, Aabb)> {
    boxes.iter().enumerate().map(|(i, bounds)| (PolygonId(i as u32), *bounds)).collect()
}

fn some_views(bounds: &Aabb) -> Vec<Frustum> {
    let mut all = views(bounds, 6, Place::Outside, 11);
    all.extend(views(bounds, 18, Place::Inside, 12));
    all
}

/// Work of some queries, and how many polygons they found.
fn work(osp: &Osp, frusta: &[Frustum]) -> WorkCounts {
    let mut all = WorkCounts::default();
    let mut list = Vec::new();
    for frustum in frusta {
        list.clear();
        all += osp.frustum_cull(frustum, &mut list);
    }
    all
}

/// What a query costs: a wide test of sixteen boxes, or a node read.
fn cost(work: &WorkCounts) -> f64 {
    work.nodes as f64 + work.planes as f64 / 16.0
}

fn assert_cost(osp: &Osp, fresh: &Osp, frusta: &[Frustum], at_most: f64, what: &str) {
    let (is, should) = (work(osp, frusta), work(fresh, frusta));
    assert_eq!(is.reported, should.reported, "{what}: found");
    let ratio = cost(&is) / cost(&should);
    assert!(ratio <= at_most, "{what}: {ratio:.2} times the work of a fresh tree\n{is:?}\n{should:?}");
}

#[derive(Default)]
struct Deepest(u32);

impl Visitor for Deepest {
    fn node(&mut self, node: &Node<'_>) -> Visit {
        self.0 = self.0.max(node.depth);
        Visit::Descend
    }

    fn polygons(&mut self, _ids: &[PolygonId], _decision: Visit) {}
}

pub(crate) fn depth(osp: &Osp) -> u32 {
    let mut deepest = Deepest::default();
    let everything = Frustum::new([osp::math::Plane { normal: Vec3::ZERO, d: 0.0 }; 6]);
    osp.traverse(&everything, &mut deepest);
    deepest.0
}

/// Commits without changes until all polygons are in the tree again.
fn let_rest(osp: &mut Osp) {
    for _ in 0..1000 {
        osp.commit();
    }
    assert_eq!(osp.moving(), 0, "polygons that rest outside the tree");
}

#[test]
fn after_nine_tenths_are_erased_a_query_costs_what_a_fresh_tree_costs() {
    let all = numbered(&drawn(40_000, 5));
    let frusta = some_views(&root());
    // Whole stretches as an eraser takes them, and single polygons from everywhere.
    let stretch = |i: usize| i / 100 % 10 == 3;
    let sparse = |i: usize| i * 2_654_435_761 % (1 << 32) < (1 << 32) / 10;
    let kept: [&dyn Fn(usize) -> bool; 2] = [&stretch, &sparse];
    for (what, keep) in ["stretches", "single polygons"].iter().zip(kept) {
        for drawn_in_order in [true, false] {
            let mut boxes: Vec<Aabb> = all.iter().map(|(_, bounds)| *bounds).collect();
            if !drawn_in_order {
                boxes = shuffled(boxes, 6);
            }
            let all = numbered(&boxes);
            let mut osp = tree_of(&all, root());
            let gone = all.iter().filter(|(id, _)| !keep(id.index())).map(|(id, _)| *id);
            for (i, id) in gone.enumerate() {
                osp.remove(id).unwrap();
                if i % 16 == 0 {
                    osp.commit();
                }
            }
            let_rest(&mut osp);
            osp.validate().unwrap();
            let rest: Vec<_> = all.iter().filter(|(id, _)| keep(id.index())).copied().collect();
            let fresh = tree_of(&rest, root());
            assert_eq!(osp.len(), rest.len());
            let what = format!("{what}, drawn in order: {drawn_in_order}");
            assert_cost(&osp, &fresh, &frusta, 1.3, &what);
            assert!(depth(&osp) <= depth(&fresh) + 1, "{what}: deeper than a fresh tree");
        }
    }
}

#[test]
fn ten_thousand_rounds_of_erase_and_redraw_leave_no_trace() {
    const STROKES: usize = 100;
    const STROKE: usize = 40;
    let mut rng = Rng(9);
    let pattern = drawn(STROKES * STROKE * 4, 10);
    let mut osp = Osp::new(&IndexConfig { root: root(), capacity: STROKES * STROKE }).with_most_in_order(0);
    let mut strokes = std::collections::VecDeque::new();
    let mut next = 0u32;
    let mut first_bytes = None;
    let frusta = some_views(&root());
    for round in 0..10_000 {
        if strokes.len() == STROKES {
            // Mostly the oldest, at times any one.
            let at = if rng.below(4) == 0 { rng.below(STROKES) } else { 0 };
            let stroke: Vec<(PolygonId, Aabb)> = strokes.remove(at).unwrap();
            for (id, _) in stroke {
                osp.remove(id).unwrap();
            }
        }
        let from = rng.below(pattern.len() - STROKE);
        let stroke: Vec<(PolygonId, Aabb)> =
            pattern[from..from + STROKE].iter().zip(next..).map(|(b, id)| (PolygonId(id), *b)).collect();
        next += STROKE as u32;
        for (id, bounds) in &stroke {
            osp.insert(*id, bounds).unwrap();
        }
        strokes.push_back(stroke);
        osp.commit();
        if round % 2_500 == 2_499 {
            let_rest(&mut osp);
            osp.validate().unwrap();
            let rest: Vec<_> = strokes.iter().flatten().copied().collect();
            let fresh = tree_of(&rest, root());
            assert_eq!(osp.len(), rest.len());
            assert_cost(&osp, &fresh, &frusta, 1.3, &format!("round {round}"));
            assert!(depth(&osp) <= depth(&fresh) + 1, "round {round}: deeper than a fresh tree");
            let first = *first_bytes.get_or_insert(osp.bytes());
            assert!(
                osp.bytes() <= first + first / 50,
                "round {round}: {} bytes, {first} at first",
                osp.bytes()
            );
        }
    }
}

/// Strokes undone and redone keep their ids.
#[test]
fn undo_and_redo_leave_no_trace() {
    let all = numbered(&drawn(6_000, 13));
    let mut osp = tree_of(&all, root());
    let frusta = some_views(&root());
    let mut rng = Rng(14);
    let mut bytes = None;
    for _ in 0..2 {
        for _ in 0..300 {
            let from = rng.below(all.len() - 200);
            let stroke = &all[from..from + rng.below(200)];
            for (id, _) in stroke {
                osp.remove(*id).unwrap();
            }
            osp.commit();
            for (id, bounds) in stroke {
                osp.insert(*id, bounds).unwrap();
            }
            osp.commit();
        }
        let_rest(&mut osp);
        osp.validate().unwrap();
        assert_cost(&osp, &tree_of(&all, root()), &frusta, 1.3, "undone and redone");
        bytes = bytes.or(Some(osp.bytes()));
        assert_eq!(Some(osp.bytes()), bytes, "memory");
    }
}

/// A brush that smooths: each new polygon changes the eight before it a little.
#[test]
fn smoothing_leaves_no_trace() {
    let all = numbered(&drawn(20_000, 16));
    let mut rng = Rng(17);
    let mut osp = Osp::new(&IndexConfig { root: root(), capacity: all.len() }).with_most_in_order(0);
    for (i, (id, bounds)) in all.iter().enumerate() {
        osp.insert(*id, bounds).expect("a finite box, each id once");
        for back in 1..=i.min(8) {
            let (id, bounds) = all[i - back];
            let by = if back == 8 { Vec3::ZERO } else { rng.direction() * 0.002 };
            osp.update(id, &Aabb::new(bounds.min + by, bounds.max + by)).expect("it is there");
        }
        osp.commit();
    }
    for (id, bounds) in &all[all.len() - 8..] {
        osp.update(*id, bounds).expect("it is there");
    }
    let_rest(&mut osp);
    osp.validate().expect("a sound tree");
    assert_cost(&osp, &tree_of(&all, root()), &some_views(&root()), 1.05, "smoothed");
}

/// Strokes carried about, a frame at a time, and put down where they were.
#[test]
fn moving_leaves_no_trace() {
    let all = numbered(&drawn(6_000, 15));
    let mut osp = tree_of(&all, root());
    for round in 0..40 {
        let stroke = &all[round * 100..round * 100 + 150];
        for step in (0..10).rev() {
            let by = Vec3::new(0.3, 0.1, -0.2) * step as f32;
            for (id, bounds) in stroke {
                osp.update(*id, &Aabb::new(bounds.min + by, bounds.max + by)).unwrap();
            }
            osp.commit();
        }
    }
    // What was put down last is still kept beside the tree.
    let mut commits = 0;
    while osp.moving() > 0 {
        osp.commit();
        commits += 1;
        assert!(commits < 1_000, "{} are still kept beside the tree", osp.moving());
    }
    osp.validate().unwrap();
    assert_cost(&osp, &tree_of(&all, root()), &some_views(&root()), 1.3, "moved and moved back");
}

/// The root cube need not be chosen with care: a model far outside it, much larger, much smaller or both costs little
/// more than one that fits.
#[test]
fn any_place_and_size_costs_what_a_fitting_root_costs() {
    let fitting = drawn(12_000, 16);
    let transforms = [
        ("a kilometre away", 1.0, Vec3::new(1000.0, -700.0, 40.0)),
        ("a millimetre wide", 0.00025, Vec3::splat(0.3)),
        ("half a kilometre wide", 125.0, Vec3::ZERO),
        ("a millimetre wide and away", 0.00025, Vec3::splat(-9.0)),
    ];
    for (what, scale, by) in transforms {
        let place = |p: Vec3| p * scale + by;
        let boxes: Vec<Aabb> = fitting.iter().map(|b| Aabb::new(place(b.min), place(b.max))).collect();
        let around = Aabb::new(place(root().min), place(root().max));
        let boxes = numbered(&boxes);
        let osp = tree_of(&boxes, root());
        osp.validate().unwrap();
        assert_cost(&osp, &tree_of(&boxes, around), &some_views(&around), 1.3, what);
    }
    // A kilometre's walk with strokes of a millimetre beside strokes of a metre.
    let mut rng = Rng(17);
    let walk: Vec<Aabb> = (0..12_000)
        .map(|i| {
            let center = Vec3::X * (i as f32 / 12.0) + rng.direction();
            Aabb::cube(center, 10f32.powf(rng.range(-3.0, 0.0)))
        })
        .collect();
    let around = walk.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
    let walk = numbered(&walk);
    let osp = tree_of(&walk, root());
    osp.validate().unwrap();
    let frusta = views(&Aabb::cube(Vec3::X * 500.0, 4.0), 12, Place::Inside, 18);
    let fitting = tree_of(&walk, Aabb::cube(around.center(), around.extent().max_element()));
    assert_cost(&osp, &fitting, &frusta, 1.3, "a walk");
    let mut reference = BruteForce::new();
    for (id, bounds) in &walk {
        reference.insert(*id, bounds).unwrap();
    }
    super::assert_same(&osp, &reference, &frusta);
}

/// `cargo test --release --test culler -- --ignored --nocapture ten_million`
#[test]
#[ignore = "ten seconds with --release, minutes without"]
fn ten_million_polygons_within_400_mb() {
    const COUNT: usize = 10_000_000;
    let boxes = drawn(COUNT, 19);
    let mut osp = Osp::new(&IndexConfig { root: root(), capacity: COUNT });
    let start = std::time::Instant::now();
    for (i, bounds) in boxes.iter().enumerate() {
        osp.insert(PolygonId(i as u32), bounds).unwrap();
        if i % 256 == 255 {
            osp.commit();
        }
    }
    osp.commit();
    let loaded = start.elapsed();
    assert!(osp.bytes() < 400_000_000, "{} bytes", osp.bytes());
    let mut list = Vec::with_capacity(COUNT + ROOM_BEHIND);
    let start = std::time::Instant::now();
    let frusta = some_views(&root());
    for frustum in &frusta {
        list.clear();
        osp.frustum_cull(frustum, &mut list);
    }
    let culled = start.elapsed() / frusta.len() as u32;
    let expected = boxes.iter().filter(|b| frusta[frusta.len() - 1].may_see(b)).count();
    assert_eq!(list.len(), expected);
    let start = std::time::Instant::now();
    for i in 0..COUNT {
        osp.remove(PolygonId(i as u32)).unwrap();
        if i % 256 == 255 {
            osp.commit();
        }
    }
    osp.commit();
    let erased = start.elapsed();
    assert_eq!(osp.len(), 0);
    eprintln!(
        "10 M polygons: {:.0} MB; {:.0} ns an insert, {:.1} ms a query, {:.0} ns a removal",
        osp.bytes() as f64 / 1.0e6,
        loaded.as_secs_f64() * 1.0e9 / COUNT as f64,
        culled.as_secs_f64() * 1.0e3,
        erased.as_secs_f64() * 1.0e9 / COUNT as f64,
    );
}

/// Runs of four lose two, and what is left of each has its middle in the cell beside; then their leaf is split.
#[test]
fn a_run_whose_middle_has_left_its_cell_stays_below_its_cell_when_that_is_split() {
    let (mut both, mut rng) = (Both::new(), Rng(51));
    // Cells of two metres meet at the origin.
    let (this, beside) = (Aabb::cube(Vec3::splat(0.5), 0.8), Aabb::cube(Vec3::new(-1.5, 0.5, 0.5), 0.8));
    let run =
        |i: u32| [-0.02, 0.0, 0.02, 0.04].map(|x| Aabb::cube(Vec3::new(x, 0.3 + 0.1 * i as f32, 0.5), 0.02));
    both.add_small(100, &beside, &mut rng);
    let runs: Vec<u32> = (0..4).map(|i| both.add(&run(i))).collect();
    both.add_small(180, &this, &mut rng);
    both.osp.commit();
    for id in runs.iter().flat_map(|first| [first + 2, first + 3]) {
        both.remove(id);
    }
    (0..4).for_each(|_| both.osp.commit());
    both.osp.validate().expect("valid before the leaf is split");
    for _ in 0..120 {
        both.add_small(1, &this, &mut rng);
        both.osp.validate().expect("valid");
    }
    // Freed and taken again: what is found must still be there.
    for id in (0..both.next).filter(|id| id % 3 == 0).map(PolygonId) {
        assert_eq!(both.osp.remove(id), both.reference.remove(id));
    }
    both.wait();
    both.osp.validate().expect("valid");
    super::assert_same(&both.osp, &both.reference, &some_views(&root()));
}
