//! Layers that one author has closed to the others.

use glam::{Quat, Vec3};
use osp_session::{
    recording::{Author, Event, StrokeId, Transform},
    scene::Scene,
};
use osp_testkit::events::By;
use proptest::prelude::*;

use super::authors::{group_id, id, join, stroke};

const A: Author = Author(1);
const B: Author = Author(2);

fn apply(scene: &mut Scene, events: &[Event]) {
    scene.apply_all(events, &mut Vec::new());
}

/// Applies the events; returns the number of ignored ones.
fn ignored(scene: &mut Scene, events: &[Event]) -> u64 {
    let before = scene.counts().ignored_events;
    apply(scene, events);
    scene.counts().ignored_events - before
}

fn layer(author: Author, layer: u32, mine: Option<bool>) -> Event {
    let name = Some(format!("of {author}"));
    Event::Layer { t: 0.0, author, layer, name, hidden: None, locked: None, mine }
}

fn on_layer(author: Author, n: u32, layer: u32) -> Vec<Event> {
    let mut events = stroke(author, n);
    if let Event::Begin { paint: Some(paint), .. } = &mut events[0] {
        paint.layer = layer;
    }
    events
}

fn moved(author: Author, strokes: &[StrokeId]) -> Event {
    By(author).moved(strokes, Vec3::X)
}

fn place(author: Author, group: osp_session::recording::GroupId) -> Event {
    By(author).placed(group, Transform { p: Vec3::Y, q: Quat::IDENTITY, s: 1.0 })
}

fn group(author: Author, n: u32, strokes: &[StrokeId], parent: Option<u32>) -> Event {
    let parent = parent.map(|n| group_id(author, n));
    By(author).grouped(group_id(author, n), strokes, parent)
}

/// Both authors are present, the second layer is A's, and each author has a stroke on it.
fn both() -> Scene {
    let mut scene = Scene::new();
    let events = [vec![join(A), join(B), layer(A, 1, None)], on_layer(A, 0, 1), on_layer(B, 0, 1)].concat();
    assert_eq!(ignored(&mut scene, &events), 0, "it is open to all");
    assert_eq!(scene.layer_states()[&1].owner, Some(A));
    scene
}

fn x_of(scene: &Scene, stroke: StrokeId) -> f32 {
    scene.stroke(stroke).expect("a stroke").offset().x
}

#[test]
fn what_its_owner_has_closed_nobody_else_draws_on_or_changes() {
    let mut scene = both();
    apply(&mut scene, &[group(B, 9, &[id(A, 0)], None)]);
    assert_eq!(ignored(&mut scene, &[layer(A, 1, Some(true))]), 0);
    assert_eq!((scene.closed_by(1), scene.closed_by(0)), (Some(A), None));
    assert!(scene.may_touch(A, 1) && !scene.may_touch(B, 1) && scene.may_touch(Author::SOLE, 1));
    // A stroke counts as five events, none of which draws.
    assert_eq!(ignored(&mut scene, &on_layer(B, 1, 1)), 5);
    assert!(scene.stroke(id(B, 1)).is_none());
    let assign = |author, layer, stroke| Event::Assign { t: 0.0, author, layer, strokes: vec![stroke] };
    apply(&mut scene, &stroke(B, 2));
    let refused = [
        By(B).erase(id(A, 0)),
        By(B).erase(id(B, 0)),
        moved(B, &[id(A, 0)]),
        assign(B, 0, id(A, 0)),
        assign(B, 1, id(B, 2)),
        layer(B, 1, None),
        layer(B, 1, Some(false)),
        place(B, group_id(B, 9)),
    ];
    for event in refused {
        assert_eq!(ignored(&mut scene, std::slice::from_ref(&event)), 1, "{event:?}");
    }
    // Of several strokes, the others are moved. A group with strokes on the layer gets no other parent.
    assert_eq!(ignored(&mut scene, &[moved(B, &[id(A, 0), id(B, 2)])]), 0);
    assert_eq!((x_of(&scene, id(A, 0)), x_of(&scene, id(B, 2))), (0.0, 1.0));
    assert_eq!(ignored(&mut scene, &[group(B, 10, &[id(A, 0), id(B, 2)], None)]), 0);
    let in_group = |scene: &Scene, stroke| scene.groups_of(scene.stroke(stroke).expect("a stroke"));
    assert_eq!(in_group(&scene, id(A, 0)), [group_id(B, 9)]);
    assert_eq!(in_group(&scene, id(B, 2)), [group_id(B, 10)]);
    assert_eq!(ignored(&mut scene, &[group(B, 9, &[], Some(10))]), 1);
    assert_eq!(ignored(&mut scene, &[place(B, group_id(B, 10))]), 0);
    assert_eq!(scene.layer_states()[&1].name.as_deref(), Some("of 1"));
    // The owner may make all these edits, and every author may undo own edits.
    assert_eq!(ignored(&mut scene, &[moved(A, &[id(A, 0), id(B, 0)]), place(A, group_id(B, 9))]), 0);
    assert_eq!(x_of(&scene, id(B, 0)), 1.0);
    let visible = |scene: &Scene, stroke| scene.stroke(stroke).expect("a stroke").is_visible();
    let undos: Vec<Event> = std::iter::repeat_n(By(B).undo(), 6).collect();
    apply(&mut scene, &undos);
    assert!(!visible(&scene, id(B, 0)) && visible(&scene, id(A, 0)));
    assert_eq!(ignored(&mut scene, &[By(B).redo()]), 0);
    assert!(visible(&scene, id(B, 0)));
    // The layer is open again.
    assert_eq!(ignored(&mut scene, &[layer(A, 1, Some(false))]), 0);
    assert_eq!(ignored(&mut scene, &on_layer(B, 3, 1)), 0);
}

/// A stroke has left the group, or is erased for good.
#[test]
fn a_group_is_placed_as_soon_as_nothing_in_it_is_on_a_closed_layer() {
    let gone = (0..Scene::UNDO_DEPTH).map(|_| group(A, 1, &[], None));
    let gone = [By(A).erase(id(A, 0))].into_iter().chain(gone).collect();
    for leaves in [vec![group(A, 0, &[id(A, 0)], None)], gone] {
        let mut scene = both();
        let nested = [group(B, 8, &[], None), group(B, 9, &[id(A, 0)], Some(8)), layer(A, 1, Some(true))];
        assert_eq!(ignored(&mut scene, &nested), 0);
        assert_eq!(ignored(&mut scene, &[place(B, group_id(B, 8)), place(B, group_id(B, 9))]), 2);
        assert_eq!(ignored(&mut scene, &leaves), 0);
        assert_eq!(ignored(&mut scene, &[place(B, group_id(B, 8)), place(B, group_id(B, 9))]), 0);
    }
    // An undo in the same frame has taken the inner group out. A later grouping delays what it does.
    let mut scene = both();
    let nested = [group(B, 8, &[], None), group(B, 9, &[id(A, 0)], None), group(B, 9, &[], Some(8))];
    let later = [group(A, 1, &[], None), group(A, 0, &[], Some(1)), layer(A, 1, Some(true))];
    assert_eq!(ignored(&mut scene, &[nested, later].concat()), 0);
    assert_eq!(ignored(&mut scene, &[By(B).undo(), place(B, group_id(B, 8))]), 0);
}

#[test]
fn only_its_owner_closes_a_layer_until_that_one_leaves() {
    let mut scene = both();
    // The layer is not B's; the first layer has no owner; the host owns no layer.
    let refused = [layer(B, 1, Some(true)), layer(A, 0, Some(true)), layer(Author::SOLE, 2, Some(true))];
    for event in refused {
        assert_eq!(ignored(&mut scene, std::slice::from_ref(&event)), 1, "{event:?}");
    }
    // A stroke that has begun continues.
    let open = on_layer(B, 1, 1);
    apply(&mut scene, &open[..2]);
    assert_eq!(ignored(&mut scene, &[layer(A, 1, Some(true))]), 0);
    assert_eq!(ignored(&mut scene, &open[2..]), 0);
    apply(&mut scene, &[Event::Leave { t: 1.0, author: A }]);
    assert_eq!((scene.closed_by(1), scene.layer_states()[&1].owner), (None, Some(A)));
    assert_eq!(ignored(&mut scene, &on_layer(B, 2, 1)), 0);
    // The author who closes the layer now owns it, also against a former owner who returns.
    assert_eq!(ignored(&mut scene, &[join(Author(3)), layer(B, 1, Some(true))]), 0);
    assert_eq!((scene.closed_by(1), scene.layer_states()[&1].owner), (Some(B), Some(B)));
    assert_eq!(ignored(&mut scene, &[layer(Author(3), 1, Some(true))]), 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

    /// Edits of other authors, except for undo and redo of their own edits, do not change the strokes on a closed
    /// layer.
    #[test]
    fn nothing_on_a_closed_layer_changes_by_others(
        doings in prop::collection::vec((0u8..8, 1u32..4, 0u32..64), 1..80),
    ) {
        let authors = [A, B, Author(3)];
        let mut scene = Scene::new();
        apply(&mut scene, &authors.map(join));
        let mut next = 0;
        for (kind, author, pick) in doings {
            let author = Author(author);
            let any = id(Author(1 + pick % 3), pick / 3 % 12);
            let events = match kind {
                0 => {
                    next += 1;
                    on_layer(author, next - 1, pick % 4)
                }
                1 => vec![By(author).erase(any)],
                2 => vec![moved(author, &[any, id(author, 0)])],
                3 => vec![Event::Assign { t: 0.0, author, layer: pick / 36 % 4, strokes: vec![any] }],
                4 => vec![layer(author, pick % 4, [None, Some(true), Some(false)][pick as usize / 4 % 3])],
                5 => vec![group(author, pick % 3, &[any], (pick % 2 == 0).then_some(pick / 2 % 3))],
                6 => vec![place(author, group_id(Author(1 + pick % 3), pick / 3 % 3))],
                _ => vec![group(author, pick % 3, &[any, id(author, 1)], None)],
            };
            let closed = |scene: &Scene| -> Vec<_> {
                let held = scene.strokes().iter().filter(|stroke| !scene.may_touch(author, stroke.layer()));
                held.map(|stroke| {
                    let id = stroke.id().expect("a number");
                    let to = scene.world_from_stroke(id).expect("there");
                    (id, stroke.layer(), stroke.is_visible(), stroke.polygon_count(), to)
                })
                .collect()
            };
            let names = |scene: &Scene| -> Vec<_> {
                (0..4u32).filter(|&layer| !scene.may_touch(author, layer))
                    .map(|layer| (layer, scene.layer_states()[&layer].clone(), scene.closed_by(layer))).collect()
            };
            let before = (closed(&scene), names(&scene));
            apply(&mut scene, &events);
            prop_assert_eq!((closed(&scene), names(&scene)), before, "{:?}", events);
        }
    }
}
