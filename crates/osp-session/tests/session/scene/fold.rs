//! Random sessions of several authors, compared with a simple model that stores every edit and applies the active ones
//! in order. Also random sessions of one author, in which an undo must restore the former bits.

use std::collections::{BTreeMap, BTreeSet};

use glam::{Quat, Vec3};
use osp::polygon::PolygonId;
use osp_session::{
    recording::{Author, Event, GroupId, StrokeId, Transform},
    replay::fingerprint_of_frame,
    scene::Scene,
};
use proptest::prelude::*;

use super::authors::{group_id, id, join, stroke};
use osp_testkit::{
    Editor,
    events::{By, SOLE},
};

#[derive(Clone, Debug)]
enum Op {
    Draw(StrokeId),
    Erase(StrokeId),
    Move(Vec<(StrokeId, Vec3)>),
    Group { group: GroupId, strokes: Vec<StrokeId>, parent: Option<GroupId>, name: Option<String> },
    Place(GroupId, Transform),
    Assign(u32, Vec<StrokeId>),
}

struct Edit {
    author: Author,
    is_active: bool,
    op: Op,
}

#[derive(Clone, Debug, Default, PartialEq)]
struct StrokeState {
    is_drawn: bool,
    erased_by: BTreeSet<Author>,
    offset: Vec3,
    group: Option<GroupId>,
    layer: u32,
}

#[derive(Clone, Debug, PartialEq)]
struct GroupState {
    parent: Option<GroupId>,
    name: Option<String>,
    to: Transform,
}

#[derive(Default)]
struct Stacks {
    done: Vec<Vec<usize>>,
    taken_back: Vec<Vec<usize>>,
    /// Number of edits that may still join the last step, and whether the step has begun.
    open: Option<(u32, bool)>,
}

/// All edits so far, and the authors who can undo them.
#[derive(Default)]
struct Model {
    edits: Vec<Edit>,
    stacks: BTreeMap<Author, Stacks>,
    groups: BTreeSet<GroupId>,
    gone: BTreeSet<StrokeId>,
    used: BTreeSet<StrokeId>,
    ignored: u64,
}

type State = (BTreeMap<StrokeId, StrokeState>, BTreeMap<GroupId, GroupState>);

impl Model {
    /// The result of all active edits.
    fn fold(&self) -> State {
        let to = Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0 };
        let none = GroupState { parent: None, name: None, to };
        let mut strokes: BTreeMap<StrokeId, StrokeState> = BTreeMap::new();
        let mut groups: BTreeMap<GroupId, GroupState> =
            self.groups.iter().map(|&group| (group, none.clone())).collect();
        for edit in &self.edits {
            if let Op::Draw(stroke) = edit.op {
                strokes.insert(stroke, StrokeState { is_drawn: edit.is_active, ..StrokeState::default() });
            }
        }
        for edit in self.edits.iter().filter(|edit| edit.is_active) {
            match &edit.op {
                Op::Draw(_) => {}
                Op::Erase(stroke) => {
                    strokes.entry(*stroke).or_default().erased_by.insert(edit.author);
                }
                Op::Move(ways) => {
                    ways.iter().for_each(|(stroke, way)| strokes.entry(*stroke).or_default().offset += *way)
                }
                Op::Group { group, strokes: members, parent, name } => {
                    if can_hang(&groups, *group, *parent) {
                        groups.entry(*group).and_modify(|group| group.parent = *parent);
                    }
                    if let Some(name) = name {
                        let name = Some(name.clone()).filter(|name| !name.is_empty());
                        groups.entry(*group).and_modify(|group| group.name = name);
                    }
                    for stroke in members {
                        strokes.entry(*stroke).or_default().group = Some(*group);
                    }
                }
                Op::Place(group, to) => groups.get_mut(group).expect("a group").to = *to,
                Op::Assign(layer, named) => {
                    named.iter().for_each(|stroke| strokes.entry(*stroke).or_default().layer = *layer)
                }
            }
        }
        strokes.retain(|stroke, _| !self.gone.contains(stroke));
        (strokes, groups)
    }

    /// Applies an event; events without effect are counted.
    fn take(&mut self, event: &Event) {
        let (strokes, groups) = self.fold();
        let author = event.author().unwrap_or_default();
        let known = |named: &[StrokeId]| -> Vec<StrokeId> {
            let named: BTreeSet<StrokeId> = named.iter().copied().collect();
            named.into_iter().filter(|stroke| strokes.contains_key(stroke)).collect()
        };
        let op = match event {
            Event::Begin { stroke, .. } => self.used.insert(*stroke).then_some(Op::Draw(*stroke)),
            Event::Erase { stroke, .. } => {
                let of = strokes.get(stroke).filter(|of| !of.erased_by.contains(&author));
                of.map(|_| Op::Erase(*stroke))
            }
            Event::Move { strokes: named, by, .. } => {
                let way = |stroke: StrokeId| {
                    let mut above = strokes[&stroke].group;
                    let mut scale = 1.0;
                    while let Some(group) = above {
                        scale *= groups[&group].to.s;
                        above = groups[&group].parent;
                    }
                    (stroke, *by / scale)
                };
                let ways: Vec<_> = known(named).into_iter().map(way).collect();
                (!ways.is_empty()).then_some(Op::Move(ways))
            }
            Event::Group { group, strokes: named, parent, name, .. } => {
                let is_known = groups.contains_key(group);
                let can = (is_known || group.author() == author)
                    && parent.is_none_or(|parent| groups.contains_key(&parent) && parent != *group)
                    && (!is_known || can_hang(&groups, *group, *parent));
                can.then(|| {
                    self.groups.insert(*group);
                    let strokes = known(named);
                    Op::Group { group: *group, strokes, parent: *parent, name: name.clone() }
                })
            }
            Event::Place { group, to, .. } => groups.contains_key(group).then_some(Op::Place(*group, *to)),
            Event::Assign { layer, strokes: named, .. } => {
                Some(known(named)).filter(|named| !named.is_empty()).map(|named| Op::Assign(*layer, named))
            }
            Event::Step { edits, .. } => {
                self.stacks.entry(author).or_default().open = (*edits > 0).then_some((*edits, false));
                return;
            }
            Event::Undo { .. } | Event::Redo { .. } => {
                let stacks = self.stacks.entry(author).or_default();
                let is_undo = matches!(event, Event::Undo { .. });
                let step = if is_undo { stacks.done.pop() } else { stacks.taken_back.pop() };
                let Some(step) = step else {
                    self.ignored += 1;
                    return;
                };
                stacks.open = None;
                step.iter().for_each(|&edit| self.edits[edit].is_active = !is_undo);
                let onto = if is_undo { &mut stacks.taken_back } else { &mut stacks.done };
                onto.push(step);
                return;
            }
            _ => return,
        };
        let Some(op) = op else {
            self.ignored += 1;
            return;
        };
        let stacks = self.stacks.entry(author).or_default();
        for edit in stacks.taken_back.drain(..).flatten() {
            if let Op::Draw(stroke) = self.edits[edit].op {
                self.gone.insert(stroke);
            }
        }
        match (&mut stacks.open, stacks.done.last_mut()) {
            (Some((_, true)), Some(step)) => step.push(self.edits.len()),
            _ => stacks.done.push(vec![self.edits.len()]),
        }
        stacks.open = stacks.open.and_then(|(left, _)| (left > 1).then_some((left - 1, true)));
        self.edits.push(Edit { author, is_active: true, op });
    }
}

fn can_hang(groups: &BTreeMap<GroupId, GroupState>, group: GroupId, parent: Option<GroupId>) -> bool {
    let mut above = parent;
    while let Some(at) = above {
        if at == group {
            return false;
        }
        above = groups[&at].parent;
    }
    true
}

/// The same result, computed by a scene.
fn state_of(scene: &mut Scene) -> State {
    let strokes =
        scene.strokes().iter().filter(|stroke| scene.stroke(stroke.id().unwrap_or(StrokeId(0))).is_some());
    let strokes = strokes.map(|stroke| {
        let (offset, layer) = (stroke.offset(), stroke.layer());
        let group = scene.groups_of(stroke).first().copied();
        let is_drawn = !stroke.is_taken_away();
        let state = StrokeState { is_drawn, offset, group, layer, ..StrokeState::default() };
        (stroke.id().expect("all have numbers"), state)
    });
    let strokes = strokes.collect();
    let groups = scene
        .group_tree()
        .into_iter()
        .map(|node| (node.id, GroupState { parent: node.parent, name: node.name, to: node.to }));
    (strokes, groups.collect())
}

/// An edit of an author, of any strokes and groups. Lengths are chosen so that sums are exact in any order.
fn event_of(author: Author, authors: u32, kind: u8, pick: [u32; 4]) -> Vec<Event> {
    let first = if authors == 1 { 0 } else { 1 };
    let whose = |pick: u32| Author(first + pick % authors);
    let some = |pick: u32| id(whose(pick), pick / authors % 3);
    let some_group = |pick: u32| group_id(whose(pick), pick / authors % 2);
    let length = |pick: u32| (pick % 64) as f32 / 8.0 - 4.0;
    let strokes = vec![some(pick[0]), some(pick[1])];
    let (by, t) = (By(author), 0.0);
    vec![match kind {
        0..=1 => return stroke(author, pick[0] % 3),
        2..=3 => by.erase(some(pick[0])),
        4..=6 => by.moved(strokes, Vec3::new(length(pick[2]), length(pick[3]), length(pick[2] / 64))),
        7..=9 => {
            let parent = (!pick[3].is_multiple_of(3)).then(|| some_group(pick[3] / 3));
            let name = (pick[3] / 64)
                .is_multiple_of(3)
                .then(|| ["", "left", "right"][pick[3] as usize / 256 % 3].to_owned());
            Event::Group { t, author, group: some_group(pick[2]), strokes, parent, name }
        }
        10..=11 => {
            let s = [0.5, 1.0, 2.0][pick[1] as usize % 3];
            let to = Transform { p: Vec3::X * length(pick[2]), q: Quat::IDENTITY, s };
            by.placed(some_group(pick[0]), to)
        }
        12 => Event::Assign { t, author, layer: pick[2] % 4, strokes },
        13 => Event::Step { t, author, edits: pick[0] % 4 },
        14..=17 => by.undo(),
        _ => by.redo(),
    }]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn the_state_is_the_fold_of_the_active_edits(
        authors in 1u32..=4,
        picks in prop::collection::vec((any::<u32>(), 0u8..22, any::<[u32; 4]>()), 1..120),
    ) {
        let (mut scene, mut batched, mut model) = (Scene::new(), Scene::keeping_groups_whole(), Model::default());
        let all: Vec<Author> = if authors == 1 { vec![Author::SOLE] } else { (1..=authors).map(Author).collect() };
        let joined: Vec<Event> = all.iter().filter(|author| !author.is_sole()).map(|&author| join(author)).collect();
        let mut changes = Vec::new();
        scene.apply_all(&joined, &mut changes);
        batched.apply_all(&joined, &mut changes);
        let mut waiting = Vec::new();
        for (whose, kind, pick) in picks {
            let author = all[whose as usize % all.len()];
            let events = event_of(author, authors, kind, pick);
            events.iter().for_each(|event| {
                model.take(event);
                scene.apply(event, &mut changes);
            });
            waiting.extend(events);
            if pick[0].is_multiple_of(5) {
                batched.apply_all(&std::mem::take(&mut waiting), &mut changes);
            }
            let (mut strokes, groups) = model.fold();
            for state in strokes.values_mut() {
                state.is_drawn &= state.erased_by.is_empty();
                state.erased_by.clear();
            }
            let (of_scene, groups_of_scene) = state_of(&mut scene);
            prop_assert_eq!(&of_scene, &strokes);
            prop_assert_eq!(&groups_of_scene, &groups);
            for &author in &all {
                let stacks = model.stacks.entry(author).or_default();
                prop_assert_eq!(scene.can_undo_of(author), !stacks.done.is_empty());
                prop_assert_eq!(scene.can_redo_of(author), !stacks.taken_back.is_empty());
                prop_assert_eq!(scene.is_step_open_of(author), stacks.open.is_some());
            }
            scene.free_unreachable();
        }
        // With frames of any length and with groups that move as a whole, the model is the same.
        batched.apply_all(&waiting, &mut changes);
        prop_assert_eq!(state_of(&mut batched), state_of(&mut scene));
        prop_assert_eq!(
            fingerprint_of_frame(batched.visible_ids()),
            fingerprint_of_frame(scene.visible_ids())
        );
        for polygon in scene.visible_ids() {
            prop_assert_eq!(scene.polygon(polygon), batched.polygon(polygon));
            prop_assert_eq!(scene.bounds(polygon), batched.bounds(polygon));
        }
    }

    /// Lengths and rotations of any value. Undo restores the former state and redo the later one: the polygons, their
    /// order, and the bits of their corners.
    #[test]
    fn with_one_author_an_undo_gives_back_the_bits_of_before(
        seed in any::<u64>(),
        walks in prop::collection::vec((any::<bool>(), 1..20_usize), 12),
    ) {
        type Seen = (Vec<(PolygonId, Vec<Vec3>)>, Vec<(GroupId, Option<GroupId>, Transform)>);
        let seen = |scene: &mut Scene| -> Seen {
            let visible = scene.visible_ids().map(|id| (id, scene.polygon(id).vertices().to_vec())).collect();
            let tree = scene.group_tree().into_iter();
            (visible, tree.map(|node| (node.id, node.parent, node.to)).collect())
        };
        let (mut editor, mut scene, mut changes) = (Editor::new(seed), Scene::new(), Vec::new());
        // The visible polygons before each edit, and after the last one; and the number of edits that are redone.
        let (mut states, mut at): (Vec<Seen>, usize) = (vec![seen(&mut scene)], 0);
        let mut events = editor.start();
        for _ in 0..80 {
            events.extend(editor.edit());
        }
        for (back, steps) in walks {
            events.extend((0..steps).map(|_| if back { SOLE.undo() } else { SOLE.redo() }));
        }
        for event in events {
            let ignored = scene.counts().ignored_events;
            scene.apply(&event, &mut changes);
            if scene.counts().ignored_events > ignored {
                continue;
            }
            let now = seen(&mut scene);
            match event {
                Event::Undo { .. } | Event::Redo { .. } => {
                    at = if matches!(event, Event::Undo { .. }) { at - 1 } else { at + 1 };
                    prop_assert_eq!(&now.0, &states[at].0);
                    // Groups are never removed.
                    for group in &states[at].1 {
                        prop_assert!(now.1.contains(group), "{:?}", group);
                    }
                }
                Event::Point { .. } | Event::End { .. } => states[at] = now,
                _ => {
                    states.truncate(at + 1);
                    states.push(now);
                    at += 1;
                }
            }
        }
    }
}
