//! The groups of the flat rows: sixteen lanes with boxes, and the ids of their polygons.

use crate::{
    index::simd::Boxes,
    math::Aabb,
    polygon::{BLOCK, PolygonId, bits},
};

/// Groups of sixteen lanes, with polygons of any blocks.
#[derive(Clone, Debug)]
pub(super) struct Groups {
    pub(super) boxes: Vec<Boxes<BLOCK>>,
    /// For each group, the lanes in use. Other lanes have unspecified boxes.
    pub(super) lanes: Vec<u16>,
    /// For each group, the lanes that were added or moved since the group was last examined.
    pub(super) moved: Vec<u16>,
}

impl Groups {
    pub(super) fn with_room_for(groups: usize) -> Self {
        let (boxes, lanes) = (Vec::with_capacity(groups), Vec::with_capacity(groups));
        Self { boxes, lanes, moved: Vec::with_capacity(groups) }
    }

    pub(super) fn push(&mut self) {
        self.boxes.push(Boxes::EMPTY);
        self.lanes.push(0);
        self.moved.push(0);
    }

    #[inline(always)]
    pub(super) fn set(&mut self, group: usize, lane: usize, bounds: &Aabb) {
        self.boxes[group].set(lane % BLOCK, bounds);
        self.moved[group] |= 1 << lane;
    }

    /// Sets a lane that was not in use.
    pub(super) fn put(&mut self, group: usize, lane: usize, bounds: &Aabb) {
        self.lanes[group] |= 1 << lane;
        self.set(group, lane, bounds);
    }

    pub(super) fn truncate(&mut self, groups: usize) {
        self.boxes.truncate(groups);
        self.lanes.truncate(groups);
        self.moved.truncate(groups);
    }
}

/// A group of sixteen lanes, and the ids of its polygons.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group<'a> {
    pub(super) boxes: &'a Boxes<BLOCK>,
    pub(super) lanes: u16,
    pub(super) ids: GroupIds<'a>,
}

/// The ids of a group.
#[derive(Clone, Copy, Debug)]
pub(super) enum GroupIds<'a> {
    /// The consecutive ids of a block with this number.
    Block(u32),
    Each(&'a [u32; BLOCK]),
}

impl GroupIds<'_> {
    #[inline]
    pub(super) fn id(self, lane: usize) -> PolygonId {
        PolygonId(match self {
            Self::Block(block) => block * BLOCK as u32 + lane as u32,
            Self::Each(ids) => ids[lane % BLOCK],
        })
    }
}

/// The id of a lane of a block.
pub(super) fn id_in(block: u32, lane: usize) -> PolygonId {
    GroupIds::Block(block).id(lane)
}

pub(super) fn lanes_of(mask: u16) -> impl Iterator<Item = usize> {
    bits::bits_of(u64::from(mask))
}
