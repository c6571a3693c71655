#![expect(unsafe_code, reason = "boxes in use are looked up without a check; it pays in queries")]
//! The walk in the order of the ids: a hierarchy of boxes around 16, 256 and 4,096 consecutive ids. It answers a query
//! alone if few groups of 256 ids are cut by a plane. Otherwise the tree answers for the filed polygons, and this walk
//! for the rest.

use super::{
    query::count,
    shelf::{Around, BLOCKS, Shelf},
    store::Store,
};
use crate::index::{
    WorkCounts,
    mask_writer::{RunSink, ones},
    simd::{Boxes, Kernel, PlaneSet, Sides, WithKernel, lanes_of},
};

/// The polygons that a walk reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    All,
    /// The polygons that are not in the tree.
    Unfiled,
}

impl Of {
    /// The lanes with polygons to report.
    #[inline(always)]
    fn wanted(self, around: &Around) -> u16 {
        if self == Self::All { around.used } else { around.unfiled }
    }
}

/// A shelf that a query may see: its entry in the directory, the planes that cut it, and the test of its groups.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    entry: u32,
    planes: u8,
    groups: u16,
    sides: Sides,
}

/// The first part of a walk: finds the shelves that a query may see. Returns whether planes cut at most `most` groups. If
/// they cut more, the walk may stop early.
pub(super) struct FindShelves<'a> {
    pub(super) store: &'a Store,
    pub(super) planes: &'a PlaneSet,
    pub(super) of: Of,
    pub(super) most: usize,
    pub(super) may_stop: bool,
    pub(super) seen: &'a mut Vec<Seen>,
}

impl WithKernel for FindShelves<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) -> bool {
        let (store, mut cut) = (self.store, 0);
        for (at, top) in store.tops.iter().enumerate() {
            let wanted = self.of.wanted(top);
            if wanted == 0 {
                continue;
            }
            let sides = test(kernel, self.planes, top, wanted & !top.stale, PlaneSet::ALL);
            for lane in lanes_of(wanted & (top.stale | !sides.behind as u16)) {
                let is_stale = top.stale >> lane & 1 == 1;
                let planes = if is_stale { PlaneSet::ALL } else { sides.planes_at(PlaneSet::ALL, lane) };
                cut += self.shelf(kernel, at * 16 + lane, planes);
                if self.may_stop && cut > self.most {
                    return false;
                }
            }
        }
        cut <= self.most
    }
}

impl FindShelves<'_> {
    #[inline(always)]
    fn shelf<K: Kernel>(&mut self, kernel: K, entry: usize, planes: u8) -> usize {
        let top = &self.store.shelf_at(entry).top;
        let wanted = self.of.wanted(top);
        let sides = test(kernel, self.planes, top, wanted & !top.stale, planes);
        let groups = wanted & (top.stale | !sides.behind as u16);
        let cut = groups & (top.stale | sides.cut as u16);
        self.seen.push(Seen { entry: entry as u32, planes, groups, sides });
        cut.count_ones() as usize
    }
}

/// Tests the boxes `fresh`, which are not stale.
#[inline(always)]
fn test<K: Kernel>(kernel: K, planes: &PlaneSet, around: &Around, fresh: u16, mask: u8) -> Sides {
    if fresh == 0 { Sides::NONE } else { planes.sides_in_order(kernel, mask, &around.boxes) }
}

/// The second part of a walk: a query of the shelves that the first part has found.
pub(super) struct InOrder<'a, S> {
    pub(super) store: &'a Store,
    pub(super) planes: &'a PlaneSet,
    pub(super) of: Of,
    pub(super) seen: &'a [Seen],
    pub(super) out: S,
}

impl<S: RunSink> WithKernel for InOrder<'_, S> {
    type Output = (WorkCounts, S);

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> Self::Output {
        let Self { store, planes, of, seen, out } = self;
        let mut walk = Walk { store, planes, kernel, of, out, work: WorkCounts::default() };
        for wanted in store.tops.iter().map(|top| of.wanted(top)).filter(|&wanted| wanted != 0) {
            walk.work.nodes += 1;
            count(&mut walk.work, wanted.count_ones(), PlaneSet::ALL);
        }
        let before = walk.out.found();
        for seen in seen {
            walk.shelf(seen);
        }
        walk.work.reported = (walk.out.found() - before) as u64;
        (walk.work, walk.out)
    }
}

struct Walk<'a, K, S> {
    store: &'a Store,
    planes: &'a PlaneSet,
    kernel: K,
    of: Of,
    out: S,
    work: WorkCounts,
}

/// With more planes, all are tested, because this takes no loop over the planes.
const FEW_PLANES: u32 = 3;

impl<K: Kernel, S: RunSink> Walk<'_, K, S> {
    #[inline(always)]
    fn shelf(&mut self, &Seen { entry, planes, groups, sides }: &Seen) {
        let (shelf, first) = (self.store.shelf_at(entry as usize), entry as usize * BLOCKS);
        if planes == 0 && self.of == Of::All {
            self.work.taken_whole += self.out.push_masks(self.kernel, first, &shelf.live) as u64;
            return;
        }
        self.work.nodes += 1;
        count(&mut self.work, 16, planes);
        for group in lanes_of(groups) {
            let is_stale = shelf.top.stale >> group & 1 == 1;
            let planes = if is_stale { PlaneSet::ALL } else { sides.planes_at(planes, group) };
            self.group(first, shelf, group, planes);
        }
    }

    /// The polygons of a block to report.
    #[inline(always)]
    fn lanes(&self, shelf: &Shelf, block: usize) -> u16 {
        let live = shelf.live[block];
        if self.of == Of::All { live } else { live & !shelf.filed[block] }
    }

    /// The polygons of sixteen blocks to report.
    #[inline(always)]
    fn group_lanes(&self, shelf: &Shelf, base: usize) -> [u16; 16] {
        let mut lanes = [0; 16];
        lanes.copy_from_slice(&shelf.live[base..base + 16]);
        if self.of != Of::All {
            for (lanes, filed) in lanes.iter_mut().zip(&shelf.filed[base..base + 16]) {
                *lanes &= !filed;
            }
        }
        lanes
    }

    #[inline(always)]
    fn group(&mut self, first: usize, shelf: &Shelf, group: usize, mask: u8) {
        let (around, base) = (&shelf.groups[group], group * 16);
        let wanted = self.of.wanted(around);
        let stale = if around.is_wide { u16::MAX } else { around.stale };
        let sides = test(self.kernel, self.planes, around, wanted & !stale, mask);
        self.work.nodes += 1;
        if mask != 0 && !around.is_wide {
            count(&mut self.work, 16, mask);
        }
        let seen = wanted & (stale | !sides.behind as u16);
        let cut = if mask == 0 { 0 } else { seen & (stale | sides.cut as u16) };
        let whole = seen & !cut;
        if whole != 0 {
            let mut masks = self.group_lanes(shelf, base);
            for (at, mask) in masks.iter_mut().enumerate() {
                *mask &= 0u16.wrapping_sub(whole >> at & 1);
            }
            self.work.taken_whole += u64::from(ones(&masks));
            self.out.push_masks(self.kernel, first + base, &masks);
        }
        // All blocks are tested against the same planes, so that a processor can predict the loop.
        count(&mut self.work, 16 * cut.count_ones(), mask);
        let is_few = mask.count_ones() <= FEW_PLANES;
        let blocks = cut.trailing_ones() as usize;
        if blocks >= ROW
            && cut.count_ones() as usize == blocks
            && !is_few
            && let Some(row) = self.store.row(shelf, group, blocks)
        {
            let lanes = self.group_lanes(shelf, base);
            let seen = seen_of(self.kernel, self.planes, &lanes, row);
            self.out.push_masks(self.kernel, first + base, &seen[..blocks]);
            return;
        }
        for lane in lanes_of(cut) {
            let block = base + lane % 16;
            // SAFETY: a block that is wanted has a polygon; `validate` checks its bits.
            let boxes = unsafe { self.store.known_boxes(shelf.boxes[block]) };
            let behind = match is_few {
                true => self.planes.behind(self.kernel, mask, boxes),
                false => self.planes.behind_any(self.kernel, boxes),
            };
            self.out.push_block(self.kernel, first + block, self.lanes(shelf, block) & !behind as u16);
        }
    }
}

/// Least number of neighbouring blocks that are tested in a loop of their own.
const ROW: usize = 8;

/// The polygons of neighbouring blocks that no plane excludes. In a loop of its own, the planes stay in registers.
#[inline(always)]
fn seen_of<K: Kernel>(kernel: K, planes: &PlaneSet, lanes: &[u16; 16], boxes: &[Boxes<16>]) -> [u16; 16] {
    // Without `black_box`, the compiler would prepare the planes once for all groups, and run out of registers.
    let planes = std::hint::black_box(planes);
    let mut seen = [0; 16];
    for ((seen, lanes), boxes) in seen.iter_mut().zip(lanes).zip(boxes) {
        *seen = lanes & !(planes.behind_any(kernel, boxes) as u16);
    }
    seen
}
