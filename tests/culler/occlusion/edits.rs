//! What is moved, erased, taken back or placed with its group hides where it is now, and nowhere else.

use super::{
    judge::{is_blocked, points_of_box},
    random::{Polygon, Random, volume},
    session::{Told, polygon_of, view},
};
use glam::{Quat, Vec3};
use osp::{
    math::Aabb,
    occlusion::{OccluderPool, Occlusion, PoolConfig, SelectConfig, Selector, ShadowVolume, Verdict},
    polygon::Change,
    view::ViewWindow,
};
use osp_session::{
    recording::{Event, GroupId, StrokeId, Transform},
    scene::Scene,
};
use osp_testkit::events::SOLE;

/// A wall of `columns` quads with shared edges, facing +z.
fn wall(stroke: u32, low: Vec3, columns: usize, size: f32) -> Vec<Event> {
    let at = |x: usize, y: usize| low + Vec3::new(x as f32, y as f32, 0.0) * size;
    (0..columns).map(|x| polygon_of(stroke, &[at(x, 0), at(x + 1, 0), at(x + 1, 1), at(x, 1)])).collect()
}

fn shadows(pool: &OccluderPool, scene: &Scene, window: &ViewWindow) -> Vec<ShadowVolume> {
    let mut selector = Selector::new(SelectConfig { least_share: 1.0e-5, ..SelectConfig::default() });
    selector.select(pool, scene, window);
    selector.chosen().to_vec()
}

fn is_hidden(pool: &OccluderPool, scene: &Scene, window: &ViewWindow, bounds: &Aabb) -> bool {
    let mut culler = Occlusion::Msvbsp.create(64);
    culler.build(window, &shadows(pool, scene, window));
    culler.test_box(bounds).verdict == Verdict::Hidden
}

#[test]
fn a_wall_that_was_moved_hides_nothing_at_its_old_place() {
    let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
    let behind = |x: f32| Aabb::cube(Vec3::new(x * 2.0, 0.0, -8.0), 0.2);
    let group = GroupId(1);
    let strokes = vec![StrokeId(0)];
    let by = Vec3::X * 2.5;
    let to = Transform { p: by, q: Quat::IDENTITY, s: 1.0 };
    let moves: [Vec<Event>; 4] = [
        vec![SOLE.moved(strokes.clone(), by)],
        vec![SOLE.grouped(group, strokes.clone(), None), SOLE.placed(group, to)],
        // Moved, erased and restored in one frame.
        vec![SOLE.moved(strokes.clone(), by), SOLE.erase(StrokeId(0)), SOLE.undo()],
        vec![SOLE.moved(strokes.clone(), by), SOLE.undo(), SOLE.redo()],
    ];
    for (i, events) in moves.iter().enumerate() {
        for roughly in [false, true] {
            let mut told = Told::of(&wall(0, Vec3::new(-1.0, -0.5, -4.0), 2, 1.0));
            let mut pool = told.pool();
            assert_eq!(pool.len(), 1, "one patch of two");
            assert!(is_hidden(&pool, &told.scene, &window, &behind(0.0)));
            told.tell(events);
            let name = format!("{i} {roughly}");
            if roughly {
                pool.follow_roughly(&told.scene, &told.changes, 0);
                assert!(!is_hidden(&pool, &told.scene, &window, &behind(0.0)), "{name}: roughly");
                pool.catch_up(&told.scene, 100);
            } else {
                pool.follow(&told.scene, &told.changes);
            }
            assert!(!is_hidden(&pool, &told.scene, &window, &behind(0.0)), "{name}: the old place");
            assert!(is_hidden(&pool, &told.scene, &window, &behind(2.5)), "{name}: the new place");
        }
    }
}

#[test]
fn what_is_erased_is_no_candidate_whatever_is_told_of_it() {
    let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
    let behind = Aabb::cube(Vec3::new(0.0, 0.0, -8.0), 0.2);
    for roughly in [false, true] {
        let mut told = Told::of(&wall(0, Vec3::new(-1.0, -0.5, -4.0), 2, 1.0));
        let ids: Vec<_> = told.scene.visible_ids().collect();
        let mut pool = told.pool();
        told.tell(&[SOLE.erase(StrokeId(0))]);
        let follow = |pool: &mut OccluderPool, scene: &Scene, changes: &[Change]| {
            if roughly {
                pool.follow_roughly(scene, changes, 100)
            } else {
                pool.follow(scene, changes);
                0
            };
        };
        follow(&mut pool, &told.scene, &told.changes);
        assert!(pool.is_empty() && !is_hidden(&pool, &told.scene, &window, &behind), "{roughly}");
        for change in [Change::Update(ids[0]), Change::Insert(ids[0]), Change::Update(ids[1])] {
            follow(&mut pool, &told.scene, &[change]);
            pool.catch_up(&told.scene, 100);
            assert!(pool.is_empty(), "{roughly} {change:?}");
        }
        told.tell(&[SOLE.undo()]);
        follow(&mut pool, &told.scene, &told.changes);
        pool.catch_up(&told.scene, 100);
        assert!(is_hidden(&pool, &told.scene, &window, &behind), "{roughly}: back again");
    }
}

/// A wall that loses one polygon has a hole there: the candidate dies, the others come back on their own.
#[test]
fn a_wall_that_loses_a_part_has_a_hole() {
    let window = view(Vec3::ZERO, Vec3::NEG_Z).window().expect("a window");
    for hole in 0..3u32 {
        for roughly in [false, true] {
            let part = |k| wall(k, Vec3::new(k as f32 - 1.5, -0.5, -4.0), 1, 1.0);
            let mut told = Told::of(&(0..3).flat_map(part).collect::<Vec<_>>());
            let mut pool = told.pool();
            assert_eq!(pool.len(), 1, "one patch of three strokes");
            told.tell(&[SOLE.erase(StrokeId(hole))]);
            if roughly {
                pool.follow_roughly(&told.scene, &told.changes, 0);
            } else {
                pool.follow(&told.scene, &told.changes);
            }
            let behind = |k: u32| Aabb::cube(Vec3::new((k as f32 - 1.0) * 2.0, 0.0, -8.0), 0.2);
            for k in 0..3 {
                let hidden = is_hidden(&pool, &told.scene, &window, &behind(k));
                assert!(k != hole || !hidden, "{hole} {roughly}");
                assert!(k == hole || roughly || hidden, "{hole}: {k} hides still");
            }
        }
    }
}

fn zigzag(stroke: u32, random: &mut Random) -> Vec<Event> {
    let mut at = random.in_cube() * 1.5;
    let mut travel = random.direction();
    let side = travel.cross(random.direction()).normalize() * random.range(0.2, 0.8);
    let mut rung = [(at + side).as_vec3(), (at - side).as_vec3()];
    let mut events = Vec::new();
    for _ in 0..2 + random.below(8) {
        travel = (travel + random.direction() * 0.1).normalize();
        at += travel * 0.3;
        let next = [(at + side).as_vec3(), (at - side).as_vec3()];
        events.push(polygon_of(stroke, &[rung[0], rung[1], next[1], next[0]]));
        rung = next;
    }
    events
}

/// Random edits, many in one frame, followed closely or roughly: after each frame, what is hidden is behind something
/// that is there now. Needed around everything's present and former places.
#[test]
fn random_edits_leave_no_shadow_behind() {
    let (mut asked, mut hidden) = (0, 0);
    for n in 0..40 {
        let mut random = Random::new(0xED17 + n);
        let mut told = Told::default();
        let mut pool = OccluderPool::new(PoolConfig::default());
        let mut strokes = 0;
        let mut former: Vec<Polygon> = Vec::new();
        for _ in 0..25 {
            let mut events = Vec::new();
            for _ in 0..1 + random.below(4) {
                let stroke = StrokeId(random.below(strokes.max(1) as usize) as u32);
                match random.below(if strokes < 3 { 1 } else { 9 }) {
                    0 | 1 => {
                        events.extend(zigzag(strokes, &mut random));
                        strokes += 1;
                    }
                    2 => events.push(SOLE.erase(stroke)),
                    3 | 4 => events.push(SOLE.undo()),
                    5 => events.push(SOLE.redo()),
                    6 => {
                        let group = GroupId(random.below(2) as u32);
                        events.push(SOLE.grouped(group, [stroke], None));
                        let q = Quat::from_rotation_y(random.range(-3.0, 3.0) as f32);
                        let to = Transform { p: random.in_cube().as_vec3(), q, s: 1.0 };
                        events.push(SOLE.placed(group, to));
                    }
                    _ => {
                        let by = random.in_cube().as_vec3() * 2.0;
                        events.push(SOLE.moved([stroke], by));
                    }
                }
            }
            told.tell(&events);
            if random.chance(0.5) {
                pool.follow(&told.scene, &told.changes);
            } else {
                pool.follow_roughly(&told.scene, &told.changes, random.below(20));
            }
            for id in pool.candidates().flatten() {
                assert!(told.scene.is_visible(*id), "{n}: {id:?} has gone");
            }
            let present = told.polygons();
            let eye = random.direction().as_vec3() * 5.0;
            let window = view(eye, random.in_cube().as_vec3() * 0.5).window().expect("a window");
            let mut culler = Occlusion::Msvbsp.create(64);
            culler.build(&window, &shadows(&pool, &told.scene, &window));
            for k in 0..30 {
                let around = if k % 2 == 0 { &former } else { &present };
                let bounds = volume(&window, around, &mut random);
                asked += 1;
                if culler.test_box(&bounds).verdict == Verdict::Hidden {
                    hidden += 1;
                    for x in points_of_box(&window, &bounds) {
                        assert!(is_blocked(&window, &present, x), "{n}: {x} of {bounds:?}");
                    }
                }
            }
            former = present;
        }
    }
    assert!(hidden * 20 > asked, "{hidden} of {asked}");
}
