//! The ids of scattered polygons that do not move, in the order of the tree. If a subtree or leaf is wholly in
//! view, a query copies all its ids at once. `rest.rs` writes the ids.

use super::{
    grid::TOP_SHIFT,
    layout::{Node, Span},
    pool::NONE,
};
use crate::polygon::PolygonId;

/// Greatest number of levels of nodes.
const LEVELS: usize = TOP_SHIFT as usize + 1;

/// The ids of all polygons in the order of the tree, and the number of ids of each subtree.
#[derive(Clone, Debug)]
pub(super) struct Spans {
    pub(super) ids: Vec<PolygonId>,
    /// Largest number of ids so far, for [`Spans::bytes`]. The system has not committed the memory of further ids.
    pub(super) most: usize,
    /// The spans of a node are valid if the node's edition equals this number. If this number is 0, no span
    /// is valid.
    pub(super) edition: u32,
    /// Upper bound of the number of polygons in void spans.
    pub(super) void: usize,
    /// Number of commits since the last change.
    pub(super) quiet: u32,
    /// The nodes whose spans are being written, from the top; the first `depth` are in use.
    pub(super) open: [Open; LEVELS],
    pub(super) depth: usize,
}

/// A node whose slots are being written one after the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    pub(super) node: u32,
    /// The next slot to write. The last slot is [`OWN`](super::layout::OWN).
    pub(super) slot: u32,
    /// Number of ids in the list before the node's first id.
    pub(super) start: u32,
}

impl Spans {
    /// An empty list with room for this number of ids. The system commits the memory at the first write.
    pub(super) fn with_room_for(ids: usize) -> Self {
        // In a browser, reserved memory counts as used.
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

    /// Whether the spans of a node may be valid. A span of another edition is void.
    #[inline(always)]
    pub(super) fn hold_of(&self, node: &Node) -> bool {
        node.edition == self.edition && self.edition != 0
    }

    /// Records a change: restarts the count of quiet commits, and abandons unfinished writing.
    #[inline]
    pub(super) fn give_up(&mut self) {
        self.quiet = 0;
        if self.depth > 0 {
            (self.depth, self.void) = (0, usize::MAX);
        }
    }

    /// The span of all ids from position `start` on.
    pub(super) fn from(&self, start: u32) -> Span {
        Span { start, len: self.ids.len() as u32 - start }
    }
}
