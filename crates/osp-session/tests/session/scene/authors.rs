//! Several authors: which edits each author's undo reverts, and the result of all edits together.

use glam::{Quat, Vec3};
use osp_session::{
    recording::{Author, Event, GroupId, NormalRule, Paint, StrokeId, Transform},
    scene::Scene,
};
use osp_testkit::events::{Begin, By, point};

const A: Author = Author(1);
const B: Author = Author(2);

pub(crate) fn join(author: Author) -> Event {
    Event::Join { t: 0.0, author, name: format!("author {author}"), color: None }
}

fn leave(author: Author) -> Event {
    Event::Leave { t: 9.0, author }
}

/// The author's stroke number `n`.
pub(crate) fn id(author: Author, n: u32) -> StrokeId {
    StrokeId(author.number(n).expect("a number of the author"))
}

pub(crate) fn group_id(author: Author, n: u32) -> GroupId {
    GroupId(author.number(n).expect("a number of the author"))
}

/// A ribbon of three points, along x at its own height.
pub(crate) fn stroke(author: Author, n: u32) -> Vec<Event> {
    let stroke = id(author, n);
    let y = (author.0 * 64 + n % 64) as f32;
    let paint = Some(Box::new(Paint::new("", 0)));
    let mut events =
        vec![Begin { author, width: 0.25, normal: NormalRule::LocalX, paint, ..Begin::of(stroke) }.event()];
    events.extend((0..3).map(|i| point(stroke, Vec3::new(i as f32, y, 0.0))));
    events.push(Event::End { t: 0.0, stroke });
    events
}

fn placed(author: Author, group: GroupId, x: f32) -> Event {
    let to = Transform { p: Vec3::X * x, q: Quat::IDENTITY, s: 1.0 };
    By(author).placed(group, to)
}

fn scene_of(events: impl IntoIterator<Item = Event>) -> Scene {
    let mut scene = Scene::new();
    super::play(&mut scene, &events.into_iter().collect::<Vec<_>>());
    scene
}

/// Two authors with a stroke each.
fn two() -> Vec<Event> {
    [vec![join(A), join(B)], stroke(A, 0), stroke(B, 0)].concat()
}

fn and(events: &[Event], more: &[Event]) -> Vec<Event> {
    [events, more].concat()
}

#[test]
fn who_leaves_ends_strokes_and_can_do_nothing_any_more() {
    let mut events = and(&two(), &stroke(A, 1)[..2]);
    events.extend([By(A).erase(id(B, 0)), leave(A), By(A).undo(), By(A).moved([id(A, 0)], Vec3::X)]);
    events.push(Event::Point { t: 0.0, stroke: id(A, 1), p: Vec3::Y, q: Quat::IDENTITY, pressure: 1.0 });
    let mut scene = scene_of(events);
    assert_eq!(scene.counts().ignored_events, 3);
    assert!(!scene.stroke(id(A, 1)).expect("A's").is_open());
    // Nobody can restore the stroke that A erased: its number stays used.
    assert!(scene.stroke(id(B, 0)).is_none() && scene.is_used(id(B, 0)));
    let left: Vec<_> = scene.authors().map(|(author, info)| (author, info.left_secs)).collect();
    assert_eq!(left, [(A, Some(9.0)), (B, None)]);
    super::play(&mut scene, &[By(B).undo()]);
    assert!(scene.stroke(id(A, 0)).expect("A's").is_visible());
}

#[test]
fn numbers_are_those_of_the_author() {
    let theirs = stroke(B, 5);
    let theirs = theirs.iter().cloned().map(|event| match event {
        Event::Begin { t, stroke, tool, width, color, normal, thinnest, paint, .. } => {
            Event::Begin { t, author: A, stroke, tool, width, color, normal, thinnest, paint }
        }
        other => other,
    });
    let mut events = two();
    events.extend(theirs);
    events.push(By(A).grouped(group_id(B, 1), [], None));
    let polygon = Event::Polygon {
        t: 0.0,
        author: A,
        stroke: Some(id(B, 0)),
        vertices: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        shading: None,
        color: (1.0, 1.0, 1.0, 1.0),
    };
    events.push(polygon);
    // No third author has joined, and no author has a number beyond the limit.
    events.extend([By(Author(3)).undo(), join(A), join(Author(Author::MAX)), By(Author(u32::MAX)).undo()]);
    let scene = scene_of(events);
    // The stroke with its three points and its end.
    assert_eq!(scene.counts().ignored_events, 5 + 1 + 1 + 4);
    assert!(!scene.is_used(id(B, 5)) && scene.group_name(group_id(B, 1)).is_none());
}

/// A permanent grouping precedes all others. The parent that it sets takes precedence over earlier groupings that are
/// redone, unless it never had an effect.
#[test]
fn a_forgotten_grouping_stands_only_if_it_had_an_effect() {
    const C: Author = Author(3);
    let (g, h, k) = (group_id(A, 0), group_id(B, 0), group_id(C, 0));
    let made = [By(A).grouped(g, [], None), By(B).grouped(h, [], None), By(C).grouped(k, [], None)];
    let made = [two(), vec![join(C)], made.to_vec()].concat();
    // A's grouping is undone. B gives the same group another parent and leaves. A's grouping is redone.
    let events =
        [By(A).grouped(g, [], Some(h)), By(A).undo(), By(B).grouped(g, [], Some(k)), leave(B), By(A).redo()];
    assert_eq!(scene_of(and(&made, &events)).parent_of(g), Some(k));
    // B's grouping has no effect when B leaves, because it would close a cycle; so C's earlier grouping takes effect.
    let refused = [
        By(C).grouped(h, [], Some(k)),
        By(C).undo(),
        By(A).grouped(g, [], Some(h)),
        By(A).undo(),
        By(B).grouped(h, [], Some(g)),
        By(A).redo(),
        leave(B),
    ];
    let mut scene = scene_of(and(&made, &refused));
    assert_eq!((scene.parent_of(g), scene.parent_of(h)), (Some(h), None));
    super::play(&mut scene, &[By(C).redo()]);
    assert_eq!((scene.parent_of(g), scene.parent_of(h)), (Some(h), Some(k)));
}

/// Edits that undo no longer reaches stay, whatever earlier or later edits of others are undone.
#[test]
fn what_is_forgotten_stays() {
    let (s, g) = (id(A, 0), group_id(A, 0));
    let mut events = and(&two(), &[By(A).grouped(g, [s], None)]);
    // B's edits come first, then A's, which undo no longer reaches.
    events.extend([By(B).moved([s], Vec3::Y), placed(B, g, 5.0)]);
    events.extend([By(A).moved([s], Vec3::X), placed(A, g, 7.0)]);
    let other = id(B, 0);
    events.extend((0..1100).map(|_| By(A).moved([other], Vec3::X)));
    let mut scene = scene_of(events);
    let state = |scene: &Scene| {
        (scene.stroke(s).expect("a stroke").offset(), scene.group_transform(g).expect("a group").p.x)
    };
    assert_eq!(state(&scene), (Vec3::X + Vec3::Y, 7.0));
    super::play(&mut scene, &[By(B).undo(), By(B).undo()]);
    assert_eq!(state(&scene), (Vec3::X, 7.0));
    super::play(&mut scene, &[By(B).redo(), By(B).redo()]);
    assert_eq!(state(&scene), (Vec3::X + Vec3::Y, 7.0));
    for _ in 0..1200 {
        super::play(&mut scene, &[By(A).undo()]);
    }
    assert_eq!(scene.stroke(other).expect("a stroke").offset(), Vec3::X * 100.0);
    assert_eq!(state(&scene), (Vec3::X + Vec3::Y, 7.0));
}

/// The number of undoable edits of all authors together is bounded.
#[test]
fn all_together_remember_so_much() {
    let mut scene = Scene::new();
    let count = 70;
    let authors: Vec<Author> = (1..=count).map(Author).collect();
    for &author in &authors {
        super::play(&mut scene, &[join(author)]);
    }
    for n in 0..1000 {
        for &author in &authors {
            super::play(&mut scene, &stroke(author, n)[..1]);
        }
    }
    let mut reach = vec![0; authors.len()];
    for (&author, reach) in authors.iter().zip(&mut reach) {
        while scene.can_undo_of(author) {
            super::play(&mut scene, &[By(author).undo()]);
            *reach += 1;
        }
    }
    assert_eq!(reach.iter().sum::<usize>(), 1 << 16, "{reach:?}");
    assert!(reach.iter().all(|reach| (900..=1000).contains(reach)), "{reach:?}");
}

/// A redone edit applies before later edits of another author, even if that author has left and cannot undo them.
#[test]
fn what_is_made_again_comes_before_what_is_forgotten() {
    let (s, g, h) = (id(A, 0), group_id(A, 0), group_id(B, 0));
    let named = |author, group, name: &str| Event::Group {
        t: 0.0,
        author,
        group,
        strokes: vec![],
        parent: None,
        name: Some(name.to_owned()),
    };
    let assign = |author, layer| Event::Assign { t: 0.0, author, layer, strokes: vec![s] };
    let of_a = [By(A).grouped(g, [s], None), named(A, g, "A's"), assign(A, 1)];
    let of_b = [By(B).grouped(h, [s], None), named(B, g, "B's"), assign(B, 2)];
    let events = [two(), of_a.to_vec(), vec![By(A).undo(), By(A).undo(), By(A).undo()]].concat();
    let events = [events, of_b.to_vec(), vec![leave(B), By(A).redo(), By(A).redo(), By(A).redo()]].concat();
    let scene = scene_of(events);
    let stroke = scene.stroke(s).expect("a stroke");
    assert_eq!((scene.groups_of(stroke), scene.group_name(g), stroke.layer()), (vec![h], Some("B's"), 2));
}
