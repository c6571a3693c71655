//! Flat rows beside the tree for polygons that move again and again. Setting a new box writes six numbers; a query
//! tests all boxes, sixteen at a time. `settle.rs` moves polygons to the rows and back.
//!
//! A block of sixteen ids with many moving polygons has a group of its own, with a lane for each id. So polygons with
//! consecutive ids are written and found together. Polygons of other blocks share groups in order of arrival.

use super::{
    rows::Rows,
    slots::{Slot, Slots},
    tuning::LINEAR_BLOCKS,
};
use crate::{
    index::simd::{Boxes, Wide},
    math::Aabb,
    polygon::{BLOCK, PolygonId, bits},
};

/// A block with more moving polygons than this gets a group of its own. With a smaller number, groups have more empty
/// lanes, which are tested without effect.
const OWN_GROUP: usize = 8;

/// A block loses its group when fewer polygons than this are left in it. It is at most half of [`OWN_GROUP`], so that
/// polygons that stop and start do not move between groups again and again.
const FEW_LEFT: u32 = 4;

/// The moving polygons, by id, with their boxes.
#[derive(Clone, Debug)]
pub(super) struct Movers {
    slots: Slots,
    /// The groups of one block each. A block that has not moved since it was in the plain list keeps the box around it.
    own: Rows,
    /// For each group of one block, the lanes that were added or moved since the group was last examined.
    own_moved: Vec<u16>,
    /// The groups of polygons of any blocks, all full except the last, and the ids of these polygons.
    shared: Groups,
    ids: Vec<[u32; BLOCK]>,
    /// Guess of the shared slot that gets the next new box. Polygons that move together mostly have slots in the order of
    /// their updates, or in the reverse order. A right guess saves a read from the large table `slots`.
    guess: Slot,
    /// The shared slot that last got a new box, and the expected distance of the next one: 1, or -1 as a wrapping number.
    last: Slot,
    step: u32,
    /// The group of one block in which a single polygon last got a new box.
    last_own: usize,
    len: usize,
    /// Upper bound of all ids since the rows were last empty.
    ids_end: usize,
    /// Largest number of shared groups, and of ids so far. The system commits memory only when the memory is written to.
    most: [usize; 2],
    /// Number of shared groups, and of groups of one block, that this round has not examined yet. These are the
    /// first groups of each kind.
    unexamined: [usize; 2],
}

/// Groups of sixteen lanes, with polygons of any blocks.
#[derive(Clone, Debug)]
struct Groups {
    boxes: Vec<Boxes<BLOCK>>,
    /// For each group, the lanes in use. Other lanes have unspecified boxes.
    lanes: Vec<u16>,
    /// For each group, the lanes that were added or moved since the group was last examined.
    moved: Vec<u16>,
}

impl Groups {
    fn with_room_for(groups: usize) -> Self {
        let (boxes, lanes) = (Vec::with_capacity(groups), Vec::with_capacity(groups));
        Self { boxes, lanes, moved: Vec::with_capacity(groups) }
    }

    fn push(&mut self) {
        self.boxes.push(Boxes::EMPTY);
        self.lanes.push(0);
        self.moved.push(0);
    }

    #[inline(always)]
    fn set(&mut self, group: usize, lane: usize, bounds: &Aabb) {
        self.boxes[group].set(lane % BLOCK, bounds);
        self.moved[group] |= 1 << lane;
    }

    /// Sets a lane that was not in use.
    fn put(&mut self, group: usize, lane: usize, bounds: &Aabb) {
        self.lanes[group] |= 1 << lane;
        self.set(group, lane, bounds);
    }

    fn truncate(&mut self, groups: usize) {
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
fn id_in(block: u32, lane: usize) -> PolygonId {
    GroupIds::Block(block).id(lane)
}

fn lanes_of(mask: u16) -> impl Iterator<Item = usize> {
    bits::bits_of(u64::from(mask))
}

impl Movers {
    /// Empty rows with room for `polygons` polygons with consecutive ids.
    pub(super) fn with_room_for(polygons: usize) -> Self {
        // In a browser, reserved memory counts as used.
        let polygons = if cfg!(target_family = "wasm") { 0 } else { polygons };
        let groups = (polygons / BLOCK + 1).max(LINEAR_BLOCKS);
        let mut movers = Self {
            // Polygons that replace others have new ids, so twice as many ids are needed.
            slots: Slots::with_room_for(2 * polygons),
            own: Rows::with_room_for(0, groups),
            own_moved: Vec::with_capacity(groups),
            shared: Groups::with_room_for(groups),
            ids: Vec::with_capacity(groups),
            guess: Slot::shared(0, 0),
            last: Slot::shared(0, 0),
            step: 1,
            last_own: 0,
            len: 0,
            ids_end: 0,
            most: [0; 2],
            unexamined: [0; 2],
        };
        if polygons > 0 {
            // The memory for a plain list is written to here, so that no frame waits until the system commits it.
            for block in 0..LINEAR_BLOCKS {
                movers.own_moved.push(0);
                movers.slots.set_own_group(block, Some(block));
            }
            movers.ids_end = LINEAR_BLOCKS * BLOCK;
            movers.clear();
        }
        movers
    }

    /// Frees the boxes of a long list whose polygons are all in the tree now. Reserves room for the same number.
    pub(super) fn give_boxes_back(&mut self) {
        self.own.give_boxes_back(LINEAR_BLOCKS);
    }

    pub(super) fn clear(&mut self) {
        self.slots.clear(self.ids_end);
        self.own.clear();
        self.own_moved.clear();
        self.shared.truncate(0);
        self.ids.clear();
        (self.len, self.ids_end, self.unexamined) = (0, 0, [0; 2]);
    }

    /// Number of polygons in the rows.
    #[inline]
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Upper bound of the ids of all polygons in the rows.
    pub(super) fn ids_end(&self) -> usize {
        self.ids_end
    }

    /// Memory held, bytes. Room that was never written to does not count, because the system has not committed it.
    pub(super) fn bytes(&self) -> usize {
        let [shared, ids] = self.most;
        shared * (size_of::<Boxes<BLOCK>>() + 2 * size_of::<u16>() + size_of::<[u32; BLOCK]>())
            + self.own.bytes()
            + self.own_moved.len() * size_of::<u16>()
            + ids * size_of::<u32>()
            + self.slots.bytes()
    }

    /// The slot of a polygon, if it is in the rows.
    #[inline(always)]
    pub(super) fn slot(&self, id: PolygonId) -> Option<Slot> {
        if self.len == 0 {
            return None;
        }
        if let Some(slot) = self.guessed(id) {
            return Some(slot);
        }
        if self.own.numbers.get(self.last_own) == Some(&(id.0 / BLOCK as u32)) {
            return self.own_slot(id, self.last_own);
        }
        match self.slots.own_group(id.index() / BLOCK) {
            Some(group) => self.own_slot(id, group),
            None => self.slots.shared(id),
        }
    }

    /// The slot of a polygon, if it is the guess.
    #[inline(always)]
    fn guessed(&self, id: PolygonId) -> Option<Slot> {
        let (group, lane) = (self.guess.group(), self.guess.lane());
        let is_of_id = self.ids.get(group).is_some_and(|ids| ids[lane] == id.0);
        (is_of_id && self.shared.lanes[group] >> lane & 1 == 1).then_some(self.guess)
    }

    /// The slot of a polygon in its block's own group.
    #[inline(always)]
    fn own_slot(&self, id: PolygonId, group: usize) -> Option<Slot> {
        let lane = id.index() % BLOCK;
        (self.own.lanes[group] >> lane & 1 == 1).then(|| Slot::own(group, lane))
    }

    pub(super) fn bounds(&self, id: PolygonId) -> Option<Aabb> {
        let slot = self.slot(id)?;
        let boxes = if slot.is_own() { &self.own.boxes } else { &self.shared.boxes };
        Some(boxes[slot.group()].get(slot.lane()))
    }

    /// Gives the polygon at a slot a new box.
    #[inline(always)]
    pub(super) fn set(&mut self, slot: Slot, bounds: &Aabb) {
        if slot.is_own() {
            self.set_own(slot.group(), slot.lane(), bounds);
            self.last_own = slot.group();
            return;
        }
        self.shared.set(slot.group(), slot.lane(), bounds);
        if slot != self.guess {
            self.step = if slot.after(1) == self.last { u32::MAX } else { 1 };
        }
        (self.last, self.guess) = (slot, slot.after(self.step));
    }

    #[inline(always)]
    fn set_own(&mut self, group: usize, lane: usize, bounds: &Aabb) {
        self.own.boxes[group].set(lane % BLOCK, bounds);
        self.note_moved(group, 1 << lane);
    }

    #[inline(always)]
    fn note_moved(&mut self, group: usize, lanes: u16) {
        let moved = &mut self.own_moved[group];
        if *moved == 0 {
            self.own.mark_changed(group);
        }
        *moved |= lanes;
    }

    /// Sets new boxes in order, up to the first polygon that is not in the rows or the first invalid box. Returns the
    /// number of boxes set.
    pub(super) fn update_first(&mut self, updates: &[(PolygonId, Aabb)]) -> usize {
        let mut at = 0;
        while let Some((id, bounds)) = updates.get(at) {
            match self.slot(*id) {
                Some(slot) if slot.is_own() => {
                    let count = self.update_own(slot.group(), &updates[at..]);
                    at += count;
                    if count == 0 {
                        break;
                    }
                }
                Some(slot) if Wide::from_box(bounds).is_valid() => {
                    self.set(slot, bounds);
                    at += 1;
                }
                _ => break,
            }
        }
        at
    }

    /// Does the same as [`Movers::update_first`] for the polygons of a group of one block.
    #[inline(always)]
    fn update_own(&mut self, group: usize, updates: &[(PolygonId, Aabb)]) -> usize {
        let (boxes, there, block) =
            (&mut self.own.boxes[group], self.own.lanes[group], self.own.numbers[group]);
        let (mut moved, mut count) = (0, 0);
        for (id, bounds) in updates {
            let lane = id.index() % BLOCK;
            let is_there = id.0 / BLOCK as u32 == block && there >> lane & 1 == 1;
            if !(is_there && Wide::from_box(bounds).is_valid()) {
                break;
            }
            boxes.set(lane, bounds);
            moved |= 1 << lane;
            count += 1;
        }
        self.note_moved(group, moved);
        count
    }

    /// Adds a polygon that is not in the rows.
    pub(super) fn insert(&mut self, id: PolygonId, bounds: &Aabb) {
        let block = id.index() / BLOCK;
        self.len += 1;
        self.ids_end = self.ids_end.max((block + 1) * BLOCK);
        self.most[1] = self.most[1].max(self.ids_end);
        if let Some(group) = self.slots.own_group(block) {
            let lane = id.index() % BLOCK;
            self.own.lanes[group] |= 1 << lane;
            self.set_own(group, lane, bounds);
            return;
        }
        self.share(id, bounds);
        let ids = (block * BLOCK..(block + 1) * BLOCK).map(|id| PolygonId(id as u32));
        if ids.filter(|&id| self.slots.shared(id).is_some()).count() > OWN_GROUP {
            self.give_own_group(block);
        }
    }

    /// Takes over the blocks of the plain list if the rows are empty. They are swapped with the empty rows, so no box is
    /// copied. The polygons count as unmoved. The polygons of blocks with few lanes go to shared groups.
    pub(super) fn take_rows(&mut self, rows: &mut Rows) {
        std::mem::swap(&mut self.own, rows);
        self.own_moved.resize(self.own.len(), 0);
        for (group, (block, lanes, _)) in self.own.blocks().enumerate() {
            self.slots.set_own_group(block as usize, Some(group));
            self.len += lanes.count_ones() as usize;
            self.ids_end = self.ids_end.max((block as usize + 1) * BLOCK);
        }
        self.most[1] = self.most[1].max(self.ids_end);
        for group in (0..self.own.len()).rev() {
            if self.own.lanes[group].count_ones() < FEW_LEFT {
                self.give_up_group(group);
            }
        }
    }

    /// Puts a polygon into the last shared group.
    fn share(&mut self, id: PolygonId, bounds: &Aabb) {
        if self.shared.lanes.last().is_none_or(|&lanes| lanes == u16::MAX) {
            self.shared.push();
            self.ids.push([0; BLOCK]);
        }
        let group = self.ids.len() - 1;
        let lane = self.shared.lanes[group].count_ones() as usize % BLOCK;
        self.shared.put(group, lane, bounds);
        self.ids[group][lane] = id.0;
        self.slots.set_shared(id, Some(Slot::shared(group, lane)));
        self.most[0] = self.most[0].max(self.ids.len());
    }

    /// Removes a polygon from the shared groups. The last polygon takes its slot.
    fn unshare(&mut self, id: PolygonId, slot: Slot) {
        self.slots.set_shared(id, None);
        let last = self.ids.len() - 1;
        let lane = self.shared.lanes[last].count_ones() as usize - 1;
        let (to, to_lane) = (slot.group(), slot.lane());
        if (to, to_lane) != (last, lane) {
            let id = self.ids[last][lane];
            let bounds = self.shared.boxes[last].get(lane);
            self.shared.boxes[to].set(to_lane, &bounds);
            let moved = self.shared.moved[last] >> lane & 1;
            self.shared.moved[to] = self.shared.moved[to] & !(1 << to_lane) | moved << to_lane;
            self.ids[to][to_lane] = id;
            self.slots.set_shared(PolygonId(id), Some(slot));
        }
        self.shared.lanes[last] &= !(1 << lane);
        self.shared.moved[last] &= !(1 << lane);
        if lane == 0 {
            self.shared.truncate(last);
            self.ids.pop();
        }
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

    /// Dissolves a block's own group. Its polygons go to the shared groups.
    fn give_up_group(&mut self, group: usize) {
        let (block, lanes, boxes) = self.own.block(group);
        let boxes = *boxes;
        self.remove_group(group);
        // Groups are examined from the last to the first, so the reverse order of lanes makes one order of all ids.
        for lane in (0..BLOCK).rev().filter(|lane| lanes >> lane & 1 == 1) {
            self.share(id_in(block, lane), &boxes.get(lane));
        }
    }

    /// Removes a block's own group with its polygons. The last group takes its position.
    fn remove_group(&mut self, group: usize) {
        self.slots.set_own_group(self.own.numbers[group] as usize, None);
        self.own.swap_remove(group);
        self.own_moved.swap_remove(group);
        if let Some(&block) = self.own.numbers.get(group) {
            self.slots.set_own_group(block as usize, Some(group));
        }
    }

    /// Removes a polygon; returns its box, or `None` if it was not in the rows.
    pub(super) fn remove(&mut self, id: PolygonId) -> Option<Aabb> {
        let (slot, bounds) = (self.slot(id)?, self.bounds(id));
        if slot.is_own() {
            self.remove_lanes(slot.group(), 1 << slot.lane());
        } else {
            self.unshare(id, slot);
        }
        self.uncount(1);
        bounds
    }

    fn uncount(&mut self, removed: usize) {
        self.len -= removed;
        if self.len == 0 {
            self.ids_end = 0;
        }
    }

    /// Removes polygons of a group of one block. Does not count them.
    fn remove_lanes(&mut self, group: usize, lanes: u16) {
        self.own.lanes[group] &= !lanes;
        self.own_moved[group] &= !lanes;
        match self.own.lanes[group].count_ones() {
            0 => self.remove_group(group),
            1..FEW_LEFT => self.give_up_group(group),
            _ => {}
        }
    }

    #[inline(always)]
    pub(super) fn group_count(&self) -> usize {
        self.ids.len() + self.own.len()
    }

    /// All groups, the shared ones first.
    #[inline(always)]
    pub(super) fn groups(&self) -> impl Iterator<Item = Group<'_>> {
        let (ids, lanes, boxes) = self.shared_rows();
        let shared = ids.iter().map(GroupIds::Each).zip(lanes).zip(boxes);
        let shared = shared.map(|((ids, &lanes), boxes)| Group { boxes, lanes, ids });
        let own = self.own.blocks();
        shared.chain(own.map(|(block, lanes, boxes)| Group { boxes, lanes, ids: GroupIds::Block(block) }))
    }

    /// The groups of one block each.
    #[inline(always)]
    pub(super) fn own_rows(&self) -> &Rows {
        &self.own
    }

    /// The shared groups: ids, lanes in use, boxes.
    #[inline(always)]
    pub(super) fn shared_rows(&self) -> (&[[u32; BLOCK]], &[u16], &[Boxes<BLOCK>]) {
        (&self.ids, &self.shared.lanes, &self.shared.boxes)
    }

    /// Starts a round in which every group is examined once.
    pub(super) fn begin_round(&mut self) {
        self.unexamined = [self.ids.len(), self.own.len()];
    }

    /// Whether all groups were examined in this round.
    pub(super) fn is_round_over(&self) -> bool {
        self.unexamined == [0; 2]
    }

    /// Examines the next group. Removes the polygons that have not moved since its last examination, and writes them to
    /// `resting`. Returns their number.
    pub(super) fn take_resting(&mut self, resting: &mut [(PolygonId, Aabb); BLOCK]) -> usize {
        let mut count = 0;
        // Groups are examined from the last to the first, so a polygon that fills a gap has been examined already.
        let [shared, own] = self.unexamined;
        if let Some(at) = own.checked_sub(1) {
            self.unexamined = [shared, at];
            let Some(moved) = self.own_moved.get_mut(at) else { return 0 };
            let (block, lanes, boxes) = self.own.block(at);
            let lanes = lanes & !std::mem::take(moved);
            for lane in lanes_of(lanes) {
                resting[count] = (id_in(block, lane), boxes.get(lane));
                count += 1;
            }
            self.remove_lanes(at, lanes);
            self.uncount(count);
        } else {
            let at = shared.max(1) - 1;
            self.unexamined = [at, 0];
            let Some(moved) = self.shared.moved.get_mut(at) else { return 0 };
            let (ids, lanes) = (self.ids[at], self.shared.lanes[at] & !std::mem::take(moved));
            for lane in lanes_of(lanes) {
                let id = PolygonId(ids[lane]);
                let Some(bounds) = self.remove(id) else { continue };
                resting[count] = (id, bounds);
                count += 1;
            }
        }
        count
    }

    /// Checks the invariants; for tests.
    pub(super) fn check(&self) -> Result<(), String> {
        self.own.check()?;
        let mut found = 0;
        for (at, group) in self.groups().enumerate() {
            found += group.lanes.count_ones() as usize;
            let is_shared = at < self.ids.len();
            let least = if is_shared { 1 } else { FEW_LEFT };
            if group.lanes.count_ones() < least {
                return Err(format!("group {at} of what moves has the lanes {:b}", group.lanes));
            }
            if is_shared && at + 1 < self.ids.len() && group.lanes != u16::MAX {
                return Err(format!("shared group {at} is not full and not the last"));
            }
            for lane in lanes_of(group.lanes) {
                let id = group.ids.id(lane);
                let slot = match at.checked_sub(self.ids.len()) {
                    None => Slot::shared(at, lane),
                    Some(at) => Slot::own(at, lane),
                };
                if self.slot(id) != Some(slot) {
                    return Err(format!("polygon {} moves at another place", id.0));
                }
                if !group.boxes.get(lane).is_valid() || id.index() >= self.ids_end {
                    return Err(format!("polygon {} moves with a wrong box or number", id.0));
                }
            }
        }
        if found != self.len {
            return Err(format!("{found} polygons in groups of what moves, {} counted", self.len));
        }
        Ok(())
    }
}
