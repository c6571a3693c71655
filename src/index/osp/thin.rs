//! Removes hidden polygons from the result of a query. `occlusion::remove_hidden` calls `Osp::thin_out`, which walks the
//! tree with `Thin`. `Tests` in `occlusion/cull.rs` implements `Thinner`: it tests boxes against the culler. The walk
//! descends only into nodes that lie in the frustum and are partly hidden. It removes wholly hidden nodes from the
//! result, and keeps nodes that are not hidden without reading them.

use super::{index::Osp, layout::Target, pool::NONE, unfiled::Group};
use crate::{
    index::{
        Thinner, Visit,
        simd::{Boxes, Kernel, PlaneSet, WithKernel},
    },
    math::{Aabb, Frustum},
    polygon::VisibleBlocks,
};

/// Greatest number of polygons of a run.
const RUN: usize = 16;

impl Osp {
    pub(super) fn thin(&self, frustum: &Frustum, visible: &mut VisibleBlocks, thinner: &mut dyn Thinner) {
        let least = thinner.least_polygons();
        let planes = PlaneSet::new(frustum);
        self.backend.run(Thin { osp: self, planes, least, visible, thinner });
    }
}

struct Thin<'a> {
    osp: &'a Osp,
    planes: PlaneSet,
    least: usize,
    visible: &'a mut VisibleBlocks,
    thinner: &'a mut dyn Thinner,
}

impl WithKernel for Thin<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(mut self, kernel: K) {
        let osp = self.osp;
        for group in osp.store.unfiled_groups() {
            self.group(group);
        }
        let polygons = osp.store.filed();
        match self.test(&osp.node_box(osp.top), polygons) {
            Visit::Take => {}
            Visit::Skip => self.hide_node(osp.top),
            Visit::Descend => self.node(kernel, osp.top, polygons, PlaneSet::ALL),
        }
    }
}

impl Thin<'_> {
    fn test(&mut self, bounds: &Aabb, polygons: usize) -> Visit {
        // A node that has become empty may still be queued for upkeep.
        if polygons == 0 || polygons < self.least || bounds.is_empty() {
            return Visit::Take;
        }
        self.thinner.node(bounds, polygons)
    }

    /// Tests a group of blocks that are not in the tree. In a partly hidden group, tests single blocks, or several
    /// neighbouring blocks at once if a test requires more polygons.
    fn group(&mut self, group: Group<'_>) {
        match self.blocks(group.blocks(), group.bounds()) {
            Visit::Take => {}
            Visit::Skip => self.hide(group.blocks()),
            Visit::Descend => {
                // Neighbouring blocks share a test, so that it covers `least` polygons.
                let together = self.least.div_ceil(RUN).next_power_of_two();
                for start in (0..RUN).step_by(together) {
                    let part = group.blocks().skip(start).take(together);
                    match self.blocks(part.clone(), None) {
                        Visit::Take => {}
                        Visit::Skip => self.hide(part),
                        Visit::Descend if together > 1 => {}
                        answer => part.for_each(|(block, lanes, boxes)| {
                            self.answered(block, lanes, answer, |lane| boxes.get(lane));
                        }),
                    }
                }
            }
        }
    }

    /// Tests blocks together, by a box around them or else by their polygons' boxes.
    fn blocks<'b>(
        &mut self,
        blocks: impl Iterator<Item = (u32, u16, &'b Boxes<16>)> + Clone,
        bounds: Option<Aabb>,
    ) -> Visit {
        if !blocks.clone().any(|(block, lanes, _)| lanes & self.visible.mask(block as usize) != 0) {
            return Visit::Take;
        }
        let polygons = blocks.clone().map(|(_, lanes, _)| lanes.count_ones() as usize).sum();
        let around =
            || blocks.fold(Aabb::EMPTY, |all, (_, lanes, boxes)| all.union(&boxes.around(lanes.into())));
        self.test(&bounds.unwrap_or_else(around), polygons)
    }

    fn hide<'b>(&mut self, blocks: impl Iterator<Item = (u32, u16, &'b Boxes<16>)>) {
        blocks.for_each(|(block, lanes, _)| self.visible.remove_block(block as usize, lanes));
    }

    /// Applies the result of the occlusion test to polygons of a block.
    fn answered(&mut self, block: u32, lanes: u16, answer: Visit, own: impl Fn(usize) -> Aabb) {
        match answer {
            Visit::Take => {}
            Visit::Skip => self.visible.remove_block(block as usize, lanes),
            Visit::Descend if !self.thinner.tests_polygons() => {}
            Visit::Descend => {
                let mut boxes = [Aabb::EMPTY; RUN];
                let seen = lanes & self.visible.mask(block as usize);
                let (mut lanes, mut count, mut left) = ([0_u8; RUN], 0, seen);
                while left != 0 {
                    lanes[count] = left.trailing_zeros() as u8;
                    boxes[count] = own(usize::from(lanes[count]));
                    left &= left - 1;
                    count += 1;
                }
                let hidden = self.thinner.hidden_of(&boxes[..count]);
                let bit = |(i, lane): (usize, &u8)| (hidden >> i & 1) << lane;
                let hidden = lanes[..count].iter().enumerate().map(bit).fold(0, |all, bit| all | bit);
                self.visible.remove_block(block as usize, hidden);
            }
        }
    }

    fn node<K: Kernel>(&mut self, kernel: K, number: u32, polygons: usize, planes: u8) {
        let osp = self.osp;
        let node = &osp.nodes[number];
        let sides = self.planes.sides8(kernel, planes, &node.boxes);
        let mut seen = !sides.behind & node.used();
        while seen != 0 {
            let slot = seen.trailing_zeros() as usize;
            seen &= seen - 1;
            let (bounds, below) = (node.boxes.get(slot), sides.planes_at(planes, slot));
            match node.children[slot].target() {
                Target::Nothing => {}
                Target::Leaf(head) => match self.test(&bounds, osp.buckets[head].polygons as usize) {
                    Visit::Take => {}
                    Visit::Skip => self.hide_chain(head),
                    Visit::Descend => self.chain(kernel, head, below),
                },
                Target::Node(child) => match self.test(&bounds, polygons) {
                    Visit::Take => {}
                    Visit::Skip => self.hide_node(child),
                    Visit::Descend => self.node(kernel, child, polygons, below),
                },
            }
        }
        self.chain(kernel, node.own, planes);
    }

    fn chain<K: Kernel>(&mut self, kernel: K, head: u32, planes: u8) {
        let osp = self.osp;
        let mut at = head;
        while at != NONE {
            let bucket = &osp.buckets[at];
            let behind = match planes {
                0 => 0,
                _ => self.planes.sides16(kernel, planes, &bucket.boxes).behind,
            };
            let mut seen = !behind & bucket.used();
            while seen != 0 {
                let i = seen.trailing_zeros() as usize;
                seen &= seen - 1;
                if usize::from(bucket.counts[i]) * RUN < self.least {
                    continue;
                }
                let page = &osp.pages[bucket.pages[i]];
                let runs = &page.masks[..usize::from(page.runs)];
                let polygons = runs.iter().map(|mask| mask.count_ones() as usize).sum();
                match self.test(&bucket.boxes.get(i), polygons) {
                    Visit::Take => {}
                    Visit::Skip => self.hide_page(bucket.pages[i]),
                    Visit::Descend => self.page(bucket.pages[i]),
                }
            }
            at = bucket.next;
        }
    }

    fn page(&mut self, number: u32) {
        if RUN < self.least {
            return;
        }
        let osp = self.osp;
        let runs = usize::from(osp.pages[number].runs);
        for start in (0..runs).step_by(RUN) {
            let (mut boxes, mut polygons) = ([Aabb::EMPTY; RUN], [0_u8; RUN]);
            let (mut tested, mut count) = ([0; RUN], 0);
            for i in start..runs.min(start + RUN) {
                let (run, bounds) = osp.pages.run(number, i);
                let in_run = run.lanes().count_ones();
                let is_seen = run.lanes() & self.visible.mask((run.first / 16) as usize) != 0;
                if is_seen && in_run as usize >= self.least && !bounds.is_empty() {
                    (boxes[count], polygons[count], tested[count]) = (bounds, in_run as u8, i);
                    count += 1;
                }
            }
            if count == 0 {
                continue;
            }
            let mut answers = [Visit::Take; RUN];
            self.thinner.nodes(&boxes[..count], &polygons[..count], &mut answers[..count]);
            for (&i, &answer) in tested[..count].iter().zip(&answers) {
                let (run, bounds) = osp.pages.run(number, i);
                let (block, lanes) = (run.first / 16, run.lanes());
                if run.is_exact() {
                    self.answered(block, lanes, answer, |_| bounds);
                } else {
                    let boxes = osp.store.boxes(run.store);
                    self.answered(block, lanes, answer, |lane| boxes.get(lane));
                }
            }
        }
    }

    fn hide_node(&mut self, number: u32) {
        let osp = self.osp;
        let node = &osp.nodes[number];
        for link in node.children {
            match link.target() {
                Target::Nothing => {}
                Target::Leaf(head) => self.hide_chain(head),
                Target::Node(below) => self.hide_node(below),
            }
        }
        self.hide_chain(node.own);
    }

    fn hide_chain(&mut self, head: u32) {
        let osp = self.osp;
        let mut at = head;
        while at != NONE {
            let bucket = &osp.buckets[at];
            bucket.pages[..bucket.page_count as usize].iter().for_each(|&page| self.hide_page(page));
            at = bucket.next;
        }
    }

    fn hide_page(&mut self, number: u32) {
        let page = &self.osp.pages[number];
        for (first, mask) in page.first.iter().zip(&page.masks).take(usize::from(page.runs)) {
            self.visible.remove_block((first / 16) as usize, mask << (first % 16));
        }
    }
}
