//! Inserts runs: finds the bucket of a run, appends the run, and widens the boxes above.

use super::{
    grid::{self, Grid, Key, TOP_SHIFT},
    index::Osp,
    layout::{Bucket, Link, Node, OWN, Run, TakenRun, Target},
    pool::NONE,
};
use crate::{
    index::simd::{Boxes, Wide, prefetch_lines},
    math::Aabb,
};

/// The bucket to which a run belongs by its box, or the node under which this bucket is missing.
#[derive(Clone, Copy, Default)]
pub(super) struct Destination {
    pub(super) key: Key,
    level: u32,
    /// The lowest existing node on the path to the bucket.
    node: u32,
    /// The leaf or list of straddlers under that node; [`NONE`] if it does not exist yet.
    pub(super) bucket: u32,
}

impl Osp {
    /// Inserts runs by their boxes. The destinations are prefetched first, because many runs go to many buckets.
    pub(super) fn insert_runs(&mut self, runs: &[(Run, Wide)]) {
        self.new_runs += runs.len() as u32;
        let shape = self.shape;
        let mut targets = [Destination::default(); 16];
        for (target, (_, bounds)) in targets.iter_mut().zip(runs) {
            *target = self.destination(*bounds);
            prefetch_lines::<2, _>(self.buckets.place(target.bucket));
        }
        if runs.len() > 2 {
            for target in targets[..runs.len()].iter().filter(|target| target.bucket != NONE) {
                self.prefetch_end_of(target.bucket);
            }
        }
        for (target, (run, bounds)) in targets.iter().zip(runs) {
            let target = if self.shape == shape { *target } else { self.destination(*bounds) };
            self.insert_run(*run, *bounds, target, false);
        }
    }

    /// The destination of a run with this box.
    #[inline]
    pub(super) fn destination(&self, bounds: Wide) -> Destination {
        let key = self.grid.key(bounds);
        let level = self.grid.level_for(bounds);
        let (node, leaf) = self.descend(&key, level);
        let straddles = leaf == NONE && level >= self.nodes[node].shift;
        let bucket = if straddles { self.nodes[node].own } else { leaf };
        Destination { key, level, node, bucket }
    }

    /// Prefetches the cache lines to which the next run of a bucket will be written.
    fn prefetch_end_of(&self, bucket: u32) {
        let bucket = &self.buckets[bucket];
        prefetch_lines::<8, _>(self.pages.place(bucket.last));
        prefetch_lines::<6, _>(&raw const bucket.boxes);
    }

    /// Inserts a run at its destination. If `is_loose`, the run's box may be too large, and its page is queued for
    /// upkeep.
    pub(super) fn insert_run(&mut self, run: Run, bounds: Wide, target: Destination, is_loose: bool) {
        let has_grown = self.grow_to(&target.key);
        let target = if has_grown { self.destination(bounds) } else { target };
        let head = if target.bucket != NONE { target.bucket } else { self.add_bucket(&target) };
        let wider = !self.buckets[head].bounds.contains(bounds);
        let place = self.append(head, run, bounds, target.level);
        if is_loose {
            // The mark is set before a split, because a split may move the run.
            self.mark_loose(place);
        }
        if wider {
            self.widen_above(head, &bounds.to_box());
        }
        let leaf = &self.buckets[head];
        if leaf.runs > leaf.split_at {
            self.try_split(head);
        } else if leaf.runs >= leaf.pack_at {
            self.queue_for_packing(head);
        }
    }

    /// Creates the missing bucket for a run: a leaf, or the list of straddlers.
    fn add_bucket(&mut self, target: &Destination) -> u32 {
        let shift = self.nodes[target.node].shift;
        let slot = if target.level < shift { grid::octant(&target.key, shift) as u32 } else { OWN };
        self.new_bucket(target.node, slot, &target.key)
    }

    /// Adds levels on top until the top cell contains the key. Returns whether it added a level. Existing cells keep
    /// their size.
    fn grow_to(&mut self, key: &Key) -> bool {
        let mut grown = false;
        loop {
            let old = self.top;
            let Node { shift, key: at, .. } = self.nodes[old];
            if shift >= TOP_SHIFT || grid::same_cell(&at, key, shift) {
                return grown;
            }
            grown = true;
            self.shape += 1;
            let top = self.nodes.take();
            let slot = grid::octant(&at, shift + 1);
            let node_box = self.node_box(old);
            let node = &mut self.nodes[top];
            (node.shift, node.key, node.parent) = (shift + 1, at, NONE);
            // The preallocated levels contain the old top already.
            node.children[slot] = Link::node(old);
            node.boxes.set(slot, &node_box);
            (self.nodes[old].parent, self.nodes[old].slot) = (top, slot as u32);
            self.set_top(top);
        }
    }

    /// The tight box around all polygons at a node and below.
    pub(super) fn node_box(&self, node: u32) -> Aabb {
        let node = &self.nodes[node];
        let mut bounds = node.boxes.around(0xFF);
        if node.own != NONE {
            bounds = bounds.union(&self.chain_box(node.own));
        }
        bounds
    }

    /// The box around a chain of buckets.
    pub(super) fn chain_box(&self, head: u32) -> Aabb {
        let mut bounds = Wide::EMPTY;
        let mut at = head;
        while at != NONE {
            let bucket = &self.buckets[at];
            bounds = bounds.union(bucket.bounds);
            at = bucket.next;
        }
        bounds.to_box()
    }

    /// Descends towards the cell of `level` that contains `key`. Returns the lowest node, and the leaf below it or
    /// [`NONE`].
    #[inline]
    fn descend(&self, key: &Key, level: u32) -> (u32, u32) {
        let (mut at, leaf) = self.look_up(key, level);
        if leaf != NONE {
            return (at, leaf);
        }
        loop {
            let node = &self.nodes[at];
            if level >= node.shift {
                return (at, NONE);
            }
            match node.children[grid::octant(key, node.shift)].target() {
                Target::Node(below) => at = below,
                Target::Leaf(head) => return (at, head),
                Target::Nothing => return (at, NONE),
            }
        }
    }

    /// Does the first part of [`Osp::descend`] by table look-up. Inside the root cube, the key determines the entry of
    /// each preallocated level.
    #[inline]
    pub(super) fn look_up(&self, key: &Key, level: u32) -> (u32, u32) {
        let mut at = self.top;
        if let Some(morton) = grid::morton_in_root(key).filter(|_| level <= grid::ROOT_SHIFT) {
            // Levels above the top have no entries.
            let first = grid::ROOT_SHIFT.saturating_sub(self.nodes[at].shift);
            for depth in first..=(grid::ROOT_SHIFT - level).min(self.flat_levels) {
                match Link::from_bits(self.flat[grid::flat_entry_at(morton, depth)]).target() {
                    Target::Node(node) => at = node,
                    Target::Leaf(head) => return (at, head),
                    Target::Nothing => break,
                }
            }
        }
        (at, NONE)
    }

    /// Creates an empty bucket at a free slot of a node.
    pub(super) fn new_bucket(&mut self, node: u32, slot: u32, key: &Key) -> u32 {
        let new = self.buckets.take();
        let shift = if slot == OWN { 0 } else { self.nodes[node].shift - 1 };
        let bucket = &mut self.buckets[new];
        (bucket.parent, bucket.slot, bucket.shift) = (node, slot, shift);
        self.shape += 1;
        if slot == OWN {
            self.nodes[node].own = new;
        } else {
            self.set_child(node, slot, Link::leaf(new), key);
        }
        new
    }

    /// Sets the link of a node's slot, in the node and in the preallocated levels. `key` lies in the slot's cell.
    pub(super) fn set_child(&mut self, node: u32, slot: u32, link: Link, key: &Key) {
        self.nodes[node].children[slot as usize] = link;
        if let Some(entry) = Grid::flat_entry(self.flat_levels, key, self.nodes[node].shift - 1) {
            self.flat[entry] = link.to_bits();
        }
    }

    /// Makes a node the top, also in the preallocated levels.
    pub(super) fn set_top(&mut self, top: u32) {
        self.top = top;
        let Node { key, shift, .. } = self.nodes[top];
        if let Some(entry) = Grid::flat_entry(self.flat_levels, &key, shift) {
            self.flat[entry] = Link::node(top).to_bits();
        }
    }

    /// Appends a run to the first bucket of a chain; returns the run's place. The caller widens the boxes above the bucket.
    pub(super) fn append(&mut self, head: u32, run: Run, bounds: Wide, level: u32) -> u32 {
        let mut bucket = &mut self.buckets[head];
        if bucket.last == NONE || bucket.counts[bucket.last_at()] >= 16 {
            self.new_page(head);
            bucket = &mut self.buckets[head];
        }
        let (page_number, at) = (bucket.last, bucket.last_at());
        bucket.counts[at] += 1;
        // The copies in the bucket are updated here, without a read of the page.
        let is_single = run.is_exact() && (bucket.counts[at] == 1 || bucket.single >> at & 1 == 1);
        bucket.single = bucket.single & !(1 << at) | u16::from(is_single) << at;
        bucket.runs += 1;
        bucket.movable = bucket.movable.saturating_add(u32::from(level < bucket.shift));
        bucket.polygons += run.mask.count_ones();
        if !bucket.last_bounds.contains(bounds) {
            bucket.last_bounds = bucket.last_bounds.union(bounds);
            bucket.bounds = bucket.bounds.union(bounds);
            bucket.boxes.set_wide(at, bucket.last_bounds);
        }
        let lane = self.pages[page_number].push_run(run, &bounds.to_box());
        let place = page_number * 16 + lane as u32;
        self.note_place(run, place);
        place
    }

    /// Writes a run's place into the id map.
    pub(super) fn note_place(&mut self, run: Run, place: u32) {
        self.store.set_place(run.first / 16, run.lanes(), place);
    }

    /// Moves the contents of a chain's first bucket to a new second bucket, so that links to the first stay valid.
    pub(super) fn empty_first(&mut self, head: u32) {
        let full = self.buckets.take();
        // Only the first bucket of a chain has these flags.
        self.buckets[full] = Bucket { prev: head, is_queued: false, divides: false, ..self.buckets[head] };
        let Bucket { next: after, pages, page_count, .. } = self.buckets[full];
        if after != NONE {
            self.buckets[after].prev = full;
        }
        for &page in &pages[..page_count as usize] {
            self.pages[page].bucket = full;
        }
        let bucket = &mut self.buckets[head];
        bucket.next = full;
        (bucket.page_count, bucket.single, bucket.counts) = (0, 0, [0; 16]);
        (bucket.bounds, bucket.boxes) = (Wide::EMPTY, Boxes::EMPTY);
        (bucket.last, bucket.last_bounds) = (NONE, Wide::EMPTY);
    }

    /// Adds an empty page to the end of a chain's first bucket; returns the page's number.
    fn new_page(&mut self, head: u32) -> u32 {
        if self.buckets[head].page_count == 16 {
            self.empty_first(head);
        }
        let page_number = self.pages.take();
        let bucket = &mut self.buckets[head];
        let page = &mut self.pages[page_number];
        (page.bucket, page.at) = (head, bucket.page_count as u8);
        (bucket.last, bucket.last_bounds) = (page_number, Wide::EMPTY);
        bucket.pages[bucket.page_count as usize] = page_number;
        // The count may still be the count of an earlier page.
        bucket.counts[bucket.page_count as usize] = 0;
        bucket.page_count += 1;
        page_number
    }

    /// Widens the boxes above a bucket so that they contain `bounds`. Stops at the first box that contains `bounds`
    /// already, because all boxes above it contain `bounds`, too.
    pub(super) fn widen_above(&mut self, bucket: u32, bounds: &Aabb) {
        let (mut at, mut slot) = (self.buckets[bucket].parent, self.buckets[bucket].slot);
        while at != NONE {
            let node = &mut self.nodes[at];
            if slot != OWN && !node.boxes.widen(slot as usize, bounds) {
                return;
            }
            (at, slot) = (node.parent, node.slot);
        }
    }

    /// Appends a run that was taken out of a bucket; see [`Osp::append`].
    pub(super) fn append_taken(&mut self, head: u32, (run, bounds, is_loose): &TakenRun) {
        let bounds = Wide::from_box(bounds);
        let place = self.append(head, *run, bounds, self.grid.level_for(bounds));
        if *is_loose {
            self.mark_loose(place);
        }
    }

    /// Releases a chain of buckets, and adds its runs to `taken`.
    pub(super) fn take_apart(&mut self, head: u32, taken: &mut Vec<TakenRun>) {
        let mut at = head;
        while at != NONE {
            let Bucket { pages, page_count, next, .. } = self.buckets[at];
            let pages = &pages[..page_count as usize];
            // Pages, and the entries of their polygons in the id map, are prefetched before they are read.
            for &number in &pages[..pages.len().min(2)] {
                prefetch_lines::<9, _>(self.pages.place(number));
            }
            for (i, &number) in pages.iter().enumerate() {
                if let Some(&later) = pages.get(i + 2) {
                    prefetch_lines::<9, _>(self.pages.place(later));
                }
                let page = &self.pages[number];
                for lane in 0..usize::from(page.runs) {
                    self.store.prefetch_detail(page.first[lane] / 16);
                    let (run, bounds) = page.run(lane);
                    taken.push((run, bounds, page.loose >> lane & 1 == 1));
                }
                self.release_page(number);
            }
            self.give_bucket(at);
            at = next;
        }
    }

    /// A key in the cell of a node's slot.
    pub(super) fn cell_of_slot(&self, node: u32, slot: u32) -> Key {
        let Node { shift, key, .. } = self.nodes[node];
        std::array::from_fn(|axis| {
            let base = key[axis] >> shift << shift;
            base | u64::from(slot >> axis & 1) << (shift - 1)
        })
    }
}
