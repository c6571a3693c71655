//! Memory of a scene, counted in bytes: polygons that no undo can restore are freed.

use glam::Vec3;
use osp_session::{
    recording::{Event, GroupId, StrokeId},
    scene::Scene,
};
use osp_testkit::{
    events::{Begin, SOLE, point},
    held_bytes,
};

/// Draws strokes of 30 polygons each, and calls the caller's function after each stroke.
fn draw(strokes: std::ops::Range<u32>, mut then: impl FnMut(StrokeId, &mut Scene), scene: &mut Scene) {
    let mut changes = Vec::new();
    for number in strokes {
        let stroke = StrokeId(number);
        let mut events = vec![Begin::of(stroke).event()];
        let place = |i| Vec3::new(i as f32 * 0.1, number as f32 * 1.0e-3, 0.0);
        events.extend((0..=30).map(|i| point(stroke, place(i))));
        events.push(Event::End { t: 0.0, stroke });
        scene.apply_all(&events, &mut changes);
        changes.clear();
        then(stroke, scene);
        scene.free_unreachable();
    }
}

fn apply(scene: &mut Scene, event: Event) {
    scene.apply(&event, &mut Vec::new());
}

/// Memory of a polygon in the model, bytes: its corners, its box, its stroke's index, and a share of the stroke.
const BYTES_A_POLYGON: i64 = 100;

/// Constant memory of any scene, bytes: partly filled pages, a thousand edits, tables.
const ROOM: i64 = 2 << 20;

#[test]
fn what_is_erased_and_what_is_taken_back_does_not_pile_up() {
    const STROKES: u32 = 34_000;
    for is_erased in [true, false] {
        let before = held_bytes();
        let mut scene = Scene::new();
        draw(
            0..STROKES,
            |stroke, scene| apply(scene, if is_erased { SOLE.erase(stroke) } else { SOLE.undo() }),
            &mut scene,
        );
        assert_eq!((scene.polygon_count(), scene.counts().visible), (1_020_000, 0));
        // Memory of edits that undo can still reach: half of the edits are erasures of 30 polygons each.
        let reached = Scene::UNDO_DEPTH as i64 * 30 * BYTES_A_POLYGON;
        let held = held_bytes() - before;
        assert!(held < reached + ROOM, "{held} bytes for a model in which there is nothing");
    }
}

#[test]
fn what_is_left_here_and_there_does_not_hold_the_rest() {
    const STROKES: u32 = 30_000;
    let before = held_bytes();
    let mut scene = Scene::new();
    draw(0..STROKES, |_, _| {}, &mut scene);
    let whole = held_bytes() - before;
    assert!(whole > 80 * 900_000, "{whole} bytes for 900,000 polygons: less than their corners and boxes");
    // All but each twentieth stroke are erased, so no page is empty.
    for stroke in (0..STROKES).filter(|stroke| stroke % 20 != 0) {
        apply(&mut scene, SOLE.erase(StrokeId(stroke)));
        scene.free_unreachable();
    }
    assert_eq!(scene.counts().visible, 900_000 / 20);
    let held = held_bytes() - before;
    let left = (900_000 / 20 + Scene::UNDO_DEPTH as i64 * 30) * BYTES_A_POLYGON;
    // A page keeps its free entries until three quarters of its entries are free.
    assert!(held < 4 * left + ROOM, "{held} bytes of {whole} for 45,000 polygons");
    assert!(scene.visible_ids().all(|id| scene.polygon(id).area_m2() > 0.0));
}

#[test]
fn moves_of_many_strokes_do_not_pile_up() {
    let mut scene = Scene::new();
    draw(0..2000, |_, _| {}, &mut scene);
    let strokes: Vec<StrokeId> = (0..2000).map(StrokeId).collect();
    let moved = SOLE.moved(strokes, Vec3::X);
    let before = held_bytes();
    let moves = vec![moved; 900];
    let of_events = held_bytes() - before;
    scene.apply_all(&moves, &mut Vec::new());
    let held = held_bytes() - before - of_events;
    assert!(held < 28 * (1 << 20) + ROOM, "{held} bytes for 900 moves of 2,000 strokes");
}

#[test]
fn groups_forget_what_is_gone() {
    let of_twenty_thousand = |group: Option<GroupId>| {
        let before = held_bytes();
        let mut scene = Scene::new();
        let then = |stroke, scene: &mut Scene| {
            let edit = group.map(|group| SOLE.grouped(group, [stroke], None));
            apply(scene, edit.unwrap_or_else(|| SOLE.moved([stroke], Vec3::X)));
            apply(scene, SOLE.erase(stroke));
        };
        draw(0..20_000, then, &mut scene);
        held_bytes() - before
    };
    let (grouped, alone) = (of_twenty_thousand(Some(GroupId(1))), of_twenty_thousand(None));
    // The edits that undo can reach are also in two indexes by group.
    assert!(grouped < alone + (128 << 10), "{grouped} bytes in a group, {alone} in none");
}
