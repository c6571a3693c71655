//! Strokes of hidden layers: they are in the session, but never in the model.

use super::{begin, end, follow, play, point, straight, turned};
use glam::Vec3;
use osp_session::{
    recording::{Event, NormalRule, Paint, StrokeId, Tool},
    scene::Scene,
};
use osp_testkit::events::SOLE;

fn hidden(stroke: u32) -> Event {
    let mut event = begin(stroke, Tool::Ribbon, NormalRule::LocalX);
    if let Event::Begin { paint, .. } = &mut event {
        *paint = Some(Box::new(Paint { hidden: true, layer: 3, ..Paint::new("", 0) }));
    }
    event
}

#[test]
fn a_hidden_stroke_is_counted_and_never_seen() {
    let mut scene = Scene::new();
    let mut inserted = std::collections::BTreeSet::new();
    let mut events = straight(1, 3, NormalRule::LocalX);
    events.push(hidden(2));
    events.extend((0..4).map(|i| point(2, Vec3::new(i as f32, 1.0, 0.0), turned())));
    events.push(end(2));
    follow(&play(&mut scene, &events), &mut inserted);
    assert_eq!(inserted.len(), 2, "the polygons of the other stroke");
    let stroke = scene.stroke(StrokeId(2)).expect("it is in the session");
    assert!(stroke.is_hidden() && !stroke.is_visible() && !stroke.is_taken_away());
    assert_eq!((stroke.layer(), stroke.point_count(), stroke.polygon_count()), (3, 4, 3));
    let counts = scene.counts();
    assert_eq!((counts.strokes, counts.points, counts.polygons, counts.visible), (2, 7, 5, 2));
    // For all edits, the stroke stays in the scene, invisible.
    for event in [
        SOLE.moved([StrokeId(2)], Vec3::Y),
        SOLE.erase(StrokeId(2)),
        SOLE.undo(),
        SOLE.undo(),
        SOLE.undo(),
        SOLE.redo(),
        SOLE.redo(),
        SOLE.redo(),
    ] {
        assert_eq!(play(&mut scene, &[event]), []);
        assert_eq!(scene.visible_ids().count(), 2);
        assert_eq!(scene.counts().visible, 2);
    }
    assert_eq!(scene.counts().erased_strokes, 1);
}
