use std::ops::Range;

use super::{by_id::NO_POLYGON, item::Item, sink::Sink};
use osp::{
    index::{
        WorkCounts,
        kernels::{Boxes, Kernel, PlaneSet},
    },
    math::Aabb,
    polygon::PolygonId,
};

/// Number of boxes that are tested at once against a plane, by four, two or one SIMD instructions.
pub(super) const LANES: usize = 16;

/// The planes against which boxes are tested: the planes of `all` that `mask` selects.
#[derive(Clone, Copy)]
pub(super) struct Planes<'a> {
    pub(super) all: &'a PlaneSet,
    pub(super) mask: u8,
}

/// Tests the boxes in `lanes` exactly. Adds the ids of boxes that belong to a polygon and are not behind any plane.
#[inline(always)]
pub(super) fn cull_lanes<K: Kernel>(
    kernel: K,
    (boxes, ids, lanes): (&Boxes<LANES>, &[u32; LANES], u32),
    planes: Planes<'_>,
    sink: &mut impl Sink,
    work: &mut WorkCounts,
) {
    let seen = lanes & !planes.all.behind(kernel, planes.mask, boxes) & in_use(ids);
    work.boxes += u64::from(lanes.count_ones());
    work.planes += u64::from(lanes.count_ones() * planes.mask.count_ones());
    work.reported += u64::from(seen.count_ones());
    if seen != 0 {
        sink.put_lanes(kernel, ids, seen);
    }
}

/// Boxes with their ids. Blocks of sixteen boxes store each side as an array, so that SIMD instructions test many boxes
/// against one plane.
#[derive(Clone, Debug, Default)]
pub(super) struct BoxLanes {
    /// The ids. The last block is filled with [`NO_POLYGON`].
    ids: Vec<PolygonId>,
    blocks: Vec<Boxes<LANES>>,
    len: usize,
}

impl BoxLanes {
    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn clear(&mut self) {
        self.ids.clear();
        self.blocks.clear();
        self.len = 0;
    }

    pub(super) fn reserve(&mut self, additional: usize) {
        self.ids.reserve(additional + LANES);
        self.blocks.reserve(additional.div_ceil(LANES) + 1);
    }

    pub(super) fn append(&mut self, items: &[Item]) {
        for item in items {
            let lane = self.len % LANES;
            if lane == 0 {
                self.blocks.push(Boxes::EMPTY);
                self.ids.resize(self.len + LANES, NO_POLYGON);
            }
            self.ids[self.len] = item.id;
            self.blocks[self.len / LANES].set(lane, &item.bounds);
            self.len += 1;
        }
    }

    pub(super) fn set(&mut self, at: usize, bounds: &Aabb) {
        self.blocks[at / LANES].set(at % LANES, bounds);
    }

    /// Makes a hole: the box stays, but belongs to no polygon.
    pub(super) fn vacate(&mut self, at: usize) {
        self.ids[at] = NO_POLYGON;
    }

    pub(super) fn get(&self, at: usize) -> Aabb {
        self.blocks[at / LANES].get(at % LANES)
    }

    pub(super) fn ids(&self) -> &[PolygonId] {
        &self.ids[..self.len]
    }

    pub(super) fn bounds(&self, range: Range<usize>) -> Aabb {
        let parts = blocks_of(range).map(|(block, lanes)| self.blocks[block].around(lanes));
        parts.fold(Aabb::EMPTY, |all, part| all.union(&part))
    }

    #[inline(always)]
    fn ids_of(&self, block: usize) -> [u32; LANES] {
        let ids: &[PolygonId; LANES] =
            self.ids[block * LANES..].first_chunk().expect("ids are kept in whole blocks");
        ids.map(|id| id.0)
    }

    /// Tests each box of a range.
    #[inline(always)]
    pub(super) fn cull<K: Kernel>(
        &self,
        range: Range<usize>,
        kernel: K,
        planes: Planes<'_>,
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
        for (block, lanes) in blocks_of(range) {
            cull_lanes(kernel, (&self.blocks[block], &self.ids_of(block), lanes), planes, sink, work);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        self.ids.capacity() * size_of::<PolygonId>() + self.blocks.capacity() * size_of::<Boxes<LANES>>()
    }
}

/// The lanes that belong to a polygon.
#[inline(always)]
fn in_use(ids: &[u32; LANES]) -> u32 {
    ids.iter().enumerate().fold(0, |lanes, (lane, &id)| lanes | u32::from(id != NO_POLYGON.0) << lane)
}

/// The blocks that a range reaches, with the lanes of each block that are in the range.
#[inline(always)]
fn blocks_of(range: Range<usize>) -> impl Iterator<Item = (usize, u32)> {
    let blocks = range.start / LANES..range.end.div_ceil(LANES).max(range.start / LANES);
    blocks.map(move |block| {
        let from = range.start.saturating_sub(block * LANES);
        let to = (range.end - block * LANES).min(LANES);
        (block, (1u32 << to) - (1u32 << from))
    })
}
