//! The ids of scattered polygons that rest, in the order of the tree: what lies in view as a whole, a subtree or a leaf, is
//! copied at once. `rest.rs` writes them.

use super::{
    grid::TOP_SHIFT,
    layout::{Node, Span},
    pool::NONE,
};
use crate::polygon::PolygonId;

/// Levels of nodes at most.
const LEVELS: usize = TOP_SHIFT as usize + 1;

/// Ids in the order of the tree.
#[derive(Clone, Debug)]
pub(super) struct Spans {
    pub(super) ids: Vec<PolygonId>,
    /// The most ids that there have been: memory is only had once it is written to.
    pub(super) most: usize,
    /// The spans of a node hold if it has this number. 0: of none.
    pub(super) edition: u32,
    /// Polygons whose spans have become void, at most.
    pub(super) void: usize,
    /// Commits since the last change.
    pub(super) quiet: u32,
    /// The nodes being written, from the top; empty if nothing is.
    pub(super) open: [Open; LEVELS],
    pub(super) depth: usize,
}

/// A node some of whose slots are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    pub(super) node: u32,
    /// The next slot; [`OWN`] is the last.
    pub(super) slot: u32,
    /// Ids before its first.
    pub(super) start: u32,
}

impl Spans {
    /// Room for so many ids, which is not in memory before it is used.
    pub(super) fn with_room_for(ids: usize) -> Self {
        // In a browser memory that is reserved counts as used.
        let ids = if cfg!(target_family = "wasm") { 0 } else { ids };
        Self {
            ids: Vec::with_capacity(ids),
            most: 0,
            edition: 0,
            void: usize::MAX,
            quiet: 0,
            open: [Open { node: NONE, slot: 0, start: 0 }; LEVELS],
            depth: 0,
        }
    }

    pub(super) fn clear(&mut self) {
        self.ids.clear();
        (self.edition, self.void, self.quiet, self.depth) = (0, usize::MAX, 0, 0);
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        self.most * size_of::<PolygonId>()
    }

    /// The ids of a span.
    #[inline(always)]
    pub(super) fn ids(&self, span: Span) -> &[PolygonId] {
        &self.ids[span.start as usize..][..span.len as usize]
    }

    /// Whether the spans of a node's slots hold.
    #[inline(always)]
    pub(super) fn hold_of(&self, node: &Node) -> bool {
        node.edition == self.edition && self.edition != 0
    }

    /// What is being written is given up.
    #[inline]
    pub(super) fn give_up(&mut self) {
        self.quiet = 0;
        if self.depth > 0 {
            (self.depth, self.void) = (0, usize::MAX);
        }
    }

    /// All ids from a place on.
    pub(super) fn from(&self, start: u32) -> Span {
        Span { start, len: self.ids.len() as u32 - start }
    }
}
