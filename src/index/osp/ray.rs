//! Searches for the nearest hit of a ray, and for the nearest polygons to a point. The nearest child is searched first. The
//! boxes of a node, bucket, page or run are tested together.

use std::cell::Cell;

use glam::Vec3;

use super::{index::Osp, layout::Target, pool::NONE, residence::Demand, shelf::GROUPS, unfiled::Group};
use crate::{
    index::{
        WorkCounts,
        probe::{Nearest, NearestPolygons, is_wanted},
        search_entry::SearchEntry,
        simd::{Boxes, Kernel, WithKernel, lanes_of},
    },
    math::{Ray, latest},
    polygon::PolygonId,
};

/// A part of the index that a search still has to test.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Candidate {
    Node(u32),
    /// A leaf, by its first bucket.
    Leaf(u32),
    Page(u32),
    /// A group of blocks that are not in the tree, by its number.
    Group(u32),
}

/// A search, nearest polygons first: for hits of a ray, or for neighbours of a point.
trait Search {
    /// The distances of the boxes in the lanes `used`, and the lanes that may still contain a result.
    fn reach<K: Kernel, const N: usize>(&self, kernel: K, boxes: &Boxes<N>, used: u32) -> Reached<N>;

    /// Whether a box at this distance may still contain a result.
    fn wants(&self, t: f32) -> bool;

    /// Tests a polygon.
    fn test(&mut self, id: PolygonId);
}

struct AlongRay<'a, 'h> {
    ray: &'a Ray,
    nearest: &'a mut Nearest<'h>,
}

impl Search for AlongRay<'_, '_> {
    #[inline(always)]
    fn reach<K: Kernel, const N: usize>(&self, kernel: K, boxes: &Boxes<N>, used: u32) -> Reached<N> {
        enter(kernel, self.ray, boxes, used, self.nearest.reach())
    }

    #[inline(always)]
    fn wants(&self, t: f32) -> bool {
        is_wanted(t, self.nearest.reach())
    }

    #[inline(always)]
    fn test(&mut self, id: PolygonId) {
        self.nearest.test(id);
    }
}

impl Search for &mut NearestPolygons<'_> {
    #[inline(always)]
    fn reach<K: Kernel, const N: usize>(&self, kernel: K, boxes: &Boxes<N>, used: u32) -> Reached<N> {
        distances(kernel, self.point(), boxes, used, self.reach_m())
    }

    #[inline(always)]
    fn wants(&self, t: f32) -> bool {
        t <= self.reach_m()
    }

    #[inline(always)]
    fn test(&mut self, id: PolygonId) {
        NearestPolygons::test(self, id);
    }
}

impl Osp {
    /// Passes the polygons along a ray to `nearest`, near nodes first.
    pub(super) fn test_along(&self, ray: &Ray, nearest: &mut Nearest<'_>) {
        self.backend.run(Nearby { osp: self, search: AlongRay { ray, nearest } });
    }

    /// Passes polygons to `nearest`, the nodes near its point first.
    pub(super) fn test_around(&self, nearest: &mut NearestPolygons<'_>) -> WorkCounts {
        self.backend.run(Nearby { osp: self, search: nearest })
    }
}

thread_local! {
    /// The stack of a search. Later searches of the same thread reuse it. A search that starts within the exact test of
    /// another search gets a new stack.
    static STACK: Cell<Vec<SearchEntry<Candidate>>> = const { Cell::new(Vec::new()) };
}

/// A search to run on a kernel.
struct Nearby<'a, S> {
    osp: &'a Osp,
    search: S,
}

impl<S: Search> WithKernel for Nearby<'_, S> {
    type Output = WorkCounts;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> WorkCounts {
        let Self { osp, search } = self;
        let mut stack = STACK.take();
        stack.clear();
        let mut walk = Walk { kernel, osp, search, stack, work: WorkCounts::default() };
        walk.run();
        STACK.set(walk.stack);
        walk.work
    }
}

/// A walk to the nearest polygons. It is compiled for each instruction set, because its loops over lanes use SIMD.
struct Walk<'a, S, K> {
    kernel: K,
    osp: &'a Osp,
    search: S,
    stack: Vec<SearchEntry<Candidate>>,
    work: WorkCounts,
}

impl<S: Search, K: Kernel> Walk<'_, S, K> {
    #[inline(always)]
    fn run(&mut self) {
        let osp = self.osp;
        osp.residence.demand.note(Demand::YES);
        self.unfiled();
        if osp.store.filed() > 0 {
            // The top node has no box of its own; the boxes of its children are tested.
            self.stack.push(SearchEntry { t: 0.0, place: Candidate::Node(osp.top) });
        }
        while let Some(SearchEntry { t, place }) = self.stack.pop() {
            if self.search.wants(t) {
                let before = self.stack.len();
                self.visit(place);
                self.stack[before..].sort_unstable();
            }
        }
    }

    #[inline(always)]
    fn reach<const N: usize>(&mut self, boxes: &Boxes<N>, used: u32) -> Reached<N> {
        self.work.boxes += u64::from(used.count_ones());
        self.search.reach(self.kernel, boxes, used)
    }

    #[inline(always)]
    fn visit(&mut self, place: Candidate) {
        self.work.nodes += 1;
        match place {
            Candidate::Node(number) => {
                let node = &self.osp.nodes[number];
                for (slot, t) in self.reach(&node.boxes, node.used()).lanes() {
                    let place = match node.children[slot].target() {
                        Target::Nothing => continue,
                        Target::Leaf(head) => Candidate::Leaf(head),
                        Target::Node(below) => Candidate::Node(below),
                    };
                    self.stack.push(SearchEntry { t, place });
                }
                self.pages_of(node.own);
            }
            Candidate::Leaf(head) => self.pages_of(head),
            Candidate::Page(number) => self.test_page(number),
            Candidate::Group(number) => self.group(self.osp.store.group(number as usize)),
        }
    }

    /// Pushes the groups of blocks that are not in the tree.
    #[inline(always)]
    fn unfiled(&mut self) {
        for (entry, top) in self.osp.store.unfiled_shelves() {
            let number = |group: usize| Candidate::Group((entry * GROUPS + group) as u32);
            for group in lanes_of(top.unfiled & top.stale) {
                self.stack.push(SearchEntry { t: 0.0, place: number(group) });
            }
            for (group, t) in self.reach(&top.boxes, u32::from(top.unfiled & !top.stale)).lanes() {
                self.stack.push(SearchEntry { t, place: number(group) });
            }
        }
        self.stack.sort_unstable();
    }

    /// Searches a group of blocks that are not in the tree.
    #[inline(always)]
    fn group(&mut self, group: Group<'_>) {
        let mut blocks = [(0.0, 0); 16];
        let (around, mut count) = (group.around(), 0);
        for (lane, t) in self.reach(&around.boxes, u32::from(around.unfiled & !around.stale)).lanes() {
            (blocks[count], count) = ((t, lane), count + 1);
        }
        let fresh = &mut blocks[..count];
        fresh.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let stale = lanes_of(around.unfiled & around.stale).map(|lane| (0.0, lane));
        for (t, lane) in fresh.iter().copied().chain(stale) {
            if self.search.wants(t) {
                let (block, lanes, boxes) = group.block(lane);
                self.test_lanes(block, u32::from(lanes), boxes);
            }
        }
    }

    #[inline(always)]
    fn pages_of(&mut self, head: u32) {
        let osp = self.osp;
        let mut at = head;
        while at != NONE {
            let bucket = &osp.buckets[at];
            for (lane, t) in self.reach(&bucket.boxes, bucket.used()).lanes() {
                self.stack.push(SearchEntry { t, place: Candidate::Page(bucket.pages[lane]) });
            }
            at = bucket.next;
        }
    }

    /// Searches the runs of a page, near ones first.
    #[inline(always)]
    fn test_page(&mut self, number: u32) {
        let (osp, page) = (self.osp, &self.osp.pages[number]);
        let (mut runs, mut count) = ([(0.0, 0); 16], 0);
        for (lane, t) in self.reach(&page.boxes, page.used()).lanes() {
            (runs[count], count) = ((t, lane), count + 1);
        }
        let runs = &mut runs[..count];
        runs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(t, lane) in runs.iter() {
            if !self.search.wants(t) {
                return;
            }
            let (run, _) = page.run(lane);
            let (first, lanes) = (run.first & !15, u32::from(run.lanes()));
            if !run.is_exact() {
                self.test_lanes(first / 16, lanes, osp.store.boxes(run.store));
            } else if lanes != 0 {
                // The run's box, which was tested, is the polygon's box.
                self.search.test(PolygonId(first + lanes.trailing_zeros()));
            }
        }
    }

    #[inline(always)]
    fn test_lanes(&mut self, block: u32, lanes: u32, boxes: &Boxes<16>) {
        for (lane, t) in self.reach(boxes, lanes).lanes() {
            if self.search.wants(t) {
                self.search.test(PolygonId(block * 16 + lane as u32));
            }
        }
    }
}

/// Distances of boxes, and the mask of the boxes that may still contain a result.
struct Reached<const N: usize> {
    t: [f32; N],
    mask: u32,
}

impl<const N: usize> Reached<N> {
    #[inline(always)]
    fn lanes(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        lanes_of(self.mask).map(|lane| (lane % N, self.t[lane % N]))
    }
}

/// Does the same as [`Ray::enter_box`] for the lanes in `used`, with the same results. Lanes without a polygon have an
/// empty box.
#[inline(always)]
fn enter<K: Kernel, const N: usize>(
    kernel: K,
    ray: &Ray,
    boxes: &Boxes<N>,
    used: u32,
    reach: f32,
) -> Reached<N> {
    // `odd` is NaN if a product is NaN or infinite, else 0.
    let mut odd = [0.0f32; N];
    let (mut near, mut far) = ([0.0f32; N], [reach; N]);
    for axis in 0..3 {
        let (low, high) = (&boxes.rows[axis], &boxes.rows[axis + 3]);
        let (origin, inverse) = (ray.origin[axis], ray.inverse()[axis]);
        for i in 0..N {
            let (a, b) = ((low[i] - origin) * inverse, (high[i] - origin) * inverse);
            let (first, last) = if a < b { (a, b) } else { (b, a) };
            near[i] = if first > near[i] { first } else { near[i] };
            far[i] = if last < far[i] { last } else { far[i] };
            odd[i] += a * 0.0 + b * 0.0;
        }
    }
    let mut later = [0.0f32; N];
    for i in 0..N {
        later[i] = latest(far[i]) - near[i];
    }
    let odd = used & !kernel.not_negative(&odd);
    let mut mask = used & !odd & kernel.not_negative(&later);
    // A lane needs the exact test if the ray is parallel to an axis or the lane has no box.
    for lane in lanes_of(odd) {
        let bounds = boxes.get(lane % N);
        if let Some(t) = (!bounds.is_empty()).then(|| ray.enter_box(&bounds, reach)).flatten() {
            near[lane % N] = t;
            mask |= 1 << lane;
        }
    }
    Reached { t: near, mask }
}

/// The square root of [`Aabb::distance_squared`](crate::math::Aabb::distance_squared) for the lanes in `used`.
#[inline(always)]
fn distances<K: Kernel, const N: usize>(
    kernel: K,
    point: Vec3,
    boxes: &Boxes<N>,
    used: u32,
    reach_m: f32,
) -> Reached<N> {
    let mut squared = [0.0f32; N];
    for axis in 0..3 {
        let (low, high) = (&boxes.rows[axis], &boxes.rows[axis + 3]);
        for i in 0..N {
            let (below, above) = (low[i] - point[axis], point[axis] - high[i]);
            let beside = if below > above { below } else { above };
            let beside = if beside > 0.0 { beside } else { 0.0 };
            squared[i] += beside * beside;
        }
    }
    // Lanes without a polygon have an empty box, whose size is negative.
    let (mut within, mut size) = ([0.0f32; N], [0.0f32; N]);
    for (i, distance_m) in squared.iter_mut().enumerate() {
        // The square root is taken because the square of a short distance may be too small for an `f32`.
        *distance_m = distance_m.sqrt();
        // Boxes at an infinite distance are found only if the reach is infinite.
        within[i] = reach_m - if *distance_m < f32::MAX { *distance_m } else { f32::MAX };
        size[i] = boxes.rows[3][i] - boxes.rows[0][i];
    }
    Reached { t: squared, mask: used & kernel.not_negative(&within) & kernel.not_negative(&size) }
}
