//! Flat rows hold polygons outside the tree: moving polygons, the polygons of a former plain list, or all while many
//! change in each frame. Setting a new box writes six numbers; a query tests all boxes, sixteen at a time. `settle.rs`
//! moves polygons to the rows and back.
//!
//! A block of sixteen ids with many moving polygons has a group of its own, with a lane for each id. Polygons with
//! consecutive ids are therefore written and found together. Polygons of other blocks share groups in order of arrival.

mod insert;

use super::{
    groups::{Group, GroupIds, Groups, id_in, lanes_of},
    rows::Rows,
    slots::{Slot, Slots},
    tuning::LINEAR_BLOCKS,
};
use crate::{
    index::simd::{Boxes, Wide, prefetch_lines},
    math::Aabb,
    polygon::{BLOCK, PolygonId},
};

/// A block with more moving polygons than this gets a group of its own. With a smaller number, groups have more empty
/// lanes, which are tested without effect.
const OWN_GROUP: usize = 8;

/// A block loses its group when fewer polygons than this are left in it. It is at most half of [`OWN_GROUP`], so that
/// polygons that stop and start do not move between groups again and again.
const FEW_LEFT: u32 = 4;

/// A batch has many updates for each block if this number of updates has ids within two blocks.
const MANY_OF_BLOCK: usize = 8;

/// Largest number of additional groups to reserve memory for, because blocks may have gaps.
const MOST_GAPS: usize = 1 << 16;

/// Number of groups that hold `polygons` polygons with consecutive ids.
fn groups_for(polygons: usize) -> usize {
    (polygons / BLOCK + 1).max(LINEAR_BLOCKS)
}

/// Number of groups to reserve memory for if the blocks of `polygons` polygons have gaps. The plain list reserves as many,
/// because list and rows swap their memory.
pub(super) fn room_for(polygons: usize) -> usize {
    groups_for(polygons) + groups_for(polygons).min(MOST_GAPS)
}

/// The moving polygons, by id, with their boxes.
#[derive(Clone, Debug)]
pub(super) struct Movers {
    slots: Slots,
    /// The groups of one block each. The box around a block is valid until a polygon of the block changes.
    own: Rows,
    /// For each group of one block, the lanes that were added or moved since the group was last examined.
    own_moved: Vec<u16>,
    /// The groups of polygons of any blocks, all full except the last.
    shared: Groups,
    /// For each shared group, the ids of its polygons.
    ids: Vec<[u32; BLOCK]>,
    /// Guess of the shared slot that gets the next new box. Polygons that move together mostly have slots in the order of
    /// their updates, or in the reverse order. A right guess saves a read from the large table `slots`.
    guess: Slot,
    /// The shared slot updated last.
    last: Slot,
    /// Expected step to the next slot: 1, or -1 as a wrapping number.
    step: u32,
    /// The group of one block in which a single polygon was last inserted, removed, or got a new box.
    last_own: usize,
    /// The id after the polygon that [`Movers::insert_new`] inserted last.
    next_id: u32,
    len: usize,
    /// Upper bound of all ids since the rows were last empty.
    ids_end: usize,
    /// Largest number of shared groups so far. [`Movers::bytes`] counts only memory that was written to, because the system
    /// has not committed the rest.
    most: usize,
    /// Numbers of shared groups and of groups of one block that the current round of [`Movers::take_resting`] has not
    /// examined yet. These are the first groups of each kind.
    unexamined: [usize; 2],
    /// The blocks whose groups lost polygons and have few left. The next commit dissolves such groups.
    sparse: Vec<u32>,
}

/// In rows of more blocks than this, boxes are prefetched [`AHEAD`] updates before their own.
const MOST_CACHED: usize = 1 << 14;
const AHEAD: usize = 8;
/// Largest number of sparse groups that wait for a commit.
const MOST_SPARSE: usize = 256;

impl Movers {
    /// Empty rows with room for `polygons` polygons with consecutive ids.
    pub(super) fn with_room_for(polygons: usize) -> Self {
        let polygons = if cfg!(target_family = "wasm") { 0 } else { polygons };
        let groups = groups_for(polygons);
        let mut movers = Self {
            // Polygons that replace others have new ids, so twice as many ids are needed.
            slots: Slots::with_room_for(2 * polygons),
            own: Rows::with_room_for(0, room_for(polygons)),
            own_moved: Vec::with_capacity(room_for(polygons)),
            shared: Groups::with_room_for(groups),
            ids: Vec::with_capacity(groups),
            guess: Slot::shared(0, 0),
            last: Slot::shared(0, 0),
            step: 1,
            last_own: 0,
            next_id: 0,
            len: 0,
            ids_end: 0,
            most: 0,
            unexamined: [0; 2],
            sparse: Vec::with_capacity(MOST_SPARSE),
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

    pub(super) fn clear(&mut self) {
        self.slots.clear(self.ids_end);
        self.own.clear();
        self.own_moved.clear();
        self.shared.truncate(0);
        self.ids.clear();
        self.sparse.clear();
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

    /// Memory held, bytes, without memory that was never written to.
    pub(super) fn bytes(&self) -> usize {
        self.most * (size_of::<Boxes<BLOCK>>() + 2 * size_of::<u16>() + size_of::<[u32; BLOCK]>())
            + self.own.bytes()
            + self.own_moved.len() * size_of::<u16>()
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
        match self.own_group(id) {
            Some(group) => self.own_slot(id, group),
            None => self.slots.shared(id),
        }
    }

    /// The group of its own that the block of a polygon has.
    #[inline(always)]
    fn own_group(&self, id: PolygonId) -> Option<usize> {
        if self.own.numbers.get(self.last_own) == Some(&(id.0 / BLOCK as u32)) {
            return Some(self.last_own);
        }
        self.slots.own_group(id.index() / BLOCK)
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

    /// Sets the box of the polygon in a slot.
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
        self.own.mark_changed(group);
        self.own_moved[group] |= 1 << lane;
    }

    /// Sets new boxes in order, up to the first polygon that is not in the rows or the first invalid box. Returns the
    /// number of boxes set.
    pub(super) fn update_first(&mut self, updates: &[(PolygonId, Aabb)]) -> usize {
        let mut at = 0;
        while let Some((id, bounds)) = updates.get(at) {
            match self.slot(*id) {
                Some(slot) if slot.is_own() => {
                    let rest = &updates[at..];
                    let is_dense = rest
                        .get(MANY_OF_BLOCK)
                        .is_some_and(|(other, _)| other.0.wrapping_sub(id.0) < 2 * BLOCK as u32);
                    let count = if is_dense {
                        let (moved, count) = self.own.set_first(slot.group(), rest);
                        self.own_moved[slot.group()] |= moved;
                        count
                    } else if self.own.len() > MOST_CACHED {
                        self.update_each_own::<true>(rest)
                    } else {
                        self.update_each_own::<false>(rest)
                    };
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

    /// Does the same as [`Movers::update_first`] for polygons of groups of one block each. The loop has no branch for
    /// the next block, which a processor could not predict.
    #[inline(never)]
    fn update_each_own<const IS_LARGE: bool>(&mut self, updates: &[(PolygonId, Aabb)]) -> usize {
        let (lanes, boxes, changed) = self.own.columns();
        let (boxes, changed) = (&mut boxes[..lanes.len()], &mut changed[..lanes.len()]);
        let moved = &mut self.own_moved[..lanes.len()];
        for (at, (id, bounds)) in updates.iter().enumerate() {
            if IS_LARGE
                && let Some((ahead, _)) = updates.get(at + AHEAD)
                && let Some(group) = self.slots.own_group(ahead.index() / BLOCK)
            {
                prefetch_lines::<6, _>(boxes.as_ptr().wrapping_add(group));
            }
            let lane = id.index() % BLOCK;
            match self.slots.own_group(id.index() / BLOCK) {
                Some(group)
                    if lanes.get(group).is_some_and(|lanes| lanes >> lane & 1 == 1)
                        && Wide::from_box(bounds).is_valid() =>
                {
                    boxes[group].set(lane, bounds);
                    moved[group] |= 1 << lane;
                    changed[group] = 1;
                }
                _ => return at,
            }
        }
        updates.len()
    }

    /// Removes a polygon from the shared groups. The last shared polygon moves to its slot.
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

    /// Dissolves a block's own group. Its polygons go to the shared groups.
    fn give_up_group(&mut self, group: usize) {
        let (block, lanes, boxes) = self.own.block(group);
        let boxes = *boxes;
        self.remove_group(group);
        // The groups and the lanes are examined in reverse order, so the ids are in descending order.
        for lane in (0..BLOCK).rev().filter(|lane| lanes >> lane & 1 == 1) {
            self.share(id_in(block, lane), &boxes.get(lane));
        }
    }

    /// Removes a block's own group with its polygons. The last group moves to its position.
    fn remove_group(&mut self, group: usize) {
        self.slots.set_own_group(self.own.numbers[group] as usize, None);
        self.own.swap_remove(group);
        self.own_moved.swap_remove(group);
        if let Some(&block) = self.own.numbers.get(group) {
            self.slots.set_own_group(block as usize, Some(group));
        }
    }

    /// Removes a polygon; returns `false` if it is not in the rows.
    #[inline]
    pub(super) fn remove(&mut self, id: PolygonId) -> bool {
        if self.len == 0 {
            return false;
        }
        if let Some(group) = self.own_group(id) {
            let lane = id.index() % BLOCK;
            if self.own.lanes[group] >> lane & 1 == 0 {
                return false;
            }
            self.last_own = group;
            self.drop_lane(group, lane);
        } else {
            let Some(slot) = self.slots.shared(id) else { return false };
            self.unshare(id, slot);
        }
        self.uncount(1);
        if self.len == 0 {
            self.dissolve_sparse();
        }
        true
    }

    /// Removes a polygon of a group of one block. The group stays until the commit.
    #[inline]
    fn drop_lane(&mut self, group: usize, lane: usize) {
        self.own.lanes[group] &= !(1 << lane);
        self.own_moved[group] &= !(1 << lane);
        if self.own.lanes[group].count_ones() == FEW_LEFT - 1 {
            self.sparse.push(self.own.numbers[group]);
            if self.sparse.len() == MOST_SPARSE {
                self.dissolve_sparse();
            }
        }
    }

    /// Work of a commit: dissolves the groups that have few polygons left, and computes boxes around changed blocks.
    pub(super) fn commit(&mut self) {
        self.dissolve_sparse();
        self.own.refresh_some();
    }

    #[inline(never)]
    fn dissolve_sparse(&mut self) {
        while let Some(block) = self.sparse.pop() {
            if let Some(group) = self.slots.own_group(block as usize) {
                self.remove_lanes(group, 0);
            }
        }
    }

    /// Counts polygons that were added to a block.
    fn count(&mut self, block: usize, added: u32) {
        self.len += added as usize;
        self.ids_end = self.ids_end.max((block + 1) * BLOCK);
    }

    fn uncount(&mut self, removed: usize) {
        self.len -= removed;
        if self.len == 0 {
            self.ids_end = 0;
        }
    }

    /// Removes the polygons `lanes` of a group of one block. The caller updates `len`.
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

    /// Number of polygons that were added or moved since their group was last examined, or since
    /// [`Movers::forget_moves`].
    pub(super) fn moved_count(&self) -> usize {
        let count = |moved: &[u16]| moved.iter().map(|lanes| lanes.count_ones() as usize).sum::<usize>();
        count(&self.own_moved) + count(&self.shared.moved)
    }

    /// Counts all polygons as unmoved.
    pub(super) fn forget_moves(&mut self) {
        self.own_moved.fill(0);
        self.shared.moved.fill(0);
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
            let boxes = self.shared.boxes[at];
            for lane in lanes_of(lanes) {
                let id = PolygonId(ids[lane]);
                resting[count] = (id, boxes.get(lane));
                count += usize::from(self.remove(id));
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
            let is_sparse = matches!(group.ids, GroupIds::Block(block) if self.sparse.contains(&block));
            let least = if is_sparse {
                0
            } else if is_shared {
                1
            } else {
                FEW_LEFT
            };
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
