//! Removes polygons. Later upkeep tightens boxes, joins pages and buckets, and turns nodes into leaves again.
//!
//! Removal clears a bit of the run's mask. It queues the page each time a run has lost half of its polygons. Until then the
//! run's box, around at most sixteen neighbours, may be a little too large. A commit processes as many queued pages as
//! polygons were removed or moved, up to a limit. So the cost of upkeep is proportional to the changes.

use super::{
    grid::{Grid, ROOT_SHIFT},
    index::Osp,
    layout::{Bucket, Link, Node, OWN, Target},
    pool::NONE,
    tuning::{MERGE_RUNS, UPKEEP_PER_COMMIT},
};
use crate::{
    index::simd::{Boxes, lanes_of},
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
        let (run, bounds) = self.pages[page_number].run(last);
        if lane != last {
            self.pages[page_number].set_run(lane, run, &bounds);
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
        for lane in lanes_of(self.pages[page_number].loose) {
            self.tighten_run(page_number, lane);
        }
        let page = &self.pages[page_number];
        let bucket = page.bucket;
        if page.runs == 0 {
            self.detach_page(page_number);
            self.release_page(page_number);
        } else {
            let (at, bounds) = (usize::from(page.at), page.boxes.around(page.used()));
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
        let (mut run, _) = self.pages[page_number].run(lane);
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
        self.pages[page_number].set_run(lane, run, &bounds);
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
            let (run, bounds) = self.pages[from].run(lane);
            let new = self.pages[to].push_run(run, &bounds);
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

    /// Replaces a sparse node by a leaf.
    fn collapse(&mut self, node: u32) {
        self.shape += 1;
        let Node { children, own, parent, slot, key, .. } = self.nodes[node];
        let mut taken = std::mem::take(&mut self.taken);
        taken.clear();
        for (slot, link) in (0..).zip(children) {
            if let Target::Leaf(head) = link.target() {
                self.take_apart(head, &mut taken);
                let cell = self.cell_of_slot(node, slot);
                self.set_child(node, slot, Link::NONE, &cell);
            }
        }
        self.take_apart(own, &mut taken);
        self.nodes.give(node);
        self.set_child(parent, slot, Link::NONE, &key);
        if !taken.is_empty() {
            let leaf = self.new_bucket(parent, slot, &key);
            taken.iter().for_each(|run| self.append_taken(leaf, run));
        }
        self.taken = taken;
        self.tighten_above(parent, slot);
    }

    /// Removes the top node as long as its only content is one child node. If it has no content, the root cube's node
    /// replaces it.
    fn lower_top(&mut self) {
        loop {
            let top = self.nodes[self.top];
            let mut below = top.children.iter().filter(|&&link| link != Link::NONE);
            let only = match (below.next().map(|link| link.target()), below.next(), top.own) {
                (Some(Target::Node(node)), None, NONE) => node,
                (None, None, NONE) if top.shift != ROOT_SHIFT => NONE,
                _ => return,
            };
            if let Some(entry) = Grid::flat_entry(self.flat_levels, &top.key, top.shift) {
                self.flat[entry] = Link::NONE.to_bits();
            }
            self.shape += 1;
            self.nodes.give(self.top);
            if only == NONE {
                self.init_root();
                return;
            }
            self.nodes[only].parent = NONE;
            self.top = only;
        }
    }
}
