use super::{
    grid::Key,
    pool::{NONE, Pooled},
};
use crate::{
    index::simd::{Boxes, Wide},
    math::Aabb,
};

/// A page: up to sixteen runs. A query reads only the first two cache lines of a page that lies inside every plane.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Page {
    /// For each run, the id of bit 0 of its mask.
    pub(super) first: [u32; 16],
    /// For each run, the mask of its polygons `first + bit`.
    pub(super) masks: [u16; 16],
    /// Mask of the runs of a single polygon: the run's box is the polygon's box.
    pub(super) exact: u16,
    /// Mask of the runs whose ids are not consecutive from `first` on.
    pub(super) gaps: u16,
    /// Mask of the runs that have lost a polygon since their box was computed.
    pub(super) loose: u16,
    pub(super) runs: u8,
    /// Index of the page in its bucket.
    pub(super) at: u8,
    /// Whether the page is in the queue for upkeep.
    pub(super) queued: bool,
    /// The page's bucket; [`NONE`] once the page is released.
    pub(super) bucket: u32,
    /// The next page in the queue for upkeep.
    pub(super) next: u32,
    /// The boxes of the runs.
    pub(super) boxes: Boxes<16>,
    /// For each run, the number of its polygons' exact boxes; unspecified for a run of one polygon.
    pub(super) store: [u32; 16],
}

impl Pooled for Page {
    const BLANK: Self = Self {
        first: [0; 16],
        masks: [0; 16],
        exact: 0,
        gaps: 0,
        loose: 0,
        runs: 0,
        at: 0,
        queued: false,
        bucket: NONE,
        next: NONE,
        boxes: Boxes::EMPTY,
        store: [NONE; 16],
    };
}

impl Page {
    /// A run and its box.
    #[inline]
    pub(super) fn run(&self, lane: usize) -> (Run, Aabb) {
        let is_exact = self.exact >> lane & 1 == 1;
        let store = if is_exact { NONE } else { self.store[lane] };
        (Run { first: self.first[lane], store, mask: self.masks[lane] }, self.boxes.get(lane))
    }

    /// Sets a run; its box counts as tight.
    #[inline]
    pub(super) fn set_run(&mut self, lane: usize, run: Run, bounds: &Aabb) {
        self.boxes.set(lane, bounds);
        (self.first[lane], self.masks[lane]) = (run.first, run.mask);
        if !run.is_exact() {
            self.store[lane] = run.store;
        }
        self.exact = self.exact & !(1 << lane) | u16::from(run.is_exact()) << lane;
        self.note_gaps(lane);
        self.loose &= !(1 << lane);
    }

    /// Appends a run, whose box counts as tight, to a page that is not full; returns the run's lane.
    #[inline]
    pub(super) fn push_run(&mut self, run: Run, bounds: &Aabb) -> usize {
        let lane = usize::from(self.runs) % 16;
        self.runs += 1;
        self.set_run(lane, run, bounds);
        lane
    }

    /// Updates `gaps` for a run whose mask has changed.
    #[inline]
    pub(super) fn note_gaps(&mut self, lane: usize) {
        let mask = self.masks[lane];
        let gaps = mask & mask.wrapping_add(1) != 0;
        self.gaps = self.gaps & !(1 << lane) | u16::from(gaps) << lane;
    }

    /// Mask of the lanes in use.
    #[inline]
    pub(super) fn used(&self) -> u32 {
        (1 << self.runs) - 1
    }
}

/// A bucket: up to sixteen pages and their boxes. A leaf is a chain of buckets, and so is the list of a node's straddlers.
/// Only the first bucket of a chain receives new pages. The first two cache lines contain all fields that inserting a run
/// touches.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Bucket {
    /// The box around all pages.
    pub(super) bounds: Wide,
    pub(super) last_bounds: Wide,
    pub(super) page_count: u32,
    /// First bucket of a chain only: number of runs in the chain.
    pub(super) runs: u32,
    /// First bucket of a chain only: number of polygons in the chain.
    pub(super) polygons: u32,
    /// First bucket of a chain only: number of runs above which a split is tried.
    pub(super) split_at: u32,
    /// The parent node and the slot in this node: a child, 0 to 7, or [`OWN`].
    pub(super) parent: u32,
    pub(super) slot: u32,
    /// The next bucket of the chain.
    pub(super) next: u32,
    /// The previous bucket of the chain; [`NONE`] for the first bucket.
    pub(super) prev: u32,
    /// Number of the last page, a copy of its entry in `pages`.
    pub(super) last: u32,
    /// Level of a leaf's cell; 0 for straddlers.
    pub(super) shift: u32,
    /// First bucket of a chain only: number of runs that were short enough for a smaller cell when they were inserted.
    pub(super) movable: u32,
    /// Number of runs of each page, a copy of the pages' counts.
    pub(super) counts: [u8; 16],
    /// Mask of the pages whose runs all have one polygon.
    pub(super) single: u16,
    /// First bucket of a chain only: whether the leaf is queued for packing.
    pub(super) is_queued: bool,
    /// First bucket of a chain only: whether the runs of later buckets are queued for a move to the node's children.
    pub(super) divides: bool,
    /// Whether the bucket's runs are queued for a move to the node's children.
    pub(super) drains: bool,
    /// First bucket of a chain only: number of runs at which the leaf is packed next.
    pub(super) pack_at: u32,
    pub(super) pages: [u32; 16],
    pub(super) boxes: Boxes<16>,
}

/// The slot number of a node's straddlers.
pub(super) const OWN: u32 = 8;

impl Pooled for Bucket {
    const BLANK: Self = Self {
        bounds: Wide::EMPTY,
        last_bounds: Wide::EMPTY,
        page_count: 0,
        runs: 0,
        polygons: 0,
        split_at: super::tuning::LEAF_RUNS,
        parent: NONE,
        slot: 0,
        next: NONE,
        prev: NONE,
        last: NONE,
        shift: 0,
        movable: 0,
        counts: [0; 16],
        single: 0,
        is_queued: false,
        divides: false,
        drains: false,
        pack_at: super::tuning::PACKED_FIRST,
        pages: [NONE; 16],
        boxes: Boxes::EMPTY,
    };
}

impl Bucket {
    #[inline]
    pub(super) fn used(&self) -> u32 {
        (1 << self.page_count) - 1
    }

    /// Whether the bucket belongs to a leaf in which most polygons have a run of their own. Strokes are inserted in
    /// order and need no packing.
    pub(super) fn is_scattered(&self) -> bool {
        self.slot != OWN && self.polygons < self.runs * 2 && self.runs as usize <= super::tuning::MOST_TAKEN
    }

    /// Updates the copies of a page's data: its number of runs, and whether all of them have one polygon.
    #[inline]
    pub(super) fn note_runs(&mut self, page: &Page) {
        let at = usize::from(page.at) % 16;
        self.counts[at] = page.runs;
        let single = u32::from(page.exact) & page.used() == page.used();
        self.single = self.single & !(1 << at) | u16::from(single) << at;
    }

    /// The position of the last page in `pages`.
    #[inline]
    pub(super) fn last_at(&self) -> usize {
        (self.page_count as usize).wrapping_sub(1) % 16
    }

    /// Recomputes the copies of page data after pages have changed.
    pub(super) fn refresh(&mut self) {
        self.bounds = Wide::from_box(&self.boxes.around(self.used()));
        (self.last, self.last_bounds) = match self.page_count as usize {
            0 => (NONE, Wide::EMPTY),
            n => (self.pages[n - 1], Wide::from_box(&self.boxes.get(n - 1))),
        };
    }
}

/// A node: the eight octants of a cell, with tight boxes around their contents.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub(super) boxes: Boxes<8>,
    pub(super) children: [Link; 8],
    /// The first bucket of the straddlers, the runs that are too long for the children.
    pub(super) own: u32,
    pub(super) parent: u32,
    pub(super) slot: u32,
    /// Level of the node's cell.
    pub(super) shift: u32,
    /// Any key in the node's cell.
    pub(super) key: Key,
}

impl Pooled for Node {
    const BLANK: Self = Self {
        boxes: Boxes::EMPTY,
        children: [Link::NONE; 8],
        own: NONE,
        parent: NONE,
        slot: 0,
        shift: 0,
        key: [0; 3],
    };
}

impl Node {
    /// Mask of the slots in use.
    #[inline]
    pub(super) fn used(&self) -> u32 {
        self.children.iter().rev().fold(0, |used, &link| used << 1 | u32::from(link != Link::NONE))
    }
}

/// The contents of a node's slot, encoded: nothing, a node or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Link(u32);

/// A decoded [`Link`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    Nothing,
    Node(u32),
    Leaf(u32),
}

impl Link {
    pub(super) const NONE: Self = Self(0);

    pub(super) fn node(i: u32) -> Self {
        Self((i + 1) << 1 | 1)
    }

    pub(super) fn leaf(i: u32) -> Self {
        Self((i + 1) << 1)
    }

    #[inline]
    pub(super) fn target(self) -> Target {
        match self.0 {
            0 => Target::Nothing,
            i if i & 1 == 1 => Target::Node((i >> 1) - 1),
            i => Target::Leaf((i >> 1) - 1),
        }
    }

    pub(super) fn to_bits(self) -> u32 {
        self.0
    }

    pub(super) fn from_bits(bits: u32) -> Self {
        Self(bits)
    }
}

/// A run: the polygons `first + bit` for the set bits of `mask`, all of one block of sixteen ids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub(super) first: u32,
    /// Index of the record with its polygons' exact boxes; [`NONE`] for a single polygon, whose box is the run's box.
    pub(super) store: u32,
    pub(super) mask: u16,
}

impl Run {
    /// An empty run.
    pub(super) const NONE: Self = Self { first: 0, store: NONE, mask: 0 };

    /// The run's polygons as a mask of their block.
    #[inline]
    pub(super) fn lanes(&self) -> u16 {
        self.mask << (self.first % 16)
    }

    /// Whether the run is a single polygon, whose box is the run's box.
    #[inline]
    pub(super) fn is_exact(&self) -> bool {
        self.store == NONE
    }
}

/// A run, its box, and whether the box may be too large.
pub(super) type TakenRun = (Run, Aabb, bool);
