//! The cost of events, in counts, and lists of events that are split at a cost limit.

use osp_session::{
    recording::{Event, NormalRule, StrokeId},
    replay::fingerprint_of_frame,
    scene::Scene,
};
use osp_testkit::events::SOLE;

use super::{play, straight};
use osp_testkit::Editor;

fn erase(stroke: u32) -> Event {
    SOLE.erase(StrokeId(stroke))
}

#[test]
fn a_list_is_cut_where_it_has_cost_enough_and_comes_to_the_same() {
    for seed in 0..8 {
        let mut editor = Editor::new(seed);
        let mut events = editor.start();
        (0..200).for_each(|_| events.extend(editor.edit()));
        let (mut whole, mut cut) = (Scene::new(), Scene::new());
        whole.apply_all(&events, &mut Vec::new());
        let (mut left, mut calls) = (&events[..], 0);
        while !left.is_empty() {
            let before = cut.work().total();
            let taken = cut.apply_within(left, 20, &mut Vec::new());
            assert!((1..=20).contains(&taken), "an event costs one at least, and one is always taken");
            // Without its last event the call would be below the limit.
            assert!(taken == left.len() || cut.work().total() - before >= 20);
            left = &left[taken..];
            calls += 1;
        }
        assert!(calls > events.len() / 20);
        assert_eq!(cut.counts(), whole.counts());
        assert_eq!(fingerprint_of_frame(cut.visible_ids()), fingerprint_of_frame(whole.visible_ids()));
        cut.visible_ids().for_each(|id| assert_eq!(cut.polygon(id), whole.polygon(id)));
    }
}

#[test]
fn one_event_is_taken_whatever_it_costs_and_polygons_count() {
    let mut scene = Scene::new();
    for stroke in 0..3 {
        play(&mut scene, &straight(stroke, 101, NormalRule::LocalX));
    }
    let before = scene.work().total();
    let events = [erase(0), erase(1), erase(2)];
    let mut changes = Vec::new();
    assert_eq!(scene.apply_within(&events, 1, &mut changes), 1);
    assert_eq!((changes.len(), scene.work().total() - before), (100, 101));
    // The budget of one plus a hundred for the first event is less than all, so the second event is applied, too.
    assert_eq!(scene.apply_within(&events[1..], 102, &mut changes), 2);
    assert_eq!(scene.apply_within(&[], 102, &mut changes), 0);
    assert_eq!((changes.len(), scene.counts().visible), (300, 0));
    // Even a budget of zero applies an event without cost; otherwise a caller would wait forever.
    assert_eq!(scene.apply_within(&[SOLE.redo()], 0, &mut changes), 1);
}
