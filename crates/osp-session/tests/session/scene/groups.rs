//! Groups: the coordinates of moved members, and the cost of changes.

use super::{begin, play, point, straight};
use glam::{Quat, Vec3};
use osp::polygon::{Change, PolygonId};
use osp_session::{
    recording::{Event, GroupId, NormalRule, StrokeId, Tool, Transform},
    scene::Scene,
};
use osp_testkit::events::SOLE;
use osp_testkit::events::polygon;

const HALF_TURN_ABOUT_Y: Quat = Quat::from_xyzw(0.0, 1.0, 0.0, 0.0);
const QUARTER_TURN_ABOUT_Z: Quat =
    Quat::from_xyzw(0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2);

fn place(group: u32, p: Vec3, q: Quat, s: f32) -> Event {
    SOLE.placed(GroupId(group), Transform { p, q, s })
}

fn group(group: u32, strokes: &[u32], parent: Option<u32>) -> Event {
    let strokes: Vec<_> = strokes.iter().map(|&s| StrokeId(s)).collect();
    SOLE.grouped(GroupId(group), strokes, parent.map(GroupId))
}

fn moved(stroke: u32, by: Vec3) -> Event {
    SOLE.moved([StrokeId(stroke)], by)
}

fn center(scene: &Scene) -> Vec3 {
    scene.bounds(PolygonId(0)).center()
}

fn assert_near(a: Vec3, b: Vec3) {
    assert!((a - b).length() < 1.0e-5, "{a} is not {b}");
}

/// A ribbon of a square metre from x = 0 to x = 1, in group 1.
fn grouped() -> Scene {
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 2, NormalRule::LocalX));
    play(&mut scene, &[group(1, &[1], None)]);
    assert_near(center(&scene), Vec3::new(0.5, 0.0, 0.0));
    scene
}

/// Every corner of every polygon, and every box, bit for bit.
fn bits(scene: &Scene) -> Vec<u32> {
    let ids = || (0..scene.polygon_count() as u32).map(PolygonId);
    let corners = ids().flat_map(|id| scene.polygon(id).vertices().to_vec());
    let boxes = ids().flat_map(|id| [scene.bounds(id).min, scene.bounds(id).max]);
    corners.chain(boxes).flat_map(|p| p.to_array().map(f32::to_bits)).collect()
}

#[test]
fn what_was_moved_in_a_group_turns_and_scales_with_it() {
    let mut scene = grouped();
    play(&mut scene, &[moved(1, Vec3::X * 3.0)]);
    assert_near(center(&scene), Vec3::new(3.5, 0.0, 0.0));
    play(&mut scene, &[place(1, Vec3::ZERO, HALF_TURN_ABOUT_Y, 1.0)]);
    assert_near(center(&scene), Vec3::new(-3.5, 0.0, 0.0));
    play(&mut scene, &[place(1, Vec3::Y, HALF_TURN_ABOUT_Y, 2.0)]);
    assert_near(center(&scene), Vec3::new(-7.0, 1.0, 0.0));
}

#[test]
fn a_move_is_in_world_space_whatever_the_groups_have_done() {
    let mut scene = grouped();
    let placed = [
        group(2, &[], None),
        group(1, &[], Some(2)),
        place(1, Vec3::new(0.3, 0.0, 1.0), QUARTER_TURN_ABOUT_Z, 0.5),
        place(2, Vec3::new(0.0, 2.0, 0.0), HALF_TURN_ABOUT_Y, 4.0),
    ];
    play(&mut scene, &placed);
    for by in [Vec3::X, Vec3::new(-0.5, 2.0, 0.25)] {
        let before = center(&scene);
        play(&mut scene, &[moved(1, by)]);
        assert_near(center(&scene), before + by);
    }
    // After a rotation with the outer group, the box of the group is that of its polygons.
    let before = center(&scene);
    play(&mut scene, &[place(2, Vec3::new(0.0, 2.0, 0.0), Quat::IDENTITY, 4.0)]);
    assert_near(center(&scene), Vec3::new(-before.x, before.y, -before.z));
}

#[test]
fn a_stroke_is_where_its_points_say_in_its_group_moved_or_not() {
    // The stroke is moved first, then added to a placed group: the points and the move are both in the group's space
    // now.
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 2, NormalRule::LocalX));
    let mut other = scene.clone();
    play(&mut scene, &[moved(1, Vec3::X * 3.0), group(1, &[], None)]);
    play(&mut scene, &[place(1, Vec3::Y, HALF_TURN_ABOUT_Y, 2.0), group(1, &[1], None)]);
    assert_near(center(&scene), Vec3::new(-7.0, 1.0, 0.0));
    play(
        &mut other,
        &[group(1, &[1], None), moved(1, Vec3::X * 3.0), place(1, Vec3::Y, HALF_TURN_ABOUT_Y, 2.0)],
    );
    assert_near(center(&other), center(&scene));
}

#[test]
fn a_group_that_was_hung_elsewhere_does_not_go_with_the_old_one() {
    let mut scene = grouped();
    play(&mut scene, &[group(2, &[], None), group(3, &[], None), group(1, &[], Some(2))]);
    assert_eq!(play(&mut scene, &[place(2, Vec3::X, Quat::IDENTITY, 1.0)]).len(), 1);
    // The group moves back, because it has another parent now.
    assert_eq!(play(&mut scene, &[group(1, &[], Some(3))]).len(), 1);
    assert_near(center(&scene), Vec3::new(0.5, 0.0, 0.0));
    assert!(play(&mut scene, &[place(2, Vec3::Y, Quat::IDENTITY, 1.0)]).is_empty());
    assert_eq!(play(&mut scene, &[place(3, Vec3::Y, Quat::IDENTITY, 1.0)]).len(), 1);
    assert_near(center(&scene), Vec3::new(0.5, 1.0, 0.0));
}

#[test]
fn rotations_are_taken_at_unit_length() {
    // Quaternions in a file may be a per cent longer or shorter.
    for longer in [0.995, 1.005] {
        let q = Quat::from_xyzw(0.36, 0.48, 0.0, 0.8);
        let mut scenes = [grouped(), grouped()];
        for (scene, q) in scenes.iter_mut().zip([q, q * longer]) {
            play(scene, &[place(1, Vec3::Y, q, 3.0), moved(1, Vec3::X)]);
            play(scene, &[begin(2, Tool::Ribbon, NormalRule::Travel)]);
            for i in 0..3 {
                play(scene, &[point(2, Vec3::new(i as f32, 0.0, 0.3 * (i * i) as f32), q)]);
            }
        }
        let corners = |scene: &Scene| {
            let ids = (0..scene.polygon_count() as u32).map(PolygonId);
            ids.flat_map(|id| scene.polygon(id).vertices().to_vec()).collect::<Vec<Vec3>>()
        };
        let [exact, rounded] = [corners(&scenes[0]), corners(&scenes[1])];
        assert_eq!((exact.len(), rounded.len()), (12, 12));
        exact.into_iter().zip(rounded).for_each(|(a, b)| assert_near(a, b));
    }
}

#[test]
fn a_group_without_extent_cannot_be_moved_in() {
    let mut scene = grouped();
    play(&mut scene, &straight(2, 2, NormalRule::LocalX));
    play(&mut scene, &[place(1, Vec3::Y, Quat::IDENTITY, 0.0)]);
    assert_near(center(&scene), Vec3::Y);
    let ignored = scene.counts().ignored_events;
    assert!(play(&mut scene, &[moved(1, Vec3::X)]).is_empty());
    assert_eq!(scene.counts().ignored_events, ignored + 1);
    // The scale is so small that the vector in the group's space is not finite.
    play(&mut scene, &[place(1, Vec3::Y, Quat::IDENTITY, 1.0e-30), moved(1, Vec3::X * 1.0e15)]);
    assert_eq!(scene.counts().ignored_events, ignored + 2);
    // The other strokes of the move are moved all the same.
    let both = SOLE.moved([StrokeId(1), StrokeId(2)], Vec3::X * 1.0e15);
    let changes = play(&mut scene, &[both]);
    assert_eq!(changes, [Change::Update(PolygonId(1))]);
    play(&mut scene, &[place(1, Vec3::ZERO, Quat::IDENTITY, 1.0)]);
    assert_near(center(&scene), Vec3::new(0.5, 0.0, 0.0));
}

#[test]
fn a_chain_of_groups_is_64_long_at_most_wherever_it_grows() {
    // From above, from below, and by joining two chains of 32 groups.
    let chain = |first: u32, length: u32| {
        (first + 1..first + length).map(|number| group(number, &[], Some(number - 1))).collect::<Vec<_>>()
    };
    let mut scene = Scene::new();
    play(&mut scene, &[group(0, &[], None)]);
    play(&mut scene, &chain(0, 64));
    assert_eq!(scene.counts().ignored_events, 0);
    play(&mut scene, &[group(64, &[], Some(63))]);
    assert_eq!(scene.counts().ignored_events, 1, "a 65th below");
    play(&mut scene, &[group(100, &[], None), group(0, &[], Some(100))]);
    assert_eq!(scene.counts().ignored_events, 2, "a 65th above");
    play(&mut scene, &[group(200, &[], None)]);
    play(&mut scene, &chain(200, 32));
    play(&mut scene, &[group(300, &[], None)]);
    play(&mut scene, &chain(300, 33));
    play(&mut scene, &[group(300, &[], Some(231))]);
    assert_eq!(scene.counts().ignored_events, 3, "32 and 33");
    // With a chain that is shorter by one the grouping is possible; the undo makes the chain long again.
    play(&mut scene, &[group(332, &[], None), group(300, &[], Some(231))]);
    assert_eq!(scene.counts().ignored_events, 3);
    play(&mut scene, &[SOLE.undo(), SOLE.undo(), group(300, &[], Some(231))]);
    assert_eq!(scene.counts().ignored_events, 4);
    // A second, shorter child does not hide the longer one.
    play(&mut scene, &[group(400, &[], Some(300)), group(400, &[], None), group(300, &[], Some(231))]);
    assert_eq!(scene.counts().ignored_events, 5);
}

#[test]
fn many_lines_of_groups_look_at_few_groups_each() {
    const LINES: u32 = 8000;
    let mut scene = Scene::new();
    // A bush: chains of 60 groups, which get parents in other chains and back.
    let mut events = vec![group(0, &[], None)];
    for number in 1..LINES {
        let parent = if number % 60 == 0 { 0 } else { number - 1 };
        events.push(group(number, &[], Some(parent)));
    }
    for event in &events {
        scene.apply(event, &mut Vec::new());
    }
    assert_eq!(scene.counts().ignored_events, 0);
    let steps = scene.work().group_steps;
    assert!(steps <= u64::from(LINES) * 3 * 64, "{steps} steps for {LINES} lines");
    // The same groupings again: each group keeps its parent.
    scene.apply_all(&events[1..], &mut Vec::new());
    assert!(scene.work().group_steps <= 2 * u64::from(LINES) * 3 * 64);
}

#[test]
fn a_frame_places_each_polygon_once() {
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 401, NormalRule::LocalX));
    play(&mut scene, &straight(2, 101, NormalRule::LocalX));
    let mut events: Vec<Event> = (1..60).map(|number| group(number, &[], Some(number - 1))).collect();
    events.insert(0, group(0, &[2], None));
    events.push(group(59, &[1], Some(58)));
    let changes = play_as_a_frame(&mut scene, &events);
    assert_eq!(changes.len(), 500);
    let before = scene.work();
    let events: Vec<Event> = (0..1000)
        .flat_map(|i| {
            let turn = if i % 2 == 0 { QUARTER_TURN_ABOUT_Z } else { HALF_TURN_ABOUT_Y };
            [place(i % 60, Vec3::X * i as f32, turn, 1.0), moved(2, Vec3::Y), moved(1, Vec3::Y)]
        })
        .collect();
    let mut one_by_one = scene.clone();
    let changes = play_as_a_frame(&mut scene, &events);
    assert_eq!(changes, (0..500).map(|i| Change::Update(PolygonId(i))).collect::<Vec<_>>());
    let work = scene.work();
    assert_eq!(work.displaced - before.displaced, 500, "each polygon once for 3,000 events");
    assert!(work.group_steps - before.group_steps <= 62, "60 groups and two members: {}", work.group_steps);
    play(&mut one_by_one, &events);
    assert!(bits(&one_by_one) == bits(&scene), "a frame at once is not its events one by one");
}

fn play_as_a_frame(scene: &mut Scene, events: &[Event]) -> Vec<Change> {
    let mut changes = Vec::new();
    scene.apply_all(events, &mut changes);
    changes
}

/// Corners are computed in `f32`, group by group. The box of a group that moves as a whole contains them all, also if
/// large numbers cancel along the chain, or the group's own numbers are large.
#[test]
fn the_box_of_a_group_that_moves_as_a_whole_holds_what_is_rounded() {
    for number in 0..40 {
        let half = 0.1 + 0.07 * number as f32;
        let turn = Quat::from_xyzw(half.sin() * 0.48, half.sin() * 0.6, half.sin() * 0.64, half.cos());
        let far = Vec3::new(5.0e5 + 0.3, -4.0e5, 6.0e5);
        // Far away and back; or drawn far away in the group's own space.
        for (at, inner, outer) in [(Vec3::ZERO, far, turn * -far), (far, Vec3::ZERO, Vec3::ZERO)] {
            let mut scene = Scene::keeping_groups_whole();
            let vertices = vec![at, at + Vec3::X * 0.3, at + Vec3::Y * 0.2];
            let polygon = polygon(Some(StrokeId(1)), vertices, (1.0, 1.0, 1.0, 1.0));
            play(&mut scene, &[polygon, group(2, &[], None), group(1, &[1], Some(2))]);
            let placed = || [place(1, inner, turn, 1.0), place(2, outer, turn, 1.0)];
            (0..2).for_each(|_| drop(play(&mut scene, &placed())));
            let changes = play(&mut scene, &placed());
            assert!(changes.iter().any(|change| matches!(change, Change::Place(_))), "{changes:?}");
            let (nodes, tight) = (scene.group_tree(), scene.bounds(PolygonId(0)));
            let changed = changes.into_iter().map(|change| scene.bounds_of_change(change));
            for whole in changed.chain(nodes.iter().map(|node| node.bounds)) {
                assert!(whole.contains(&tight), "turn {number}: {whole:?} does not hold {tight:?}");
            }
        }
    }
}
