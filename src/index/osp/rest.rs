//! Writes a second list of the ids of scattered polygons that do not move. This takes several commits. A *span* is the
//! part of this list with the ids of one child of a node. A change invalidates the spans that contain its leaf.

use super::{
    index::Osp,
    layout::{Node, OWN, Span, Target},
    pool::NONE,
    spans::Open,
};
use crate::polygon::{PolygonId, bits::bits_of};

/// Number of commits without a change before the ids are written.
const QUIET: u32 = 16;

/// Number of ids that a commit writes. If it is larger, the list is complete sooner, and commits take longer.
const IDS_A_COMMIT: usize = 4096;
/// A commit writes at least this fraction of all ids: 1 / `IDS_SHARE`.
const IDS_SHARE: usize = 64;

/// The ids are written again if more than one of every `VOID` ids lies in no valid span.
const VOID: usize = 8;

impl Osp {
    /// Invalidates the span of a slot of `node`, and the spans of all slots above it, because polygons in this slot
    /// change. All spans above an invalid span are invalid.
    #[inline]
    pub(super) fn void_spans(&mut self, node: u32, slot: u32) {
        self.spans.give_up();
        if self.spans.edition != 0 {
            self.void_above(node, slot);
        }
    }

    fn void_above(&mut self, node: u32, slot: u32) {
        let (mut at, mut slot) = (node, slot);
        let mut lost = 0;
        while at != NONE {
            let node = &mut self.nodes[at];
            if slot != OWN {
                let is_held = self.spans.hold_of(node);
                let span = std::mem::replace(&mut node.spans[slot as usize], Span::VOID);
                if !is_held || span.is_void() {
                    break;
                }
                // Only the lowest span counts, because the other ids of the higher spans are in valid spans.
                lost = if lost == 0 { span.len as usize } else { lost };
            }
            (at, slot) = (node.parent, node.slot);
        }
        self.spans.void = self.spans.void.saturating_add(lost);
    }

    /// Writes a part of the ids, if the tree has not changed for [`QUIET`] commits.
    pub(super) fn write_spans(&mut self) {
        if self.is_flat || !self.ids.are_scattered() {
            return;
        }
        let in_tree = self.in_tree();
        if self.spans.depth == 0 {
            if self.spans.void <= in_tree / VOID {
                return;
            }
            self.spans.quiet += 1;
            if self.spans.quiet < QUIET {
                return;
            }
            self.spans.ids.clear();
            self.spans.ids.reserve(in_tree);
            self.spans.edition = self.spans.edition.wrapping_add(1).max(1);
            self.enter(self.top);
        }
        let enough = self.spans.ids.len() + (in_tree / IDS_SHARE).max(IDS_A_COMMIT);
        while self.spans.depth > 0 && self.spans.ids.len() < enough {
            self.write_slot();
        }
        self.spans.most = self.spans.most.max(self.spans.ids.len());
        if self.spans.depth == 0 {
            self.spans.void = 0;
        }
    }

    fn enter(&mut self, node: u32) {
        let edition = self.spans.edition;
        let entered = &mut self.nodes[node];
        (entered.edition, entered.spans) = (edition, [Span::VOID; 8]);
        self.spans.open[self.spans.depth] = Open { node, slot: 0, start: self.spans.ids.len() as u32 };
        self.spans.depth += 1;
    }

    /// Writes the next slot of the lowest open node.
    fn write_slot(&mut self) {
        let open = &mut self.spans.open[self.spans.depth - 1];
        let Open { node, slot, start } = *open;
        open.slot += 1;
        if slot < OWN {
            match self.nodes[node].children[slot as usize].target() {
                // An empty span is valid. So `void_above` continues to the root when a polygon enters this slot.
                Target::Nothing => {
                    self.nodes[node].spans[slot as usize] = self.spans.from(self.spans.ids.len() as u32);
                }
                Target::Node(below) => self.enter(below),
                Target::Leaf(head) => {
                    let start = self.spans.ids.len() as u32;
                    self.write_chain(head);
                    self.nodes[node].spans[slot as usize] = self.spans.from(start);
                }
            }
            return;
        }
        self.write_chain(self.nodes[node].own);
        self.spans.depth -= 1;
        if self.spans.depth > 0 {
            let Node { parent, slot, .. } = self.nodes[node];
            self.nodes[parent].spans[slot as usize] = self.spans.from(start);
        }
    }

    fn write_chain(&mut self, head: u32) {
        let mut at = head;
        while at != NONE {
            let bucket = &self.buckets[at];
            for &page in &bucket.pages[..bucket.page_count as usize] {
                let page = &self.pages[page];
                for (&first, &mask) in page.first.iter().zip(&page.masks).take(usize::from(page.runs)) {
                    self.spans.ids.extend(bits_of(u64::from(mask)).map(|bit| PolygonId(first + bit as u32)));
                }
            }
            at = bucket.next;
        }
    }
}
