//! Groupings of many authors: to take one back costs what depends on it, not what there is.

use glam::{Quat, Vec3};
use osp_session::{
    recording::{Author, Event, GroupId, StrokeId, Transform},
    scene::Scene,
};

use crate::authors::{group_id, id, join, redo, stroke, undo};

/// The first author has the group that all others hang under.
const ROOT: Author = Author(1);
const A: Author = Author(2);
const B: Author = Author(3);

fn grouped(author: Author, group: GroupId, strokes: &[StrokeId], parent: Option<GroupId>) -> Event {
    Event::Group { t: 0.0, author, group, strokes: strokes.to_vec(), parent, name: None }
}

/// So many hierarchies of other authors under the root, each hung elsewhere and back.
fn hierarchies(count: u32) -> Vec<Event> {
    let root = Some(group_id(ROOT, 0));
    let mut events = Vec::new();
    for hierarchy in 0..count {
        let author = Author(10 + hierarchy % 50);
        if hierarchy < 50 {
            events.push(join(author));
        }
        let group = |n: u32| group_id(author, 3 * (hierarchy / 50) + n);
        events.extend(stroke(author, hierarchy / 50));
        events.push(grouped(author, group(0), &[], root));
        events.push(grouped(author, group(1), &[], Some(group(0))));
        events.push(grouped(author, group(2), &[id(author, hierarchy / 50)], Some(group(1))));
        events.push(grouped(author, group(1), &[], None));
        events.push(grouped(author, group(1), &[], Some(group(0))));
    }
    events
}

/// What an event costs.
fn cost(scene: &mut Scene, event: Event) -> u64 {
    let before = scene.work().total();
    scene.apply(&event, &mut Vec::new());
    scene.work().total() - before
}

fn parent(scene: &Scene, group: GroupId) -> Option<GroupId> {
    scene.parent_of(group)
}

#[test]
fn an_undo_costs_what_depends_on_it() {
    let (root, a, b, below) = (group_id(ROOT, 0), group_id(A, 0), group_id(B, 0), group_id(B, 1));
    let costs = [50, 400].map(|count| {
        let mut scene = Scene::new();
        let mut events = vec![join(ROOT), join(A), join(B), grouped(ROOT, root, &[], None)];
        events.extend([stroke(A, 0), stroke(B, 0)].concat());
        events.push(grouped(B, b, &[], Some(root)));
        events.push(grouped(A, a, &[id(A, 0)], Some(root)));
        // This one is taken back: two later ones depend on it, one of them is refused.
        events.push(grouped(A, a, &[id(B, 0)], Some(b)));
        events.push(grouped(B, below, &[id(B, 0)], Some(a)));
        events.extend(hierarchies(count));
        scene.apply_all(&events, &mut Vec::new());
        assert_eq!(scene.counts().ignored_events, 0);
        let undone = cost(&mut scene, undo(A));
        assert_eq!([a, b, below].map(|group| parent(&scene, group)), [Some(root), Some(root), Some(a)]);
        let made_again = cost(&mut scene, redo(A));
        assert_eq!([a, b, below].map(|group| parent(&scene, group)), [Some(b), Some(root), Some(a)]);
        [undone, made_again]
    });
    assert_eq!(costs[0], costs[1], "however many groupings others have made");
}

/// The same of moves, placings, names and layers, and of edits that undo does not reach any more.
#[test]
fn an_undo_of_any_arrangement_costs_what_depends_on_it() {
    let (a, s) = (group_id(A, 0), id(A, 0));
    let arrangements = |author: Author, group: GroupId, stroke: StrokeId| {
        let to = Transform { p: Vec3::X, q: Quat::IDENTITY, s: 1.0 };
        let name = Some("a name".to_owned());
        vec![
            Event::Group { t: 0.0, author, group, strokes: vec![stroke], parent: None, name },
            Event::Move { t: 0.0, author, strokes: vec![stroke], by: Vec3::Y },
            Event::Place { t: 0.0, author, group, to },
            Event::Assign { t: 0.0, author, layer: 1, strokes: vec![stroke] },
        ]
    };
    let costs = [50, 400].map(|count| {
        let mut scene = Scene::new();
        let mut events = vec![join(A), join(B), grouped(A, a, &[], None)];
        events.extend(stroke(A, 0));
        events.extend(arrangements(A, a, s));
        // B does the same after A.
        events.extend(arrangements(B, a, s));
        for n in 0..count {
            let author = Author(10 + n % 50);
            if n < 50 {
                events.push(join(author));
            }
            events.extend(stroke(author, n / 50));
            events.extend(arrangements(author, group_id(author, n / 50), id(author, n / 50)));
        }
        scene.apply_all(&events, &mut Vec::new());
        assert_eq!(scene.counts().ignored_events, 0);
        let undone: Vec<u64> = (0..4).map(|_| cost(&mut scene, undo(A))).collect();
        let made_again: Vec<u64> = (0..4).map(|_| cost(&mut scene, redo(A))).collect();
        // Undo does not reach A's first edits any more.
        let other = group_id(A, 1);
        let beyond: Vec<Event> = (0..Scene::UNDO_DEPTH).map(|_| grouped(A, other, &[], None)).collect();
        let forgotten = beyond.into_iter().map(|event| cost(&mut scene, event)).max();
        (undone, made_again, forgotten)
    });
    assert_eq!(costs[0], costs[1], "however much others have arranged");
}
