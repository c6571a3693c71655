//! Buckets of polygons with their boxes side by side, for trees that grow: a node has a chain of buckets.

use super::{
    item::Item,
    lanes::{LANES, Planes, cull_lanes},
    sink::Sink,
};
use osp::{
    index::{
        WorkCounts,
        kernels::{Boxes, Kernel},
    },
    math::Aabb,
    polygon::PolygonId,
};

/// The number that stands for no bucket.
pub(super) const NONE: u32 = u32::MAX;

/// The position of a polygon: the number of its bucket, times the capacity of a bucket, plus its lane in the bucket.
pub(super) type Spot = u32;

/// The value that stands for no spot.
pub(super) const NOWHERE: Spot = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Bucket<const B: usize> {
    boxes: [Boxes<LANES>; B],
    ids: [[PolygonId; LANES]; B],
    len: u32,
    /// The next bucket of the chain; in a free bucket, the next free bucket.
    next: u32,
    /// The node that the chain belongs to.
    owner: u32,
}

impl<const B: usize> Bucket<B> {
    fn item(&self, lane: usize) -> Item {
        let (block, lane) = (lane / LANES, lane % LANES);
        Item { bounds: self.boxes[block].get(lane), id: self.ids[block][lane] }
    }

    fn set(&mut self, lane: usize, item: &Item) {
        let (block, lane) = (lane / LANES, lane % LANES);
        self.ids[block][lane] = item.id;
        self.boxes[block].set(lane, &item.bounds);
    }
}

/// All buckets of a tree, with `B` times [`LANES`] polygons each. Only the first bucket of a chain may have free lanes, so
/// a chain is as short as possible.
#[derive(Clone, Debug)]
pub(super) struct Buckets<const B: usize> {
    buckets: Vec<Bucket<B>>,
    first_free: u32,
}

impl<const B: usize> Buckets<B> {
    const N: usize = B * LANES;

    pub(super) fn with_capacity(polygons: usize) -> Self {
        Self { buckets: Vec::with_capacity(polygons.div_ceil(Self::N)), first_free: NONE }
    }

    pub(super) fn clear(&mut self) {
        self.buckets.clear();
        self.first_free = NONE;
    }

    pub(super) fn bytes(&self) -> usize {
        self.buckets.capacity() * size_of::<Bucket<B>>()
    }

    /// The node of the bucket that contains a spot.
    pub(super) fn owner(&self, spot: Spot) -> u32 {
        self.buckets[spot as usize / Self::N].owner
    }

    pub(super) fn set_bounds(&mut self, spot: Spot, bounds: &Aabb) {
        let bucket = &mut self.buckets[spot as usize / Self::N];
        let lane = spot as usize % Self::N;
        let id = bucket.item(lane).id;
        bucket.set(lane, &Item { bounds: *bounds, id });
    }

    /// Adds a polygon to the chain that starts at `head`.
    pub(super) fn push(&mut self, head: &mut u32, owner: u32, item: &Item) -> Spot {
        if *head == NONE || self.buckets[*head as usize].len as usize == Self::N {
            *head = self.take(*head, owner);
        }
        let bucket = &mut self.buckets[*head as usize];
        let lane = bucket.len as usize;
        bucket.len += 1;
        bucket.set(lane, item);
        *head * Self::N as u32 + lane as u32
    }

    fn take(&mut self, next: u32, owner: u32) -> u32 {
        if self.first_free == NONE {
            let ids = [[PolygonId(0); LANES]; B];
            self.buckets.push(Bucket { boxes: [Boxes::EMPTY; B], ids, len: 0, next, owner });
            return self.buckets.len() as u32 - 1;
        }
        let at = self.first_free;
        let bucket = &mut self.buckets[at as usize];
        self.first_free = bucket.next;
        (bucket.len, bucket.next, bucket.owner) = (0, next, owner);
        at
    }

    /// Removes a polygon from its chain. Returns the id of the polygon that moves to its spot, if any.
    pub(super) fn remove(&mut self, head: &mut u32, spot: Spot) -> Option<PolygonId> {
        let first = *head as usize;
        let last_lane = self.buckets[first].len as usize - 1;
        let last = self.buckets[first].item(last_lane);
        let moved = (spot as usize != first * Self::N + last_lane).then(|| {
            self.buckets[spot as usize / Self::N].set(spot as usize % Self::N, &last);
            last.id
        });
        self.buckets[first].len -= 1;
        if last_lane == 0 {
            *head = self.buckets[first].next;
            self.give(first as u32);
        }
        moved
    }

    fn give(&mut self, at: u32) {
        let bucket = &mut self.buckets[at as usize];
        (bucket.len, bucket.next, bucket.owner) = (0, self.first_free, NONE);
        self.first_free = at;
    }

    /// Removes all polygons of a chain.
    pub(super) fn drain(&mut self, head: &mut u32, into: &mut Vec<Item>) {
        into.extend(self.items(*head).map(|(_, item)| item));
        while *head != NONE {
            let next = self.buckets[*head as usize].next;
            self.give(*head);
            *head = next;
        }
    }

    /// Assigns a chain to another node.
    pub(super) fn set_owner(&mut self, head: u32, owner: u32) {
        let mut at = head;
        while let Some(bucket) = self.buckets.get_mut(at as usize) {
            bucket.owner = owner;
            at = bucket.next;
        }
    }

    /// The polygons of a chain.
    pub(super) fn items(&self, head: u32) -> impl Iterator<Item = (Spot, Item)> + '_ {
        self.chain(head).flat_map(|(at, bucket)| {
            (0..bucket.len as usize).map(move |lane| (at * Self::N as u32 + lane as u32, bucket.item(lane)))
        })
    }

    fn chain(&self, head: u32) -> impl Iterator<Item = (u32, &Bucket<B>)> {
        let mut at = head;
        std::iter::from_fn(move || {
            let bucket = self.buckets.get(at as usize)?;
            Some((std::mem::replace(&mut at, bucket.next), bucket))
        })
    }

    /// The smallest box around a chain.
    pub(super) fn bounds(&self, head: u32) -> Aabb {
        self.items(head).fold(Aabb::EMPTY, |all, (_, item)| all.union(&item.bounds))
    }

    /// Tests the polygons of a chain.
    #[inline(always)]
    pub(super) fn cull<K: Kernel>(
        &self,
        head: u32,
        kernel: K,
        planes: Planes<'_>,
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
        for (_, bucket) in self.chain(head) {
            for block in 0..(bucket.len as usize).div_ceil(LANES) {
                let lanes = (1u32 << (bucket.len as usize - block * LANES).min(LANES)) - 1;
                let ids = bucket.ids[block].map(|id| id.0);
                cull_lanes(kernel, (&bucket.boxes[block], &ids, lanes), planes, sink, work);
            }
        }
    }

    /// Reports the polygons of a chain without a test.
    pub(super) fn take_all(&self, head: u32, sink: &mut impl Sink, work: &mut WorkCounts) {
        for (_, bucket) in self.chain(head) {
            let ids = &bucket.ids.as_flattened()[..bucket.len as usize];
            work.taken_whole += ids.len() as u64;
            work.reported += ids.len() as u64;
            sink.put(ids);
        }
    }
}
