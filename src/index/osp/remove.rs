//! Removes polygons. Later upkeep tightens boxes, joins pages and buckets, and turns nodes into leaves again.
//!
//! Removal clears a bit of the run's mask. It queues the page each time a run has lost half of its polygons. Until then the
//! run's box, around at most sixteen neighbours, may be a little too large. A commit processes as many queued pages as
//! polygons were removed or moved, up to a limit. So the cost of upkeep is proportional to the changes.

use super::{
    grid::Grid,
    index::Osp,
    layout::{Bucket, Link, Node, OWN, Run, TakenRun, Target},
    pool::NONE,
    tuning::{MERGE_RUNS, UPKEEP_PER_COMMIT},
};
use crate::{
    index::simd::{Boxes, Wide},
    math::Aabb,
};

/// Largest number of pages that a commit processes because of removals, or one for every [`UPKEEP_SHARE`] polygons.
const MOST_UPKEEP: u32 = 64;
const UPKEEP_SHARE: u32 = 512;

impl Osp {
    /// Removes a polygon in the tree from its run. Returns whether it had a run of its own.
    pub(super) fn remove_from_run(&mut self, id: u32) -> bool {
        let Some(place) = self.store.place(id) else { return false };
        let (page_number, lane) = (place / 16, place as usize % 16);
        self.store.unfile(id);
        let page = &mut self.pages[page_number];
        let was_alone = page.masks[lane] == 1;
        page.masks[lane] &= !(1 << (id - page.first[lane]));
        page.loose |= 1 << lane;
        page.note_gaps(lane);
        let left = page.masks[lane].count_ones();
        let gone = u32::from(left == 0);
        let bucket = page.bucket;
        let head = self.chain_head(bucket);
        let bucket = &mut self.buckets[head];
        bucket.polygons -= 1;
        bucket.runs -= gone;
        if gone == 1 {
            self.drop_run(page_number, lane);
        }
        if gone == 1 || left.is_power_of_two() {
            self.queue_page(page_number);
        }
        was_alone
    }

    /// Removes a run; the page's last run moves to its lane.
    fn drop_run(&mut self, page_number: u32, lane: usize) {
        let page = &mut self.pages[page_number];
        page.runs -= 1;
        let last = usize::from(page.runs);
        let loose = page.loose >> last & 1;
        let (run, bounds) = self.pages.run(page_number, last);
        if lane != last {
            self.pages.set_run(page_number, lane, run, &bounds);
            self.pages[page_number].loose |= loose << lane;
            self.note_place(run, page_number * 16 + lane as u32);
        }
        let page = &mut self.pages[page_number];
        let below = (1u16 << last) - 1;
        page.loose &= below;
        page.exact &= below;
        page.gaps &= below;
        self.buckets[page.bucket].note_runs(page);
    }

    pub(super) fn queue_page(&mut self, page_number: u32) {
        let page = &mut self.pages[page_number];
        if !page.queued {
            page.queued = true;
            page.next = self.queue;
            self.queue = page_number;
        }
    }

    /// Marks a run whose box may be too large, and queues its page.
    pub(super) fn mark_loose(&mut self, place: u32) {
        self.pages[place / 16].loose |= 1 << (place % 16);
        self.queue_page(place / 16);
    }

    /// Releases a page: at once, or during upkeep if the page is queued.
    pub(super) fn release_page(&mut self, page_number: u32) {
        let page = &mut self.pages[page_number];
        page.runs = 0;
        page.bucket = NONE;
        if !page.queued {
            self.pages.give(page_number);
        }
    }

    /// Processes queued pages: as many as polygons were removed or moved, and a few more. After very many removals, the
    /// work takes several commits.
    pub(super) fn keep_up(&mut self) {
        let most = MOST_UPKEEP.max(self.store.filed() as u32 / UPKEEP_SHARE);
        for _ in 0..UPKEEP_PER_COMMIT + self.removals.min(most) {
            let page_number = self.queue;
            if page_number == NONE {
                break;
            }
            let page = &mut self.pages[page_number];
            self.queue = page.next;
            page.queued = false;
            if page.bucket == NONE {
                self.pages.give(page_number);
            } else {
                self.tighten(page_number);
            }
        }
        self.lower_top();
    }

    /// Tightens the boxes of a page's runs, the page's box and the boxes above. Joins pages and buckets that have become
    /// too empty.
    fn tighten(&mut self, page_number: u32) {
        let mut left = self.pages[page_number].loose;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            self.tighten_run(page_number, lane);
        }
        let page = &self.pages[page_number];
        let bucket = page.bucket;
        if page.runs == 0 {
            self.detach_page(page_number);
            self.release_page(page_number);
        } else {
            let (at, bounds) = (usize::from(page.at), self.pages.boxes(page_number).around(page.used()));
            self.upkeep.boxes += 1;
            let bucket = &mut self.buckets[bucket];
            bucket.note_runs(page);
            bucket.boxes.set(at, &bounds);
            bucket.refresh();
            if page.runs <= 8 {
                self.join_page(page_number);
            }
        }
        self.settle_bucket(bucket);
    }

    fn tighten_run(&mut self, page_number: u32, lane: usize) {
        let (mut run, _) = self.pages.run(page_number, lane);
        if run.is_exact() {
            self.pages[page_number].loose &= !(1 << lane);
            return;
        }
        self.upkeep.boxes += 1;
        let bounds = self.store.boxes(run.store).around(u32::from(run.lanes()));
        let skip = run.mask.trailing_zeros();
        (run.first, run.mask) = (run.first + skip, run.mask >> skip);
        if run.mask == 1 {
            run.store = NONE;
        }
        self.pages.set_run(page_number, lane, run, &bounds);
    }

    /// Removes a page from its bucket; the bucket's last page moves to its position.
    pub(super) fn detach_page(&mut self, page_number: u32) {
        let (bucket_number, at) = (self.pages[page_number].bucket, usize::from(self.pages[page_number].at));
        let bucket = &mut self.buckets[bucket_number];
        bucket.page_count -= 1;
        let last = bucket.page_count as usize;
        let moved = bucket.pages[last];
        bucket.pages[at] = moved;
        let bounds = bucket.boxes.get(last);
        bucket.boxes.set(at, &bounds);
        bucket.boxes.set(last, &Aabb::EMPTY);
        bucket.refresh();
        self.pages[moved].at = at as u8;
        bucket.note_runs(&self.pages[moved]);
    }

    /// Moves the runs of a half-empty page to another page of the bucket, if a page has room.
    fn join_page(&mut self, from: u32) {
        let bucket_number = self.pages[from].bucket;
        let bucket = self.buckets[bucket_number];
        let runs = self.pages[from].runs;
        let others = bucket.pages[..bucket.page_count as usize].iter().copied();
        let Some(to) = others.filter(|&p| p != from).find(|&p| self.pages[p].runs + runs <= 16) else {
            return;
        };
        for lane in 0..usize::from(runs) {
            let (run, bounds) = self.pages.run(from, lane);
            let new = self.pages.push_run(to, run, &bounds);
            let page = &self.pages[to];
            let at = usize::from(page.at);
            self.buckets[bucket_number].note_runs(page);
            let boxes = &mut self.buckets[bucket_number].boxes;
            boxes.set(at, &boxes.get(at).union(&bounds));
            self.note_place(run, to * 16 + new as u32);
        }
        self.detach_page(from);
        self.release_page(from);
    }

    /// Upkeep of a bucket whose pages have changed. Joins it with a neighbour, removes its chain if the chain is empty,
    /// tightens the boxes above, and replaces sparse nodes above by leaves.
    pub(super) fn settle_bucket(&mut self, bucket: u32) {
        let head = self.chain_head(bucket);
        let Bucket { parent, slot, .. } = self.buckets[head];
        self.join_bucket(bucket);
        let Bucket { page_count, next, .. } = self.buckets[head];
        if page_count == 0 && next == NONE {
            if slot == OWN {
                self.nodes[parent].own = NONE;
            } else {
                let cell = self.cell_of_slot(parent, slot);
                self.set_child(parent, slot, Link::NONE, &cell);
            }
            self.give_bucket(head);
        }
        self.tighten_above(parent, slot);
        self.collapse_above(parent);
    }

    /// Joins a bucket with the previous or next bucket of the chain, if the pages of both fit into one bucket.
    fn join_bucket(&mut self, bucket: u32) {
        let Bucket { page_count, next, prev, .. } = self.buckets[bucket];
        for (into, from) in [(prev, bucket), (bucket, next)] {
            if into != NONE && from != NONE {
                let counts = (self.buckets[into].page_count, self.buckets[from].page_count);
                // Runs that are queued for a move to the node's children must not mix with runs that stay.
                let is_alike = self.buckets[into].drains == self.buckets[from].drains || counts.1 == 0;
                if is_alike && page_count <= 8 && counts.0 + counts.1 <= 16 {
                    self.move_pages(from, into);
                    return;
                }
            }
        }
    }

    fn move_pages(&mut self, from: u32, into: u32) {
        let source = self.buckets[from];
        for i in 0..source.page_count as usize {
            let target = &mut self.buckets[into];
            let at = target.page_count as usize;
            target.pages[at] = source.pages[i];
            target.boxes.set(at, &source.boxes.get(i));
            target.page_count += 1;
            let page = &mut self.pages[source.pages[i]];
            (page.bucket, page.at) = (into, at as u8);
            target.note_runs(page);
        }
        self.buckets[into].refresh();
        self.buckets[into].next = source.next;
        if source.next != NONE {
            self.buckets[source.next].prev = into;
        }
        self.give_bucket(from);
    }

    /// Tightens the boxes from a node upwards.
    fn tighten_above(&mut self, node: u32, slot: u32) {
        let (mut at, mut slot) = (node, slot);
        while at != NONE {
            if slot != OWN {
                self.upkeep.boxes += 1;
                let bounds = match self.nodes[at].children[slot as usize].target() {
                    Target::Nothing => Aabb::EMPTY,
                    Target::Leaf(head) => self.chain_box(head),
                    Target::Node(below) => self.node_box(below),
                };
                let boxes: &mut Boxes<8> = &mut self.nodes[at].boxes;
                if boxes.get(slot as usize) == bounds {
                    return;
                }
                boxes.set(slot as usize, &bounds);
            }
            (at, slot) = (self.nodes[at].parent, self.nodes[at].slot);
        }
    }

    /// Replaces nodes with few runs by leaves, from `node` upwards.
    fn collapse_above(&mut self, node: u32) {
        let mut at = node;
        while at != self.top && self.is_sparse(at) {
            let parent = self.nodes[at].parent;
            self.collapse(at);
            at = parent;
        }
        if at == self.top && !self.is_flat && self.is_sparse(at) {
            self.flatten();
        }
    }

    /// Replaces a sparse top node by the root cube's node, with the remaining runs in its list.
    fn flatten(&mut self) {
        if let Some(entry) =
            Grid::flat_entry(self.flat_levels, &self.nodes[self.top].key, self.nodes[self.top].shift)
        {
            self.flat[entry] = Link::NONE.to_bits();
        }
        let (kept, count) = self.take_runs(self.top);
        self.init_root();
        self.shape += 1;
        if count > 0 {
            let bucket = self.new_bucket(self.top, OWN, &Grid::root_key());
            self.append_all(bucket, &kept[..count]);
        }
    }

    /// Releases a sparse node with its subtree. Returns the runs and their number.
    fn take_runs(&mut self, node: u32) -> ([TakenRun; MERGE_RUNS as usize], usize) {
        let mut kept = [(Run::NONE, Aabb::EMPTY, false); MERGE_RUNS as usize];
        let mut count = 0;
        self.dissolve(node, &mut |run| {
            kept[count] = run;
            count += 1;
        });
        (kept, count)
    }

    fn append_all(&mut self, bucket: u32, runs: &[TakenRun]) {
        for (run, bounds, loose) in runs {
            let wide = Wide::from_box(bounds);
            let place = self.append(bucket, *run, wide, self.grid.level_for(wide));
            if *loose {
                self.mark_loose(place);
            }
        }
    }

    /// Whether a node has no child nodes, and at most [`MERGE_RUNS`] runs in its list and leaves.
    fn is_sparse(&self, node: u32) -> bool {
        let Node { children, own, .. } = self.nodes[node];
        let mut runs = if own == NONE { 0 } else { self.buckets[own].runs };
        for link in children {
            match link.target() {
                Target::Nothing => {}
                Target::Leaf(head) => runs += self.buckets[head].runs,
                Target::Node(_) => return false,
            }
        }
        runs <= MERGE_RUNS
    }

    fn collapse(&mut self, node: u32) {
        self.shape += 1;
        let (parent, slot, cell) = (self.nodes[node].parent, self.nodes[node].slot, self.nodes[node].key);
        let (kept, count) = self.take_runs(node);
        self.set_child(parent, slot, Link::NONE, &cell);
        if count > 0 {
            let bucket = self.new_bucket(parent, slot, &cell);
            self.append_all(bucket, &kept[..count]);
        }
        self.tighten_above(parent, slot);
    }

    /// Releases a node with its subtree. Calls `out` with each run.
    fn dissolve(&mut self, node: u32, out: &mut dyn FnMut(TakenRun)) {
        for slot in 0..8 {
            let cell = self.cell_of_slot(node, slot);
            match self.nodes[node].children[slot as usize].target() {
                Target::Nothing => continue,
                Target::Leaf(head) => self.take_apart(head, |_, run| out(run)),
                Target::Node(below) => self.dissolve(below, out),
            }
            self.set_child(node, slot, Link::NONE, &cell);
        }
        self.take_apart(self.nodes[node].own, |_, run| out(run));
        self.nodes.give(node);
    }

    /// Removes the top node as long as its only content is one child node.
    fn lower_top(&mut self) {
        loop {
            let top = self.nodes[self.top];
            let mut below = top.children.iter().filter(|&&link| link != Link::NONE);
            let (Some(only), None, NONE) = (below.next(), below.next(), top.own) else { return };
            let Target::Node(node) = only.target() else { return };
            if let Some(entry) = Grid::flat_entry(self.flat_levels, &top.key, top.shift) {
                self.flat[entry] = Link::NONE.to_bits();
            }
            self.nodes.give(self.top);
            self.nodes[node].parent = NONE;
            self.top = node;
        }
    }
}
