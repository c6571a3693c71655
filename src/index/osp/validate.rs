//! Checks every invariant of the tree, from the top down, for tests.

use super::{
    grid::{self, Grid, TOP_SHIFT},
    index::Osp,
    layout::{Bucket, Link, OWN, Target},
    pool::NONE,
    shelf::BLOCKS,
};
use crate::math::Aabb;

/// Counts of a slot and its subtree.
#[derive(Clone, Copy, Default)]
struct Found {
    runs: u32,
    polygons: u32,
}

macro_rules! ensure {
    ($condition:expr, $($message:tt)+) => {
        if !$condition {
            return Err(format!($($message)+));
        }
    };
}

impl Osp {
    pub(super) fn check(&self) -> Result<(), String> {
        self.check_store()?;
        let mut pages = 0;
        let mut buckets = 0;
        let mut nodes = 0;
        let top = &self.nodes[self.top];
        ensure!(top.parent == NONE, "the top has a parent");
        ensure!(top.shift <= TOP_SHIFT, "the top is too wide");
        let found = self.check_node(self.top, &mut nodes, &mut buckets, &mut pages)?;
        ensure!(nodes == self.nodes.live(), "{nodes} nodes found, {} in use", self.nodes.live());
        ensure!(buckets == self.buckets.live(), "{buckets} buckets found, {} in use", self.buckets.live());
        ensure!(!self.is_flat || nodes == 1, "runs are kept at the top, and there is a tree");
        let leaves = top.children.iter().filter(|&&link| link != Link::NONE).count();
        ensure!(!self.is_flat || leaves == 0, "runs are kept at the top, and there are leaves");
        let mut released = 0;
        let mut at = self.queue;
        while at != NONE {
            let page = &self.pages[at];
            ensure!(page.queued, "page {at} is queued, but not marked");
            released += u32::from(page.bucket == NONE);
            at = page.next;
        }
        ensure!(
            pages + released == self.pages.live(),
            "{pages}+{released} pages found, {} in use",
            self.pages.live()
        );
        let filed = self.store.filed();
        ensure!(filed == found.polygons as usize, "{filed} polygons filed, {} in runs", found.polygons);
        if let Some(entry) = Grid::flat_entry(self.flat_levels, &top.key, top.shift) {
            let link = Link::from_bits(self.flat[entry]);
            ensure!(link == Link::node(self.top), "preallocated cell {entry} does not lead to the top");
        }
        let linked = self.flat.iter().filter(|&&bits| Link::from_bits(bits) != Link::NONE).count();
        let reached = self.count_flat(self.top);
        ensure!(linked == reached, "{linked} preallocated cells in use, {reached} reached");
        Ok(())
    }

    /// Checks the masks and boxes of the store.
    fn check_store(&self) -> Result<(), String> {
        let (mut polygons, mut blocks, mut unfiled) = (0, 0, 0);
        for (first, shelf) in self.store.shelves() {
            let entry = first as usize / BLOCKS;
            let top = &self.store.tops[entry / 16];
            let lane = entry % 16;
            let bits = [top.used, top.unfiled, top.stale].map(|mask| mask >> lane & 1 == 1);
            let of_shelf = [shelf.top.used, shelf.top.unfiled, shelf.top.stale].map(|mask| mask != 0);
            ensure!(bits == of_shelf, "shelf {entry}: {bits:?} above, {of_shelf:?} below");
            for (group, around) in shelf.groups.iter().enumerate() {
                let bits =
                    [shelf.top.used, shelf.top.unfiled, shelf.top.stale].map(|mask| mask >> group & 1 == 1);
                let of_group = [around.used, around.unfiled, around.stale].map(|mask| mask != 0);
                ensure!(bits == of_group, "group {group} of shelf {entry}: {bits:?}, {of_group:?}");
                let mut of_blocks = Aabb::EMPTY;
                for lane in 0..16 {
                    let block = group * 16 + lane;
                    let (live, filed, moved) = (shelf.live[block], shelf.filed[block], shelf.moved[block]);
                    let bit = |mask: u16| mask >> lane & 1 == 1;
                    ensure!(
                        filed & !live == 0 && moved & !live == 0,
                        "block {block}: filed or moved, not live"
                    );
                    let is_right = (bit(around.used), bit(around.unfiled)) == (live != 0, live != filed);
                    ensure!(is_right, "block {block} of shelf {entry} is marked wrongly");
                    let is_waiting = bit(shelf.waiting[group]) || !self.residence.is_tree_needed;
                    ensure!(live == filed || is_waiting, "block {block} will not be examined");
                    if live == 0 {
                        continue;
                    }
                    let bounds = self.store.boxes_of(shelf, block).around(live.into());
                    ensure!(
                        bit(around.stale) || around.boxes.get(lane).contains(&bounds),
                        "the box around block {block} is too small"
                    );
                    of_blocks = of_blocks.union(&around.boxes.get(lane));
                    (polygons, blocks) = (polygons + live.count_ones() as usize, blocks + 1);
                    unfiled += usize::from(live != filed);
                }
                let is_right = around.stale != 0 || shelf.top.boxes.get(group).contains(&of_blocks);
                ensure!(is_right, "the box around group {group} of shelf {entry} is too small");
            }
            let of_groups = shelf.top.boxes.around(shelf.top.used.into());
            let is_right = shelf.top.stale != 0 || top.boxes.get(lane).contains(&of_groups);
            ensure!(is_right, "the box around shelf {entry} is too small");
        }
        let shelves = self.store.shelves().filter(|(_, shelf)| shelf.top.used != 0).count() as u32;
        let used: u32 = self.store.tops.iter().map(|top| top.used.count_ones()).sum();
        ensure!(used == shelves, "{used} shelves are marked as used, {shelves} are");
        let found = (polygons, blocks, unfiled);
        let counted = (self.store.len(), self.store.blocks(), self.store.unfiled_blocks());
        ensure!(found == counted, "{found:?} polygons, blocks and unfiled blocks; {counted:?} counted");
        Ok(())
    }

    /// Number of preallocated cells that agree with a link of the tree.
    fn count_flat(&self, node: u32) -> usize {
        let mut count = 0;
        if self.nodes[node].parent == NONE {
            let entry = Grid::flat_entry(self.flat_levels, &self.nodes[node].key, self.nodes[node].shift);
            count += usize::from(entry.is_some_and(|e| self.flat[e] == Link::node(node).to_bits()));
        }
        for slot in 0..8 {
            let link = self.nodes[node].children[slot as usize];
            if link == Link::NONE {
                continue;
            }
            let entry = Grid::flat_entry(
                self.flat_levels,
                &self.cell_of_slot(node, slot),
                self.nodes[node].shift - 1,
            );
            count += usize::from(entry.is_some_and(|e| self.flat[e] == link.to_bits()));
            if let Target::Node(below) = link.target() {
                count += self.count_flat(below);
            }
        }
        count
    }

    fn check_node(
        &self,
        number: u32,
        nodes: &mut u32,
        buckets: &mut u32,
        pages: &mut u32,
    ) -> Result<Found, String> {
        *nodes += 1;
        let node = &self.nodes[number];
        if Grid::flat_entry(self.flat_levels, &node.key, node.shift).is_some() {
            let direct = self.look_up(&node.key, node.shift);
            ensure!(direct == (number, NONE), "the look-up of node {number} returned {direct:?}");
        }
        let mut found = Found::default();
        for slot in 0..8u32 {
            let bounds = node.boxes.get(slot as usize);
            let cell = self.cell_of_slot(number, slot);
            let below = match node.children[slot as usize].target() {
                Target::Nothing => {
                    ensure!(bounds == Aabb::EMPTY, "node {number} has a box at empty slot {slot}");
                    continue;
                }
                Target::Leaf(head) => self.check_chain(head, number, slot, Some(&bounds), buckets, pages)?,
                Target::Node(below) => {
                    let child = &self.nodes[below];
                    ensure!((child.parent, child.slot) == (number, slot), "node {below} has another parent");
                    ensure!(child.shift + 1 == node.shift, "node {below} has the wrong level");
                    ensure!(
                        grid::same_cell(&child.key, &cell, child.shift),
                        "node {below} is in the wrong cell"
                    );
                    ensure!(bounds.contains(&self.node_box(below)), "the box of node {below} is too small");
                    self.check_node(below, nodes, buckets, pages)?
                }
            };
            if let Some(entry) = Grid::flat_entry(self.flat_levels, &cell, node.shift - 1) {
                let link = Link::from_bits(self.flat[entry]);
                ensure!(link == node.children[slot as usize], "preallocated cell {entry} leads elsewhere");
            }
            found = Found { runs: found.runs + below.runs, polygons: found.polygons + below.polygons };
        }
        if node.own != NONE {
            let own = self.check_chain(node.own, number, OWN, None, buckets, pages)?;
            found = Found { runs: found.runs + own.runs, polygons: found.polygons + own.polygons };
        }
        Ok(found)
    }

    fn check_chain(
        &self,
        head: u32,
        node: u32,
        slot: u32,
        above: Option<&Aabb>,
        buckets: &mut u32,
        pages: &mut u32,
    ) -> Result<Found, String> {
        let mut found = Found::default();
        let (mut at, mut before) = (head, NONE);
        while at != NONE {
            *buckets += 1;
            let bucket: &Bucket = &self.buckets[at];
            ensure!((bucket.parent, bucket.slot) == (node, slot), "bucket {at} has another parent");
            ensure!(bucket.prev == before, "bucket {at} has the wrong previous bucket");
            ensure!(at == head || !bucket.is_queued, "bucket {at} waits to be packed and is not the first");
            ensure!(!bucket.drains || at != head && slot == OWN, "bucket {at} waits to be moved to children");
            ensure!(at == head || !bucket.divides, "bucket {at} divides and is not the first");
            let mut fresh = *bucket;
            fresh.refresh();
            let kept = (bucket.bounds, bucket.last, bucket.last_bounds);
            ensure!(
                kept == (fresh.bounds, fresh.last, fresh.last_bounds),
                "bucket {at}: {kept:?} is out of date"
            );
            for i in 0..bucket.page_count as usize {
                *pages += 1;
                let bounds = bucket.boxes.get(i);
                let runs = self.pages[bucket.pages[i]].runs;
                ensure!(bucket.counts[i] == runs, "bucket {at} counts the runs of page {i} wrongly");
                let page = &self.pages[bucket.pages[i]];
                let single = page.used() & !u32::from(page.exact) == 0;
                ensure!(bucket.single >> i & 1 == u16::from(single), "bucket {at}, page {i}: single or not");
                ensure!(
                    above.is_none_or(|b| b.contains(&bounds)),
                    "bucket {at}, page {i}: box above too small"
                );
                let below = self.check_page(bucket.pages[i], at, i, &bounds)?;
                found = Found { runs: found.runs + below.runs, polygons: found.polygons + below.polygons };
            }
            (before, at) = (at, bucket.next);
        }
        let first = &self.buckets[head];
        ensure!(!first.divides || self.to_divide.contains(&head), "list {head} divides and does not wait");
        ensure!(found.runs == first.runs, "leaf {head}: {} runs found, {} counted", found.runs, first.runs);
        ensure!(found.polygons == first.polygons, "leaf {head} counts its polygons wrongly");
        Ok(found)
    }

    fn check_page(&self, number: u32, bucket: u32, at: usize, bounds: &Aabb) -> Result<Found, String> {
        let page = &self.pages[number];
        ensure!((page.bucket, usize::from(page.at)) == (bucket, at), "page {number} is in another bucket");
        let unused = u32::from(page.loose | page.gaps | page.exact) & !page.used();
        ensure!(unused == 0, "page {number}: an unused run is marked");
        let mut polygons = 0;
        for lane in 0..usize::from(page.runs) {
            let (run, run_box) = self.pages.run(number, lane);
            ensure!(bounds.contains(&run_box), "page {number}: its box does not hold run {lane}");
            let gaps = !(u32::from(run.mask) + 1).is_power_of_two();
            ensure!((page.gaps >> lane & 1 == 1) == gaps, "page {number}: run {lane} is not marked right");
            ensure!(run.mask != 0, "page {number}: run {lane} is empty");
            let exact = run.is_exact();
            ensure!((page.exact >> lane & 1 == 1) == exact, "page {number}: run {lane} is not marked right");
            ensure!(!exact || run.mask == 1, "page {number}: run {lane} of several has an exact box");
            ensure!(
                run.lanes() >> (run.first % 16) == run.mask,
                "page {number}: run {lane} is of two blocks"
            );
            let store = self.store.number(run.first / 16);
            ensure!(
                exact || store == run.store,
                "page {number}: run {lane} has another store than its block"
            );
            polygons += run.mask.count_ones();
            let mut all = Aabb::EMPTY;
            for id in (0..16).filter(|bit| run.mask >> bit & 1 == 1).map(|bit| run.first + bit) {
                let in_tree = self.store.filed_lanes(id / 16) >> (id % 16) & 1 == 1;
                ensure!(in_tree, "polygon {id} is in a run, but not in the tree");
                let place = self.store.place(id);
                ensure!(place == Some(number * 16 + lane as u32), "polygon {id} is said to be at {place:?}");
                let own = self.store.boxes(store).get(id as usize % 16);
                ensure!(!exact || own == run_box, "polygon {id} has another box than its run");
                ensure!(own.is_valid(), "polygon {id} has the box {own:?}");
                ensure!(run_box.contains(&own), "polygon {id} extends beyond the box of its run");
                all = all.union(&own);
            }
            let loose = page.loose >> lane & 1 == 1;
            let may_be_inexact = page.queued || exact || run.mask != 1;
            ensure!(
                may_be_inexact,
                "page {number}: run {lane} has one polygon left but does not wait for upkeep"
            );
            ensure!(loose || all == run_box, "page {number}: the box of run {lane} is not tight");
        }
        Ok(Found { runs: u32::from(page.runs), polygons })
    }
}
