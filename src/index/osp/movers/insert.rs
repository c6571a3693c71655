//! Insertion of polygons into the flat rows, one by one or block by block.

use super::{FEW_LEFT, MOST_SPARSE, Movers, OWN_GROUP};
use crate::{
    index::{
        osp::{
            groups::{id_in, lanes_of},
            rows::Rows,
            slots::Slot,
        },
        simd::Boxes,
    },
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};

impl Movers {
    /// Adds a polygon that is not in the rows.
    pub(in crate::index::osp) fn insert(&mut self, id: PolygonId, bounds: &Aabb) {
        let block = id.index() / BLOCK;
        self.count(block, 1);
        if let Some(group) = self.slots.own_group(block) {
            let lane = id.index() % BLOCK;
            self.own.lanes[group] |= 1 << lane;
            self.set_own(group, lane, bounds);
            return;
        }
        self.share(id, bounds);
        if self.slots.shared_in_block(block) > OWN_GROUP {
            self.give_own_group(block);
        }
    }

    /// Inserts a polygon; returns `false` if it is in the rows. If ids follow each other, the block gets a group of its own
    /// at once.
    pub(in crate::index::osp) fn insert_new(&mut self, id: PolygonId, bounds: &Aabb) -> bool {
        let (block, lane) = (id.index() / BLOCK, id.index() % BLOCK);
        let follows = id.0 == std::mem::replace(&mut self.next_id, id.0.wrapping_add(1));
        let group = match self.own_group(id) {
            Some(group) => group,
            None if follows => self.begin_group(block),
            None if self.slots.shared(id).is_some() => return false,
            None => {
                self.insert(id, bounds);
                return true;
            }
        };
        if self.own.lanes[group] >> lane & 1 == 1 {
            return false;
        }
        self.own.lanes[group] |= 1 << lane;
        self.set_own(group, lane, bounds);
        self.last_own = group;
        self.count(block, 1);
        true
    }

    /// Gives a block a group of its own. The next commit dissolves the group if few polygons are in it then.
    #[inline(never)]
    fn begin_group(&mut self, block: usize) -> usize {
        if self.sparse.len() + 1 >= MOST_SPARSE {
            self.dissolve_sparse();
        }
        self.sparse.push(block as u32);
        self.give_own_group(block);
        self.own.len() - 1
    }

    /// Moves the blocks of the plain list to the rows, which must be empty. Both are swapped, so that no box is copied.
    /// The polygons count as unmoved. Polygons of blocks with fewer than [`FEW_LEFT`] polygons go to shared groups.
    pub(in crate::index::osp) fn take_rows(&mut self, rows: &mut Rows) {
        std::mem::swap(&mut self.own, rows);
        self.own_moved.resize(self.own.len(), 0);
        for (group, (block, lanes, _)) in self.own.blocks().enumerate() {
            self.slots.set_own_group(block as usize, Some(group));
            self.len += lanes.count_ones() as usize;
            self.ids_end = self.ids_end.max((block as usize + 1) * BLOCK);
        }
        for group in (0..self.own.len()).rev() {
            if self.own.lanes[group].count_ones() < FEW_LEFT {
                self.give_up_group(group);
            }
        }
    }

    /// Puts a polygon into the last shared group.
    pub(super) fn share(&mut self, id: PolygonId, bounds: &Aabb) {
        if self.shared.lanes.last().is_none_or(|&lanes| lanes == u16::MAX) {
            self.shared.push();
            self.ids.push([0; BLOCK]);
        }
        let group = self.ids.len() - 1;
        let lane = self.shared.lanes[group].count_ones() as usize % BLOCK;
        self.shared.put(group, lane, bounds);
        self.ids[group][lane] = id.0;
        self.slots.set_shared(id, Some(Slot::shared(group, lane)));
        self.most = self.most.max(self.ids.len());
    }

    /// Undoes the swap of [`Movers::take_rows`] if both are empty, so that the list finds its written memory again.
    pub(in crate::index::osp) fn swap_memory(&mut self, rows: &mut Rows) {
        if self.own.len() == 0 && rows.len() == 0 {
            std::mem::swap(&mut self.own, rows);
        }
    }

    /// Adds polygons of a block that are not in the rows. They count as unmoved.
    pub(in crate::index::osp) fn insert_block(&mut self, block: u32, lanes: u16, boxes: &Boxes<BLOCK>) {
        let number = block as usize;
        if self.slots.own_group(number).is_none() && lanes.count_ones() as usize > OWN_GROUP {
            self.give_own_group(number);
        }
        let Some(group) = self.slots.own_group(number) else {
            for lane in lanes_of(lanes) {
                self.insert(id_in(block, lane), &boxes.get(lane));
            }
            return;
        };
        if self.own.lanes[group] == 0 {
            self.own.boxes[group] = *boxes;
        } else {
            for lane in lanes_of(lanes) {
                self.own.boxes[group].set(lane, &boxes.get(lane));
            }
        }
        self.own.lanes[group] |= lanes;
        self.own.mark_changed(group);
        self.count(number, lanes.count_ones());
    }

    /// Moves the polygons of a block from the shared groups to a group of its own.
    fn give_own_group(&mut self, block: usize) {
        let group = self.own.push(block as u32);
        self.own_moved.push(0);
        for lane in 0..BLOCK {
            // Slots are read one by one, because each removal moves another polygon, perhaps one of this block.
            let id = id_in(block as u32, lane);
            if let Some(slot) = self.slots.shared(id) {
                self.own.lanes[group] |= 1 << lane;
                self.set_own(group, lane, &self.shared.boxes[slot.group()].get(slot.lane()));
                self.unshare(id, slot);
            }
        }
        self.slots.set_own_group(block, Some(group));
    }
}
