//! Samples become polygons, and events change the model: draw, erase, move, group, undo, redo.

use glam::{Quat, Vec3};
use osp::polygon::{Change, PolygonId};
use osp_session::{
    recording::{Event, GroupId, NormalRule, StrokeId, Tool, Transform},
    scene::Scene,
};
use osp_testkit::events::{Begin, SOLE};

mod authors;
mod batches;
mod brush_strokes;
mod brushes_ribbons;
mod brushes_solids;
mod fold;
mod groupings;
mod groups;
mod hidden;
mod history;
mod long_strokes;
mod owned_layers;
mod steps;
mod strokes;
mod unseen;
mod work;

const WHITE: (f32, f32, f32, f32) = (1.0, 1.0, 1.0, 1.0);

fn begin(stroke: u32, tool: Tool, normal: NormalRule) -> Event {
    let stroke = StrokeId(stroke);
    Begin { tool, width: 0.2, color: WHITE, normal, ..Begin::of(stroke) }.event()
}

fn point(stroke: u32, p: Vec3, q: Quat) -> Event {
    Event::Point { t: 0.0, stroke: StrokeId(stroke), p, q, pressure: 1.0 }
}

fn end(stroke: u32) -> Event {
    Event::End { t: 0.0, stroke: StrokeId(stroke) }
}

fn play(scene: &mut Scene, events: &[Event]) -> Vec<Change> {
    let mut changes = Vec::new();
    for event in events {
        scene.apply(event, &mut changes);
    }
    changes
}

/// A straight ribbon along +x with the identity orientation, under the rule that uses `side` as the direction of the
/// width.
fn straight(stroke: u32, points: u32, rule: NormalRule) -> Vec<Event> {
    let mut events = vec![begin(stroke, Tool::Ribbon, rule)];
    events.extend((0..points).map(|i| point(stroke, Vec3::new(i as f32, 0.0, 0.0), turned())));
    events.push(end(stroke));
    events
}

/// Rotates local x to world y: the paper's normal then points up, and the ribbon is horizontal.
fn turned() -> Quat {
    Quat::from_xyzw(0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2)
}

/// The model that receivers of changes have: the ids after all inserts, removes and updates.
fn follow(changes: &[Change], inserted: &mut std::collections::BTreeSet<PolygonId>) {
    for change in changes {
        match *change {
            Change::Insert(id) => assert!(inserted.insert(id), "{id:?} came twice"),
            Change::Remove(id) => assert!(inserted.remove(&id), "{id:?} went without being there"),
            Change::Update(id) | Change::Repaint(id) => {
                assert!(inserted.contains(&id), "{id:?} moved without being there");
            }
            Change::Place(space) => panic!("{space:?}: this scene tells of each polygon"),
        }
    }
}

#[test]
fn each_rule_lays_the_ribbon_as_it_says() {
    // The travel is along +x; local x is world y.
    let width_along = |rule: NormalRule, q: Quat| {
        let mut scene = Scene::new();
        let mut events = vec![begin(1, Tool::Ribbon, rule)];
        events.extend((0..3).map(|i| point(1, Vec3::new(i as f32, 0.0, 0.0), q)));
        play(&mut scene, &events);
        let extent = scene.bounds(PolygonId(1)).extent();
        [extent.y, extent.z].map(|e| (e * 10.0).round() as i32)
    };
    // The paper: local x (world y) is the normal, so the width lies along z.
    assert_eq!(width_along(NormalRule::LocalX, turned()), [0, 2]);
    // A-Painter: local x (world y) is the width.
    assert_eq!(width_along(NormalRule::SideX, turned()), [2, 0]);
    // Tilt Brush: forward (-z) x travel (+x) = -y.
    assert_eq!(width_along(NormalRule::Travel, Quat::IDENTITY), [2, 0]);
}

#[test]
fn a_twisted_quad_becomes_two_triangles() {
    let mut scene = Scene::new();
    let quarter = |turns: f32| {
        let half = turns * std::f32::consts::FRAC_PI_4;
        Quat::from_xyzw(half.sin(), 0.0, 0.0, half.cos()) * turned()
    };
    let events = [
        begin(1, Tool::Ribbon, NormalRule::LocalX),
        point(1, Vec3::ZERO, quarter(0.0)),
        point(1, Vec3::X, quarter(0.5)),
    ];
    play(&mut scene, &events);
    assert_eq!(scene.polygon_count(), 2);
    assert_eq!(scene.polygon(PolygonId(0)).vertices().len(), 3);
}

#[test]
fn neighbouring_quads_share_an_edge_bit_for_bit() {
    let mut scene = Scene::new();
    let mut events = vec![begin(1, Tool::Ribbon, NormalRule::Transport)];
    events.extend((0..20).map(|i| {
        let a = i as f32 * 0.3;
        point(1, Vec3::new(a.cos(), a * 0.1, a.sin()), Quat::IDENTITY)
    }));
    play(&mut scene, &events);
    for i in 1..scene.polygon_count() as u32 {
        let shared = scene
            .polygon(PolygonId(i - 1))
            .vertices()
            .iter()
            .filter(|v| scene.polygon(PolygonId(i)).vertices().contains(v))
            .count();
        assert!(shared >= 2, "polygon {i} hangs on the one before by {shared} corners");
    }
}

#[test]
fn what_is_degenerate_is_dropped_and_counted() {
    let mut scene = Scene::new();
    let zero_width =
        Begin { width: 0.0, color: WHITE, normal: NormalRule::LocalX, ..Begin::of(StrokeId(2)) }.event();
    let far = Vec3::splat(3.0e38);
    let events = [
        begin(1, Tool::Ribbon, NormalRule::LocalX),
        point(1, Vec3::ZERO, turned()),
        point(1, Vec3::ZERO, turned()),
        point(1, Vec3::X, turned()),
        point(1, far, turned()),
        zero_width,
        point(2, Vec3::ZERO, turned()),
        point(2, Vec3::X, turned()),
    ];
    play(&mut scene, &events);
    let drops = scene.counts().drops;
    assert_eq!((drops.zero_length, drops.out_of_range, drops.degenerate), (1, 1, 1), "{drops:?}");
    assert_eq!(scene.polygon_count(), 1);
}

#[test]
fn a_wall_is_planar_and_a_concave_one_is_cut() {
    let mut scene = Scene::new();
    let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let mut events = vec![begin(1, Tool::Wall, NormalRule::LocalX)];
    events.extend(corners.map(|(x, y)| point(1, Vec3::new(x, y, -1.0), Quat::IDENTITY)));
    assert!(play(&mut scene, &events).is_empty(), "a wall is there when its stroke ends");
    play(&mut scene, &[end(1)]);
    let area: f32 = (0..scene.polygon_count() as u32).map(|i| scene.polygon(PolygonId(i)).area_m2()).sum();
    assert!((area - 3.0).abs() < 1.0e-5, "an L of three unit squares: {area}");
}

#[test]
fn a_tube_is_closed() {
    let mut scene = Scene::new();
    let mut events = vec![begin(1, Tool::Tube, NormalRule::LocalX)];
    events.extend((0..3).map(|i| point(1, Vec3::new(i as f32, 0.0, 0.0), Quat::IDENTITY)));
    events.push(end(1));
    play(&mut scene, &events);
    // Every edge of a closed surface belongs to two polygons.
    let mut edges = std::collections::BTreeMap::new();
    for i in 0..scene.polygon_count() as u32 {
        let polygon = scene.polygon(PolygonId(i));
        let v = polygon.vertices();
        for k in 0..v.len() {
            let mut edge = [v[k], v[(k + 1) % v.len()]].map(|p| p.to_array().map(f32::to_bits));
            edge.sort_unstable();
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    assert!(edges.values().all(|&n| n == 2), "{edges:?}");
    assert_eq!(scene.polygon_count(), 2 * 8 + 2 * 3);
}

#[test]
fn points_of_a_stroke_that_was_taken_back_stay_hidden_until_redo() {
    let mut scene = Scene::new();
    let mut inserted = std::collections::BTreeSet::new();
    let events = straight(1, 4, NormalRule::LocalX);
    follow(&play(&mut scene, &events[..3]), &mut inserted);
    follow(&play(&mut scene, &[SOLE.undo()]), &mut inserted);
    follow(&play(&mut scene, &events[3..]), &mut inserted);
    assert!(inserted.is_empty());
    follow(&play(&mut scene, &[SOLE.redo()]), &mut inserted);
    assert_eq!(inserted.len(), 3);
}

#[test]
fn strokes_may_overlap_in_time() {
    let mut scene = Scene::new();
    let (a, b) = (straight(1, 4, NormalRule::LocalX), straight(2, 4, NormalRule::SideX));
    let mixed: Vec<Event> = a.into_iter().zip(b).flat_map(|(a, b)| [a, b]).collect();
    play(&mut scene, &mixed);
    let ids =
        |s: u32| scene.stroke(StrokeId(s)).expect("drawn").polygon_ids().map(|id| id.0).collect::<Vec<_>>();
    assert_eq!((ids(1), ids(2)), (vec![0, 2, 4], vec![1, 3, 5]));
}

#[test]
fn events_without_sense_change_nothing_and_are_counted() {
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 3, NormalRule::LocalX));
    let nonsense = [
        point(9, Vec3::ZERO, Quat::IDENTITY),
        end(9),
        end(1),
        begin(1, Tool::Tube, NormalRule::LocalX),
        SOLE.erase(StrokeId(9)),
        SOLE.redo(),
        SOLE.moved([StrokeId(9)], Vec3::X),
        SOLE.placed(GroupId(4), Transform { p: Vec3::X, q: Quat::IDENTITY, s: 1.0 }),
    ];
    assert!(play(&mut scene, &nonsense).is_empty());
    assert_eq!(scene.counts().ignored_events, nonsense.len() as u64);
    assert_eq!(scene.counts().visible, 2);
}

proptest::proptest! {
    /// For any events, the inserts, removes and updates leave exactly the visible polygons.
    #[test]
    fn changes_always_lead_to_what_is_visible(steps in proptest::collection::vec((0u8..12, 0u32..5, -2.0f32..2.0), 1..120)) {
        let mut scene = Scene::new();
        let mut inserted = std::collections::BTreeSet::new();
        let mut boxes = std::collections::BTreeMap::new();
        for (kind, n, x) in steps {
            let event = match kind {
                0 | 1 => begin(n, [Tool::Ribbon, Tool::Wall, Tool::Tube][n as usize % 3], NormalRule::Transport),
                2..=4 => point(n, Vec3::new(x, x * x, f32::from(kind)), Quat::IDENTITY),
                5 => end(n),
                6 => SOLE.erase(StrokeId(n)),
                7 => SOLE.undo(),
                8 => SOLE.redo(),
                9 => SOLE.moved([StrokeId(n), StrokeId(n + 1)], Vec3::splat(x)),
                10 => SOLE.grouped(GroupId(n), [StrokeId(n)], (x > 0.0).then_some(GroupId(n + 1))),
                _ => SOLE.placed(GroupId(n), Transform { p: Vec3::splat(x), q: Quat::IDENTITY, s: 0.5 }),
            };
            let changes = play(&mut scene, &[event]);
            follow(&changes, &mut inserted);
            for change in &changes {
                if let Change::Insert(id) | Change::Update(id) = *change {
                    boxes.insert(id, scene.bounds(id));
                }
            }
            let visible: std::collections::BTreeSet<PolygonId> = scene.visible_ids().collect();
            assert_eq!(inserted, visible);
            assert_eq!(scene.counts().visible, visible.len() as u64);
            for id in visible {
                assert_eq!(boxes[&id], scene.bounds(id), "an index would still have the old box of {id:?}");
                assert_eq!(scene.polygon(id).bounds(), scene.bounds(id));
            }
        }
    }
}
