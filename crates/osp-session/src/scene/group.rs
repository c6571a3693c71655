use std::collections::{BTreeMap, BTreeSet, HashMap};

use glam::{Quat, Vec3};

use crate::recording::{GroupId, Transform};
use osp::math::{Aabb, rotate};

/// Largest nesting depth of groups. Deeper nesting is refused, so a walk to the root is short.
pub(super) const MAX_GROUP_DEPTH: usize = 64;

const IDENTITY: Transform = Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0 };

/// A group: a transform from its own space to its parent's space, or to world space.
#[derive(Clone, Debug)]
pub(super) struct Group {
    id: GroupId,
    name: Option<String>,
    parent: Option<usize>,
    to: Transform,
    /// The strokes that are direct members of the group, as indices of the scene's list of strokes.
    strokes: BTreeSet<u32>,
    /// The layers of these strokes, and the number of strokes on each.
    layers: BTreeMap<u32, u32>,
    children: BTreeSet<usize>,
    heights: BTreeMap<usize, u32>,
    /// Whether the group was placed or got another parent since its strokes were last updated.
    has_moved: bool,
    /// The frame in which the group last moved. `None` if groups never move as a whole.
    pub(super) moved_in: Option<u64>,
    /// Whether the group moves as a whole. The boxes of its direct members' polygons are then stored in its space.
    pub(super) is_whole: bool,
    /// Box of all polygons that were in the group while it moved as a whole, in the group's space.
    pub(super) reach: Aabb,
    /// Scratch of [`Groups::take_moved`].
    is_walked: bool,
    /// Extent of the group's direct members at the last refresh, in the group's space if it moves as a whole.
    own: Extent,
    /// Extent of the subtree at the last refresh.
    subtree: Extent,
    /// Whether `own` must be computed again.
    is_own_stale: bool,
    /// Whether `subtree` must be computed again. If so, `subtree` of every ancestor must be computed again, too.
    is_stale: bool,
}

/// Counts and box of the visible contents of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    pub(super) strokes: u64,
    pub(super) polygons: u64,
    /// Box, in world space, or in the space of a group that moves as a whole.
    pub(super) bounds: Aabb,
}

impl Extent {
    pub(super) const NOTHING: Self = Self { strokes: 0, polygons: 0, bounds: Aabb::EMPTY };

    pub(super) fn add(&mut self, other: &Self) {
        self.strokes += other.strokes;
        self.polygons += other.polygons;
        self.bounds = self.bounds.union(&other.bounds);
    }
}

impl Group {
    fn leave_layer(&mut self, layer: u32) {
        match self.layers.get_mut(&layer) {
            Some(count) if *count > 1 => *count -= 1,
            _ => _ = self.layers.remove(&layer),
        }
    }

    /// Height of the group's subtree, in groups; 1 without children.
    fn height(&self) -> usize {
        1 + self.heights.last_key_value().map_or(0, |(&height, _)| height)
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    groups: Vec<Group>,
    by_id: HashMap<GroupId, usize>,
    /// Groups with `has_moved` set.
    moved: Vec<usize>,
    /// Scratch of [`Groups::take_moved`].
    walk: Vec<usize>,
    /// Number of groups visited so far, to check nesting depths and to find the strokes that a change affects, and of
    /// members of moved groups.
    pub(super) steps: u64,
}

impl Groups {
    pub(super) fn reach(&self, group: usize) -> Aabb {
        self.groups[group].reach
    }

    pub(super) fn len(&self) -> usize {
        self.groups.len()
    }

    pub(super) fn get_mut(&mut self, group: usize) -> &mut Group {
        &mut self.groups[group]
    }

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

    pub(super) fn name(&self, group: usize) -> Option<&str> {
        self.groups[group].name.as_deref()
    }

    pub(super) fn set_name(&mut self, group: usize, name: Option<String>) -> Option<String> {
        std::mem::replace(&mut self.groups[group].name, name)
    }

    /// The children of a group, or the groups without a parent, by order of creation.
    pub(super) fn below(&self, group: Option<usize>) -> Vec<usize> {
        match group {
            Some(group) => self.groups[group].children.iter().copied().collect(),
            None => (0..self.groups.len()).filter(|&at| self.groups[at].parent.is_none()).collect(),
        }
    }

    pub(super) fn is_whole(&self, group: Option<usize>) -> bool {
        group.is_some_and(|group| self.groups[group].is_whole)
    }

    pub(super) fn strokes(&self, group: usize) -> impl Iterator<Item = u32> + '_ {
        self.groups[group].strokes.iter().copied()
    }

    /// Extent of a group's subtree at the last call of [`Groups::refresh`].
    pub(super) fn subtree(&self, group: usize) -> Extent {
        self.groups[group].subtree
    }

    /// Marks a group whose direct members have changed. Also marks its ancestors, up to the first ancestor that is
    /// already marked.
    pub(super) fn note_changed(&mut self, group: Option<usize>) {
        if let Some(group) = group {
            self.groups[group].is_own_stale = true;
        }
        self.note_stale(group);
    }

    pub(super) fn note_stale(&mut self, mut group: Option<usize>) {
        while let Some(at) = group
            && !std::mem::replace(&mut self.groups[at].is_stale, true)
        {
            group = self.groups[at].parent;
        }
    }

    /// Computes the extents that changed since the last call. `extent` returns the extent of a stroke. The cost is
    /// proportional to the number of strokes of the changed groups, plus the number of their ancestors.
    pub(super) fn refresh(&mut self, extent: impl Fn(u32) -> Extent) {
        // Parents come before children. No descendant of an up-to-date group is stale.
        let mut stale: Vec<usize> = (0..self.groups.len())
            .filter(|&at| self.groups[at].parent.is_none() && self.groups[at].is_stale)
            .collect();
        let mut at = 0;
        while let Some(&group) = stale.get(at) {
            at += 1;
            let children = self.groups[group].children.iter().copied();
            stale.extend(children.filter(|&child| self.groups[child].is_stale));
        }
        for &group in stale.iter().rev() {
            let of = &self.groups[group];
            let mut own = of.own;
            if of.is_own_stale {
                own = Extent::NOTHING;
                of.strokes.iter().for_each(|&stroke| own.add(&extent(stroke)));
            }
            let mut subtree = own;
            if of.is_whole {
                subtree.bounds = self.place_of(group).world_box(&own.bounds);
            }
            of.children.iter().for_each(|&child| subtree.add(&self.groups[child].subtree));
            let of = &mut self.groups[group];
            (of.own, of.subtree, of.is_own_stale, of.is_stale) = (own, subtree, false, false);
        }
    }

    /// Whether a group (a new group if `known` is `None`) can get the parent `parent` without a cycle, and without
    /// exceeding [`MAX_GROUP_DEPTH`].
    fn can_hang(&mut self, known: Option<usize>, parent: Option<usize>) -> bool {
        let height = known.map_or(1, |at| self.groups[at].height());
        let (mut depth, mut above) = (0, parent);
        while let Some(group) = above {
            self.steps += 1;
            depth += 1;
            if depth + height > MAX_GROUP_DEPTH || Some(group) == known {
                return false;
            }
            above = self.groups[group].parent;
        }
        true
    }

    /// Sets the parent of a group, if possible. Returns whether the group has this parent.
    pub(super) fn try_hang(&mut self, group: usize, parent: Option<usize>) -> bool {
        let before = self.parent(group);
        let is_linked = self.try_link(group, parent);
        self.note_parent(group, before);
        is_linked
    }

    /// Does the same as [`Groups::try_hang`] within [`Groups::rearrange`].
    pub(super) fn try_link(&mut self, group: usize, parent: Option<usize>) -> bool {
        let can = self.groups[group].parent == parent || self.can_hang(Some(group), parent);
        if can {
            self.link(group, parent);
        }
        can
    }

    /// Removes the parents of groups, lets `link` link them again, and marks the groups whose parents have changed.
    pub(super) fn rearrange(&mut self, of: impl Iterator<Item = usize>, link: impl FnOnce(&mut Self)) {
        let before: Vec<(usize, Option<usize>)> = of.map(|group| (group, self.parent(group))).collect();
        before.iter().for_each(|&(group, _)| self.link(group, None));
        link(self);
        before.into_iter().for_each(|(group, before)| self.note_parent(group, before));
    }

    /// Finds or creates the group with this number. `None` if it cannot get the parent `parent`, because of a cycle or
    /// of [`MAX_GROUP_DEPTH`].
    pub(super) fn find_or_make(&mut self, id: GroupId, parent: Option<usize>) -> Option<usize> {
        let known = self.find(id);
        if !self.can_hang(known, parent) {
            return None;
        }
        Some(known.unwrap_or_else(|| {
            let at = self.groups.len();
            self.groups.push(Group {
                id,
                name: None,
                parent: None,
                to: IDENTITY,
                strokes: BTreeSet::new(),
                layers: BTreeMap::new(),
                children: BTreeSet::new(),
                heights: BTreeMap::new(),
                has_moved: false,
                moved_in: None,
                is_whole: false,
                reach: Aabb::EMPTY,
                is_walked: false,
                own: Extent::NOTHING,
                subtree: Extent::NOTHING,
                is_own_stale: false,
                is_stale: false,
            });
            self.by_id.insert(id, at);
            at
        }))
    }

    pub(super) fn place(&mut self, group: usize, to: Transform) {
        self.groups[group].to = to;
        self.note_moved(group);
    }

    pub(super) fn set_parent(&mut self, group: usize, parent: Option<usize>) {
        let before = self.parent(group);
        self.link(group, parent);
        self.note_parent(group, before);
    }

    fn note_parent(&mut self, group: usize, before: Option<usize>) {
        let parent = self.parent(group);
        if parent != before {
            self.note_stale(before);
            self.note_stale(parent);
            self.note_moved(group);
        }
    }

    fn link(&mut self, group: usize, parent: Option<usize>) {
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
    }

    /// Updates heights after a child of `group` has changed from height `was` to height `is`. If the child was added,
    /// `was` is `None`; if it was removed, `is` is `None`.
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

    pub(super) fn layers(&self, group: usize) -> impl Iterator<Item = u32> + '_ {
        self.groups[group].layers.keys().copied()
    }

    /// Moves a stroke on this layer from one group to another.
    pub(super) fn change_member(&mut self, stroke: u32, layer: u32, from: Option<usize>, to: Option<usize>) {
        self.note_changed(from);
        self.note_changed(to);
        if let Some(from) = from {
            self.groups[from].strokes.remove(&stroke);
            self.groups[from].leave_layer(layer);
        }
        if let Some(to) = to {
            self.groups[to].strokes.insert(stroke);
            *self.groups[to].layers.entry(layer).or_default() += 1;
        }
    }

    /// Moves a member of a group from one layer to another.
    pub(super) fn change_layer(&mut self, group: Option<usize>, from: u32, to: u32) {
        if let Some(group) = group.filter(|_| from != to) {
            self.groups[group].leave_layer(from);
            *self.groups[group].layers.entry(to).or_default() += 1;
        }
    }

    fn note_moved(&mut self, group: usize) {
        if !std::mem::replace(&mut self.groups[group].has_moved, true) {
            self.moved.push(group);
            self.steps += self.groups[group].strokes.len() as u64;
        }
    }

    /// Calls `moved` once for every group that was placed or got another parent since the last call, and for every
    /// descendant.
    pub(super) fn take_moved(&mut self, mut moved: impl FnMut(usize)) {
        if self.moved.is_empty() {
            return;
        }
        let mut walk = std::mem::take(&mut self.walk);
        walk.append(&mut self.moved);
        let mut at = 0;
        while let Some(&number) = walk.get(at) {
            at += 1;
            let group = &mut self.groups[number];
            // An ancestor has moved, too, so this group was reported before.
            if std::mem::replace(&mut group.is_walked, true) {
                continue;
            }
            self.steps += 1;
            moved(number);
            walk.extend(&group.children);
        }
        for number in walk.drain(..) {
            (self.groups[number].has_moved, self.groups[number].is_walked) = (false, false);
        }
        self.walk = walk;
    }

    /// Fills `chain` with the transforms from a group's space to world space, in order of application.
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

    /// Transforms a point from a group's space to world space.
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

    /// Rotates a direction from a group's space to world space.
    pub(super) fn direction_to_world(&self, mut group: Option<usize>, mut way: Vec3) -> Vec3 {
        while let Some(at) = group {
            let Group { to, parent, .. } = &self.groups[at];
            way = rotate(to.q, way);
            group = *parent;
        }
        way
    }

    pub(super) fn scale_to_world(&self, mut group: Option<usize>) -> f32 {
        let mut scale = 1.0;
        while let Some(at) = group {
            let Group { to, parent, .. } = &self.groups[at];
            scale *= to.s;
            group = *parent;
        }
        scale
    }

    /// Transforms a vector from world space to a group's space. `None` if the group's scale is 0, or too small for
    /// `f32`.
    pub(super) fn way_from_world(&self, group: Option<usize>, by: Vec3) -> Option<Vec3> {
        let mut chain = Vec::new();
        self.chain(group, &mut chain);
        let way = chain.iter().rev().fold(by, |by, to| rotate(to.q.conjugate(), by) / to.s);
        way.is_finite().then_some(way)
    }
}

pub(super) fn apply(to: &Transform, p: Vec3) -> Vec3 {
    rotate(to.q, p * to.s) + to.p
}
