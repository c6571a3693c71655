//! Several views in one walk: each gets the answer that it gets alone.

use osp::{
    glam::Quat,
    math::Plane,
    view::{Projection, View},
};
use osp_session::rig::Rig;
use proptest::prelude::{ProptestConfig, prop_oneof, proptest};

use super::*;

/// What the views of a frame are.
fn rig(kind: usize, rng: &mut Rng) -> Vec<Frustum> {
    let at = rng.point(&root()) * if rng.below(2) == 0 { 1.0 } else { 3.0 };
    let head = View::look_at(at, rng.point(&root()), Projection::symmetric(90.0, 1.0, 0.05, 100.0));
    let view = |aside_m: f32, turn: Quat| {
        let eye_in_world = head.eye_in_world + head.world_from_view * Vec3::X * aside_m;
        View { eye_in_world, world_from_view: head.world_from_view * turn, ..head }.frustum()
    };
    let quarter = |i: u32| Quat::from_rotation_y(i as f32 * std::f32::consts::FRAC_PI_2);
    let up_down = [1.0, -1.0].map(|up| Quat::from_rotation_x(up * std::f32::consts::FRAC_PI_2));
    match kind {
        0 => [-0.032, 0.032].map(|aside_m| view(aside_m, Quat::IDENTITY)).to_vec(),
        1 => (0..4).map(|i| view(0.0, quarter(i))).collect(),
        2 => (0..4).map(quarter).chain(up_down).map(|turn| view(0.0, turn)).collect(),
        3 => {
            // Cascades: boxes one in another.
            let cascade = |i: u32| {
                let half_m = 0.3 * (1 << i) as f32;
                let slab = |axis: Vec3| {
                    let d = axis.dot(at);
                    [Plane { normal: axis, d: half_m - d }, Plane { normal: -axis, d: half_m + d }]
                };
                let [[a, b], [c, d], [e, f]] = [Vec3::X, Vec3::Y, Vec3::Z].map(slab);
                Frustum::new([a, b, c, d, e, f])
            };
            (0..4).map(cascade).collect()
        }
        4 => {
            // Two eyes for each wall of a shipped rig.
            let rig = Rig::open("cave4").expect("a shipped rig");
            let eye = |i: f32| at * 0.2 + Vec3::new(i * 0.064, 1.6, 0.0);
            let eyes = [eye(-0.5), eye(0.5)];
            let views = rig.screens.iter().flat_map(|screen| eyes.map(|eye| screen.view(eye, 0.05, 50.0)));
            views.flatten().map(|view| view.frustum()).collect()
        }
        5 => {
            // More than a walk has room for, some of them alike, one that holds everything and one that holds nothing.
            let mut frusta = views(&root(), 19, Place::Inside, rng.below(1000) as u64);
            frusta[3] = frusta[2];
            frusta[7] = Frustum::everything();
            frusta[11] = Frustum::new([Plane { normal: Vec3::X, d: -1.0e9 }; 6]);
            frusta
        }
        _ => views(&root(), 1 + rng.below(9), Place::Outside, rng.below(1000) as u64),
    }
}

/// Asks one after the other and all at once.
fn assert_as_one_by_one(index: &dyn SpatialIndex, frusta: &[Frustum]) -> usize {
    let mut together = vec![VisibleBlocks::new(); frusta.len()];
    let work = index.frustum_cull_views(frusta, &mut together);
    let mut reported = 0;
    for (frustum, together) in frusta.iter().zip(&together) {
        let mut alone = VisibleBlocks::new();
        reported += index.frustum_cull_blocks(frustum, &mut alone).reported;
        assert!(alone.blocks().eq(together.blocks()), "{}: the same blocks", index.name());
        assert_eq!(alone.len(), together.len(), "{}: as many as it says", index.name());
    }
    assert_eq!(work.reported, reported, "{}: reported", index.name());
    reported as usize
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn each_view_of_a_rig_gets_the_answer_that_it_gets_alone(
        seed in 0u64..1_000_000,
        polygons in prop_oneof![1usize..400, 400usize..6000],
        world in 0u32..3,
        kind in 0usize..7,
    ) {
        let mut rng = Rng(seed);
        let boxes = match world {
            0 => drawn(polygons, seed),
            1 => shuffled(drawn(polygons, seed), seed + 1),
            _ => (0..polygons).map(|_| any_box(&mut rng)).collect(),
        };
        let frusta = rig(kind, &mut rng);
        for backend in backends() {
            let mut osp = tree(backend);
            for (i, bounds) in boxes.iter().enumerate() {
                osp.insert(PolygonId(i as u32), bounds).expect("a sound box");
                if i % 700 == 0 {
                    osp.commit();
                }
            }
            // Before a commit files what was inserted last, and tightens what was taken out.
            assert_as_one_by_one(&osp, &frusta);
            for i in (0..boxes.len()).filter(|i| i / 40 % 5 == 1 || i % 11 == 0) {
                osp.remove(PolygonId(i as u32)).expect("it is there");
            }
            assert_as_one_by_one(&osp, &frusta);
            osp.commit();
            assert_as_one_by_one(&osp, &frusta);
        }
    }
}

#[test]
fn two_eyes_are_culled_in_one_walk() {
    let mut osp = tree(Backend::detect());
    for (i, bounds) in drawn(20_000, 5).iter().enumerate() {
        osp.insert(PolygonId(i as u32), bounds).expect("a sound box");
    }
    osp.commit();
    let mut rng = Rng(8);
    // Stereo, and two eyes before each of four walls; other rigs are asked one after the other.
    for (kind, is_one_walk) in [(0, true), (4, true), (1, false), (2, false), (3, false)] {
        let (mut each, mut walk, mut seen) = (0, 0, 0);
        for _ in 0..16 {
            let frusta = rig(kind, &mut rng);
            let reported = assert_as_one_by_one(&osp, &frusta);
            // Of most of the tree each eye looks for what is hidden, by itself.
            if reported * 2 > osp.len() * frusta.len() {
                continue;
            }
            seen += reported;
            let mut sets = vec![VisibleBlocks::new(); frusta.len()];
            walk += osp.frustum_cull_views(&frusta, &mut sets).nodes;
            sets.iter_mut().for_each(VisibleBlocks::clear);
            each += frusta
                .iter()
                .zip(&mut sets)
                .map(|(frustum, set)| osp.frustum_cull_blocks(frustum, set).nodes)
                .sum::<u64>();
        }
        let is_less = walk * 10 < each * 8;
        assert!(seen > 0 && is_less == is_one_walk, "rig {kind}: {walk} nodes of {each}, {seen} seen");
        assert!(is_one_walk || walk == each, "rig {kind}: {walk} nodes of {each}");
    }
}

/// The frustum of a window that looks at all of a box and at nothing beside it.
fn window(bounds: &Aabb) -> Frustum {
    let slab = |axis: Vec3| {
        [Plane { normal: axis, d: -axis.dot(bounds.min) }, Plane { normal: -axis, d: axis.dot(bounds.max) }]
    };
    let [[a, b], [c, d], [e, f]] = [Vec3::X, Vec3::Y, Vec3::Z].map(slab);
    Frustum::new([a, b, c, d, e, f])
}

/// A box in each corner of the cube, and a window that just holds all of them for one eye and not for the other.
#[test]
fn what_one_eye_sees_as_a_whole_the_other_need_not() {
    let corner = |i: u32| Vec3::from([0, 1, 2].map(|bit| if i >> bit & 1 == 1 { 1.9 } else { -1.9 }));
    let all = window(&Aabb::cube(Vec3::ZERO, 3.84));
    let some = window(&Aabb::cube(Vec3::X * 0.064, 3.84));
    for polygons in [300, 6000] {
        for backend in backends() {
            let mut osp = tree(backend);
            for i in 0..polygons {
                osp.insert(PolygonId(i), &Aabb::cube(corner(i), 0.02)).expect("a sound box");
            }
            osp.commit();
            for frusta in [[all, some], [some, all], [all, all]] {
                let seen = assert_as_one_by_one(&osp, &frusta);
                let halves = frusta.iter().map(|of| 1 + usize::from(*of == all)).sum::<usize>();
                assert_eq!(seen, halves * polygons as usize / 2);
            }
        }
    }
}

/// In dense places boxes as long as a cell stay at small inner nodes, which lie wholly inside a plane of one eye and behind that of
/// the other.
#[test]
fn each_of_two_eyes_far_apart_gets_its_own_straddlers() {
    let mut rng = Rng(95);
    let mut osp = tree(Backend::detect());
    let places: Vec<Vec3> = (0..8).map(|_| rng.point(&root())).collect();
    for i in 0..24_000 {
        let center = rng.point(&Aabb::cube(places[i % 8], 0.25));
        let half = rng.direction().abs() * [0.005, 0.005, 0.005, 0.1][i / 8 % 4];
        osp.insert(PolygonId(i as u32), &Aabb::new(center - half, center + half)).expect("a sound box");
    }
    osp.commit();
    let mut reported = 0;
    for i in 0..200 {
        let eye = rng.point(&root()) * 1.5;
        let head = View::look_at(eye, rng.point(&root()), Projection::symmetric(50.0, 1.0, 0.05, 100.0));
        let apart_m = 0.2 + 2.3 * (i % 24) as f32 / 23.0;
        let frusta = [-0.5, 0.5].map(|aside| {
            let eye_in_world = head.eye_in_world + head.world_from_view * Vec3::X * (apart_m * aside);
            View { eye_in_world, ..head }.frustum()
        });
        reported += assert_as_one_by_one(&osp, &frusta);
    }
    assert!(reported > 100_000, "{reported}");
}
