//! Groupings of many authors: the cost of undoing one depends on its dependants, not on the number of groups.

use glam::{Quat, Vec3};
use osp_session::{
    recording::{Author, Event, GroupId, StrokeId, Transform},
    scene::Scene,
};
use osp_testkit::events::By;

use super::authors::{group_id, id, join, stroke};

const A: Author = Author(2);
const B: Author = Author(3);

/// The cost of an event.
fn cost(scene: &mut Scene, event: Event) -> u64 {
    let before = scene.work().total();
    scene.apply(&event, &mut Vec::new());
    scene.work().total() - before
}

/// The same for moves, placements, names and layers, and for edits that undo no longer reaches.
#[test]
fn an_undo_of_any_arrangement_costs_what_depends_on_it() {
    let (a, s) = (group_id(A, 0), id(A, 0));
    let arrangements = |author: Author, group: GroupId, stroke: StrokeId| {
        let to = Transform { p: Vec3::X, q: Quat::IDENTITY, s: 1.0 };
        let name = Some("a name".to_owned());
        vec![
            Event::Group { t: 0.0, author, group, strokes: vec![stroke], parent: None, name },
            By(author).moved([stroke], Vec3::Y),
            By(author).placed(group, to),
            Event::Assign { t: 0.0, author, layer: 1, strokes: vec![stroke] },
        ]
    };
    let costs = [50, 400].map(|count| {
        let mut scene = Scene::new();
        let mut events = vec![join(A), join(B), By(A).grouped(a, [], None)];
        events.extend(stroke(A, 0));
        events.extend(arrangements(A, a, s));
        // B makes the same edits after A.
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
        let undone: Vec<u64> = (0..4).map(|_| cost(&mut scene, By(A).undo())).collect();
        let made_again: Vec<u64> = (0..4).map(|_| cost(&mut scene, By(A).redo())).collect();
        // Undo no longer reaches A's first edits.
        let other = group_id(A, 1);
        let beyond: Vec<Event> = (0..Scene::UNDO_DEPTH).map(|_| By(A).grouped(other, [], None)).collect();
        let forgotten = beyond.into_iter().map(|event| cost(&mut scene, event)).max();
        (undone, made_again, forgotten)
    });
    assert_eq!(costs[0], costs[1], "however much others have arranged");
}

/// Authors with one group each. In each round, the parent is the group of an author one position farther.
fn tangle(authors: u32, rounds: u32) -> Vec<Event> {
    let author = |n: u32| Author(1 + n % authors);
    let mut events: Vec<Event> = (0..authors).map(|n| join(author(n))).collect();
    events.extend((0..authors).map(|n| By(author(n)).grouped(group_id(author(n), 0), [], None)));
    for round in 1..=rounds {
        let parent = |n: u32| Some(group_id(author(n + round), 0));
        events.extend((0..authors).map(|n| By(author(n)).grouped(group_id(author(n), 0), [], parent(n))));
    }
    events
}

/// A vector in world space needs no parents, whether in the frame of an undo or of an edit that is forgotten.
#[test]
fn moves_of_strokes_in_no_group_leave_parents_to_the_end_of_the_frame() {
    let mover = Author(100);
    let moved = |n: u32| By(mover).moved([id(mover, n)], Vec3::X);
    let steps = |moves: u32, before: u32, member: Option<GroupId>| {
        let mut scene = Scene::new();
        scene.apply_all(&tangle(16, 20), &mut Vec::new());
        let mut events = vec![join(mover)];
        events.extend(stroke(mover, 0));
        events.extend(member.map(|group| By(mover).grouped(group, [id(mover, 0)], None)));
        events.extend((0..before).map(|_| moved(0)));
        scene.apply_all(&events, &mut Vec::new());
        let before = scene.work().group_steps;
        let undone =
            (0..8).flat_map(|n| [By(Author(1 + n)).undo(), moved(0)].into_iter().take(1 + moves as usize));
        scene.apply_all(&undone.collect::<Vec<_>>(), &mut Vec::new());
        scene.work().group_steps - before
    };
    let alone = steps(0, 0, None);
    assert!(alone > 100, "{alone}");
    assert_eq!(steps(1, 0, None), alone);
    assert_eq!(steps(1, Scene::UNDO_DEPTH as u32, None), alone);
    let in_a_group = steps(1, 0, Some(group_id(mover, 0)));
    assert!(in_a_group > 2 * alone, "{in_a_group} and {alone}");
}
