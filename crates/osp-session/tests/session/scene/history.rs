//! How far undo reaches, and what is forgotten beyond.

use super::{WHITE, begin, end, play, point, straight};
use glam::{Quat, Vec3};
use osp::polygon::{Change, PolygonId};
use osp_session::{
    recording::{Event, GroupId, NormalRule, StrokeId, Tool},
    scene::Scene,
};
use osp_testkit::events::{SOLE, polygon};

fn erase(stroke: u32) -> Event {
    SOLE.erase(StrokeId(stroke))
}

fn moved(strokes: &[u32]) -> Event {
    SOLE.moved(strokes.iter().map(|&s| StrokeId(s)).collect::<Vec<_>>(), Vec3::Y)
}

fn ignored(scene: &Scene) -> u64 {
    scene.counts().ignored_events
}

#[test]
fn undo_reaches_a_thousand_edits_back_and_redo_forth_again() {
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 2, NormalRule::LocalX));
    let height = |scene: &Scene| scene.bounds(PolygonId(0)).min.y;
    // The stroke's beginning is an edit of its own, so after this number of moves it is just out of reach.
    for _ in 0..Scene::UNDO_DEPTH {
        play(&mut scene, &[moved(&[1])]);
    }
    assert_eq!(height(&scene), 1000.0);
    for _ in 0..Scene::UNDO_DEPTH {
        play(&mut scene, &[SOLE.undo()]);
    }
    assert_eq!((height(&scene), ignored(&scene), scene.can_undo()), (0.0, 0, false));
    play(&mut scene, &[SOLE.undo()]);
    assert_eq!((ignored(&scene), scene.is_visible(PolygonId(0))), (1, true));
    for _ in 0..Scene::UNDO_DEPTH {
        play(&mut scene, &[SOLE.redo()]);
    }
    assert_eq!((height(&scene), ignored(&scene), scene.can_redo()), (1000.0, 1, false));
}

#[test]
fn what_was_erased_before_that_is_gone_and_its_number_stays_used() {
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 3, NormalRule::LocalX));
    play(&mut scene, &straight(2, 3, NormalRule::LocalX));
    play(&mut scene, &[begin(3, Tool::Ribbon, NormalRule::LocalX), point(3, Vec3::ZERO, Quat::IDENTITY)]);
    play(&mut scene, &[erase(1), erase(3)]);
    for _ in 0..Scene::UNDO_DEPTH - 2 {
        play(&mut scene, &[moved(&[2])]);
    }
    // Both erasures can still be undone.
    let mut whole = scene.clone();
    assert_eq!(whole.counts().erased_strokes, 2);
    (0..Scene::UNDO_DEPTH).for_each(|_| drop(play(&mut whole, &[SOLE.undo()])));
    assert_eq!((whole.counts().visible, whole.counts().erased_strokes, ignored(&whole)), (4, 0, 0));
    // After one more edit the older erasure cannot be undone. No change reports the freed polygons.
    assert_eq!(play(&mut scene, &[moved(&[2])]).len(), 2);
    let mut less = scene.clone();
    (0..Scene::UNDO_DEPTH).for_each(|_| drop(play(&mut less, &[SOLE.undo()])));
    assert_eq!((less.counts().visible, ignored(&less)), (2, 0));
    assert!(less.stroke(StrokeId(1)).is_none() && less.stroke(StrokeId(3)).is_some());
    // And the last.
    play(&mut scene, &[moved(&[2])]);
    assert_eq!(ignored(&scene), 0);
    let of_gone = [
        point(3, Vec3::X, Quat::IDENTITY),
        end(3),
        erase(1),
        moved(&[1, 3]),
        begin(1, Tool::Ribbon, NormalRule::LocalX),
        polygon(Some(StrokeId(1)), [Vec3::ZERO, Vec3::X, Vec3::Y], WHITE),
    ];
    for free_unreachable in [false, true] {
        assert!(play(&mut scene, &of_gone).is_empty());
        assert_eq!(ignored(&scene), of_gone.len() as u64 * (1 + u64::from(free_unreachable)));
        assert!(scene.is_used(StrokeId(1)) && scene.is_used(StrokeId(3)) && !scene.is_used(StrokeId(4)));
        assert_eq!((scene.counts().strokes, scene.counts().erased_strokes), (3, 2));
        assert_eq!(scene.visible_ids().collect::<Vec<_>>(), [PolygonId(2), PolygonId(3)]);
        (0..2).for_each(|_| scene.free_unreachable());
    }
    assert_eq!(scene.strokes().iter().count(), 1);
    // Groups accept only existing strokes, and numbers are not reused.
    let all = [1, 2, 3].map(StrokeId).to_vec();
    play(&mut scene, &[SOLE.grouped(GroupId(1), all, None)]);
    let changes = play(&mut scene, &straight(4, 2, NormalRule::LocalX));
    assert_eq!(changes, [Change::Insert(PolygonId(4))]);
}

#[test]
fn what_was_taken_back_and_drawn_over_is_gone() {
    let mut scene = Scene::new();
    play(&mut scene, &straight(1, 3, NormalRule::LocalX));
    play(&mut scene, &[SOLE.undo()]);
    let changes = play(&mut scene, &straight(2, 3, NormalRule::LocalX));
    assert_eq!(changes, [2, 3].map(|id| Change::Insert(PolygonId(id))));
    assert!(scene.stroke(StrokeId(1)).is_none() && scene.is_used(StrokeId(1)));
    // Receivers of this frame's changes may still query the stroke.
    for _ in 0..2 {
        assert_eq!(scene.polygon(PolygonId(0)).vertices().len(), 4);
        assert!(scene.bounds(PolygonId(1)).is_valid() && !scene.is_visible(PolygonId(0)));
        scene.free_unreachable();
    }
    assert!(scene.bounds(PolygonId(0)).is_empty() && !scene.is_visible(PolygonId(0)));
    assert_eq!(scene.polygon(PolygonId(1)).area_m2(), 0.0);
    assert!(!scene.stroke_of(PolygonId(1)).is_visible());
    // The stroke was undone together with its erasure, so the erasure is no longer needed either.
    play(&mut scene, &[erase(2), SOLE.undo(), SOLE.undo()]);
    play(&mut scene, &straight(3, 3, NormalRule::LocalX));
    assert!(scene.stroke(StrokeId(2)).is_none());
    play(&mut scene, &[SOLE.undo(), SOLE.undo(), SOLE.redo(), SOLE.redo()]);
    assert_eq!(scene.visible_ids().collect::<Vec<_>>(), [PolygonId(4), PolygonId(5)]);
    assert_eq!(ignored(&scene), 2);
}

#[test]
fn when_it_is_let_go_makes_no_difference() {
    for seed in 0..12 {
        let mut editor = osp_testkit::Editor::new(seed);
        let (mut kept, mut freed) = (Scene::new(), Scene::new());
        let mut events = editor.start();
        for _ in 0..700 {
            let changes = (play(&mut kept, &events), play(&mut freed, &events));
            assert_eq!(changes.0, changes.1, "seed {seed}");
            if editor.below(3) > 0 {
                freed.free_unreachable();
            }
            assert_eq!(kept.counts(), freed.counts());
            events = editor.edit();
        }
        let ids: Vec<PolygonId> = kept.visible_ids().collect();
        assert_eq!(ids, freed.visible_ids().collect::<Vec<_>>());
        assert!(ids.iter().all(|&id| kept.polygon(id) == freed.polygon(id)));
        assert!(freed.strokes().iter().count() < kept.strokes().iter().count(), "something was let go");
    }
}

#[test]
fn edits_of_many_strokes_are_remembered_less_long() {
    // 4,096 strokes of one polygon each; the history stores only 256 moves of all of them.
    const STROKES: u32 = 4096;
    let mut scene = Scene::new();
    for stroke in (0..STROKES).map(StrokeId) {
        play(&mut scene, &[polygon(Some(stroke), [Vec3::ZERO, Vec3::X, Vec3::Y], WHITE)]);
    }
    let all: Vec<u32> = (0..STROKES).collect();
    let moves: Vec<Event> = (0..300).map(|_| moved(&all)).collect();
    scene.apply_all(&moves, &mut Vec::new());
    let reach = |scene: &mut Scene| {
        let undo = |_: &_| scene.can_undo().then(|| play(scene, &[SOLE.undo()])).is_some();
        (0..).take_while(undo).count()
    };
    let reached = reach(&mut scene);
    assert_eq!(reached, (1 << 20) / STROKES as usize);
    assert_eq!(scene.bounds(PolygonId(0)).min.y, 300.0 - reached as f32);
    // Undone edits that are lost no longer count.
    for _ in 0..300 {
        scene.apply_all(&[moved(&all), SOLE.undo()], &mut Vec::new());
    }
    for _ in 0..200 {
        scene.apply_all(&[moved(&all)], &mut Vec::new());
    }
    assert_eq!(reach(&mut scene), 200);
}
