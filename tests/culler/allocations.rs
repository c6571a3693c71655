//! Frames allocate nothing as long as the capacity given at creation suffices: no index that grows in place, and no list of
//! what is in view, whatever is in view.

use osp_testkit::{
    allocations,
    boxes::{Rng, drawn, root, shuffled},
    events::Begin,
};

use crate::engine::{Thing, World};
use glam::Vec3;
use osp::{
    Camera, Culler, Occluder,
    frame::{PassConfig, Pipeline},
    index::{IndexConfig, kernels::ROOM_BEHIND},
    math::{Aabb, Frustum},
    occlusion::Occlusion,
    polygon::{Change, Geometry, PolygonId},
    view::{Projection, View},
};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Event, Paint, StrokeId},
    scene::Scene,
};

const IN_PLACE: [IndexKind; 6] = [
    IndexKind::BruteForce,
    IndexKind::BruteSimd,
    IndexKind::TimeOrder,
    IndexKind::Osp,
    IndexKind::DynamicBvh,
    IndexKind::LooseOctree,
];

/// A ribbon that winds through the room, sample by sample, in strokes of a few hundred.
fn session(samples: u32) -> Vec<Event> {
    let mut events = Vec::new();
    for i in 0..samples {
        let stroke = StrokeId(i / 300);
        if i.is_multiple_of(300) {
            events.push(Begin { width: 0.02, color: (0.5, 0.5, 0.5, 1.0), ..Begin::of(stroke) }.event());
        }
        let (angle, turns) = (i as f32 * 0.02, (i / 300) as f32 * 0.7);
        let p = Vec3::new(angle.cos() * (1.0 + turns.sin() * 0.5), 1.5 + angle * 0.7 % 1.0, angle.sin());
        events.push(Event::Point { t: 0.0, stroke, p, q: glam::Quat::IDENTITY, pressure: 1.0 });
        if i % 300 == 299 {
            events.push(Event::End { t: 0.0, stroke });
        }
    }
    events
}

fn polygons_of(events: &[Event]) -> usize {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    events.iter().for_each(|event| scene.apply(event, &mut changes));
    scene.polygon_count()
}

/// From so far away that the whole model is in view, from inside it, and away from it.
fn views() -> [View; 3] {
    let projection = Projection::symmetric(60.0, 1.5, 0.05, 50.0);
    let middle = Vec3::new(0.0, 1.5, 0.0);
    [
        View::look_at(Vec3::new(0.0, 2.0, 9.0), middle, projection),
        View::look_at(middle, Vec3::new(1.0, 1.5, 0.3), projection),
        View::look_at(Vec3::new(0.0, 2.0, 9.0), Vec3::new(0.0, 2.0, 20.0), projection),
    ]
}

/// Plays a session of 16 events a frame; what each frame allocated beyond the scene's own.
fn play(events: &[Event], pipeline: &mut Pipeline, views: &[View]) -> Vec<u64> {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    let frame = |batch: &[Event]| {
        changes.clear();
        batch.iter().for_each(|event| scene.apply(event, &mut changes));
        let before = allocations();
        pipeline.frame_of_views(&scene, &changes, views);
        allocations() - before
    };
    events.chunks(16).map(frame).collect()
}

#[test]
fn no_frame_allocates_when_all_is_in_view_and_the_room_is_just_enough() {
    let events = session(6000);
    let capacity = polygons_of(&events);
    assert!(capacity > 5000, "{capacity}");
    let root = Aabb::cube(Vec3::new(0.0, 1.5, 0.0), 4.0);
    for kind in IN_PLACE {
        for seen in [&views()[..1], &views()[1..2], &views()] {
            let index = kind.create(&IndexConfig { root, capacity });
            let mut pipeline = Pipeline::new(index, capacity);
            let made = play(&events, &mut pipeline, seen);
            assert_eq!(
                pipeline.in_view_lists()[0].len() == capacity,
                seen.len() != 1 || seen[0] == views()[0]
            );
            // The first frame has the lists of the views to make.
            let late = made.iter().skip(1).position(|&n| n > 0);
            assert_eq!(late, None, "{}, {} views: {made:?}", kind.name(), seen.len());
        }
    }
}

/// Brushes replace the last polygons of a stroke as it grows, so that neighbours in number lie in different places of the index.
#[test]
fn no_frame_of_brushed_strokes_allocates_when_the_room_is_just_enough() {
    for brush in ["Light", "Marker"] {
        let mut events = session(24_000);
        for event in &mut events {
            if let Event::Begin { paint, .. } = event {
                *paint = Some(Box::new(Paint::new(brush, 1)));
            }
        }
        let capacity = polygons_of(&events);
        assert!(capacity > 20_000, "{capacity}");
        let root = Aabb::cube(Vec3::new(0.0, 1.5, 0.0), 4.0);
        let index = IndexKind::Osp.create(&IndexConfig { root, capacity });
        let mut pipeline = Pipeline::new(index, capacity);
        let made = play(&events, &mut pipeline, &views()[..1]);
        let late = made.iter().skip(1).position(|&n| n > 0);
        assert_eq!(late, None, "{brush}: {made:?}");
    }
}

/// The later half of a session, after what is kept from frame to frame has grown.
#[test]
fn frames_with_occlusion_culling_allocate_nothing_once_a_session_runs() {
    let events = session(3000);
    let capacity = polygons_of(&events);
    for choice in [Occlusion::Msvbsp, Occlusion::PreviousFrame] {
        let index = IndexKind::Osp.create(&IndexConfig { capacity, ..IndexConfig::default() });
        let pipeline = Pipeline::new(index, capacity);
        let mut pipeline = pipeline.with_occlusion(PassConfig::new(choice));
        let made = play(&events, &mut pipeline, &views()[..1]);
        let steady: u64 = made[made.len() / 2..].iter().sum();
        assert_eq!(steady, 0, "{}: {made:?}", choice.name());
    }
}

/// A list with room for what a query finds is not grown by it.
#[test]
fn a_query_that_finds_no_more_than_there_is_room_for_does_not_allocate() {
    let root = Aabb::cube(Vec3::ZERO, 4.0);
    for count in [1u32, 15, 16, 17, 255, 256, 257, 300, 1000, 4096, 5000] {
        for kind in IN_PLACE {
            let mut index = kind.create(&IndexConfig { root, capacity: count as usize });
            for i in 0..count {
                let at = Vec3::new((i % 40) as f32 * 0.02, (i / 40) as f32 * 0.01, (i % 7) as f32 * 0.1);
                index.insert(PolygonId(i), &Aabb::cube(at - Vec3::ONE, 0.02)).expect("a good box");
            }
            index.commit();
            let mut list = Vec::with_capacity(count as usize + ROOM_BEHIND);
            let before = allocations();
            index.frustum_cull(&Frustum::everything(), &mut list);
            assert_eq!(allocations() - before, 0, "{}, {count} polygons", kind.name());
            assert_eq!(list.len(), count as usize);
        }
    }
}

/// How the polygons of a crowd move in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moves {
    /// Neighbours in number, a centimetre.
    Together,
    /// From everywhere, a centimetre.
    Alone,
    /// From everywhere, to anywhere.
    Far,
}

/// A hundred thousand polygons fill the room that was asked for. In each frame some move, some go, and as many come: with the
/// numbers of those that went before, or with new ones.
fn crowd_that_comes_and_goes(moves: Moves, has_new_numbers: bool, is_drawn: bool) -> Vec<u64> {
    const POLYGONS: usize = 100_000;
    const FRAMES: usize = 1980;
    let boxes = drawn(POLYGONS, 91);
    let boxes = if is_drawn { boxes } else { shuffled(boxes, 92) };
    let index = IndexKind::Osp.create(&IndexConfig { root: root(), capacity: POLYGONS });
    let mut pipeline = Pipeline::new(index, POLYGONS);
    let mut rng = Rng(93);
    let mut crowd = World(boxes.into_iter().map(|bounds| Some(Thing::Mesh(bounds))).collect());
    crowd.0.reserve(50 * FRAMES);
    let projection = Projection::symmetric(60.0, 1.5, 0.05, 50.0);
    let view = View::look_at(Vec3::new(0.0, 0.5, 3.0), Vec3::ZERO, projection);
    pipeline.load(&crowd);
    pipeline.frame(&crowd, &[], &view);
    let mut there: Vec<u32> = (0..POLYGONS as u32).collect();
    let mut gone: Vec<u32> = Vec::new();
    let mut changes = Vec::new();
    let mut frame = || {
        changes.clear();
        let first = rng.below(there.len() - 500);
        for i in 0..500 {
            let at = if moves == Moves::Together { first + i } else { rng.below(there.len()) };
            let id = there[at];
            let Aabb { min, max } = crowd.bounds(PolygonId(id));
            let by = match moves {
                Moves::Together => Vec3::X * 0.01,
                Moves::Alone => rng.direction() * 0.01,
                Moves::Far => rng.point(&root()) - min,
            };
            crowd.0[id as usize] = Some(Thing::Mesh(Aabb::new(min + by, max + by)));
            changes.push(Change::Update(PolygonId(id)));
        }
        for _ in 0..50 {
            let id = there.swap_remove(rng.below(there.len()));
            crowd.0[id as usize] = None;
            gone.push(id);
            changes.push(Change::Remove(PolygonId(id)));
        }
        for _ in 0..50 {
            let mesh = Some(Thing::Mesh(Aabb::cube(rng.point(&root()), 0.02)));
            let id = if has_new_numbers {
                crowd.0.push(mesh.clone());
                crowd.0.len() as u32 - 1
            } else {
                gone.swap_remove(rng.below(gone.len()))
            };
            crowd.0[id as usize] = mesh;
            there.push(id);
            changes.push(Change::Insert(PolygonId(id)));
        }
        let before = allocations();
        pipeline.frame(&crowd, &changes, &view);
        allocations() - before
    };
    let made = (0..FRAMES).map(|_| frame()).collect();
    pipeline.index().validate().expect("valid");
    made
}

/// Numbers that become free are used again, or are not: then more blocks of sixteen numbers hold something.
#[test]
fn no_frame_allocates_when_as_many_polygons_come_and_go_as_there_is_room_for() {
    let drawn =
        [Moves::Together, Moves::Alone, Moves::Far].map(|moves| [(moves, false, true), (moves, true, true)]);
    let from_everywhere = [(Moves::Far, true, false), (Moves::Alone, false, false)];
    for (moves, has_new_numbers, is_drawn) in drawn.into_iter().flatten().chain(from_everywhere) {
        let made = crowd_that_comes_and_goes(moves, has_new_numbers, is_drawn);
        let frames: Vec<(usize, u64)> = made.into_iter().enumerate().filter(|&(_, n)| n > 0).collect();
        assert!(frames.is_empty(), "{moves:?}, new numbers {has_new_numbers}, drawn {is_drawn}: {frames:?}");
    }
}

#[test]
fn frames_of_a_culler_allocate_nothing_once_it_runs() {
    let mut culler = Culler::<u64>::new();
    let mut boxes = drawn(3000, 1);
    for (key, bounds) in (0..).zip(&boxes) {
        culler.set(key, [bounds.min, bounds.max]);
    }
    let [a, b] = [Vec3::new(-1.0, -1.0, -1.0), Vec3::new(1.0, 1.0, -1.0)];
    culler.set_occluder(u64::MAX, Occluder::cuboid([a, b]).expect("a wall"));
    let cameras = views().map(|view| Camera::from(&view).hide_by_occluders().on_layers(1));
    let (mut late, mut drawn) = (0, 0);
    for frame in 0..400 {
        let before = allocations();
        for i in 0..200 {
            let key = (frame * 211 + i * 7) % boxes.len();
            let by = Vec3::new(0.01, 0.0, 0.0);
            boxes[key] = Aabb::new(boxes[key].min + by, boxes[key].max + by);
            if key.is_multiple_of(10) {
                culler.remove(key as u64);
            }
            culler.set(key as u64, [boxes[key].min, boxes[key].max]);
        }
        drawn = culler.cull(&cameras).iter().map(|seen| seen.iter().count()).sum();
        late += if frame < 300 { 0 } else { allocations() - before };
    }
    assert_eq!((late, drawn > 1000), (0, true), "{drawn}");
}
