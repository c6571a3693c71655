//! Several edits that form one undo step, and layers.

use super::{play, straight};
use glam::Vec3;
use osp::polygon::Change;
use osp_session::{
    recording::{Author, Event, NormalRule, Paint, StrokeId, Tool},
    scene::Scene,
};
use osp_testkit::events::SOLE;

fn step(edits: u32) -> Event {
    Event::Step { author: Author::SOLE, t: 0.0, edits }
}

fn erase(stroke: u32) -> Event {
    SOLE.erase(StrokeId(stroke))
}

fn moved(stroke: u32) -> Event {
    SOLE.moved([StrokeId(stroke)], Vec3::Y)
}

fn visible(scene: &Scene) -> Vec<u32> {
    let strokes = scene.strokes().iter().filter(|stroke| stroke.is_visible());
    strokes.filter_map(|stroke| Some(stroke.id()?.0)).collect()
}

#[test]
fn more_edits_than_undo_reaches_are_taken_back_as_one_step_and_made_again() {
    let mut scene = Scene::new();
    let count = Scene::UNDO_DEPTH as u32 + 300;
    (0..count).for_each(|stroke| drop(play(&mut scene, &straight(stroke, 2, NormalRule::LocalX))));
    play(&mut scene, &[step(2 * count)]);
    for stroke in 0..count {
        play(&mut scene, &straight(count + stroke, 2, NormalRule::LocalX));
    }
    (0..count).for_each(|stroke| drop(play(&mut scene, &[erase(stroke)])));
    assert!(!scene.is_step_open());
    let (old, new): (Vec<u32>, Vec<u32>) = ((0..count).collect(), (count..2 * count).collect());
    assert_eq!(visible(&scene), new);
    play(&mut scene, &[SOLE.undo()]);
    assert_eq!(visible(&scene), old);
    play(&mut scene, &[SOLE.redo()]);
    assert_eq!(visible(&scene), new);
    // A new edit after an undo makes the copies unreachable, the old strokes not.
    play(&mut scene, &[SOLE.undo(), moved(0)]);
    scene.free_unreachable();
    scene.free_unreachable();
    assert_eq!(visible(&scene), old);
    assert!(scene.stroke(StrokeId(count)).is_none() && scene.is_used(StrokeId(count)));
    assert_eq!(scene.counts().ignored_events, 0);
}

fn layer(layer: u32, hidden: Option<bool>) -> Event {
    Event::Layer { author: Author::SOLE, t: 0.0, layer, name: None, hidden, locked: None, mine: None }
}

fn assign(layer: u32, strokes: &[u32]) -> Event {
    let strokes = strokes.iter().map(|&stroke| StrokeId(stroke)).collect();
    Event::Assign { author: Author::SOLE, t: 0.0, layer, strokes }
}

#[test]
fn a_layer_hides_its_strokes_those_that_come_and_those_that_are_brought() {
    let mut scene = Scene::new();
    for stroke in [1, 2, 3] {
        play(&mut scene, &straight(stroke, 3, NormalRule::LocalX));
    }
    play(&mut scene, &[assign(2, &[2, 3, 3])]);
    let changes: Vec<Change> = play(&mut scene, &[layer(2, Some(true))]);
    assert_eq!((visible(&scene), changes.len()), (vec![1], 4));
    play(&mut scene, &[SOLE.undo()]);
    assert_eq!(visible(&scene), [1, 2, 3], "back on the layer that is not hidden");
    play(&mut scene, &[SOLE.redo()]);
    assert_eq!(visible(&scene), [1]);
    // One stroke begins on the hidden layer, and another one is hidden by its own event.
    let mut drawn = straight(4, 3, NormalRule::LocalX);
    let Event::Begin { paint, .. } = &mut drawn[0] else { panic!("a beginning") };
    *paint = Some(Box::new(Paint { layer: 2, ..Paint::new("", 0) }));
    play(&mut scene, &drawn);
    let mut drawn = straight(5, 3, NormalRule::LocalX);
    let Event::Begin { paint, tool, .. } = &mut drawn[0] else { panic!("a beginning") };
    *paint = Some(Box::new(Paint { layer: 7, hidden: true, ..Paint::new("", 0) }));
    assert_eq!(*tool, Tool::Ribbon);
    play(&mut scene, &drawn);
    assert_eq!(visible(&scene), [1]);
    play(&mut scene, &[layer(2, Some(false)), layer(7, Some(false))]);
    assert_eq!(visible(&scene), [1, 2, 3, 4, 5]);
    play(&mut scene, &[layer(2, None), layer(0, Some(true))]);
    assert_eq!(visible(&scene), [2, 3, 4, 5]);
    assert_eq!(scene.counts().visible, 8);
    let (name, locked) = (Some("sky".into()), Some(true));
    let locked =
        Event::Layer { author: Author::SOLE, t: 0.0, layer: 7, name, hidden: None, locked, mine: None };
    play(&mut scene, &[locked, layer(7, Some(true))]);
    let state = &scene.layer_states()[&7];
    assert_eq!((state.name.as_deref(), state.hidden, scene.is_locked(7)), (Some("sky"), Some(true), true));
    assert_eq!(scene.counts().ignored_events, 0);
}
