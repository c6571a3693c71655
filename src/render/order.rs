use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::{
    polygon::{BLOCK, PolygonId, VisibleBlocks, ids_of},
    scene::Scene,
};

/// The page of a run whose page is not over.
const NO_PAGE: u32 = u32::MAX;

/// Whether polygons hide what is behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// They do, at least where they are solid.
    Opaque,
    /// Their light is added to what is behind.
    Additive,
    /// What is behind shines through.
    Transparent,
}

/// How 64 polygons are drawn, a bit each; what is neither is opaque.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Classes {
    /// Those that can be seen through.
    pub transparent: u64,
    /// Those whose light is added.
    pub additive: u64,
}

/// A part of the list to draw that takes one draw call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Run {
    /// Places in [`DrawOrder::ids`], or numbers of polygons.
    pub range: Range<u32>,
    /// Whether the range is of places in the list. If not, it is of numbers: every polygon from the first to the last is
    /// drawn.
    pub is_listed: bool,
    /// Which polygons of the scene it reaches: those from `page` times the page's length.
    pub page: u32,
    /// Which style they are drawn in.
    pub style: u32,
    /// How they are blended.
    pub blend: Blend,
}

/// What is kept of a list of polygons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Listing {
    /// The number of every polygon, but for long spans without a gap.
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

/// Polygons that are looked at together.
const WORD: usize = 64;

/// Words that are looked at together, where all of their polygons are to be drawn or none.
const CHUNK_WORDS: usize = 8;

/// As many polygons without a gap are a run of their own, which sends no list. Fewer: more draw calls.
const LEAST_SPAN: usize = 2048;

/// The order in which polygons are drawn, rebuilt every frame in memory that is kept.
///
/// Opaque polygons go by number, then those whose light is added by number, then transparent ones by distance, farthest
/// first, then by number. The place of a polygon
/// among others does not depend on what else is in the list, nor on the order in which it came in: leaving out what is
/// hidden leaves the picture as it is.
#[derive(Clone, Debug, Default)]
pub struct DrawOrder {
    ids: Vec<PolygonId>,
    runs: Vec<Run>,
    listing: Listing,
    /// Whether every run is listed.
    lists_all: bool,
    /// In the order of numbers.
    handles: Vec<Handle>,
    handle_runs: Vec<HandleRun>,
    /// Like `ids` and `runs`, until the frame ends.
    additive: Vec<PolygonId>,
    additive_runs: Vec<Run>,
    /// Distance squared (its bits sort like the number), place in the list of styles, polygon.
    transparent: Vec<(u32, u32, u32)>,
}

impl DrawOrder {
    /// An empty order.
    pub fn new() -> Self {
        Self::default()
    }

    /// The polygons' numbers in the order of drawing, without those of runs that are not listed.
    pub fn ids(&self) -> &[u32] {
        bytemuck::cast_slice(&self.ids)
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

    /// Says whether every run is to be listed, long spans, too: for who cannot draw them without a list. From the next
    /// frame on.
    pub fn list_all(&mut self, lists_all: bool) {
        self.lists_all = lists_all;
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
        self.additive.clear();
        self.additive_runs.clear();
        self.transparent.clear();
    }

    /// Adds polygons to be drawn in `style`. Numbers that the scene does not have are left out. `page_len` is a multiple of
    /// 16; `classes_of` says of 64 polygons from a multiple of 64 on how they are drawn.
    pub fn add(
        &mut self,
        scene: &Scene,
        polygons: &VisibleBlocks,
        style: u32,
        eye_in_world: Vec3,
        page_len: usize,
        classes_of: impl Fn(usize) -> Classes,
    ) {
        debug_assert!(page_len.is_multiple_of(BLOCK));
        let Self { ids, runs, listing, lists_all, handles, handle_runs, .. } = self;
        let Self { additive, additive_runs, transparent, .. } = self;
        let list = List { scene, polygons, style, eye_in_world, page_len, classes_of, transparent };
        // What is tested while drawing has to be listed.
        let least_span = if *lists_all || *listing == Listing::Blocks { usize::MAX } else { LEAST_SPAN };
        let numbers = |ids, runs, blend| Numbers::new(ids, runs, style, blend, least_span);
        let additive = numbers(additive, additive_runs, Blend::Additive);
        match listing {
            Listing::Ids => {
                let sink = numbers(ids, runs, Blend::Opaque);
                Walk { list, sink, additive }.run();
            }
            Listing::Blocks => {
                let start = handles.len();
                let sink = Handles { handles, handle_runs, start, polygons: 0 };
                Walk { list, sink, additive }.run();
            }
        }
    }

    /// Ends the frame: appends the polygons of all lists that are not opaque.
    pub fn finish(&mut self, page_len: usize) {
        let before = self.ids.len() as u32;
        self.ids.append(&mut self.additive);
        self.runs.extend(self.additive_runs.drain(..).map(|mut run| {
            if run.is_listed {
                run.range = run.range.start + before..run.range.end + before;
            }
            run
        }));
        self.transparent.sort_unstable_by(|a, b| b.0.cmp(&a.0).then_with(|| (a.2, a.1).cmp(&(b.2, b.1))));
        for &(_, style, id) in &self.transparent {
            let page = id / page_len as u32;
            let at = self.ids.len() as u32;
            self.ids.push(PolygonId(id));
            match self.runs.last_mut() {
                Some(run) if run.blend == Blend::Transparent && run.page == page && run.style == style => {
                    run.range.end = at + 1;
                }
                _ => {
                    let blend = Blend::Transparent;
                    self.runs.push(Run { range: at..at + 1, is_listed: true, page, style, blend });
                }
            }
        }
    }
}

/// A list on its way into the order.
struct List<'a, F> {
    scene: &'a Scene,
    polygons: &'a VisibleBlocks,
    style: u32,
    eye_in_world: Vec3,
    page_len: usize,
    classes_of: F,
    transparent: &'a mut Vec<(u32, u32, u32)>,
}

/// Takes the opaque polygons of a list, by number.
trait Sink {
    /// Polygons `first + bit`, of one page.
    fn add(&mut self, first: usize, opaque: u64);

    /// All polygons of a range of whole words, of one page.
    #[inline(always)]
    fn add_full(&mut self, polygons: Range<usize>) {
        polygons.step_by(WORD).for_each(|first| self.add(first, u64::MAX));
    }

    /// What was added since the page before is all of this page.
    fn end_page(&mut self, page: usize);
}

/// A list and what takes it.
struct Walk<'a, F, S> {
    list: List<'a, F>,
    sink: S,
    additive: Numbers<'a>,
}

impl<F: Fn(usize) -> Classes, S: Sink> Walk<'_, F, S> {
    #[inline(always)]
    fn run(self) {
        let Walk { mut list, mut sink, mut additive } = self;
        let count = list.scene.polygon_count();
        let (begin, words) = list.polygons.words();
        let mut page = begin / list.page_len;
        let mut page_end = (page + 1) * list.page_len;
        'words: for (i, chunk) in words.chunks(CHUNK_WORDS).enumerate() {
            let start = begin + i * CHUNK_WORDS * WORD;
            let end = start + chunk.len() * WORD;
            let (all, any) =
                chunk.as_flattened().iter().fold((u16::MAX, 0), |(all, any), mask| (all & mask, any | mask));
            let is_opaque = |first| {
                let Classes { additive, transparent } = (list.classes_of)(first);
                additive | transparent == 0
            };
            if any == 0 {
                continue;
            }
            if all == u16::MAX && end <= page_end.min(count) && (start..end).step_by(WORD).all(is_opaque) {
                sink.add_full(start..end);
                continue;
            }
            for (first, masks) in (start..).step_by(WORD).zip(chunk) {
                let seen = masks.iter().rev().fold(0, |word, mask| word << BLOCK | u64::from(*mask));
                if seen == 0 {
                    continue;
                }
                let known = match count.saturating_sub(first) {
                    0 => break 'words,
                    left if left < WORD => seen & ((1 << left) - 1),
                    _ => seen,
                };
                let classes = (list.classes_of)(first);
                let transparent = known & classes.transparent;
                if transparent != 0 {
                    note_transparent(&mut list, first, transparent);
                }
                let mut added = known & classes.additive & !transparent;
                let mut opaque = known & !(transparent | added);
                while first + WORD > page_end {
                    let before = (1 << page_end.saturating_sub(first)) - 1;
                    sink.add(first, opaque & before);
                    additive.add(first, added & before);
                    opaque &= !before;
                    added &= !before;
                    sink.end_page(page);
                    additive.end_page(page);
                    page += 1;
                    page_end += list.page_len;
                }
                sink.add(first, opaque);
                additive.add(first, added);
            }
        }
        sink.end_page(page);
        additive.end_page(page);
    }
}

/// Takes the polygons as numbers.
struct Numbers<'a> {
    ids: &'a mut Vec<PolygonId>,
    runs: &'a mut Vec<Run>,
    style: u32,
    blend: Blend,
    /// What is listed from here on is of no run yet.
    start: usize,
    /// A span of so many is not listed.
    least_span: usize,
    /// All polygons of this range came last, and are of no run yet.
    full: Range<usize>,
}

impl<'a> Numbers<'a> {
    fn new(
        ids: &'a mut Vec<PolygonId>,
        runs: &'a mut Vec<Run>,
        style: u32,
        blend: Blend,
        least_span: usize,
    ) -> Self {
        let start = ids.len();
        Self { ids, runs, style, blend, start, least_span, full: 0..0 }
    }

    #[inline(always)]
    fn end_span(&mut self) {
        let Range { start, end } = std::mem::take(&mut self.full);
        if end - start >= self.least_span {
            self.end_listed();
            self.push_run(start..end, false);
        } else if start < end {
            self.ids.extend((start as u32..end as u32).map(PolygonId));
        }
    }

    fn end_listed(&mut self) {
        let listed = self.start..self.ids.len();
        self.start = listed.end;
        if !listed.is_empty() {
            self.push_run(listed, true);
        }
    }

    fn push_run(&mut self, range: Range<usize>, is_listed: bool) {
        let range = range.start as u32..range.end as u32;
        // The page is filled in when it ends.
        self.runs.push(Run { range, is_listed, page: NO_PAGE, style: self.style, blend: self.blend });
    }
}

impl Sink for Numbers<'_> {
    #[inline(always)]
    fn add_full(&mut self, polygons: Range<usize>) {
        if self.full.end != polygons.start || self.full.is_empty() {
            self.end_span();
            self.full.start = polygons.start;
        }
        self.full.end = polygons.end;
    }

    #[inline(always)]
    fn add(&mut self, first: usize, opaque: u64) {
        if opaque == 0 {
            return;
        }
        if opaque == u64::MAX {
            self.add_full(first..first + WORD);
            return;
        }
        self.end_span();
        for block in 0..WORD / BLOCK {
            let mask = opaque >> (block * BLOCK) & 0xFFFF;
            if mask != 0 {
                self.ids.extend(ids_of(first / BLOCK + block, mask as u16));
            }
        }
    }

    #[inline(always)]
    fn end_page(&mut self, page: usize) {
        self.end_span();
        self.end_listed();
        for run in self.runs.iter_mut().rev().take_while(|run| run.page == NO_PAGE) {
            run.page = page as u32;
        }
    }
}

/// Takes the polygons as blocks.
struct Handles<'a> {
    handles: &'a mut Vec<Handle>,
    handle_runs: &'a mut Vec<HandleRun>,
    /// The first of no run yet, and polygons since then.
    start: usize,
    polygons: u32,
}

impl Sink for Handles<'_> {
    #[inline(always)]
    fn add(&mut self, first: usize, opaque: u64) {
        for block in 0..WORD / BLOCK {
            let mask = (opaque >> (block * BLOCK) & 0xFFFF) as u32;
            if mask != 0 {
                let (block, place) = ((first / BLOCK + block) as u32, self.handles.len() as u32);
                self.handles.push(Handle { block, mask, place });
                self.polygons += mask.count_ones();
            }
        }
    }

    #[inline(always)]
    fn end_page(&mut self, page: usize) {
        let range = self.start as u32..self.handles.len() as u32;
        self.start = self.handles.len();
        let polygons = std::mem::take(&mut self.polygons);
        if !range.is_empty() {
            self.handle_runs.push(HandleRun { range, page: page as u32, polygons });
        }
    }
}

/// Notes polygons that can be seen through.
#[inline(never)]
fn note_transparent<F>(list: &mut List<'_, F>, first: usize, transparent: u64) {
    let mut left = transparent;
    while left != 0 {
        let id = PolygonId((first + left.trailing_zeros() as usize) as u32);
        left &= left - 1;
        let distance_squared = list.scene.bounds(id).center().distance_squared(list.eye_in_world);
        // A distance that is not a number sorts as the farthest; it is drawn all the same.
        list.transparent.push((distance_squared.to_bits(), list.style, id.0));
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
        let all_if = |is_so| if is_so { u64::MAX } else { 0 };
        let classes = Classes {
            transparent: all_if(blend == Blend::Transparent),
            additive: all_if(blend == Blend::Additive),
        };
        order.add(&scene, &ids, 0, Vec3::ZERO, page_len, |_| classes);
        order.finish(page_len);
        order
    }

    fn order_of(ids: &[u32], page_len: usize, blend: Blend) -> DrawOrder {
        listed(ids, page_len, blend, Listing::Ids)
    }

    #[test]
    fn opaque_polygons_go_by_number_and_transparent_ones_back_to_front() {
        let near_and_far = [150, 3, 70, 20, 3];
        assert_eq!(order_of(&near_and_far, 1024, Blend::Opaque).ids(), [3, 20, 70, 150]);
        assert_eq!(order_of(&near_and_far, 1024, Blend::Transparent).ids(), [150, 70, 20, 3]);
    }

    #[test]
    fn opaque_polygons_come_first_then_additive_and_transparent_ones() {
        let scene = scene_of(200);
        let ids: VisibleBlocks = (0..200).map(PolygonId).collect();
        for listing in [Listing::Ids, Listing::Blocks] {
            let mut order = DrawOrder::new();
            order.clear_for(listing);
            // Every third is transparent, of the others the odd ones are additive.
            let class = |i: u32| if i.is_multiple_of(3) { 2 } else { i % 2 };
            let of = |wanted| {
                move |first: usize| {
                    let bits = (0..64).filter(|bit| class(first as u32 + bit) == wanted);
                    bits.fold(0, |word, bit| word | 1 << bit)
                }
            };
            order.add(&scene, &ids, 0, Vec3::ZERO, 64, |first| Classes {
                transparent: of(2)(first),
                additive: of(1)(first),
            });
            order.finish(64);
            let listed: Vec<u32> = (0..3)
                .filter(|&wanted| wanted > 0 || listing == Listing::Ids)
                .flat_map(|wanted| {
                    let ids = (0..200).filter(move |&i| class(i) == wanted);
                    // Back to front: the later, the farther.
                    if wanted == 2 { ids.rev().collect::<Vec<_>>() } else { ids.collect() }
                })
                .collect();
            assert_eq!(order.ids(), listed);
            let blends = order.runs().iter().map(|run| run.blend as u8);
            assert!(blends.is_sorted(), "{:?}", order.runs());
            let mut at = 0;
            for run in order.runs() {
                assert!(run.is_listed && run.range.start == at);
                at = run.range.end;
            }
            assert_eq!(at as usize, listed.len());
        }
    }

    #[test]
    fn the_place_of_a_polygon_does_not_depend_on_the_others() {
        let all: Vec<u32> = (0..200).rev().collect();
        let some: Vec<u32> = (0..200).filter(|i| i % 3 != 0).collect();
        for blend in [Blend::Opaque, Blend::Additive, Blend::Transparent] {
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

    /// What a run draws.
    fn drawn(order: &DrawOrder, run: &Run) -> Vec<u32> {
        match run.is_listed {
            true => order.ids()[run.range.start as usize..run.range.end as usize].to_vec(),
            false => run.range.clone().collect(),
        }
    }

    #[test]
    fn long_spans_without_a_gap_are_not_listed() {
        let count = 4 * LEAST_SPAN as u32;
        let scene = scene_of(count);
        let (gap, page_len) = (LEAST_SPAN as u32 + 1000, 3 * LEAST_SPAN);
        let polygons: VisibleBlocks = (0..count).filter(|&i| i != gap && i != 7).map(PolygonId).collect();
        let mut order = DrawOrder::new();
        for lists_all in [false, true] {
            order.list_all(lists_all);
            order.clear();
            order.add(&scene, &polygons, 0, Vec3::ZERO, page_len, |_| Classes::default());
            order.finish(page_len);
            let all: Vec<u32> = order.runs().iter().flat_map(|run| drawn(&order, run)).collect();
            assert_eq!(all, (0..count).filter(|&i| i != gap && i != 7).collect::<Vec<_>>());
            for run in order.runs() {
                assert!(drawn(&order, run).iter().all(|id| id / page_len as u32 == run.page));
            }
            let listed = order.ids().len();
            assert_eq!(listed == all.len(), lists_all, "{listed} of {} are listed", all.len());
            assert!(lists_all || listed < LEAST_SPAN, "{listed} of {}", all.len());
        }
    }

    #[test]
    fn unknown_numbers_are_left_out() {
        assert_eq!(order_of(&[5, 200, PolygonId::LIMIT - 1], 1024, Blend::Opaque).ids(), [5]);
    }
}
