use std::collections::BTreeSet;

use glam::{Quat, Vec3};

use crate::{
    math::rotate,
    recording::{GroupId, Transform},
};

/// Longest chain of groups from a stroke to the world; deeper ones are refused, so a walk upwards always ends.
pub(super) const MAX_GROUP_DEPTH: usize = 64;

/// A group: a transform from its own space to its parent's, or the world's.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) id: GroupId,
    pub(super) parent: Option<usize>,
    pub(super) to: Transform,
    /// Its own members, by their place in the scene's list.
    pub(super) strokes: BTreeSet<u32>,
}

/// The transform that moves nothing.
pub(super) const IDENTITY: Transform = Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0 };

/// A point mapped by a transform.
pub(super) fn apply(to: &Transform, p: Vec3) -> Vec3 {
    if *to == IDENTITY { p } else { rotate(to.q, p * to.s) + to.p }
}

/// A point of group `group` in world space.
pub(super) fn to_world(groups: &[Group], mut group: Option<usize>, mut p: Vec3) -> Vec3 {
    while let Some(g) = group {
        p = apply(&groups[g].to, p);
        group = groups[g].parent;
    }
    p
}

/// Whether `group` hangs (also indirectly) under `ancestor`, or is it.
pub(super) fn is_under(groups: &[Group], mut group: Option<usize>, ancestor: usize) -> bool {
    while let Some(g) = group {
        if g == ancestor {
            return true;
        }
        group = groups[g].parent;
    }
    false
}

/// Length of the longest chain of groups from below up to `group`, itself counted.
pub(super) fn height(groups: &[Group], group: usize) -> usize {
    let above = depth(groups, Some(group));
    let below = (0..groups.len()).filter(|&g| is_under(groups, Some(g), group));
    below.map(|g| depth(groups, Some(g)) + 1 - above).max().unwrap_or(1)
}

/// Number of groups from `group` upwards.
pub(super) fn depth(groups: &[Group], mut group: Option<usize>) -> usize {
    let mut depth = 0;
    while let Some(g) = group {
        depth += 1;
        group = groups[g].parent;
    }
    depth
}
