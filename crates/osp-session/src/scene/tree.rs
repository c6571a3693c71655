//! The groups of a scene as a tree.

use glam::Vec3;

use super::{Scene, group::Extent};
use crate::recording::{Author, GroupId, Motion, StrokeId, Transform};
use osp::math::{Aabb, rotate};

/// A group, and counts of the visible contents of its subtree.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupNode {
    pub id: GroupId,
    pub name: Option<String>,
    pub parent: Option<GroupId>,
    pub depth: usize,
    pub to: Transform,
    /// Number of visible strokes in the subtree.
    pub strokes: u64,
    /// Number of visible polygons in the subtree.
    pub polygons: u64,
    /// The box of these polygons, world space; empty without polygons. For a group that moves as a whole, it encloses
    /// the transformed box of the polygons in the group's space.
    pub bounds: Aabb,
}

impl Scene {
    /// The groups, each followed by its descendants. Counts and boxes are cached: only changes since the last call are
    /// computed.
    pub fn group_tree(&mut self) -> Vec<GroupNode> {
        let Self { groups, strokes, bounds, .. } = self;
        groups.refresh(|at| {
            let Some(stroke) = strokes.get(at as usize).filter(|stroke| stroke.is_visible()) else {
                return Extent::NOTHING;
            };
            let mut extent = Extent { strokes: 1, ..Extent::NOTHING };
            // Unused polygons are points that coincide with a point of the stroke.
            for id in stroke.polygon_ids().take(stroke.used as usize) {
                extent.polygons += 1;
                extent.bounds = extent.bounds.union(&bounds[id.index()]);
            }
            extent
        });
        let mut nodes = Vec::new();
        let mut walk: Vec<(usize, usize)> = groups.below(None).into_iter().rev().map(|at| (at, 0)).collect();
        while let Some((at, depth)) = walk.pop() {
            let Extent { strokes, polygons, bounds } = groups.subtree(at);
            nodes.push(GroupNode {
                id: groups.id(at),
                name: groups.name(at).map(str::to_owned),
                parent: groups.parent(at).map(|parent| groups.id(parent)),
                depth,
                to: groups.transform(at),
                strokes,
                polygons,
                bounds,
            });
            walk.extend(groups.below(Some(at)).into_iter().rev().map(|child| (child, depth + 1)));
        }
        nodes
    }

    pub fn parent_of(&self, id: GroupId) -> Option<GroupId> {
        let parent = self.groups.parent(self.groups.find(id)?)?;
        Some(self.groups.id(parent))
    }

    pub fn group_transform(&self, id: GroupId) -> Option<Transform> {
        self.groups.find(id).map(|group| self.groups.transform(group))
    }

    /// Transforms a point from world space to the space of a group's parent. `None` if there is no such group, or an
    /// ancestor has scale 0.
    pub fn in_parent_of(&self, id: GroupId, world: Vec3) -> Option<Vec3> {
        let mut chain = Vec::new();
        self.groups.chain(self.groups.parent(self.groups.find(id)?), &mut chain);
        let p = chain.iter().rev().fold(world, |p, to| rotate(to.q.conjugate(), p - to.p) / to.s);
        p.is_finite().then_some(p)
    }

    /// Transform from the space of a stroke's points to world space: its offset and the transforms of its groups.
    /// `None` if there is no such stroke.
    pub fn world_from_stroke(&self, id: StrokeId) -> Option<Motion> {
        let stroke = self.stroke(id)?;
        let mut chain = Vec::new();
        self.groups.chain(stroke.group, &mut chain);
        let own = Motion::by(stroke.offset);
        Some(chain.into_iter().fold(own, |motion, to| motion.then(&Motion { is_mirrored: false, to })))
    }

    /// Transform from the space of a group to world space. `None` if there is no such group.
    pub fn world_from_group(&self, id: GroupId) -> Option<Motion> {
        let mut chain = Vec::new();
        self.groups.chain(Some(self.groups.find(id)?), &mut chain);
        Some(
            chain
                .into_iter()
                .fold(Motion::STAY, |motion, to| motion.then(&Motion { is_mirrored: false, to })),
        )
    }

    pub fn group_name(&self, id: GroupId) -> Option<&str> {
        self.groups.name(self.groups.find(id)?)
    }

    /// Unused group numbers. In a session of several authors, these numbers belong to [`Author::SOLE`].
    pub fn free_groups(&self) -> impl Iterator<Item = GroupId> + '_ {
        let is_shared = self.authors().next().is_some();
        let last = if is_shared { (1 << Author::NUMBER_BITS) - 1 } else { u32::MAX };
        let first = (self.groups.below(None).len() as u32).min(last);
        (first..=last).chain(0..first).map(GroupId).filter(|&id| self.groups.find(id).is_none())
    }

    pub fn strokes_below(&self, id: GroupId) -> Vec<StrokeId> {
        let mut walk: Vec<usize> = self.groups.find(id).into_iter().collect();
        let mut ids = Vec::new();
        while let Some(group) = walk.pop() {
            let members = self.groups.strokes(group).filter_map(|at| self.strokes.get(at as usize)?.id);
            ids.extend(members);
            walk.extend(self.groups.below(Some(group)));
        }
        ids
    }
}
