//! Groups that are placed repeatedly move as a whole: the boxes of their polygons stay in the group's space. Placing
//! such a group costs time for each descendant group, not for each polygon.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::{Scene, group::Groups};
use crate::{brush::Surface, recording::Transform};
use osp::{
    math::Aabb,
    polygon::{Change, PLACE_ROUNDING, PolygonId, SpaceId, SpacePlace, bits},
};

/// If at most this number of frames lies between two placements of a group, the group moves as a whole from the second
/// placement on.
const SOON: u64 = 64;

/// Range of scales for which a group moves as a whole. `FARTHEST_M` is the largest translation, metres. Beyond these
/// limits, rounding errors are so large that a test in the group's space is inconclusive.
const SCALES: std::ops::RangeInclusive<f32> = 1.0e-3..=1.0e3;
const FARTHEST_M: f32 = 1.0e6;

impl Scene {
    /// Creates an empty scene in which groups that are placed repeatedly move as a whole. Their polygons are then in a
    /// [space](Change::Place). Receivers of the changes must support spaces, as [`Pipeline`](osp::frame::Pipeline)
    /// does, or call [`Scene::for_each_change`] for the changes of each polygon.
    pub fn keeping_groups_whole() -> Self {
        Self { keeps_groups_whole: true, ..Self::default() }
    }

    /// Calls `each` with every change, for receivers without spaces. A [`Change::Place`] is replaced by updates of the
    /// group's polygons, including invisible ones.
    pub fn for_each_change(&self, changes: &[Change], mut each: impl FnMut(Change)) {
        for &change in changes {
            let Change::Place(SpaceId(group)) = change else {
                each(change);
                continue;
            };
            // A replay may have been rewound to a time before the group existed.
            if group as usize >= self.groups.len() {
                continue;
            }
            for at in self.groups.strokes(group as usize) {
                if let Some(stroke) = self.strokes.get(at as usize) {
                    stroke.polygon_ids().map(Change::Update).for_each(&mut each);
                }
            }
        }
    }

    /// The space of a polygon, if its group moves as a whole. Panics if the id was never assigned.
    pub fn space(&self, id: PolygonId) -> Option<SpaceId> {
        if !self.is_in_space(id) {
            return None;
        }
        self.stroke_of(id).group.map(|group| SpaceId(group as u32))
    }

    /// Box around the polygons of a change, world space. For a single polygon the box is tight. If no polygon was
    /// inserted or moved, the box is empty.
    pub fn bounds_of_change(&self, change: Change) -> Aabb {
        match change {
            Change::Insert(id) | Change::Update(id) => self.bounds(id),
            Change::Place(space) => self.place_of(space).world_box(&self.groups.reach(space.0 as usize)),
            Change::Remove(_) | Change::Repaint(_) => Aabb::EMPTY,
        }
    }

    /// The groups that move as a whole.
    pub fn spaces(&self) -> impl Iterator<Item = SpaceId> + '_ {
        (0..self.groups.len()).filter(|&at| self.groups.is_whole(Some(at))).map(|at| SpaceId(at as u32))
    }

    /// Stores the box of a polygon of `group`: in the group's space if the group moves as a whole, else in world space.
    pub(super) fn keep_bounds(&mut self, id: PolygonId, group: Option<usize>, bounds: Aabb) {
        if id.index() == self.bounds.len() {
            self.bounds.push(bounds);
        } else {
            self.bounds[id.index()] = bounds;
        }
        if let Some(group) = group.filter(|&group| self.groups.is_whole(Some(group))) {
            let words = bits::words_for(id.index() + 1);
            if words > self.in_space.len() {
                self.in_space.resize(words.next_power_of_two(), 0);
            }
            bits::insert(&mut self.in_space, id.index());
            let group = self.groups.get_mut(group);
            group.reach = group.reach.union(&bounds);
        } else if self.is_in_space(id) {
            bits::remove(&mut self.in_space, id.index());
        }
    }

    #[inline]
    pub(super) fn is_in_space(&self, id: PolygonId) -> bool {
        !self.in_space.is_empty() && bits::contains(&self.in_space, id.index())
    }

    /// The box of a polygon in world space, computed from its corners.
    pub(super) fn world_bounds_of(&self, id: PolygonId) -> Aabb {
        let stroke = self.stroke_of(id);
        let surface = self.surfaces.get(id.index()).copied().unwrap_or(Surface::PLAIN);
        stroke.bounds_of(&self.polygon(id), &surface, self.groups.scale_to_world(stroke.group))
    }

    /// Whether a group that was moved in this frame needs no changes of single polygons. When a group starts or stops
    /// moving as a whole, all its strokes are transformed again.
    pub(super) fn moves_as_whole(&mut self, group: usize) -> bool {
        if !self.keeps_groups_whole {
            return false;
        }
        let is_empty = self.groups.strokes(group).next().is_none();
        self.groups.chain(Some(group), &mut self.chain);
        let can = self.chain.iter().all(|to| {
            SCALES.contains(&to.s) && to.p.is_finite() && to.p.length() <= FARTHEST_M && to.q.is_finite()
        });
        let scale: f32 = self.chain.iter().map(|to| to.s).product();
        let group = self.groups.get_mut(group);
        let was = group.is_whole;
        let last = group.moved_in.replace(self.batches);
        let is_soon = last.is_some_and(|last| self.batches - last <= SOON);
        group.is_whole = !is_empty && can && SCALES.contains(&scale) && (was || is_soon);
        was && group.is_whole
    }

    /// Transform from a space to world space.
    pub(super) fn place_of(&self, SpaceId(group): SpaceId) -> SpacePlace {
        self.groups.place_of(group as usize)
    }
}

impl Groups {
    /// Transform from a group's space to world space. The rounding error along the chain of groups is bounded step by
    /// step.
    pub(super) fn place_of(&self, group: usize) -> SpacePlace {
        let mut world = DAffine3::IDENTITY;
        // A corner at a distance of `r` metres from the group's origin has coordinates of at most `reach.0 * r +
        // reach.1`. Its distance from its exact position is at most `rounding.0 * r + rounding.1`.
        let (mut reach, mut rounding) = ((1.0, 0.0), (0.0, 0.0));
        let mut above = Some(group);
        while let Some(at) = above {
            let Transform { p, q, s } = self.transform(at);
            above = self.parent(at);
            let (scale, way) = (f64::from(s), p.as_dvec3());
            let turn = DMat3::from_quat(DQuat::from_xyzw(q.x.into(), q.y.into(), q.z.into(), q.w.into()));
            world = DAffine3 { matrix3: turn * DMat3::from_diagonal(DVec3::splat(scale)), translation: way }
                * world;
            reach = (reach.0 * scale, reach.1 * scale + way.length());
            rounding = (
                rounding.0 * scale + PLACE_ROUNDING * reach.0,
                rounding.1 * scale + PLACE_ROUNDING * reach.1,
            );
        }
        SpacePlace { world_from_space: world, rounding_m: rounding.1, rounding_per_m: rounding.0 }
    }
}
