use glam::Vec3;

use super::{BucketTree, NONE, Partition, ROOT, TreeNode};
use crate::{buckets, buckets::NOWHERE, item::Item};
use osp::{math::Aabb, polygon::PolygonId};

impl<P: Partition> BucketTree<P> {
    /// The leaf that contains a centre. [`None`] if the centre is outside the root's cell.
    pub(super) fn leaf_for(&self, center: Vec3) -> Option<u32> {
        if self.partition.grow(&self.node(ROOT).cell, center).is_some() {
            return None;
        }
        let mut at = ROOT;
        while !self.node(at).is_leaf() {
            at = self.child_for(at, center);
        }
        Some(at)
    }

    fn child_for(&self, at: u32, center: Vec3) -> u32 {
        self.node(at).first_child + self.partition.child_of(&self.node(at).cell, center) as u32
    }

    /// Inserts a polygon from the root down. Splits its leaf if the leaf is full, or rebuilds the highest subtree that has
    /// become lopsided.
    pub(super) fn insert_item(&mut self, item: &Item) {
        self.upkeep.inserted += 1;
        let center = item.bounds.center();
        self.grow_for(center);
        let mut at = ROOT;
        let (mut lopsided, mut boxes) = (NONE, 0);
        loop {
            let node = self.node_mut(at);
            node.bounds = node.bounds.union(&item.bounds);
            node.polygons += 1;
            boxes += 1;
            if node.is_leaf() {
                break;
            }
            let (count, rebuild_at) = (node.polygons, node.rebuild_at);
            let child = self.child_for(at, center);
            let below = self.node(child).polygons + 1;
            if lopsided == NONE && count > rebuild_at && self.partition.is_lopsided(count, below) {
                lopsided = at;
            }
            at = child;
        }
        self.upkeep.boxes += boxes;
        self.push(at, item);
        if lopsided != NONE {
            self.gather_subtree(lopsided);
            self.build_below(lopsided);
        } else if self.node(at).polygons > self.node(at).rebuild_at {
            self.gather_subtree(at);
            self.build_below(at);
        }
    }

    fn push(&mut self, leaf: u32, item: &Item) {
        let mut chain = self.node(leaf).chain;
        let spot = self.buckets.push(&mut chain, leaf, item);
        self.node_mut(leaf).chain = chain;
        self.spot.set(item.id, spot);
    }

    fn grow_for(&mut self, center: Vec3) {
        while let Some((cell, place)) = self.partition.grow(&self.node(ROOT).cell, center) {
            if self.node(ROOT).is_leaf() {
                self.node_mut(ROOT).cell = cell;
                continue;
            }
            // The old root becomes a child of the new root, which gets the number of the old root.
            let first_child = self.allocate_children();
            let old = *self.node(ROOT);
            let moved = first_child + place as u32;
            for i in 0..P::ARITY {
                *self.node_mut(first_child + i as u32) = self.new_leaf(P::child_cell(&cell, i), ROOT);
            }
            *self.node_mut(moved) = TreeNode { parent: ROOT, ..old };
            for child in self.children(moved) {
                self.node_mut(child).parent = moved;
            }
            if old.is_leaf() {
                self.buckets.set_owner(old.chain, moved);
            }
            let node = self.node_mut(ROOT);
            (node.cell, node.first_child, node.chain) = (cell, first_child, buckets::NONE);
        }
    }

    /// Returns the first node of an unused group of children.
    fn allocate_children(&mut self) -> u32 {
        if self.first_free == NONE {
            let first = self.nodes.len() as u32;
            let filler = self.new_leaf(self.node(ROOT).cell, NONE);
            self.nodes.extend(std::iter::repeat_n(filler, P::ARITY));
            return first;
        }
        let first = self.first_free;
        self.first_free = self.node(first).parent;
        first
    }

    fn free_children(&mut self, first: u32) {
        self.node_mut(first).parent = self.first_free;
        self.first_free = first;
    }

    /// Moves all polygons of a subtree into `items` and makes its top an empty leaf.
    fn gather_subtree(&mut self, top: u32) {
        self.items.clear();
        self.pending.clear();
        self.pending.push((top, 0, 0));
        while let Some((at, ..)) = self.pending.pop() {
            let node = self.node_mut(at);
            let first_child = node.first_child;
            let mut chain = node.chain;
            (node.first_child, node.chain) = (NONE, buckets::NONE);
            self.buckets.drain(&mut chain, &mut self.items);
            if first_child != NONE {
                self.pending.extend((0..P::ARITY as u32).map(|i| (first_child + i, 0, 0)));
                self.free_children(first_child);
            }
        }
    }

    /// Builds a subtree of all `items` below an empty leaf. It splits until the leaves are small enough or no split
    /// separates their polygons.
    fn build_below(&mut self, top: u32) {
        let mut items = std::mem::take(&mut self.items);
        self.pending.clear();
        self.pending.push((top, 0, items.len() as u32));
        self.upkeep.inserted += items.len() as u64;
        while let Some((at, start, end)) = self.pending.pop() {
            let mut rest = &mut items[start as usize..end as usize];
            let count = end - start;
            let node = self.node_mut(at);
            node.polygons = count;
            node.bounds = rest.iter().fold(Aabb::EMPTY, |all, item| all.union(&item.bounds));
            let cell = node.cell;
            self.upkeep.boxes += 1;
            let is_large = count > self.leaf_capacity;
            let Some(own) = is_large.then(|| self.partition.split(&cell, rest)).flatten() else {
                self.node_mut(at).rebuild_at = if is_large { 2 * count } else { self.leaf_capacity };
                rest.iter().for_each(|item| self.push(at, item));
                continue;
            };
            let first_child = self.allocate_children();
            let node = self.node_mut(at);
            (node.cell, node.first_child, node.rebuild_at) = (own, first_child, count + count / 2);
            let mut start = start;
            for i in 0..P::ARITY {
                let child = first_child + i as u32;
                *self.node_mut(child) = self.new_leaf(P::child_cell(&own, i), at);
                let own_items =
                    partition(rest, |item| self.partition.child_of(&own, item.bounds.center()) == i);
                self.pending.push((child, start, start + own_items as u32));
                start += own_items as u32;
                rest = &mut rest[own_items..];
            }
        }
        self.items = items;
    }

    /// Removes a polygon and tightens the boxes above. Then rebuilds the highest subtree that has become small: with
    /// few polygons it becomes a leaf. If splits follow the polygons, a subtree is also built again when half of its
    /// polygons are removed.
    pub(super) fn take_out(&mut self, id: PolygonId) {
        let spot = self.spot.get(id);
        self.spot.set(id, NOWHERE);
        let leaf = self.buckets.owner(spot);
        let mut chain = self.node(leaf).chain;
        if let Some(moved) = self.buckets.remove(&mut chain, spot) {
            self.spot.set(moved, spot);
        }
        self.node_mut(leaf).chain = chain;
        let mut small = NONE;
        let mut at = leaf;
        while at != NONE {
            let node = self.node_mut(at);
            node.polygons -= 1;
            let (polygons, parent) = (node.polygons, node.parent);
            // `rebuild_at` is one and a half times the number at the build, so a third of it is half of that number.
            let has_shrunk = P::FOLLOWS_POLYGONS && polygons < node.rebuild_at / 3;
            if !node.is_leaf() && (has_shrunk || polygons <= self.leaf_capacity / 2) {
                small = at;
            }
            at = parent;
        }
        if small != NONE {
            self.gather_subtree(small);
            self.build_below(small);
            self.tighten_upwards(self.node(small).parent);
        } else {
            self.tighten_upwards(leaf);
        }
    }

    /// Tightens the boxes from a node upwards, as long as they change.
    pub(super) fn tighten_upwards(&mut self, mut at: u32) {
        while at != NONE {
            self.upkeep.boxes += 1;
            let node = self.node(at);
            let bounds = if node.is_leaf() {
                self.buckets.bounds(node.chain)
            } else {
                self.children(at).fold(Aabb::EMPTY, |all, child| all.union(&self.node(child).bounds))
            };
            if bounds == self.node(at).bounds {
                return;
            }
            self.node_mut(at).bounds = bounds;
            at = self.node(at).parent;
        }
    }
}

/// Moves the items for which `is_first` returns true to the front; returns their number.
fn partition(items: &mut [Item], is_first: impl Fn(&Item) -> bool) -> usize {
    let mut first = 0;
    for i in 0..items.len() {
        if is_first(&items[i]) {
            items.swap(first, i);
            first += 1;
        }
    }
    first
}
