//! The nearest hit of a ray: down into the nearest child first, the boxes of a node, a bucket, a page or a run together.

use std::cmp::Ordering;

use super::{index::Osp, layout::Target, pool::NONE};
use crate::{
    index::{
        probe::{Nearest, is_wanted},
        simd::{Boxes, Kernel, WithKernel},
    },
    math::{Ray, is_no_later},
    polygon::PolygonId,
};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Node(u32),
    /// The first bucket of a leaf.
    Leaf(u32),
    Page(u32),
}

/// A place that the ray enters at `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Waiting {
    t: f32,
    place: Place,
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    /// The nearest is the greatest, so that a sorted stack has it on top.
    fn cmp(&self, other: &Self) -> Ordering {
        other.t.total_cmp(&self.t).then(other.place.cmp(&self.place))
    }
}

impl Osp {
    /// Asks `nearest` about the polygons along a ray, near nodes first.
    pub(super) fn ask_along(&self, ray: &Ray, nearest: &mut Nearest<'_>) {
        self.backend.run(Along { osp: self, ray, nearest, stack: Vec::with_capacity(64) });
    }
}

/// A walk along a ray; compiled for each instruction set, so that the loops over lanes use it.
struct Along<'a, 'h> {
    osp: &'a Osp,
    ray: &'a Ray,
    nearest: &'a mut Nearest<'h>,
    stack: Vec<Waiting>,
}

impl WithKernel for Along<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(mut self, _kernel: K) {
        let osp = self.osp;
        let lanes = u32::from(osp.open.lanes());
        // With nothing open there is no block either.
        if lanes != 0 {
            self.ask_lanes(osp.open.block() * 16, lanes, osp.open.rows());
        }
        if osp.len > 0 {
            // The box of the top is looked at with those of its children.
            self.stack.push(Waiting { t: 0.0, place: Place::Node(osp.top) });
        }
        while let Some(Waiting { t, place }) = self.stack.pop() {
            if is_wanted(t, self.nearest.reach()) {
                let before = self.stack.len();
                self.look(place);
                self.stack[before..].sort_unstable();
            }
        }
    }
}

impl Along<'_, '_> {
    #[inline(always)]
    fn look(&mut self, place: Place) {
        match place {
            Place::Node(number) => {
                let node = &self.osp.nodes[number];
                let entered = enter(self.ray, &node.boxes, 0xFF, self.nearest.reach());
                for (slot, t) in entered.lanes() {
                    let place = match node.children[slot].target() {
                        Target::Nothing => continue,
                        Target::Leaf(head) => Place::Leaf(head),
                        Target::Node(below) => Place::Node(below),
                    };
                    self.stack.push(Waiting { t, place });
                }
                self.pages_along(node.own);
            }
            Place::Leaf(head) => self.pages_along(head),
            Place::Page(number) => self.ask_page(number),
        }
    }

    #[inline(always)]
    fn pages_along(&mut self, head: u32) {
        let mut at = head;
        while at != NONE {
            let bucket = &self.osp.buckets[at];
            for (half, boxes) in bucket.boxes.0.iter().enumerate() {
                let used = bucket.used() >> (8 * half) & 0xFF;
                if used == 0 {
                    break;
                }
                for (lane, t) in enter(self.ray, boxes, used, self.nearest.reach()).lanes() {
                    self.stack.push(Waiting { t, place: Place::Page(bucket.pages[8 * half + lane]) });
                }
            }
            at = bucket.next;
        }
    }

    /// The runs of a page, near ones first.
    #[inline(always)]
    fn ask_page(&mut self, number: u32) {
        let mut runs = [(0.0, 0); 16];
        let mut count = 0;
        let used = self.osp.pages[number].used();
        for (half, boxes) in self.osp.pages.boxes(number).0.iter().enumerate() {
            let used = used >> (8 * half) & 0xFF;
            for (lane, t) in enter(self.ray, boxes, used, self.nearest.reach()).lanes() {
                runs[count] = (t, 8 * half + lane);
                count += 1;
            }
        }
        let runs = &mut runs[..count];
        runs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(t, lane) in runs.iter() {
            if !is_wanted(t, self.nearest.reach()) {
                return;
            }
            let (run, _) = self.osp.pages.run(number, lane);
            let (first, lanes) = (run.first & !15, u32::from(run.lanes()));
            if run.is_exact() {
                // Its box is the run's.
                (lanes != 0).then(|| self.nearest.ask(PolygonId(first + lanes.trailing_zeros())));
            } else {
                self.ask_lanes(first, lanes, self.osp.ids.boxes(run.store));
            }
        }
    }

    #[inline(always)]
    fn ask_lanes(&mut self, first: u32, lanes: u32, boxes: &Boxes<16>) {
        for (lane, t) in enter(self.ray, boxes, lanes, self.nearest.reach()).lanes() {
            if is_wanted(t, self.nearest.reach()) {
                self.nearest.ask(PolygonId(first + lane as u32));
            }
        }
    }
}

/// Where a ray enters boxes, and which of them are still of interest.
struct Entered<const N: usize> {
    t: [f32; N],
    mask: u32,
}

impl<const N: usize> Entered<N> {
    #[inline(always)]
    fn lanes(&self) -> impl Iterator<Item = (usize, f32)> + '_ {
        let mut left = self.mask;
        std::iter::from_fn(move || {
            let lane = (left != 0).then(|| left.trailing_zeros() as usize)?;
            left &= left - 1;
            Some((lane, self.t[lane % N]))
        })
    }
}

/// [`Ray::enter_box`] of the lanes in `used`, with the same answers. Emptied places have no box.
#[inline(always)]
fn enter<const N: usize>(ray: &Ray, boxes: &Boxes<N>, used: u32, reach: f32) -> Entered<N> {
    let (mut near, mut far, mut is_odd) = ([0.0f32; N], [reach; N], [0u32; N]);
    for axis in 0..3 {
        let (low, high) = (&boxes.rows[axis], &boxes.rows[axis + 3]);
        let (origin, inverse) = (ray.origin[axis], ray.inverse()[axis]);
        for i in 0..N {
            let (a, b) = ((low[i] - origin) * inverse, (high[i] - origin) * inverse);
            let (first, last) = if a < b { (a, b) } else { (b, a) };
            near[i] = if first > near[i] { first } else { near[i] };
            far[i] = if last < far[i] { last } else { far[i] };
            is_odd[i] |= u32::from(!(a.abs() < f32::INFINITY && b.abs() < f32::INFINITY));
        }
    }
    let (mut odd, mut mask) = (0, 0);
    for i in 0..N {
        odd |= is_odd[i] << i;
        mask |= u32::from(is_no_later(near[i], far[i])) << i;
    }
    odd &= used;
    mask &= used & !odd;
    // What these numbers cannot decide: a ray along an axis, or no box.
    let mut left = odd;
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        left &= left - 1;
        let bounds = boxes.get(lane % N);
        if let Some(t) = (!bounds.is_empty()).then(|| ray.enter_box(&bounds, reach)).flatten() {
            near[lane % N] = t;
            mask |= 1 << lane;
        }
    }
    Entered { t: near, mask }
}
