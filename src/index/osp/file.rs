//! Filing runs: placing, appending, widening the boxes above, splitting.

use super::{
    grid::{self, Grid, Key, TOP_SHIFT},
    index::Osp,
    layout::{Bucket, Link, Node, OWN, Run, Target},
    pool::NONE,
};
use crate::math::Aabb;

impl Osp {
    /// Files a run by its box.
    pub(super) fn file(&mut self, run: Run, bounds: &Aabb) {
        let key = self.grid.key(bounds);
        let level = self.grid.level_for(bounds);
        self.grow_to(&key);
        let head = self.bucket_for(&key, level);
        self.append(head, run, bounds);
        self.count_above(head, 1, run.mask.count_ones() as i32);
        self.widen_above(head, bounds);
        if self.buckets[head].runs > self.buckets[head].split_at {
            self.try_split(head);
        }
    }

    /// Adds levels on top until the highest cell holds the key. Cells keep their size.
    fn grow_to(&mut self, key: &Key) {
        loop {
            let old = self.top;
            let Node { shift, key: at, .. } = self.nodes[old];
            if shift >= TOP_SHIFT || grid::same_cell(&at, key, shift) {
                return;
            }
            let top = self.nodes.take();
            let slot = grid::octant(&at, shift + 1);
            let node_box = self.node_box(old);
            let (runs, polygons) = (self.nodes[old].runs, self.nodes[old].polygons);
            let node = &mut self.nodes[top];
            (node.shift, node.key) = (shift + 1, at);
            (node.runs, node.polygons) = (runs, polygons);
            node.children[slot] = Link::node(old);
            node.boxes.set(slot, &node_box);
            (self.nodes[old].parent, self.nodes[old].slot) = (top, slot as u32);
            self.nodes[top].parent = NONE;
            self.top = top;
        }
    }

    /// The tight box of everything at a node and below.
    pub(super) fn node_box(&self, node: u32) -> Aabb {
        let node = &self.nodes[node];
        let mut bounds = node.boxes.around(0xFF);
        if node.own != NONE {
            bounds = bounds.union(&self.chain_box(node.own));
        }
        bounds
    }

    /// The box of a chain of buckets.
    pub(super) fn chain_box(&self, head: u32) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        let mut at = head;
        while at != NONE {
            let bucket = &self.buckets[at];
            bounds = bounds.union(&bucket.boxes.around(bucket.used()));
            at = bucket.next;
        }
        bounds
    }

    /// The bucket for runs of `level` at `key`: the leaf there, or the straddlers of the node that they are too long
    /// to leave. Inside the root cube the search starts at the run's own level and goes up, seldom more than a step
    /// or two; elsewhere it comes down from the top.
    fn bucket_for(&mut self, key: &Key, level: u32) -> u32 {
        let mut link = self.start(key, level);
        loop {
            let at = match link.target() {
                Target::Leaf(head) => return head,
                Target::Node(node) => node,
                Target::Nothing => self.top,
            };
            let shift = self.nodes[at].shift;
            let slot = if level >= shift { OWN } else { grid::octant(key, shift) as u32 };
            if slot == OWN {
                let own = self.nodes[at].own;
                return if own != NONE { own } else { self.new_bucket(at, OWN, key) };
            }
            link = self.nodes[at].children[slot as usize];
            if link == Link::NONE {
                return self.new_bucket(at, slot, key);
            }
        }
    }

    fn start(&self, key: &Key, level: u32) -> Link {
        let mut shift = level.clamp(grid::ROOT_SHIFT - super::tuning::FLAT_LEVELS, grid::ROOT_SHIFT);
        while let Some(entry) = Grid::flat_entry(key, shift) {
            let link = Link::from_bits(self.flat[entry]);
            if link != Link::NONE {
                // Straddlers longer than the root cube start above it.
                return if level > grid::ROOT_SHIFT { Link::node(self.top) } else { link };
            }
            shift += 1;
        }
        Link::node(self.top)
    }

    /// Hangs an empty bucket up at a free slot of a node.
    pub(super) fn new_bucket(&mut self, node: u32, slot: u32, key: &Key) -> u32 {
        let new = self.buckets.take();
        (self.buckets[new].parent, self.buckets[new].slot) = (node, slot);
        if slot == OWN {
            self.nodes[node].own = new;
        } else {
            self.set_child(node, slot, Link::leaf(new), key);
        }
        new
    }

    /// Puts something at a slot of a node, and in the preallocated levels. `key` lies in the slot's cell.
    pub(super) fn set_child(&mut self, node: u32, slot: u32, link: Link, key: &Key) {
        self.nodes[node].children[slot as usize] = link;
        if let Some(entry) = Grid::flat_entry(key, self.nodes[node].shift - 1) {
            self.flat[entry] = link.to_bits();
        }
    }

    /// Puts a run into the first bucket of a chain and returns its place. Boxes above the bucket are left to the
    /// caller.
    pub(super) fn append(&mut self, head: u32, run: Run, bounds: &Aabb) -> u32 {
        let count = self.buckets[head].page_count;
        let last = if count > 0 { self.buckets[head].pages[count as usize - 1] } else { NONE };
        let page_number = if last != NONE && self.pages[last].runs < 16 { last } else { self.new_page(head) };
        let page = &mut self.pages[page_number];
        let lane = usize::from(page.runs);
        page.runs += 1;
        page.set_run(lane, run, bounds);
        let at = usize::from(page.at);
        let bucket = &mut self.buckets[head];
        bucket.boxes.widen(at, bounds);
        bucket.runs += 1;
        bucket.polygons += run.mask.count_ones();
        let place = page_number * 16 + lane as u32;
        self.note_place(run, place);
        place
    }

    /// Writes a run's place into the id map.
    pub(super) fn note_place(&mut self, run: Run, place: u32) {
        self.ids.set_place(run.first / 16, run.mask << (run.first % 16), place);
    }

    /// An empty page at the end of a chain's first bucket.
    fn new_page(&mut self, head: u32) -> u32 {
        if self.buckets[head].page_count == 16 {
            // The first bucket is full: what it holds moves to a second one, so that whatever points to the first
            // stays right.
            let full = self.buckets.take();
            self.buckets[full] = self.buckets[head];
            self.buckets[full].prev = head;
            let after = self.buckets[full].next;
            if after != NONE {
                self.buckets[after].prev = full;
            }
            for i in 0..16 {
                let page = self.buckets[head].pages[i];
                self.pages[page].bucket = full;
            }
            let bucket = &mut self.buckets[head];
            bucket.next = full;
            bucket.page_count = 0;
            bucket.boxes = crate::index::simd::Boxes::EMPTY;
        }
        let page_number = self.pages.take();
        let bucket = &mut self.buckets[head];
        let page = &mut self.pages[page_number];
        (page.bucket, page.at) = (head, bucket.page_count as u8);
        bucket.pages[bucket.page_count as usize] = page_number;
        bucket.page_count += 1;
        page_number
    }

    /// Adds to the counts of all nodes above a bucket.
    pub(super) fn count_above(&mut self, bucket: u32, runs: i32, polygons: i32) {
        let mut at = self.buckets[bucket].parent;
        while at != NONE {
            let node = &mut self.nodes[at];
            node.runs = node.runs.wrapping_add_signed(runs);
            node.polygons = node.polygons.wrapping_add_signed(polygons);
            at = node.parent;
        }
    }

    /// Makes the boxes above a bucket hold `bounds`. Where one does already, those above it do too.
    fn widen_above(&mut self, bucket: u32, bounds: &Aabb) {
        let (mut at, mut slot) = (self.buckets[bucket].parent, self.buckets[bucket].slot);
        while at != NONE {
            let node = &mut self.nodes[at];
            if slot != OWN && !node.boxes.widen(slot as usize, bounds) {
                return;
            }
            (at, slot) = (node.parent, node.slot);
        }
    }

    /// Makes a node of a leaf that holds too many runs, if enough of them would leave it.
    fn try_split(&mut self, head: u32) {
        let (parent, slot) = (self.buckets[head].parent, self.buckets[head].slot);
        let shift = self.nodes[parent].shift - u32::from(slot != OWN);
        if slot == OWN || shift == 0 {
            self.buckets[head].split_at = u32::MAX;
            return;
        }
        let movable = self.movable(head, shift);
        if movable * 2 < self.buckets[head].runs {
            // Most are as long as the cell. Look again when there are twice as many.
            self.buckets[head].split_at = self.buckets[head].runs.saturating_mul(2);
            return;
        }
        self.split(head, shift);
    }

    /// Runs of a chain that are short enough for the children of a cell.
    fn movable(&self, head: u32, shift: u32) -> u32 {
        let mut movable = 0;
        let mut at = head;
        while at != NONE {
            let bucket = &self.buckets[at];
            for &page in &bucket.pages[..bucket.page_count as usize] {
                let page = &self.pages[page];
                let runs = 0..usize::from(page.runs);
                movable += runs.filter(|&i| self.grid.level_for(&page.boxes.get(i)) < shift).count() as u32;
            }
            at = bucket.next;
        }
        movable
    }

    fn split(&mut self, head: u32, shift: u32) {
        let Bucket { parent, slot, runs, polygons, .. } = self.buckets[head];
        let cell = self.cell_of_slot(parent, slot);
        let number = self.nodes.take();
        let node = &mut self.nodes[number];
        (node.shift, node.key, node.parent, node.slot) = (shift, cell, parent, slot);
        (node.runs, node.polygons) = (runs, polygons);
        self.set_child(parent, slot, Link::node(number), &cell);
        let mut at = head;
        while at != NONE {
            let Bucket { pages, page_count, next, .. } = self.buckets[at];
            for &page in &pages[..page_count as usize] {
                for i in 0..usize::from(self.pages[page].runs) {
                    self.move_down(number, page, i);
                }
                self.release_page(page);
            }
            self.buckets.give(at);
            at = next;
        }
    }

    /// Copies a run of a page to where it belongs at a new node.
    fn move_down(&mut self, number: u32, page: u32, lane: usize) {
        let Node { shift, key: cell, children, own, .. } = self.nodes[number];
        let (run, bounds) = self.pages[page].run(lane);
        let key = self.grid.key(&bounds);
        // A run whose box has shrunk may have its centre in another cell by now; it stays with this one.
        let key = if grid::same_cell(&key, &cell, shift) { key } else { cell };
        let slot = if self.grid.level_for(&bounds) >= shift { OWN } else { grid::octant(&key, shift) as u32 };
        let link = if slot == OWN { Link::NONE } else { children[slot as usize] };
        let bucket = match link.target() {
            Target::Leaf(bucket) => bucket,
            _ if slot == OWN && own != NONE => own,
            _ => self.new_bucket(number, slot, &key),
        };
        let place = self.append(bucket, run, &bounds);
        if self.pages[page].loose >> lane & 1 == 1 {
            self.mark_loose(place);
        }
        if slot != OWN {
            self.nodes[number].boxes.widen(slot as usize, &bounds);
        }
    }

    /// A place in the cell of a node's slot.
    pub(super) fn cell_of_slot(&self, node: u32, slot: u32) -> Key {
        let Node { shift, key, .. } = self.nodes[node];
        std::array::from_fn(|axis| {
            let base = key[axis] >> shift << shift;
            base | u64::from(slot >> axis & 1) << (shift - 1)
        })
    }
}
