//! The nearest hit of a ray: down into the nearest child first.

use std::cmp::Ordering;

use super::{index::Osp, layout::Target, pool::NONE};
use crate::{
    index::probe::{Nearest, is_wanted},
    math::{Aabb, Ray},
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
        if self.is_linear {
            return self.ask_blocks(ray, nearest);
        }
        let mut stack = Vec::with_capacity(64);
        self.start(ray, nearest, &mut |waiting| stack.push(waiting));
        while let Some(Waiting { t, place }) = stack.pop() {
            if is_wanted(t, nearest.reach()) {
                let before = stack.len();
                self.look(place, ray, nearest, &mut |waiting| stack.push(waiting));
                stack[before..].sort_unstable();
            }
        }
    }

    /// [`Osp::ask_along`] for the linear form: near blocks first.
    fn ask_blocks(&self, ray: &Ray, nearest: &mut Nearest<'_>) {
        let blocks = self.linear.blocks().enumerate();
        let entered =
            blocks.filter_map(|(at, block)| Some((enter(ray, &self.linear.around(at), nearest)?, block)));
        let mut waiting: Vec<_> = entered.collect();
        waiting.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.0.cmp(&b.1.0)));
        for (t, (number, lanes, boxes)) in waiting {
            if !is_wanted(t, nearest.reach()) {
                return;
            }
            self.ask_lanes(number * 16, u32::from(lanes), ray, nearest, |lane| boxes.get(lane));
        }
    }

    fn start(&self, ray: &Ray, nearest: &mut Nearest<'_>, wait: &mut impl FnMut(Waiting)) {
        let lanes = u32::from(self.open.lanes());
        // With nothing open there is no block either.
        if lanes != 0 {
            self.ask_lanes(self.open.block() * 16, lanes, ray, nearest, |lane| self.open.bounds(lane));
        }
        if self.len > 0 {
            // The box of the top is looked at with those of its children.
            wait(Waiting { t: 0.0, place: Place::Node(self.top) });
        }
    }

    fn look(&self, place: Place, ray: &Ray, nearest: &mut Nearest<'_>, wait: &mut impl FnMut(Waiting)) {
        match place {
            Place::Node(number) => {
                let node = &self.nodes[number];
                for (slot, link) in node.children.iter().enumerate() {
                    let place = match link.target() {
                        Target::Nothing => continue,
                        Target::Leaf(head) => Place::Leaf(head),
                        Target::Node(below) => Place::Node(below),
                    };
                    if let Some(t) = enter(ray, &node.boxes.get(slot), nearest) {
                        wait(Waiting { t, place });
                    }
                }
                self.pages_along(node.own, ray, nearest, wait);
            }
            Place::Leaf(head) => self.pages_along(head, ray, nearest, wait),
            Place::Page(number) => self.ask_page(number, ray, nearest),
        }
    }

    fn pages_along(&self, head: u32, ray: &Ray, nearest: &Nearest<'_>, wait: &mut impl FnMut(Waiting)) {
        let mut at = head;
        while at != NONE {
            let bucket = &self.buckets[at];
            for (i, &page) in bucket.pages[..bucket.page_count as usize].iter().enumerate() {
                if let Some(t) = enter(ray, &bucket.boxes.get(i), nearest) {
                    wait(Waiting { t, place: Place::Page(page) });
                }
            }
            at = bucket.next;
        }
    }

    /// The runs of a page, near ones first.
    fn ask_page(&self, number: u32, ray: &Ray, nearest: &mut Nearest<'_>) {
        let mut runs = [(0.0, 0); 16];
        let mut count = 0;
        for lane in 0..usize::from(self.pages[number].runs) {
            let (_, bounds) = self.pages.run(number, lane);
            if let Some(t) = enter(ray, &bounds, nearest) {
                runs[count] = (t, lane);
                count += 1;
            }
        }
        let runs = &mut runs[..count];
        runs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for &(t, lane) in runs.iter() {
            if !is_wanted(t, nearest.reach()) {
                return;
            }
            let (run, bounds) = self.pages.run(number, lane);
            let (first, lanes) = (run.first & !15, u32::from(run.lanes()));
            if run.is_exact() {
                self.ask_lanes(first, lanes, ray, nearest, |_| bounds);
            } else {
                let boxes = self.ids.boxes(run.store);
                self.ask_lanes(first, lanes, ray, nearest, |lane| boxes.get(lane));
            }
        }
    }

    fn ask_lanes(
        &self,
        first: u32,
        lanes: u32,
        ray: &Ray,
        nearest: &mut Nearest<'_>,
        bounds: impl Fn(usize) -> Aabb,
    ) {
        let mut left = lanes;
        while left != 0 {
            let lane = left.trailing_zeros();
            left &= left - 1;
            if enter(ray, &bounds(lane as usize), nearest).is_some() {
                nearest.ask(PolygonId(first + lane));
            }
        }
    }
}

/// Where a ray enters a box, if that is still of interest. Emptied places have no box.
fn enter(ray: &Ray, bounds: &Aabb, nearest: &Nearest<'_>) -> Option<f32> {
    if bounds.is_empty() { None } else { ray.enter_box(bounds, nearest.reach()) }
}
