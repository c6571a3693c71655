use glam::Vec3;

use super::{
    listing::{Handles, List, Numbers, SpanBits, Walk},
    opaque_order::{self, OpaqueOrder},
    run::{Blend, CLUSTER, Classes, Handle, HandleRun, Run, push},
};
use osp::polygon::{PolygonId, VisibleBlocks, bits};
use osp_session::scene::Scene;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Listing {
    /// The number of every polygon. If nearly all of many consecutive polygons are drawn, a bit mask replaces their
    /// numbers.
    #[default]
    Ids,
    /// Clusters with a mask for opaque polygons, and the numbers of all others.
    Clusters,
}

/// The polygons that an order takes from a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Whole,
    /// Opaque and additive polygons, whose order is the same for both eyes.
    Common,
    /// Transparent polygons.
    Own,
}

/// The order in which polygons are drawn. It is computed again in every frame, in the same memory.
///
/// Opaque polygons come first, by number, then additive polygons, by number. Transparent polygons come last, the
/// farthest first, and by number at equal distance. The relative order of two polygons depends neither on other
/// polygons nor on the order of arrival. So the picture does not change if hidden polygons are skipped.
#[derive(Clone, Debug, Default)]
pub struct DrawOrder {
    ids: Vec<PolygonId>,
    /// Runs in drawing order, opaque runs first.
    pub runs: Vec<Run>,
    pub(super) listing: Listing,
    /// The order of the opaque polygons of [`Listing::Ids`], and whether each run has polygons of a single material.
    pub(super) opaque: (OpaqueOrder, bool),
    span_bits: SpanBits,
    /// The opaque polygons of [`Listing::Clusters`], as cluster masks in ascending order.
    pub(super) handles: Vec<Handle>,
    /// The cluster masks of each page: ranges of [`DrawOrder::handles`].
    pub(super) handle_runs: Vec<HandleRun>,
    /// Numbers and runs of additive polygons, until [`DrawOrder::finish`] appends them to `ids` and `runs`.
    additive: Vec<PolygonId>,
    additive_runs: Vec<Run>,
    /// For each transparent polygon: squared distance from the eye, as float bits that sort like the value; style; number.
    transparent: Vec<(u32, u32, u32)>,
}

impl DrawOrder {
    pub fn new() -> Self {
        Self::default()
    }

    /// Polygon numbers in drawing order. Runs stored as bit masks have no numbers in this list.
    pub fn ids(&self) -> &[u32] {
        PolygonId::numbers(&self.ids)
    }

    /// Runs of all polygons that are not transparent. Both eyes can draw them.
    pub(super) fn common_runs(&self) -> &[Run] {
        &self.runs[..self.runs.partition_point(|run| run.blend != Blend::Transparent)]
    }

    /// The numbers of the additive polygons of [`Listing::Clusters`]; empty for [`Listing::Ids`].
    pub(super) fn light(&self) -> &[u32] {
        let last = self.common_runs().last().filter(|_| self.listing == Listing::Clusters);
        let end = last.map_or(0, |run| run.range.end);
        &self.ids()[..end as usize]
    }

    /// Bits of the runs stored as bit masks: the index of the first used word, and the used words. Word `i` has the
    /// bits of 64 polygons, from number 64 `i` on, the lowest bit first.
    pub fn span_bits(&self) -> (usize, &[u64]) {
        self.span_bits.used()
    }

    pub(super) fn drawn_by(&self, run: &Run) -> impl Iterator<Item = PolygonId> + '_ {
        let (first, bits) = self.span_bits();
        let (places, numbers) = match run.is_listed {
            true => (run.range.start as usize..run.range.end as usize, 0..0),
            false => (0..0, run.range.clone()),
        };
        let numbers =
            numbers.map(PolygonId).filter(move |id| bits::contains(bits, id.index() - first * bits::WORD));
        self.ids[places].iter().copied().chain(numbers)
    }

    /// Number of opaque polygons in all cluster masks.
    pub(super) fn opaque_count(&self) -> u32 {
        self.handle_runs.iter().map(|run| run.polygons).sum()
    }

    /// Sets the order of opaque polygons from the next frame on. With `splits_by_material`, each range of one material
    /// has its own draw call.
    pub(super) fn set_opaque(&mut self, order: OpaqueOrder, splits_by_material: bool) {
        self.opaque = (order, splits_by_material);
    }

    /// Sorts the opaque polygons into the order of [`DrawOrder::set_opaque`]. Call it before [`DrawOrder::finish`].
    pub(super) fn sort_opaque(&mut self, scene: &Scene, eye_in_world: Vec3, page_len: usize) {
        if self.listing == Listing::Ids && self.opaque != Default::default() {
            let (order, splits_by_material) = self.opaque;
            let Self { ids, runs, .. } = self;
            opaque_order::sort(order, scene, eye_in_world, page_len, ids, runs);
            if splits_by_material {
                opaque_order::split_by_material(scene, ids, runs);
            }
        }
    }

    pub fn clear(&mut self) {
        self.clear_for(Listing::Ids);
    }

    pub(super) fn clear_for(&mut self, listing: Listing) {
        self.listing = listing;
        self.ids.clear();
        self.runs.clear();
        self.span_bits.clear();
        self.handles.clear();
        self.handle_runs.clear();
        self.additive.clear();
        self.additive_runs.clear();
        self.transparent.clear();
    }

    /// Adds polygons to draw in `style`. Numbers that the scene does not have are skipped. `page_len`, the number of
    /// polygons of a page, is a multiple of 64. `classes_of` returns the drawing classes of 64 polygons from a multiple
    /// of 64 on.
    pub fn add(
        &mut self,
        scene: &Scene,
        polygons: &VisibleBlocks,
        style: u32,
        eye_in_world: Vec3,
        page_len: usize,
        classes_of: impl Fn(usize) -> Classes,
    ) {
        self.add_part(scene, polygons, Part::Whole, style, eye_in_world, page_len, classes_of);
    }

    /// Does the same as [`DrawOrder::add`] for a part of the polygons.
    #[expect(clippy::too_many_arguments, reason = "one argument more than `add`")]
    pub(super) fn add_part(
        &mut self,
        scene: &Scene,
        polygons: &VisibleBlocks,
        part: Part,
        style: u32,
        eye_in_world: Vec3,
        page_len: usize,
        classes_of: impl Fn(usize) -> Classes,
    ) {
        debug_assert!(page_len.is_multiple_of(CLUSTER));
        let Self { ids, runs, listing, opaque, span_bits, handles, handle_runs, .. } = self;
        let Self { additive, additive_runs, transparent, .. } = self;
        let lists = [part != Part::Own, part != Part::Common];
        let list = List { scene, polygons, style, eye_in_world, page_len, classes_of, transparent, lists };
        // Only the first style has spans, because the spans share one set of bits, and a polygon may have several styles.
        // Clusters and sorted polygons have no spans, either.
        let has_spans = *listing == Listing::Ids && *opaque == Default::default() && style == 0;
        let spans = has_spans.then_some(span_bits);
        let additive = Numbers::new(additive, additive_runs, style, Blend::Additive, None);
        match listing {
            _ if part == Part::Own => Walk { list, sink: (), additive }.run(),
            Listing::Ids => {
                let bits = spans.map(|bits| (bits, scene.polygon_count()));
                let sink = Numbers::new(ids, runs, style, Blend::Opaque, bits);
                Walk { list, sink, additive }.run();
            }
            Listing::Clusters => {
                let start = handles.len();
                let sink = Handles { handles, handle_runs, start, polygons: 0 };
                Walk { list, sink, additive }.run();
            }
        }
    }

    /// Ends the frame: appends the additive and transparent polygons of all lists.
    pub fn finish(&mut self, page_len: usize) {
        let before = self.ids.len() as u32;
        self.ids.append(&mut self.additive);
        for run in self.additive_runs.iter_mut().filter(|run| run.is_listed) {
            run.range = run.range.start + before..run.range.end + before;
        }
        self.runs.append(&mut self.additive_runs);
        self.transparent.sort_unstable_by(|a, b| b.0.cmp(&a.0).then_with(|| (a.2, a.1).cmp(&(b.2, b.1))));
        for &(_, style, id) in &self.transparent {
            push(&mut self.ids, &mut self.runs, page_len, PolygonId(id), style, Blend::Transparent);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{listing::LEAST_SPAN, test_scene};

    /// Polygon `i` lies `i + 1` metres in front of the origin.
    fn scene_of(count: u32) -> Scene {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let polygon =
            |i: u32| (corners.map(|p| p - Vec3::Z * (i as f32 + 1.0)).to_vec(), (1.0, 1.0, 1.0, 1.0));
        test_scene::of((0..count).map(polygon))
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
        let unknown = [5, 200, PolygonId::LIMIT - 1];
        assert_eq!(order_of(&unknown, 1024, Blend::Opaque).ids(), [5]);
    }

    #[test]
    fn opaque_polygons_come_first_then_additive_and_transparent_ones() {
        let scene = scene_of(200);
        let ids: VisibleBlocks = (0..200).map(PolygonId).collect();
        for listing in [Listing::Ids, Listing::Clusters] {
            let mut order = DrawOrder::new();
            order.clear_for(listing);
            // Every third polygon is transparent; of the others, the odd ones are additive.
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
                    // Transparent polygons are drawn back to front, and a higher number is farther away here.
                    if wanted == 2 { ids.rev().collect::<Vec<_>>() } else { ids.collect() }
                })
                .collect();
            assert_eq!(order.ids(), listed);
            let blends = order.runs.iter().map(|run| run.blend as u8);
            assert!(blends.is_sorted(), "{:?}", &order.runs);
            let mut at = 0;
            for run in &order.runs {
                assert!(run.is_listed && run.range.start == at);
                at = run.range.end;
            }
            assert_eq!(at as usize, listed.len());
        }
    }

    #[test]
    fn clusters_stand_for_the_same_polygons_in_the_same_order() {
        let scattered: Vec<u32> = (0..200).filter(|i| i * i % 7 < 3).collect();
        for page_len in [64, 1024] {
            let clusters = listed(&scattered, page_len, Blend::Opaque, Listing::Clusters);
            assert!(clusters.ids().is_empty());
            assert!(clusters.handles.is_sorted_by_key(|handle| handle.cluster));
            let ids = clusters.handles.iter().flat_map(Handle::ids).map(|id| id.0);
            let listed = order_of(&scattered, page_len, Blend::Opaque);
            assert_eq!(ids.collect::<Vec<_>>(), listed.ids());
            let runs = &clusters.handle_runs;
            assert_eq!(runs.len(), listed.runs.len());
            for (run, of_ids) in runs.iter().zip(&listed.runs) {
                assert_eq!((run.page, run.polygons), (of_ids.page, of_ids.range.len() as u32));
            }
        }
    }

    fn drawn(order: &DrawOrder, run: &Run) -> Vec<u32> {
        let (first, bits) = order.span_bits();
        let is_set = |id: &u32| bits[*id as usize / 64 - first] >> (id % 64) & 1 == 1;
        match run.is_listed {
            true => order.ids()[run.range.start as usize..run.range.end as usize].to_vec(),
            false => run.range.clone().filter(is_set).collect(),
        }
    }

    #[test]
    fn long_spans_with_few_gaps_are_not_listed() {
        let count = 4 * LEAST_SPAN as u32;
        let scene = scene_of(count);
        let page_len = 3 * LEAST_SPAN;
        let all: Vec<u32> = (0..count).collect();
        let few = |id: &u32| id % 600 > 100 && *id != 7;
        let many = |id: &u32| id % 3 == 1;
        let one_page = |id: &u32| id / page_len as u32 == 1 || id.is_multiple_of(9);
        let mut order = DrawOrder::new();
        type Wanted<'a> = &'a dyn Fn(&u32) -> bool;
        let sets: [(Wanted<'_>, bool); 4] =
            [(&|_| true, true), (&few, true), (&many, false), (&one_page, true)];
        for (is_in, has_spans) in sets {
            let wanted: Vec<u32> = all.iter().copied().filter(|id| is_in(id)).collect();
            let polygons: VisibleBlocks = wanted.iter().copied().map(PolygonId).collect();
            order.clear();
            order.add(&scene, &polygons, 0, Vec3::ZERO, page_len, |_| Classes::default());
            order.finish(page_len);
            let drawn_all: Vec<u32> = order.runs.iter().flat_map(|run| drawn(&order, run)).collect();
            assert_eq!(drawn_all, wanted);
            for run in &order.runs {
                assert!(drawn(&order, run).iter().all(|id| id / page_len as u32 == run.page));
            }
            let listed = order.ids().len();
            assert_eq!(listed < wanted.len(), has_spans, "{listed} of {} are listed", wanted.len());
        }
    }

    #[test]
    fn what_is_in_two_lists_is_drawn_once_by_each() {
        let count = 2 * LEAST_SPAN as u32;
        let scene = scene_of(count);
        let without_some = |gap: u32| (0..count).filter(move |id| id % 64 != gap);
        let mut order = DrawOrder::new();
        order.clear();
        for style in 0..2 {
            let polygons: VisibleBlocks = without_some(style).map(PolygonId).collect();
            order.add(&scene, &polygons, style, Vec3::ZERO, 1 << 20, |_| Classes::default());
        }
        order.finish(1 << 20);
        for style in 0..2 {
            let of_style = order.runs.iter().filter(|run| run.style == style);
            let ids: Vec<u32> = of_style.flat_map(|run| drawn(&order, run)).collect();
            assert_eq!(ids, without_some(style).collect::<Vec<_>>());
        }
    }
}
