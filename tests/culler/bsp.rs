//! The order that a binary space partition gives, against what rays meet.

use std::{any::Any, collections::BTreeMap};

use glam::Vec3;
use osp::{
    frame::Pipeline,
    index::{BruteForce, IndexConfig, SpatialIndex},
    math::{Aabb, Ray},
    polygon::{Change, ConvexPolygon, PolygonId},
    view::{Projection, View},
};
use osp_rivals::{Bsp, BspConfig};
use osp_session::{
    recording::{SynthKind, synthesize},
    scene::Scene,
};
use osp_testkit::boxes::{Place, Rng, root, views};

use crate::engine::{Thing, World};

fn built(polygons: &[ConvexPolygon]) -> Bsp {
    let config = IndexConfig { root: root(), capacity: polygons.len() };
    let mut tree = Bsp::new(BspConfig::default(), &config);
    for (polygon, id) in polygons.iter().zip((0..).map(PolygonId)) {
        tree.insert(id, &polygon.bounds()).expect("a finite box");
        tree.shape(id, polygon);
    }
    tree.commit();
    tree
}

/// Triangles and exact rectangles that pierce each other.
fn piercing(count: usize, size_m: f32, seed: u64) -> Vec<ConvexPolygon> {
    let mut rng = Rng(seed);
    let room = Aabb::cube(Vec3::ZERO, 3.0);
    (0..count)
        .map(|i| {
            let at = rng.point(&room);
            let (u, v) = (rng.direction() * size_m, rng.direction() * size_m);
            match i % 3 {
                0 => ConvexPolygon::triangle(at, at + u, at + v),
                1 => ConvexPolygon::quad([at, at + u, at + u + v, at + v]),
                _ => {
                    let (x, z) = (Vec3::X * size_m, Vec3::Z * size_m);
                    ConvexPolygon::quad([at, at + x, at + x + z, at + z])
                }
            }
        })
        .collect()
}

type Piece = (PolygonId, Vec<Vec3>);

fn pieces(tree: &Bsp, eye: Vec3) -> Vec<Piece> {
    let mut pieces = Vec::new();
    tree.back_to_front(eye, &mut |id, corners| pieces.push((id, corners.to_vec())));
    assert_eq!(pieces.len(), tree.counts().pieces);
    let mut others = pieces.clone();
    tree.front_to_back(eye, &mut |id, corners| {
        let at = others.iter().rposition(|(other, of_other)| *other == id && of_other == corners);
        others.remove(at.expect("both orders have the same pieces"));
    });
    assert_eq!(others, []);
    pieces
}

fn meet(ray: &Ray, corners: &[Vec3]) -> Option<f32> {
    corners.windows(2).skip(1).find_map(|pair| ray.meet_triangle([corners[0], pair[0], pair[1]]))
}

fn area_m2(corners: &[Vec3]) -> f32 {
    let fan = corners.windows(2).skip(1);
    fan.map(|pair| (pair[0] - corners[0]).cross(pair[1] - corners[0])).sum::<Vec3>().length() * 0.5
}

/// Sends rays from the eye and compares the order of the pieces that they meet with how far away those are. Returns
/// how many pairs were compared.
fn compare(
    tree: &Bsp,
    polygons: &[ConvexPolygon],
    eye: Vec3,
    rays: usize,
    near_m: f32,
    rng: &mut Rng,
) -> usize {
    let pieces = pieces(tree, eye);
    let mut pairs = 0;
    for _ in 0..rays {
        let target = polygons[rng.below(polygons.len())].bounds().center();
        let ray = Ray::new(eye, (target + rng.direction() * 0.02 - eye).normalize());
        let along: Vec<(PolygonId, f32)> =
            pieces.iter().filter_map(|(id, corners)| Some((*id, meet(&ray, corners)?))).collect();
        for pair in along.windows(2) {
            let [(a, far), (b, near)] = [pair[0], pair[1]];
            assert!(far >= near - near_m, "{a:?} at {far} m is drawn before {b:?} at {near} m from {eye}");
            pairs += 1;
        }
        // A ray that meets a polygon meets one of its pieces, but for the seams between them.
        let missed = polygons.iter().zip((0..).map(PolygonId)).filter(|(polygon, id)| {
            polygon.meet(&ray).is_some() && along.iter().all(|(other, _)| other != id)
        });
        assert!(missed.count() <= 1, "a ray from {eye} goes through several polygons, but not their pieces");
    }
    pairs
}

#[test]
fn pieces_come_in_the_order_in_which_rays_meet_them() {
    for (count, size_m, seed) in [(40, 2.0, 1), (300, 0.6, 2), (1500, 0.15, 3)] {
        let polygons = piercing(count, size_m, seed);
        let tree = built(&polygons);
        let counts = tree.counts();
        assert_eq!(counts.unordered, 0, "{counts:?}");
        assert!(counts.pieces > count, "something has to be cut: {counts:?}");
        let mut rng = Rng(seed + 10);
        let mut pairs = 0;
        for _ in 0..12 {
            let eye = rng.point(&Aabb::cube(Vec3::ZERO, 8.0));
            pairs += compare(&tree, &polygons, eye, 40, 1.0e-4, &mut rng);
        }
        assert!(pairs > 400, "only {pairs} pairs were compared");
    }
}

#[test]
fn pieces_cover_their_polygons() {
    let polygons = piercing(300, 0.6, 4);
    let tree = built(&polygons);
    let mut areas: BTreeMap<PolygonId, f32> = BTreeMap::new();
    for (id, corners) in pieces(&tree, Vec3::ONE) {
        *areas.entry(id).or_default() += area_m2(&corners);
        let bounds = polygons[id.index()].bounds();
        let around = Aabb::new(bounds.min - Vec3::splat(1.0e-6), bounds.max + Vec3::splat(1.0e-6));
        assert!(around.contains(&Aabb::from_points(&corners)), "{id:?}");
    }
    assert_eq!(areas.len(), polygons.len());
    for (id, area) in areas {
        let whole = polygons[id.index()].area_m2();
        assert!((area - whole).abs() <= 1.0e-3 * whole, "{id:?}: {area} of {whole}");
    }
}

#[test]
fn a_drawn_session_is_ordered_up_to_the_bend_of_its_quads() {
    let mut scene = Scene::new();
    for event in synthesize(SynthKind::Scribble, 3000, 5) {
        scene.apply(&event.expect("a synthetic session is whole"), &mut Vec::new());
    }
    let polygons: Vec<ConvexPolygon> = scene.visible_ids().map(|id| scene.polygon(id)).collect();
    let tree = built(&polygons);
    let counts = tree.counts();
    assert_eq!(counts.unordered, 0, "{counts:?}");
    assert!(counts.pieces < 3 * polygons.len(), "neighbours in a ribbon must not cut each other: {counts:?}");
    let mut rng = Rng(6);
    let eyes = [Vec3::new(0.0, 1.5, 5.0), Vec3::new(0.3, 1.2, 0.1), Vec3::new(-3.0, 3.0, -2.0)];
    let pairs: usize = eyes.iter().map(|&eye| compare(&tree, &polygons, eye, 500, 2.0e-3, &mut rng)).sum();
    assert!(pairs > 30, "only {pairs} pairs were compared");
}

#[test]
fn culling_is_that_of_whole_boxes_each_polygon_once() {
    let polygons = piercing(700, 0.5, 7);
    let mut tree = built(&polygons);
    let mut reference = BruteForce::with_capacity(polygons.len());
    for (polygon, id) in polygons.iter().zip((0..).map(PolygonId)) {
        reference.insert(id, &polygon.bounds()).expect("a finite box");
    }
    let mut rng = Rng(8);
    for round in 0..4 {
        for place in [Place::Inside, Place::Outside] {
            for frustum in views(&root(), 20, place, round) {
                let [mut found, mut expected] = [Vec::new(), Vec::new()];
                tree.frustum_cull(&frustum, &mut found);
                reference.frustum_cull(&frustum, &mut expected);
                found.sort_unstable();
                assert_eq!(found, expected);
            }
        }
        // Some go, some move; of half of these the tree is not told more than the box.
        for id in (0..polygons.len()).filter(|i| i % 5 == round as usize) {
            let by = Vec3::X * rng.unit();
            let (id, moved) = (PolygonId(id as u32), polygons[id].map(|p| p + by));
            if id.0 % 2 == 0 {
                tree.remove(id).expect("it is inserted");
                reference.remove(id).expect("it is inserted");
                // Of no polygon.
                tree.shape(id, &moved);
            } else {
                tree.update(id, &moved.bounds()).expect("it is inserted");
                reference.update(id, &moved.bounds()).expect("it is inserted");
                if id.0 % 4 == 1 {
                    tree.shape(id, &moved);
                }
            }
        }
        tree.commit();
    }
}

#[test]
fn convex_models_become_no_chain() {
    // The polygons of a ball: behind the plane of each lie all others.
    let at = |i: usize, j: usize| {
        let (a, b) = (i as f32 / 24.0 * std::f32::consts::PI, j as f32 / 48.0 * std::f32::consts::TAU);
        Vec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin())
    };
    let polygons: Vec<ConvexPolygon> = (1..23)
        .flat_map(|i| (0..48).map(move |j| ConvexPolygon::triangle(at(i, j), at(i + 1, j), at(i, j + 1))))
        .collect();
    let tree = built(&polygons);
    let counts = tree.counts();
    assert_eq!(counts.unordered, 0, "{counts:?}");
    assert!(counts.depth < 30 && counts.pieces < 3 * polygons.len(), "{counts:?}");
    assert!(compare(&tree, &polygons, Vec3::new(0.5, 3.0, 1.0), 400, 1.0e-4, &mut Rng(9)) > 50);
}

#[test]
fn hostile_polygons_stay_within_bounds() {
    let hub = Vec3::new(0.1, 0.2, 0.3);
    let mut rng = Rng(11);
    // All through one line: each cuts all others.
    let star: Vec<ConvexPolygon> = (0..900)
        .map(|i| {
            let (sin, cos) = (i as f32 * 0.0035).sin_cos();
            let arm = Vec3::new(cos, 0.0, sin);
            ConvexPolygon::quad([hub - arm, hub + arm, hub + arm + Vec3::Y, hub - arm + Vec3::Y])
        })
        .collect();
    // Through one point.
    let burst: Vec<ConvexPolygon> = (0..900)
        .map(|_| {
            let (u, v) = (rng.direction(), rng.direction());
            ConvexPolygon::quad([hub - u, hub - v, hub + u, hub + v])
        })
        .collect();
    let same = vec![ConvexPolygon::triangle(hub, hub + Vec3::X, hub + Vec3::Y); 900];
    let odd: Vec<ConvexPolygon> = (0..900)
        .map(|i| {
            let [a, b, c, d] = [(); 4].map(|()| rng.point(&Aabb::cube(hub, 2.0)));
            match i % 6 {
                // Bent, crossed, a needle, a point, huge, tiny.
                0 => ConvexPolygon::quad([a, b, c, d]),
                1 => ConvexPolygon::quad([a, a + Vec3::X, a + Vec3::Y, a + Vec3::X + Vec3::Y]),
                2 => ConvexPolygon::triangle(a, b, a),
                3 => ConvexPolygon::triangle(a, a, a),
                4 => ConvexPolygon::quad([a * 3.0e38, b * 3.0e38, c * -3.0e38, d])
                    .map(|p| p.clamp(Vec3::MIN, Vec3::MAX)),
                _ => ConvexPolygon::triangle(a * 1.0e-38, b * 1.0e-40, c * 1.0e-42),
            }
        })
        .collect();
    for (name, polygons) in [("star", star), ("burst", burst), ("same", same), ("odd", odd)] {
        let tree = built(&polygons);
        let counts = tree.counts();
        assert!(counts.pieces <= 8 * polygons.len() && counts.depth <= 60, "{name}: {counts:?}");
        for eye in [hub, Vec3::splat(f32::MAX), Vec3::NAN, Vec3::INFINITY, Vec3::new(3.0, 4.0, 5.0)] {
            let mut seen: Vec<u32> = pieces(&tree, eye).iter().map(|(id, _)| id.0).collect();
            seen.sort_unstable();
            seen.dedup();
            assert_eq!(seen.len(), polygons.len(), "{name}: every polygon has a piece");
        }
    }
    // What is not a number is not taken.
    let mut tree = built(&[]);
    tree.insert(PolygonId(4), &Aabb::cube(hub, 0.1)).expect("a finite box");
    tree.shape(PolygonId(4), &ConvexPolygon::triangle(hub, Vec3::NAN, hub));
    tree.commit();
    assert!(pieces(&tree, Vec3::ONE).iter().all(|(_, corners)| corners.iter().all(|p| p.is_finite())));
    tree.clear();
    tree.commit();
    assert_eq!(pieces(&tree, Vec3::ONE), []);
}

/// A pipeline announces what comes and what moves, alone and together: the tree in it is that of the polygons themselves.
#[test]
fn in_a_pipeline_the_tree_reads_the_polygons() {
    let mut polygons = piercing(60, 0.6, 11);
    let mut world = World::of(polygons.iter().copied());
    let config = IndexConfig { root: root(), capacity: world.0.len() };
    let index = Box::new(Bsp::new(BspConfig::default(), &config));
    let mut pipeline = Pipeline::new(index, world.0.len());
    let ids = || (0..60).map(PolygonId);
    let frames: [Vec<Change>; 3] = [
        ids().map(Change::Insert).collect(),
        // They go to the index together.
        ids().filter(|id| id.0 % 9 > 2).map(Change::Update).collect(),
        ids()
            .flat_map(|id| {
                if id.0 % 3 == 0 {
                    [Change::Update(id), Change::Repaint(id)]
                } else {
                    [Change::Repaint(id); 2]
                }
            })
            .collect(),
    ];
    let mut told = built(&polygons);
    let view = View::look_at(Vec3::ONE, Vec3::ZERO, Projection::symmetric(60.0, 1.0, 0.1, 100.0));
    for (number, changes) in frames.iter().enumerate() {
        if number > 0 {
            for &change in changes {
                let Change::Update(id) = change else { continue };
                let moved = polygons[id.index()].map(|p| p + Vec3::new(0.1, 0.2, 0.3));
                (polygons[id.index()], world.0[id.index()]) = (moved, Some(Thing::Wall(moved)));
                told.update(id, &moved.bounds()).expect("it is inserted");
                told.shape(id, &moved);
            }
            told.commit();
        }
        pipeline.frame(&world, changes, &view);
        let index: &dyn Any = pipeline.index();
        let tree = index.downcast_ref::<Bsp>().expect("the tree");
        for eye in [Vec3::new(3.0, 4.0, 5.0), Vec3::new(-4.0, 0.5, 0.0)] {
            assert_eq!(pieces(tree, eye), pieces(&told, eye), "frame {number}");
        }
    }
}
