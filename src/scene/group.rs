use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{Quat, Vec3};

use crate::{
    math::rotate,
    recording::{GroupId, Transform},
};

/// Longest chain of groups from a stroke to the world; deeper ones are refused, so a walk upwards always ends.
pub(super) const MAX_GROUP_DEPTH: usize = 64;

/// The transform that moves nothing.
const IDENTITY: Transform = Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0 };

/// A group: a transform from its own space to its parent's, or the world's.
#[derive(Clone, Debug)]
struct Group {
    id: GroupId,
    parent: Option<usize>,
    to: Transform,
    /// Its own members, by their place in the scene's list.
    strokes: BTreeSet<u32>,
    children: BTreeSet<usize>,
    /// How many children are so high.
    heights: BTreeMap<usize, u32>,
    /// It was placed or hung elsewhere, and its strokes do not know yet.
    has_moved: bool,
    /// Scratch of [`Groups::take_moved`].
    is_walked: bool,
}

impl Group {
    /// Length of the longest chain of groups from below up to this one, itself counted.
    fn height(&self) -> usize {
        1 + self.heights.last_key_value().map_or(0, |(&height, _)| height)
    }
}

/// The groups of a scene, a forest.
#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    by_id: HashMap<GroupId, usize>,
    /// Those of which `has_moved` is set.
    moved: Vec<usize>,
    /// Scratch of [`Groups::take_moved`].
    walk: Vec<usize>,
    steps: u64,
}

impl Groups {
    pub(super) fn find(&self, id: GroupId) -> Option<usize> {
        self.by_id.get(&id).copied()
    }

    pub(super) fn id(&self, group: usize) -> GroupId {
        self.groups[group].id
    }

    pub(super) fn parent(&self, group: usize) -> Option<usize> {
        self.groups[group].parent
    }

    pub(super) fn transform(&self, group: usize) -> Transform {
        self.groups[group].to
    }

    /// Groups looked at so far, to find out how deep they lie and which strokes a change of theirs concerns.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    /// The group with this number, which is made if there is none, if it can hang under `parent`: not below itself, and
    /// in no chain that is too long.
    pub(super) fn find_or_make(&mut self, id: GroupId, parent: Option<usize>) -> Option<usize> {
        let known = self.find(id);
        let height = known.map_or(1, |at| self.groups[at].height());
        let (mut depth, mut above) = (0, parent);
        while let Some(group) = above {
            self.steps += 1;
            depth += 1;
            if depth + height > MAX_GROUP_DEPTH || Some(group) == known {
                return None;
            }
            above = self.groups[group].parent;
        }
        Some(known.unwrap_or_else(|| {
            let at = self.groups.len();
            self.groups.push(Group {
                id,
                parent: None,
                to: IDENTITY,
                strokes: BTreeSet::new(),
                children: BTreeSet::new(),
                heights: BTreeMap::new(),
                has_moved: false,
                is_walked: false,
            });
            self.by_id.insert(id, at);
            at
        }))
    }

    pub(super) fn place(&mut self, group: usize, to: Transform) {
        self.groups[group].to = to;
        self.note_moved(group);
    }

    pub(super) fn hang(&mut self, group: usize, parent: Option<usize>) {
        let before = std::mem::replace(&mut self.groups[group].parent, parent);
        if before == parent {
            return;
        }
        let height = self.groups[group].height();
        if let Some(before) = before {
            self.groups[before].children.remove(&group);
            self.follow_height(before, Some(height), None);
        }
        if let Some(parent) = parent {
            self.groups[parent].children.insert(group);
            self.follow_height(parent, None, Some(height));
        }
        self.note_moved(group);
    }

    /// A child of a group was so high (if it was one) and is now so high (if it is one).
    fn follow_height(&mut self, mut group: usize, mut was: Option<usize>, mut is: Option<usize>) {
        loop {
            self.steps += 1;
            let of = &mut self.groups[group];
            let before = of.height();
            if let Some(was) = was {
                match of.heights.get_mut(&was) {
                    Some(count) if *count > 1 => *count -= 1,
                    _ => _ = of.heights.remove(&was),
                }
            }
            if let Some(is) = is {
                *of.heights.entry(is).or_default() += 1;
            }
            let Some(parent) = of.parent.filter(|_| of.height() != before) else { return };
            (was, is) = (Some(before), Some(of.height()));
            group = parent;
        }
    }

    /// A stroke goes from one group to another.
    pub(super) fn change_member(&mut self, stroke: u32, from: Option<usize>, to: Option<usize>) {
        if let Some(from) = from {
            self.groups[from].strokes.remove(&stroke);
        }
        if let Some(to) = to {
            self.groups[to].strokes.insert(stroke);
        }
    }

    fn note_moved(&mut self, group: usize) {
        if !std::mem::replace(&mut self.groups[group].has_moved, true) {
            self.moved.push(group);
        }
    }

    /// Hands out every stroke under a group that was placed or hung elsewhere since the last call, each once.
    pub(super) fn take_moved(&mut self, mut stroke: impl FnMut(u32)) {
        if self.moved.is_empty() {
            return;
        }
        let mut walk = std::mem::take(&mut self.walk);
        walk.append(&mut self.moved);
        let mut at = 0;
        while let Some(&number) = walk.get(at) {
            at += 1;
            let group = &mut self.groups[number];
            // It hangs under another one that has moved, too.
            if std::mem::replace(&mut group.is_walked, true) {
                continue;
            }
            self.steps += 1;
            group.strokes.iter().copied().for_each(&mut stroke);
            walk.extend(&group.children);
        }
        for number in walk.drain(..) {
            (self.groups[number].has_moved, self.groups[number].is_walked) = (false, false);
        }
        self.walk = walk;
    }

    /// Fills `chain` with the transforms that bring a point of a group into world space, in this order.
    pub(super) fn chain(&self, mut group: Option<usize>, chain: &mut Vec<Transform>) {
        chain.clear();
        while let Some(at) = group {
            let Group { to, parent, .. } = &self.groups[at];
            if *to != IDENTITY {
                chain.push(*to);
            }
            group = *parent;
        }
    }

    /// A point of a group in world space.
    pub(super) fn to_world(&self, mut group: Option<usize>, mut p: Vec3) -> Vec3 {
        while let Some(at) = group {
            let Group { to, parent, .. } = &self.groups[at];
            if *to != IDENTITY {
                p = apply(to, p);
            }
            group = *parent;
        }
        p
    }

    /// How much larger things of a group are in world space.
    pub(super) fn scale_to_world(&self, mut group: Option<usize>) -> f32 {
        let mut scale = 1.0;
        while let Some(at) = group {
            let Group { to, parent, .. } = &self.groups[at];
            scale *= to.s;
            group = *parent;
        }
        scale
    }

    /// A way of world space as it is in a group: scaled and turned back. `None` if the group has shrunk to a point (or to
    /// so little that no number tells it): no way within it is a way in the world.
    pub(super) fn way_from_world(&self, group: Option<usize>, by: Vec3) -> Option<Vec3> {
        let mut chain = Vec::new();
        self.chain(group, &mut chain);
        let way = chain.iter().rev().fold(by, |by, to| rotate(to.q.conjugate(), by) / to.s);
        way.is_finite().then_some(way)
    }
}

/// A point mapped by a transform.
pub(super) fn apply(to: &Transform, p: Vec3) -> Vec3 {
    rotate(to.q, p * to.s) + to.p
}
