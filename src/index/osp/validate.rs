//! Checks every invariant of the tree, from the top down, for tests.

use super::{
    grid::{self, Grid, TOP_SHIFT},
    index::Osp,
    layout::{Bucket, Link, OWN, Target},
    pool::NONE,
    shelf::{Around, BLOCKS},
};
use crate::{index::simd::lanes_of, math::Aabb};

/// Counts of a part of the tree.
#[derive(Default)]
struct Found {
    nodes: u32,
    buckets: u32,
    pages: u32,
    runs: u32,
    polygons: u32,
}

/// Returns an error that names the place and the condition.
macro_rules! ensure {
    ($place:literal, $condition:expr) => {
        if !$condition {
            return Err(format!("{}: expected {}", format_args!($place), stringify!($condition)));
        }
    };
}

impl Osp {
    pub(super) fn check(&self) -> Result<(), String> {
        self.check_store()?;
        let top = &self.nodes[self.top];
        ensure!("the top", top.parent == NONE && top.shift <= TOP_SHIFT);
        let mut found = Found::default();
        self.check_node(self.top, &mut found)?;
        let (mut at, mut released) = (self.queue, 0);
        while at != NONE {
            let page = &self.pages[at];
            ensure!("page {at} of the queue", page.queued);
            released += u32::from(page.bucket == NONE);
            at = page.next;
        }
        let (nodes, buckets, pages) = (self.nodes.live(), self.buckets.live(), self.pages.live());
        ensure!("the tree", found.nodes == nodes && found.buckets == buckets);
        ensure!("the tree", found.pages + released == pages);
        ensure!("the tree", self.store.filed() == found.polygons as usize);
        if let Some(entry) = Grid::flat_entry(self.flat_levels, &top.key, top.shift) {
            ensure!("preallocated cell {entry}", Link::from_bits(self.flat[entry]) == Link::node(self.top));
        }
        let linked = self.flat.iter().filter(|&&bits| Link::from_bits(bits) != Link::NONE).count();
        ensure!("the preallocated cells", linked == self.count_flat(self.top));
        Ok(())
    }

    /// Checks the masks and boxes of the store.
    fn check_store(&self) -> Result<(), String> {
        let (mut polygons, mut blocks, mut unfiled, mut shelves) = (0, 0, 0, 0);
        let at = |around: &Around, lane: usize| {
            [around.used, around.unfiled, around.stale].map(|mask| mask >> lane & 1 == 1)
        };
        let any = |around: &Around| [around.used, around.unfiled, around.stale].map(|mask| mask != 0);
        for (first, shelf) in self.store.shelves() {
            let entry = first as usize / BLOCKS;
            let (top, of_shelf) = (&self.store.tops[entry / 16], &shelf.top);
            ensure!("shelf {entry}", at(top, entry % 16) == any(of_shelf));
            shelves += u32::from(of_shelf.used != 0);
            for (group, around) in shelf.groups.iter().enumerate() {
                ensure!("group {group} of shelf {entry}", at(of_shelf, group) == any(around));
                let mut of_blocks = Aabb::EMPTY;
                for lane in 0..16 {
                    let block = group * 16 + lane;
                    let (live, filed, moved) = (shelf.live[block], shelf.filed[block], shelf.moved[block]);
                    let [is_used, is_unfiled, is_stale] = at(around, lane);
                    ensure!("block {block}", (filed | moved) & !live == 0);
                    ensure!("block {block}", (is_used, is_unfiled) == (live != 0, live != filed));
                    let is_waiting = shelf.waiting[group] >> lane & 1 == 1;
                    ensure!("block {block}", live == filed || is_waiting || !self.residence.is_tree_needed);
                    if live == 0 {
                        continue;
                    }
                    let bounds = self.store.boxes_of(shelf, block).around(live.into());
                    ensure!("block {block}", is_stale || around.boxes.get(lane).contains(&bounds));
                    of_blocks = of_blocks.union(&around.boxes.get(lane));
                    (polygons, blocks) = (polygons + live.count_ones() as usize, blocks + 1);
                    unfiled += usize::from(live != filed);
                }
                let is_stale = around.stale != 0;
                ensure!("group {group}", is_stale || of_shelf.boxes.get(group).contains(&of_blocks));
            }
            let of_groups = of_shelf.boxes.around(of_shelf.used.into());
            ensure!("shelf {entry}", of_shelf.stale != 0 || top.boxes.get(entry % 16).contains(&of_groups));
        }
        ensure!("the store", shelves == self.store.tops.iter().map(|top| top.used.count_ones()).sum::<u32>());
        let counted = (self.store.len(), self.store.blocks(), self.store.unfiled_blocks());
        ensure!("the store", (polygons, blocks, unfiled) == counted);
        Ok(())
    }

    /// Number of preallocated cells that agree with a link of the tree.
    fn count_flat(&self, number: u32) -> usize {
        let node = &self.nodes[number];
        let has = |key: &grid::Key, shift: u32, link: Link| {
            let entry = Grid::flat_entry(self.flat_levels, key, shift);
            usize::from(entry.is_some_and(|entry| self.flat[entry] == link.to_bits()))
        };
        let mut count = if number == self.top { has(&node.key, node.shift, Link::node(number)) } else { 0 };
        for (slot, &link) in (0..).zip(&node.children).filter(|(_, link)| **link != Link::NONE) {
            count += has(&self.cell_of_slot(number, slot), node.shift - 1, link);
            if let Target::Node(below) = link.target() {
                count += self.count_flat(below);
            }
        }
        count
    }

    fn check_node(&self, number: u32, found: &mut Found) -> Result<(), String> {
        found.nodes += 1;
        let node = &self.nodes[number];
        if Grid::flat_entry(self.flat_levels, &node.key, node.shift).is_some() {
            ensure!("node {number}", self.look_up(&node.key, node.shift) == (number, NONE));
        }
        for slot in 0..8u32 {
            let (bounds, link) = (node.boxes.get(slot as usize), node.children[slot as usize]);
            let cell = self.cell_of_slot(number, slot);
            match link.target() {
                Target::Nothing => {
                    ensure!("slot {slot} of node {number}", bounds == Aabb::EMPTY);
                    continue;
                }
                Target::Leaf(head) => self.check_chain(head, (number, slot), Some(&bounds), found)?,
                Target::Node(below) => {
                    let child = &self.nodes[below];
                    ensure!("node {below}", (child.parent, child.slot) == (number, slot));
                    ensure!("node {below}", child.shift + 1 == node.shift);
                    ensure!("node {below}", grid::same_cell(&child.key, &cell, child.shift));
                    ensure!("node {below}", bounds.contains(&self.node_box(below)));
                    self.check_node(below, found)?;
                }
            }
            if let Some(entry) = Grid::flat_entry(self.flat_levels, &cell, node.shift - 1) {
                ensure!("preallocated cell {entry}", Link::from_bits(self.flat[entry]) == link);
            }
        }
        if node.own != NONE {
            self.check_chain(node.own, (number, OWN), None, found)?;
        }
        Ok(())
    }

    fn check_chain(
        &self,
        head: u32,
        (node, slot): (u32, u32),
        above: Option<&Aabb>,
        found: &mut Found,
    ) -> Result<(), String> {
        let (runs, polygons) = (found.runs, found.polygons);
        let (mut at, mut before) = (head, NONE);
        while at != NONE {
            found.buckets += 1;
            let bucket: &Bucket = &self.buckets[at];
            let is_first = at == head;
            ensure!("bucket {at}", (bucket.parent, bucket.slot, bucket.prev) == (node, slot, before));
            ensure!("bucket {at}", is_first || !bucket.is_queued && !bucket.divides);
            ensure!("bucket {at}", !bucket.drains || !is_first && slot == OWN);
            let mut fresh = *bucket;
            fresh.refresh();
            ensure!("bucket {at}", bucket.bounds == fresh.bounds);
            ensure!("bucket {at}", (bucket.last, bucket.last_bounds) == (fresh.last, fresh.last_bounds));
            for i in 0..bucket.page_count as usize {
                found.pages += 1;
                let (number, bounds) = (bucket.pages[i], bucket.boxes.get(i));
                let page = &self.pages[number];
                ensure!("page {number}", (page.bucket, usize::from(page.at)) == (at, i));
                ensure!("page {number}", bucket.counts[i] == page.runs);
                let are_single = page.used() & !u32::from(page.exact) == 0;
                ensure!("page {number}", bucket.single >> i & 1 == u16::from(are_single));
                ensure!("page {number}", above.is_none_or(|above| above.contains(&bounds)));
                self.check_page(number, &bounds, found)?;
            }
            (before, at) = (at, bucket.next);
        }
        let first = &self.buckets[head];
        ensure!("list {head}", !first.divides || self.to_divide.contains(&head));
        ensure!(
            "leaf {head}",
            found.runs - runs == first.runs && found.polygons - polygons == first.polygons
        );
        Ok(())
    }

    fn check_page(&self, number: u32, bounds: &Aabb, found: &mut Found) -> Result<(), String> {
        let page = &self.pages[number];
        ensure!("page {number}", u32::from(page.loose | page.gaps | page.exact) & !page.used() == 0);
        found.runs += u32::from(page.runs);
        for lane in 0..usize::from(page.runs) {
            let (run, around) = page.run(lane);
            let [is_exact, has_gaps, is_loose] =
                [page.exact, page.gaps, page.loose].map(|mask| mask >> lane & 1 == 1);
            ensure!("run {lane} of page {number}", bounds.contains(&around));
            ensure!("run {lane} of page {number}", run.mask != 0 && (!is_exact || run.mask == 1));
            ensure!("run {lane} of page {number}", has_gaps != (u32::from(run.mask) + 1).is_power_of_two());
            // Of a run that lost polygons, one may be left; then upkeep makes it exact.
            ensure!("run {lane} of page {number}", page.queued || is_exact || run.mask != 1);
            ensure!("run {lane} of page {number}", run.lanes() >> (run.first % 16) == run.mask);
            let store = self.store.number(run.first / 16);
            ensure!("run {lane} of page {number}", is_exact || store == run.store);
            found.polygons += run.mask.count_ones();
            let mut all = Aabb::EMPTY;
            for id in lanes_of(run.mask).map(|bit| run.first + bit as u32) {
                ensure!("polygon {id}", self.store.filed_lanes(id / 16) >> (id % 16) & 1 == 1);
                ensure!("polygon {id}", self.store.place(id) == Some(number * 16 + lane as u32));
                let own = self.store.boxes(store).get(id as usize % 16);
                ensure!("polygon {id}", own.is_valid() && (!is_exact || own == around));
                all = all.union(&own);
            }
            ensure!("run {lane} of page {number}", around.contains(&all) && (is_loose || all == around));
        }
        Ok(())
    }
}
