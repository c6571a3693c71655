//! The cost of events, in counts, and lists of events that are split at a cost limit.

use osp_session::{
    recording::{Author, Event, GroupId, NormalRule, Pace, Pacer, StrokeId, Tool, Transform},
    replay::{Player, fingerprint_of_frame, summarize_each},
    scene::Scene,
};
use osp_testkit::events::{By, SOLE};

use super::{authors, begin, play, point, straight};
use glam::{Quat, Vec3};
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
            let cost = |scene: &Scene| scene.work().total() + scene.counts().polygons;
            let before = cost(&cut);
            let taken = cut.apply_within(left, 20, &mut Vec::new());
            assert!((1..=20).contains(&taken), "an event costs one at least, and one is always taken");
            // Without its last event the call would be below the limit.
            assert!(taken == left.len() || cost(&cut) - before >= 20);
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

const STROKES: u32 = 1000;

/// Strokes and an unfinished one, an edit of all finished ones, and two short events that change all of them in turns.
fn broad_edits() -> Vec<(&'static str, Vec<Event>, [Event; 2])> {
    let (author, t) = (Author::SOLE, 0.0);
    let all = || (0..STROKES).map(StrokeId).collect::<Vec<_>>();
    let turns = || [SOLE.undo(), SOLE.redo()];
    let hidden = |hidden| Event::Layer {
        author,
        t,
        layer: 0,
        name: None,
        hidden: Some(hidden),
        locked: None,
        mine: None,
    };
    let placed = |x| SOLE.placed(GroupId(0), Transform { p: Vec3::X * x, q: Quat::IDENTITY, s: 1.0 });
    let grouped = || SOLE.grouped(GroupId(0), all(), None);
    let step = Event::Step { author, t, edits: STROKES };
    let erased = [step].into_iter().chain(all().into_iter().map(|stroke| SOLE.erase(stroke)));
    let cases = vec![
        ("grouped", vec![grouped()], turns()),
        ("moved", vec![SOLE.moved(all(), Vec3::X)], turns()),
        ("assigned", vec![hidden(false), Event::Assign { author, t, layer: 3, strokes: all() }], turns()),
        ("erased", erased.collect(), turns()),
        ("placed", vec![grouped()], [placed(1.0), placed(2.0)]),
        ("placing undone", vec![grouped(), placed(1.0)], turns()),
        ("hidden", Vec::new(), [hidden(true), hidden(false)]),
    ];
    let strokes = || {
        let drawn = (0..STROKES).flat_map(|stroke| straight(stroke, 2, NormalRule::LocalX));
        drawn.chain([begin(STROKES, Tool::Ribbon, NormalRule::LocalX)])
    };
    cases.into_iter().map(|(name, edit, turns)| (name, strokes().chain(edit).collect(), turns)).collect()
}

#[test]
fn a_frame_costs_its_events_and_its_strokes_but_not_their_product() {
    const TURNS: usize = 501;
    for (name, start, turns) in broad_edits() {
        let mut scene = Scene::new();
        play(&mut scene, &start);
        let mut one_by_one = scene.clone();
        let events: Vec<Event> = turns.iter().cycle().take(TURNS).cloned().collect();
        let before = scene.work().total();
        scene.apply_all(&events, &mut Vec::new());
        let work = scene.work().total() - before;
        assert!(work <= 3 * TURNS as u64 + 8 * u64::from(STROKES), "{name}: {work}");
        play(&mut one_by_one, &events);
        assert_eq!(scene.counts(), one_by_one.counts(), "{name}");
        assert!(scene.visible_ids().eq(one_by_one.visible_ids()), "{name}");
        scene.visible_ids().for_each(|id| assert_eq!(scene.polygon(id), one_by_one.polygon(id), "{name}"));
    }
}

#[test]
fn an_edit_that_one_author_turns_while_another_one_groups_is_visited_once() {
    const TURNS: u32 = 500;
    let (a, b) = (Author(1), Author(2));
    let all: Vec<StrokeId> = (0..STROKES).map(|n| authors::id(a, n)).collect();
    let strokes = || (0..STROKES).flat_map(|n| authors::stroke(a, n)).chain(authors::stroke(b, 0));
    let grouped = |n: u32| By(b).grouped(authors::group_id(b, n % 2), [authors::id(b, 0)], None);
    for edit in [By(a).moved(all.clone(), Vec3::X), By(a).grouped(authors::group_id(a, 0), all, None)] {
        let mut scene = Scene::new();
        play(&mut scene, &[authors::join(a), authors::join(b)]);
        play(&mut scene, &strokes().chain([edit]).collect::<Vec<_>>());
        let mut one_by_one = scene.clone();
        let turn = |n: u32| if n.is_multiple_of(2) { By(a).undo() } else { By(a).redo() };
        let events: Vec<Event> = (0..=TURNS).flat_map(|n| [turn(n), grouped(n)]).collect();
        let before = scene.work().total();
        scene.apply_all(&events, &mut Vec::new());
        let work = scene.work().total() - before;
        assert!(work <= u64::from(10 * TURNS + 10 * STROKES), "{work}");
        play(&mut one_by_one, &events);
        assert_eq!(scene.counts(), one_by_one.counts());
        scene.visible_ids().for_each(|id| assert_eq!(scene.polygon(id), one_by_one.polygon(id)));
    }
}

/// Samples between the edits make each edit a frame of its own.
#[test]
fn reading_a_model_costs_its_events_but_not_their_product_with_its_strokes() {
    const TURNS: usize = 8000;
    for (name, mut events, turns) in broad_edits() {
        for (number, turn) in turns.into_iter().cycle().take(TURNS).enumerate() {
            events.extend([turn, point(STROKES, Vec3::X * number as f32, Quat::IDENTITY)]);
        }
        let read = || events.iter().cloned().map(Ok);
        let player = Player::new(read(), Pace::Samples(1)).merging_frames();
        let (summary, end, outcome) = summarize_each(player, |_, _| {});
        assert!(outcome.is_ok());
        let (mut pacer, mut frame, mut frames) = (Pacer::new(read(), Pace::Samples(1)), Vec::new(), 0);
        while pacer.next_frame(&mut frame).expect("sound events") {
            frames += 1;
        }
        assert_eq!(summary.frames, frames, "{name}: merged frames count as several");
        let scene = end.scene;
        // The events change eight million strokes.
        let work = scene.work().total();
        assert!(work < 4 << 20, "{name}: {work}");
        let mut at_once = Scene::new();
        at_once.apply_all(&events, &mut Vec::new());
        assert!(scene.visible_ids().eq(at_once.visible_ids()), "{name}");
    }
}
