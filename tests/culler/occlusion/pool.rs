//! Candidates for occluders: which there are, when they die, and that a run of them hides only what it covers.

use std::collections::HashSet;

use super::{
    judge::{is_blocked, points_of_box},
    random::{Polygon, Random, volume},
    session::{Told, polygon, polygon_of, ribbon, view},
};
use glam::{DVec3, Vec3};
use osp::occlusion::{
    Grouping, OccluderPool, Occlusion, PoolConfig, SelectConfig, Selector, ShadowVolume, Verdict,
};
use osp_rivals::RivalOcclusion;
use osp_session::{
    recording::{Event, StrokeId},
    scene::Scene,
};
use osp_testkit::allocations;
use osp_testkit::events::SOLE;

fn quad(center: Vec3, size: f32) -> [Vec3; 4] {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| center + Vec3::new(x, y, 0.0) * (0.5 * size))
}

#[test]
fn a_pool_of_any_size_can_be_asked_for() {
    let pool = OccluderPool::new(PoolConfig { capacity: 1 << 19, ..PoolConfig::default() });
    assert!(pool.is_empty());
}

fn assert_consistent(pool: &OccluderPool, scene: &Scene) {
    let mut seen = HashSet::new();
    let mut count = 0;
    for candidate in pool.candidates() {
        count += 1;
        for id in candidate {
            assert!(scene.is_visible(*id), "{id:?} has gone");
            assert!(scene.stroke_of(*id).color().3 >= 1.0, "{id:?} can be seen through");
            assert!(seen.insert(*id), "{id:?} is in two candidates");
        }
    }
    assert_eq!(count, pool.len());
}

#[test]
fn the_pool_keeps_the_largest_and_stays_bounded() {
    let config = PoolConfig { capacity: 16, grouping: Grouping::Single };
    let mut pool = OccluderPool::new(config);
    let mut told = Told::default();
    let mut random = Random::new(1);
    let mut sizes = Vec::new();
    for n in 0..500 {
        let size = random.log_range(0.01, 10.0) as f32;
        sizes.push((size, n));
        told.tell(&[polygon(&quad(random.in_cube().as_vec3() * 5.0, size), 1.0)]);
        pool.follow(&told.scene, &told.changes);
        assert!(pool.len() <= 32);
    }
    assert_consistent(&pool, &told.scene);
    sizes.sort_by(|a, b| b.0.total_cmp(&a.0));
    let kept: HashSet<u32> = pool.candidates().flatten().map(|id| id.0).collect();
    for (size, n) in &sizes[..16] {
        assert!(kept.contains(n), "the one of {size} m was dropped");
    }
}

#[test]
fn what_can_be_seen_through_is_no_candidate() {
    let places = [(Vec3::ZERO, 0.99), (Vec3::ONE, f32::NAN), (Vec3::X, 1.0)];
    let told = Told::of(&places.map(|(place, opacity)| polygon(&quad(place, 1.0), opacity)));
    let pool = told.pool();
    assert_eq!(pool.len(), 1);
    assert_consistent(&pool, &told.scene);
}

#[test]
fn candidates_follow_erase_undo_move_and_redo() {
    for grouping in [Grouping::Single, Grouping::Patches] {
        let mut pool = OccluderPool::new(PoolConfig { capacity: 40, grouping });
        let mut told = Told::default();
        let mut random = Random::new(3);
        let mut strokes = 0;
        for _ in 0..600 {
            let stroke = StrokeId(random.below(strokes.max(1) as usize) as u32);
            let event = match random.below(8) {
                0 => SOLE.erase(stroke),
                1 => SOLE.undo(),
                2 => SOLE.redo(),
                3 => SOLE.moved([stroke], random.in_cube().as_vec3()),
                _ => {
                    let events = ribbon(strokes, 2 + random.below(30), 0.1, &mut random);
                    strokes += 1;
                    told.tell(&events);
                    pool.follow(&told.scene, &told.changes);
                    continue;
                }
            };
            told.tell(&[event]);
            pool.follow(&told.scene, &told.changes);
            assert_consistent(&pool, &told.scene);
        }
        assert!(!pool.is_empty());
    }
}

#[test]
fn others_take_the_places_of_candidates_that_died() {
    let config = PoolConfig { capacity: 64, grouping: Grouping::Single };
    let mut pool = OccluderPool::new(config);
    let mut told = Told::default();
    // Many small ones under one number, few large ones under another.
    let mut random = Random::new(4);
    for n in 0..2000 {
        let (stroke, size) = if n % 10 == 0 { (1, 2.0) } else { (0, 0.1) };
        told.tell(&[polygon_of(stroke, &quad(random.in_cube().as_vec3() * 5.0, size))]);
        pool.follow(&told.scene, &told.changes);
    }
    let of_stroke = |pool: &OccluderPool, scene: &Scene, stroke: u32| {
        pool.candidates().flatten().filter(|id| scene.stroke_of(**id).id() == Some(StrokeId(stroke))).count()
    };
    assert!(of_stroke(&pool, &told.scene, 1) >= 64);
    told.tell(&[SOLE.erase(StrokeId(1))]);
    pool.follow(&told.scene, &told.changes);
    for _ in 0..5 {
        pool.follow(&told.scene, &[]);
    }
    assert_consistent(&pool, &told.scene);
    assert!(of_stroke(&pool, &told.scene, 0) >= 64, "{}", pool.len());
}

#[test]
fn a_ribbon_becomes_few_candidates_that_hide_more() {
    let mut random = Random::new(5);
    let told = Told::of(&ribbon(0, 200, 0.3, &mut random));
    let pools = [Grouping::Single, Grouping::Patches].map(|grouping| {
        let mut pool = OccluderPool::new(PoolConfig { capacity: 1000, grouping });
        pool.follow(&told.scene, &told.changes);
        pool
    });
    let [single, runs] = &pools;
    assert!(runs.len() * 3 < single.len(), "{} of {}", runs.len(), single.len());
    assert_eq!(runs.candidates().flatten().count(), single.len(), "every polygon is in one of them");
}

#[test]
fn coplanar_neighbours_become_one_occluder() {
    // A wall of triangles, as importers bring it, and its mirror image, wound the other way.
    let at = |x: usize, y: usize| Vec3::new(x as f32 * 0.5 - 2.0, y as f32 - 0.5, -3.0);
    let mut events = Vec::new();
    for x in 0..8 {
        let [a, b, c, d] = [at(x, 0), at(x + 1, 0), at(x + 1, 1), at(x, 1)];
        events.push(polygon(&[a, b, c], 1.0));
        events.push(if x % 2 == 0 { polygon(&[a, c, d], 1.0) } else { polygon(&[c, a, d], 1.0) });
    }
    let told = Told::of(&events);
    let pool = told.pool();
    assert_eq!(pool.len(), 1);
    let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
    let mut selector = Selector::new(SelectConfig::default());
    selector.select(&pool, &told.scene, &window);
    let [wall] = selector.chosen() else { panic!("{} occluders", selector.chosen().len()) };
    let whole =
        ShadowVolume::of_polygon(&[at(0, 0), at(8, 0), at(8, 1), at(0, 1)], &window).expect("the wall");
    let (found, whole) = (wall.solid_angle_in(&window), whole.solid_angle_in(&window));
    assert!((found / whole - 1.0).abs() < 1.0e-6, "{found} of {whole}");
    assert_eq!(wall.sides().len(), 4);
}

/// Scenes of ribbons, fans and meshes; occluders are runs; every "hidden" is judged against all polygons.
#[test]
fn random_stress_of_patches_exposes_nothing() {
    let scenes = if cfg!(debug_assertions) { 60 } else { 1500 };
    let (mut runs, mut asked, mut hidden) = (0, 0, 0);
    for n in 0..scenes {
        let mut random = Random::new(0x5717 + n);
        let mut events = Vec::new();
        for stroke in 0..1 + random.below(6) as u32 {
            let points = 3 + random.below(40);
            let width = random.log_range(0.05, 1.5) as f32;
            events.extend(ribbon(stroke, points, width, &mut random));
        }
        if random.chance(0.5) {
            events.extend(fan(&mut random));
        }
        if random.chance(0.5) {
            events.extend(crumpled_mesh(&mut random));
        }
        let told = Told::of(&events);
        let pool = told.pool();
        let eye = random.direction().as_vec3() * random.log_range(0.1, 6.0) as f32;
        let window = view(eye, random.in_cube().as_vec3() * 0.5).window().expect("a window");
        let mut selector =
            Selector::new(SelectConfig { occluders: 24, least_share: 1.0e-5, ..SelectConfig::default() });
        selector.select(&pool, &told.scene, &window);
        runs += selector.chosen().len();
        let polygons = told.polygons();
        // Around the virtual outlines, not only the polygons' own edges.
        let outlines: Vec<Polygon> = selector
            .chosen()
            .iter()
            .map(|s| s.corners().iter().map(|v| (*v + window.eye_in_world()).as_vec3()).collect())
            .collect();
        for make in [RivalOcclusion::Frusta.culler(), Occlusion::Msvbsp.culler()] {
            let mut culler = make(64);
            culler.build(&window, selector.chosen());
            for k in 0..60 {
                let around = if k % 2 == 0 { &outlines } else { &polygons };
                let bounds = volume(&window, around, &mut random);
                asked += 1;
                if culler.test_box(&bounds).verdict == Verdict::Hidden {
                    hidden += 1;
                    for x in points_of_box(&window, &bounds) {
                        assert!(is_blocked(&window, &polygons, x), "scene {n}: {x} of {bounds:?}");
                    }
                }
            }
        }
    }
    eprintln!("{runs} runs, {asked} asked, {hidden} hidden");
    assert!(hidden * 20 > asked, "{hidden} of {asked}");
}

fn fan(random: &mut Random) -> Vec<Event> {
    let center = random.in_cube() * 2.0;
    let (u, v) = (random.direction(), random.direction());
    let corners = (0..12).map(|i| {
        let angle = f64::from(i) / 12.0 * std::f64::consts::TAU;
        let wobble = random.range(-0.05, 0.05);
        (center + (u * angle.cos() + v * angle.sin()) * (0.8 + wobble)).as_vec3()
    });
    vec![polygon(&corners.collect::<Vec<_>>(), 1.0)]
}

/// A grid of triangles, row by row, out of flatness to any degree.
fn crumpled_mesh(random: &mut Random) -> Vec<Event> {
    let corner = random.in_cube() * 2.0;
    let (u, v) = (random.direction() * 0.3, random.direction() * 0.3);
    let crumple = random.log_range(1.0e-4, 0.5);
    let points: Vec<Vec3> = (0..48)
        .map(|i| corner + u * f64::from(i % 8) + v * f64::from(i / 8) + random.in_cube() * crumple)
        .map(|p: DVec3| p.as_vec3())
        .collect();
    let of_quad = |i: usize| {
        let [a, b, c, d] = [points[i], points[i + 1], points[i + 9], points[i + 8]];
        [polygon(&[a, b, c], 1.0), polygon(&[a, c, d], 1.0)]
    };
    (0..40).filter(|i| i % 8 < 7).flat_map(of_quad).collect()
}

#[test]
fn following_and_choosing_allocate_nothing_once_warm() {
    let mut told = Told::default();
    let mut random = Random::new(9);
    let mut pool = OccluderPool::new(PoolConfig { capacity: 64, grouping: Grouping::Patches });
    let mut selector = Selector::new(SelectConfig::default());
    let mut made = 0;
    for n in 0..300 {
        let events = ribbon(n, 16, 0.1, &mut random);
        told.tell(&events);
        let eye = random.direction().as_vec3() * 5.0;
        let window = view(eye, Vec3::ZERO).window().expect("a window");
        let before = allocations();
        pool.follow(&told.scene, &told.changes);
        selector.select(&pool, &told.scene, &window);
        // The table from polygons to candidates grows by a page every 4,096 polygons.
        let grows =
            told.scene.polygon_count() / 4096 != (told.scene.polygon_count() - told.changes.len()) / 4096;
        if n > 150 && !grows {
            made += allocations() - before;
        }
    }
    assert_eq!(made, 0);
}
