use super::{
    grid::Key,
    pool::{NONE, Pooled},
};
use crate::{index::simd::Boxes, math::Aabb};

/// Sixteen runs: their boxes and what they hold.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Page {
    pub(super) boxes: Boxes<16>,
    /// Per run the id that bit 0 of its mask stands for.
    pub(super) first: [u32; 16],
    /// Per run its polygons, `first + bit`.
    pub(super) masks: [u16; 16],
    /// The runs of a single polygon, whose box is the polygon's own.
    pub(super) exact: u16,
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
        boxes: Boxes::EMPTY,
        first: [0; 16],
        masks: [0; 16],
        exact: 0,
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

impl Page {
    /// A run and its box.
    #[inline]
    pub(super) fn run(&self, lane: usize) -> (Run, Aabb) {
        let exact = self.exact >> lane & 1 == 1;
        (Run { first: self.first[lane], mask: self.masks[lane], exact }, self.boxes.get(lane))
    }

    /// Sets a run; it counts as tight.
    #[inline]
    pub(super) fn set_run(&mut self, lane: usize, run: Run, bounds: &Aabb) {
        self.boxes.set(lane, bounds);
        self.first[lane] = run.first;
        self.masks[lane] = run.mask;
        self.exact = self.exact & !(1 << lane) | u16::from(run.exact) << lane;
        self.loose &= !(1 << lane);
    }

    /// Mask of the lanes in use.
    #[inline]
    pub(super) fn used(&self) -> u32 {
        (1 << self.runs) - 1
    }
}

/// Up to sixteen pages and their boxes. A leaf, or the list of a node's straddlers, is a chain of buckets; only the
/// first of a chain is filled.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Bucket {
    pub(super) boxes: Boxes<16>,
    pub(super) pages: [u32; 16],
    pub(super) page_count: u32,
    /// The next of the chain; next free one.
    pub(super) next: u32,
    /// The one before in the chain, [`NONE`] at the first.
    pub(super) prev: u32,
    /// The node it hangs under, and where: a child 0 to 7, or [`OWN`].
    pub(super) parent: u32,
    pub(super) slot: u32,
    /// First of the chain only: runs in the chain.
    pub(super) runs: u32,
    /// First of the chain only: polygons in the chain.
    pub(super) polygons: u32,
    /// First of the chain only: runs at which a split is tried next.
    pub(super) split_at: u32,
}

/// The slot of a node's straddlers.
pub(super) const OWN: u32 = 8;

impl Pooled for Bucket {
    const BLANK: Self = Self {
        boxes: Boxes::EMPTY,
        pages: [NONE; 16],
        page_count: 0,
        next: NONE,
        prev: NONE,
        parent: NONE,
        slot: 0,
        runs: 0,
        polygons: 0,
        split_at: super::tuning::LEAF_RUNS,
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
    /// Runs here and below.
    pub(super) runs: u32,
    /// Polygons here and below.
    pub(super) polygons: u32,
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
        runs: 0,
        polygons: 0,
    };

    fn next_free(&self) -> u32 {
        self.parent
    }

    fn set_next_free(&mut self, next: u32) {
        self.parent = next;
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

/// A run on its way into the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Run {
    pub(super) first: u32,
    pub(super) mask: u16,
    /// Whether it is one polygon with its own box.
    pub(super) exact: bool,
}
