use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::{
    polygon::{BLOCK, PolygonId, VisibleBlocks, ids_of},
    scene::Scene,
};

/// Whether polygons hide what is behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// They do.
    Opaque,
    /// What is behind shines through.
    Transparent,
}

/// A part of the list to draw that takes one draw call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Places in [`DrawOrder::ids`].
    pub range: Range<u32>,
    /// Which polygons of the scene it reaches: those from `page` times the page's length.
    pub page: u32,
    /// Which style they are drawn in.
    pub style: u32,
    /// How they are blended.
    pub blend: Blend,
}

/// Blocks of opaque polygons are sorted into this many steps of distance; a step is about 6 % of the distance.
const STEPS: usize = 1 << (32 - STEP_SHIFT);
/// Bits of a squared distance that do not matter: sign and exponent and three bits of the mantissa stay.
const STEP_SHIFT: u32 = 20;

/// What is kept of a list of polygons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Listing {
    /// The number of every polygon.
    #[default]
    Ids,
    /// Blocks with a mask for the opaque polygons, the numbers of the transparent ones.
    Blocks,
}

/// Opaque polygons of one block to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Handle {
    /// The block: its first polygon is [`BLOCK`] times this.
    pub(super) block: u32,
    /// A bit for each polygon of it that is to be drawn.
    pub(super) mask: u32,
    /// Its place in the order of drawing.
    pub(super) place: u32,
}

/// Handles of one page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct HandleRun {
    /// Where its handles are in [`DrawOrder::handles`]; their places have the same bounds.
    pub(super) range: Range<u32>,
    /// The page.
    pub(super) page: u32,
    /// Polygons that the handles stand for.
    pub(super) polygons: u32,
}

/// The order in which polygons are drawn, rebuilt every frame in memory that is kept.
///
/// Opaque polygons go by block: by the step of distance from the eye to the block's first polygon, drawn or not, then
/// by number; transparent ones by distance, farthest first, then by number. The place of a polygon among others does
/// not depend on what else is in the list, nor on the order in which it came in: leaving out what is hidden leaves the
/// picture as it is.
#[derive(Clone, Debug, Default)]
pub struct DrawOrder {
    ids: Vec<u32>,
    runs: Vec<Run>,
    listing: Listing,
    /// In the order of numbers.
    handles: Vec<Handle>,
    handle_runs: Vec<HandleRun>,
    /// Blocks of the page at hand, in the order of numbers: number, mask, step.
    blocks: Vec<(u32, u16, u16)>,
    sorted: Vec<(u32, u16)>,
    /// Distance squared (its bits sort like the number), place in the list of styles, polygon.
    transparent: Vec<(u32, u32, u32)>,
    steps: Vec<u32>,
}

impl DrawOrder {
    /// An empty order.
    pub fn new() -> Self {
        Self::default()
    }

    /// The polygons' numbers in the order of drawing.
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// The draw calls, in order: all opaque ones first.
    pub fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// The opaque polygons as blocks, in the order of numbers; empty if every polygon is listed.
    pub(super) fn handles(&self) -> &[Handle] {
        &self.handles
    }

    /// The pages of [`DrawOrder::handles`], in order.
    pub(super) fn handle_runs(&self) -> &[HandleRun] {
        &self.handle_runs
    }

    /// Polygons that the handles stand for.
    pub(super) fn opaque_count(&self) -> u32 {
        self.handle_runs.iter().map(|run| run.polygons).sum()
    }

    /// What is kept of the frame at hand.
    pub(super) fn listing(&self) -> Listing {
        self.listing
    }

    /// Starts a new frame.
    pub fn clear(&mut self) {
        self.clear_for(Listing::Ids);
    }

    /// Starts a new frame of which this is kept.
    pub(super) fn clear_for(&mut self, listing: Listing) {
        self.listing = listing;
        self.ids.clear();
        self.runs.clear();
        self.handles.clear();
        self.handle_runs.clear();
        self.transparent.clear();
    }

    /// Adds polygons to be drawn in `style`. Numbers that the scene does not have are left out. `page_len` is a multiple of
    /// 16; `transparent_of` gives for 64 polygons from a multiple of 64 on which of them can be seen through.
    pub fn add(
        &mut self,
        scene: &Scene,
        polygons: &VisibleBlocks,
        style: u32,
        eye_in_world: Vec3,
        page_len: usize,
        transparent_of: impl Fn(usize) -> u64,
    ) {
        debug_assert!(page_len.is_multiple_of(BLOCK));
        let count = scene.polygon_count();
        // A distance that is not a number sorts as the farthest; it is drawn all the same.
        let distance_squared =
            |id: usize| scene.bounds(PolygonId(id as u32)).center().distance_squared(eye_in_world).to_bits();
        let mut page = 0;
        // The transparent ones of four blocks are looked up at once.
        let (mut looked_up, mut transparent_there) = (usize::MAX, 0);
        for (block, mask) in polygons.blocks() {
            let first = block * BLOCK;
            let known = match count.saturating_sub(first) {
                0 => break,
                left if left < BLOCK => mask & ((1 << left) - 1),
                _ => mask,
            };
            if first / 64 != looked_up {
                (looked_up, transparent_there) = (first / 64, transparent_of(first / 64 * 64));
            }
            let transparent = known & (transparent_there >> (first % 64)) as u16;
            let opaque = known & !transparent;
            if opaque != 0 {
                if first / page_len != page {
                    self.end_page(page, style);
                    page = first / page_len;
                }
                let step = (distance_squared(first) >> STEP_SHIFT) as u16;
                self.blocks.push((block as u32, opaque, step));
            }
            for id in ids_of(block, transparent) {
                self.transparent.push((distance_squared(id.index()), style, id.0));
            }
        }
        self.end_page(page, style);
    }

    /// Sorts the blocks of one page by steps (a counting sort: equal steps keep the order of numbers).
    fn end_page(&mut self, page: usize, style: u32) {
        if self.blocks.is_empty() {
            return;
        }
        self.steps.clear();
        self.steps.resize(STEPS, 0);
        for (.., step) in &self.blocks {
            self.steps[*step as usize] += 1;
        }
        let mut at = 0;
        for step in &mut self.steps {
            at += std::mem::replace(step, at);
        }
        match self.listing {
            Listing::Ids => self.list_ids(page, style),
            Listing::Blocks => self.list_blocks(page),
        }
    }

    fn list_ids(&mut self, page: usize, style: u32) {
        self.sorted.clear();
        self.sorted.resize(self.blocks.len(), (0, 0));
        for (block, mask, step) in self.blocks.drain(..) {
            let place = &mut self.steps[step as usize];
            self.sorted[*place as usize] = (block, mask);
            *place += 1;
        }
        let first = self.ids.len() as u32;
        for &(block, mask) in &self.sorted {
            let id = block * BLOCK as u32;
            if mask == u16::MAX {
                // Most blocks: sixteen numbers are written at once.
                let all: [u32; BLOCK] = std::array::from_fn(|bit| id + bit as u32);
                self.ids.extend_from_slice(&all);
                continue;
            }
            let mut bits = u32::from(mask);
            while bits != 0 {
                self.ids.push(id + bits.trailing_zeros());
                bits &= bits - 1;
            }
        }
        let range = first..self.ids.len() as u32;
        self.runs.push(Run { range, page: page as u32, style, blend: Blend::Opaque });
    }

    fn list_blocks(&mut self, page: usize) {
        let (first, mut polygons) = (self.handles.len() as u32, 0);
        for (block, mask, step) in self.blocks.drain(..) {
            let place = &mut self.steps[step as usize];
            self.handles.push(Handle { block, mask: u32::from(mask), place: first + *place });
            *place += 1;
            polygons += mask.count_ones();
        }
        let range = first..self.handles.len() as u32;
        self.handle_runs.push(HandleRun { range, page: page as u32, polygons });
    }

    /// Ends the frame: appends the transparent polygons of all lists.
    pub fn finish(&mut self, page_len: usize) {
        self.transparent.sort_unstable_by(|a, b| b.0.cmp(&a.0).then_with(|| (a.2, a.1).cmp(&(b.2, b.1))));
        for &(_, style, id) in &self.transparent {
            let page = id / page_len as u32;
            let at = self.ids.len() as u32;
            self.ids.push(id);
            match self.runs.last_mut() {
                Some(run) if run.blend == Blend::Transparent && run.page == page && run.style == style => {
                    run.range.end = at + 1;
                }
                _ => self.runs.push(Run { range: at..at + 1, page, style, blend: Blend::Transparent }),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Event;

    /// Polygon `i` lies `i + 1` metres in front of the origin.
    fn scene_of(count: u32) -> Scene {
        let mut scene = Scene::new();
        let mut changes = Vec::new();
        for i in 0..count {
            let z = -(i as f32 + 1.0);
            let corner = |x, y| Vec3::new(x, y, z);
            let vertices = vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)];
            let event = Event::Polygon { t: 0.0, stroke: None, vertices, color: (1.0, 1.0, 1.0, 1.0) };
            scene.apply(&event, &mut changes);
        }
        scene
    }

    fn listed(ids: &[u32], page_len: usize, blend: Blend, listing: Listing) -> DrawOrder {
        let scene = scene_of(200);
        let ids: VisibleBlocks = ids.iter().map(|&i| PolygonId(i)).collect();
        let mut order = DrawOrder::new();
        order.clear_for(listing);
        let transparent = if blend == Blend::Opaque { 0 } else { u64::MAX };
        order.add(&scene, &ids, 0, Vec3::ZERO, page_len, |_| transparent);
        order.finish(page_len);
        order
    }

    fn order_of(ids: &[u32], page_len: usize, blend: Blend) -> DrawOrder {
        listed(ids, page_len, blend, Listing::Ids)
    }

    #[test]
    fn opaque_polygons_go_front_to_back_and_transparent_ones_back_to_front() {
        let near_and_far = [150, 3, 70, 20, 3];
        assert_eq!(order_of(&near_and_far, 1024, Blend::Opaque).ids(), [3, 20, 70, 150]);
        assert_eq!(order_of(&near_and_far, 1024, Blend::Transparent).ids(), [150, 70, 20, 3]);
    }

    #[test]
    fn the_place_of_a_polygon_does_not_depend_on_the_others() {
        let all: Vec<u32> = (0..200).rev().collect();
        let some: Vec<u32> = (0..200).filter(|i| i % 3 != 0).collect();
        for blend in [Blend::Opaque, Blend::Transparent] {
            let mut of_all = order_of(&all, 1024, blend).ids().to_vec();
            of_all.retain(|i| i % 3 != 0);
            assert_eq!(of_all, order_of(&some, 1024, blend).ids());
        }
    }

    #[test]
    fn every_page_is_a_run_of_its_own() {
        let all: Vec<u32> = (0..200).collect();
        let order = order_of(&all, 64, Blend::Opaque);
        let pages: Vec<_> = order.runs().iter().map(|run| (run.page, run.range.len())).collect();
        assert_eq!(pages, [(0, 64), (1, 64), (2, 64), (3, 8)]);
        for run in order.runs() {
            let ids = &order.ids()[run.range.start as usize..run.range.end as usize];
            assert!(ids.iter().all(|id| id / 64 == run.page));
        }
        assert_eq!(order_of(&[199, 7, 64], 64, Blend::Transparent).runs().len(), 3);
    }

    #[test]
    fn blocks_stand_for_the_same_polygons_in_the_same_order() {
        let scattered: Vec<u32> = (0..200).filter(|i| i * i % 7 < 3).collect();
        for page_len in [64, 1024] {
            let blocks = listed(&scattered, page_len, Blend::Opaque, Listing::Blocks);
            assert!(blocks.ids().is_empty());
            let mut by_place = blocks.handles().to_vec();
            assert!(by_place.is_sorted_by_key(|handle| handle.block));
            by_place.sort_by_key(|handle| handle.place);
            let ids = by_place.iter().flat_map(|handle| {
                (0..16).filter(|bit| handle.mask >> bit & 1 == 1).map(|bit| handle.block * 16 + bit)
            });
            let listed = order_of(&scattered, page_len, Blend::Opaque);
            assert_eq!(ids.collect::<Vec<_>>(), listed.ids());
            let runs = blocks.handle_runs();
            assert_eq!(runs.len(), listed.runs().len());
            for (run, of_ids) in runs.iter().zip(listed.runs()) {
                assert_eq!((run.page, run.polygons), (of_ids.page, of_ids.range.len() as u32));
            }
        }
    }

    #[test]
    fn unknown_numbers_are_left_out() {
        assert_eq!(order_of(&[5, 200, PolygonId::LIMIT - 1], 1024, Blend::Opaque).ids(), [5]);
    }
}
