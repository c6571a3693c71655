use super::{
    grid::Key,
    pool::{NONE, Pooled},
};
use crate::{
    index::simd::{Boxes, Halves, Wide},
    math::Aabb,
};

/// Sixteen runs: what they hold. Their boxes are kept apart ([`PageBoxes`]), because a page that is inside every plane
/// is read without them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Page {
    /// Per run the id that bit 0 of its mask stands for.
    pub(super) first: [u32; 16],
    /// Per run its polygons, `first + bit`.
    pub(super) masks: [u16; 16],
    /// The runs of a single polygon, whose box is the polygon's own.
    pub(super) exact: u16,
    /// The runs whose ids are not all from `first` on, one after the other.
    pub(super) gaps: u16,
    /// The runs that have lost a polygon since their box was computed.
    pub(super) loose: u16,
    pub(super) runs: u8,
    /// Place in its bucket.
    pub(super) at: u8,
    /// Whether it waits for upkeep.
    pub(super) queued: bool,
    /// [`NONE`] once it is released; next free page.
    pub(super) bucket: u32,
    /// Next page that waits for upkeep.
    pub(super) next: u32,
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
    };

    fn next_free(&self) -> u32 {
        self.bucket
    }

    fn set_next_free(&mut self, next: u32) {
        self.bucket = next;
    }
}

/// The boxes of a page's runs.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct PageBoxes {
    pub(super) boxes: Halves,
    /// Per run the number of its polygons' boxes; anything for a run of one.
    pub(super) store: [u32; 16],
}

impl Pooled for PageBoxes {
    const BLANK: Self = Self { boxes: Halves::EMPTY, store: [NONE; 16] };

    fn next_free(&self) -> u32 {
        self.store[0]
    }

    fn set_next_free(&mut self, next: u32) {
        self.store[0] = next;
    }
}

impl Page {
    /// Keeps `gaps` right after a run's mask has changed.
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

/// Up to sixteen pages and their boxes. A leaf, or the list of a node's straddlers, is a chain of buckets; only the
/// first of a chain is filled. What inserting a run touches comes first, in two cache lines.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Bucket {
    /// The box around all pages, and the last page's once more.
    pub(super) bounds: Wide,
    pub(super) last_bounds: Wide,
    pub(super) page_count: u32,
    /// First of the chain only: runs in the chain.
    pub(super) runs: u32,
    /// First of the chain only: polygons in the chain.
    pub(super) polygons: u32,
    /// First of the chain only: runs at which a split is tried next.
    pub(super) split_at: u32,
    /// The node it hangs under, and where: a child 0 to 7, or [`OWN`].
    pub(super) parent: u32,
    pub(super) slot: u32,
    /// The next of the chain; next free one.
    pub(super) next: u32,
    /// The one before in the chain, [`NONE`] at the first.
    pub(super) prev: u32,
    /// The number of the last page, once more.
    pub(super) last: u32,
    /// Level of a leaf's cell; 0 for straddlers.
    pub(super) shift: u32,
    /// First of the chain only: runs that were short enough for a smaller cell when they came.
    pub(super) movable: u32,
    /// Per page its runs, once more.
    pub(super) counts: [u8; 16],
    /// The pages whose runs are all of one polygon.
    pub(super) single: u16,
    /// First of the chain only: whether it waits to be packed.
    pub(super) waits: bool,
    /// First of the chain only: whether those behind it wait to be moved to the node's children.
    pub(super) divides: bool,
    /// Whether its runs wait to be moved to the node's children.
    pub(super) drains: bool,
    /// First of the chain only: runs at which it is packed next.
    pub(super) pack_at: u32,
    pub(super) pages: [u32; 16],
    pub(super) boxes: Halves,
}

/// The slot of a node's straddlers.
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
        waits: false,
        divides: false,
        drains: false,
        pack_at: super::tuning::PACKED_FIRST,
        pages: [NONE; 16],
        boxes: Halves::EMPTY,
    };

    fn next_free(&self) -> u32 {
        self.next
    }

    fn set_next_free(&mut self, next: u32) {
        self.next = next;
    }
}

impl Bucket {
    #[inline]
    pub(super) fn used(&self) -> u32 {
        (1 << self.page_count) - 1
    }

    /// Whether it is a leaf most of whose polygons have a run of their own: strokes are in order as they come.
    pub(super) fn is_scattered(&self) -> bool {
        self.slot != OWN && self.polygons < self.runs * 2 && self.runs as usize <= super::tuning::MOST_TAKEN
    }

    /// Notes how many runs a page of the bucket has, and whether all are of one polygon.
    #[inline]
    pub(super) fn note_runs(&mut self, page: &Page) {
        let at = usize::from(page.at) % 16;
        self.counts[at] = page.runs;
        let single = u32::from(page.exact) & page.used() == page.used();
        self.single = self.single & !(1 << at) | u16::from(single) << at;
    }

    /// The place of the last page.
    #[inline]
    pub(super) fn last_at(&self) -> usize {
        (self.page_count as usize).wrapping_sub(1) % 16
    }

    /// Makes the box of a page hold `bounds`; false if it did already.
    #[inline]
    pub(super) fn widen(&mut self, at: usize, bounds: &Aabb) -> bool {
        if !self.boxes.widen(at, bounds) {
            return false;
        }
        let wide = Wide::from_box(bounds);
        self.bounds = self.bounds.union(wide);
        if at == self.last_at() {
            self.last_bounds = self.last_bounds.union(wide);
        }
        true
    }

    /// Recomputes what is kept twice, after pages have changed.
    pub(super) fn refresh(&mut self) {
        self.bounds = Wide::from_box(&self.boxes.around(self.used()));
        (self.last, self.last_bounds) = match self.page_count as usize {
            0 => (NONE, Wide::EMPTY),
            n => (self.pages[n - 1], Wide::from_box(&self.boxes.get(n - 1))),
        };
    }
}

/// Eight parts of a cell, with tight boxes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    pub(super) boxes: Boxes<8>,
    pub(super) children: [Link; 8],
    /// The runs too long for the children.
    pub(super) own: u32,
    pub(super) parent: u32,
    pub(super) slot: u32,
    /// Level of its cell.
    pub(super) shift: u32,
    /// Any place in its cell.
    pub(super) key: Key,
    /// Per child the nodes there and below: how much is about where.
    pub(super) nodes_below: [u32; 8],
    /// Per child where its ids lie once more; see [`super::spans::Spans`].
    pub(super) spans: [Span; 8],
    pub(super) edition: u32,
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
        nodes_below: [0; 8],
        spans: [Span::VOID; 8],
        edition: 0,
    };

    fn next_free(&self) -> u32 {
        self.parent
    }

    fn set_next_free(&mut self, next: u32) {
        self.parent = next;
    }
}

impl Node {
    /// How much is below: nodes and leaves.
    pub(super) fn weight(&self) -> u32 {
        self.nodes_below.iter().sum::<u32>() + self.used().count_ones()
    }

    /// The node below, if nothing else is.
    #[inline]
    pub(super) fn only_node(&self) -> Option<u32> {
        let used = self.used();
        if self.own != NONE || !used.is_power_of_two() {
            return None;
        }
        match self.children[used.trailing_zeros() as usize].target() {
            Target::Node(node) => Some(node),
            _ => None,
        }
    }

    /// Mask of the slots where something hangs.
    #[inline]
    pub(super) fn used(&self) -> u32 {
        self.children.iter().rev().fold(0, |used, &link| used << 1 | u32::from(link != Link::NONE))
    }
}

/// Polygons of a subtree or a leaf, perhaps none, by their places in [`super::spans::Spans::ids`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Span {
    pub(super) start: u32,
    pub(super) len: u32,
}

impl Span {
    pub(super) const VOID: Self = Self { start: u32::MAX, len: 0 };

    #[inline(always)]
    pub(super) const fn is_void(self) -> bool {
        self.start == u32::MAX
    }
}

/// What hangs at a place of the tree: nothing, a node or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Link(u32);

/// A [`Link`], taken apart.
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

/// A run: polygons `first + bit` for the bits of `mask`, all of one block of sixteen ids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub(super) first: u32,
    /// The number of its polygons' boxes; [`NONE`] for a single polygon, whose box is the run's.
    pub(super) store: u32,
    pub(super) mask: u16,
}

impl Run {
    /// No run.
    pub(super) const NONE: Self = Self { first: 0, store: NONE, mask: 0 };

    /// Its polygons as a mask of its block.
    #[inline]
    pub(super) fn lanes(&self) -> u16 {
        self.mask << (self.first % 16)
    }

    /// Whether it is one polygon with its own box.
    #[inline]
    pub(super) fn is_exact(&self) -> bool {
        self.store == NONE
    }
}

/// A run with its box, and whether that may be too wide.
pub(super) type TakenRun = (Run, Aabb, bool);
