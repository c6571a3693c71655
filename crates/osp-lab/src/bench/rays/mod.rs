//! Rays, ranges and neighbours: every structure in a complete model and in a growing one. Queries are the nearest hit,
//! any hit, the polygons in a box, and the polygons nearest to a point. Further measurements are two traversal orders
//! of a ray, and the degradation of a tree whose boxes are refitted as polygons move.
//!
//! The times are those of the queries of a structure and of the reference, measured in turns. The same traversal
//! ([`outline`]) counts the nodes and boxes of a ray in every structure. So the counts compare the trees, not the code.

mod model;
mod moves;
mod outline;

use osp_session::platform::time::{Instant, Load};

use glam::Vec3;

use self::{
    model::Queries,
    outline::{Order, Outline, Steps, walk},
};
use super::Contender;
use crate::{
    clock::{resolution_ns, runs_for},
    rows::Rows,
};
use osp::{
    index::{SpatialIndex, WorkCounts},
    math::{Aabb, Ray},
    polygon::PolygonId,
};
use osp_rivals::IndexKind;

pub use model::RaysModel;

const PART: &str = "rays";
const TASKS: [&str; 6] = [
    "rays/nearest outside",
    "rays/nearest inside",
    "rays/any inside",
    "rays/box",
    "rays/neighbours",
    "rays/growing",
];
const WALKS: [&str; 2] = ["rays/walk in order", "rays/walk best first"];
const NOTES: [&str; 4] = [
    "nearest, any: hits of rays; box: polygons in a tenth of the model's length; neighbours: the 8 nearest polygons of a point; \
     growing: a frame that inserts 8 polygons and casts 8 rays.",
    "walk: the nearest hit by one walk that is the same for every tree, with rays from outside and from inside. The walk visits \
     the nearest child first (in order), or always the nearest waiting node (best first).",
    "moved: boxes that a ray tests after every polygon has drifted in its own direction, by half a per cent of the diagonal a move. \
     sah-refitted: the first tree with its boxes refitted; sah-rebuilt: built after the last move; bvh-sah refits \
     until its boxes have grown by half, then rebuilds.",
    "time is that of the structure's own query; the nodes and boxes of a walk depend on the tree, not on its code.",
];

/// Number of nearest polygons per query.
const NEIGHBOURS: usize = 8;
/// Number of polygons inserted, and of rays cast, in a frame of the growing model.
const BATCH: usize = 8;
/// Largest number of frames of the growing model.
const FRAMES: usize = 60;
/// Smallest number of values that are measured, whatever the budget.
const FEWEST: usize = 3;
/// Largest number of values that are measured.
const MOST: usize = 2000;
/// Number of queries that are timed together.
const TOGETHER: usize = 16;

#[derive(Clone, Debug, PartialEq)]
pub struct RaysConfig {
    pub kinds: Vec<Contender>,
    pub reference: IndexKind,
    /// Number of rays from outside, of rays from inside, of boxes and of points.
    pub queries: usize,
    /// Time for each kind of query with a structure, seconds.
    pub budget_secs: f64,
}

/// Measures every structure in a model; the rows are the part `rays`. `progress` is called with the name of the next
/// measurement. A model without polygons gives no rows.
pub fn cast_rays(config: &RaysConfig, model: &RaysModel, mut progress: impl FnMut(&str)) -> Rows {
    let mut rows = Rows::default();
    if model.boxes.is_empty() {
        return rows;
    }
    rows.part(PART, "Rays, ranges and neighbours: figures of a query, exact tests included");
    NOTES.iter().for_each(|note| rows.note(PART, *note));
    let queries = Queries::new(model, config.queries.max(1));
    let reference = model.filled(Contender::Own(config.reference), model.boxes.len());
    let expected = answers(reference.as_ref(), model, &queries);
    let share = |rays: &[Ray]| {
        let hits = rays.iter().filter(|ray| nearest_hit(reference.as_ref(), model, ray).is_some()).count();
        100.0 * hits as f64 / rays.len() as f64
    };
    for (task, rays) in
        TASKS.into_iter().zip([Some(&queries.outside), Some(&queries.inside)].into_iter().chain([None; 4]))
    {
        rows.of(task, &model.recording, "").value("polygons", "polygons", model.boxes.len() as f64).maybe(
            "hit",
            "%",
            rays.map(|rays| share(rays)),
        );
    }
    for &kind in &config.kinds {
        progress(kind.name());
        let index = model.filled(kind, model.boxes.len());
        if answers(index.as_ref(), model, &queries) != expected {
            let (name, reference) = (kind.name(), config.reference.name());
            rows.faults.push(format!("NOT THE SAME ANSWERS AS {reference} in {}: {name}.", model.recording));
        }
        let pair = Pair { index: index.as_ref(), reference: reference.as_ref(), model, config };
        let begun = Load::begin();
        pair.measure(&mut rows, kind, &queries);
        rows.load.add(begun);
    }
    progress("moving polygons");
    moves::refit_against_rebuild(&mut rows, model, &queries);
    rows
}

fn nearest_hit(index: &dyn SpatialIndex, model: &RaysModel, ray: &Ray) -> Option<(PolygonId, f32)> {
    index.ray_nearest(ray, f32::INFINITY, &mut |id| model.polygons[id.index()].meet(ray))
}

/// The results of all queries, which must be the same with every structure.
#[derive(PartialEq)]
struct Answers {
    hits: Vec<Option<(PolygonId, f32)>>,
    in_boxes: Vec<Vec<PolygonId>>,
    near: Vec<Vec<(PolygonId, f32)>>,
}

fn answers(index: &dyn SpatialIndex, model: &RaysModel, queries: &Queries) -> Answers {
    let rays = queries.outside.iter().chain(&queries.inside);
    let in_box = |bounds: &Aabb| {
        let mut ids = Vec::new();
        index.box_query(bounds, &mut ids);
        ids.sort_unstable();
        ids
    };
    let near = |&point: &Vec3| {
        let mut near = Vec::new();
        let mut distance_m = |id: PolygonId| model.polygons[id.index()].distance_m(point);
        index.nearest(point, NEIGHBOURS, &mut distance_m, &mut near);
        near
    };
    Answers {
        hits: rays.map(|ray| nearest_hit(index, model, ray)).collect(),
        in_boxes: queries.boxes.iter().map(in_box).collect(),
        near: queries.points.iter().map(near).collect(),
    }
}

/// Cost of queries: times of the structure and the reference, and exact tests, nodes and boxes per query.
struct TaskTimes {
    times: Vec<(f64, f64)>,
    exact_tests: f64,
    work: [f64; 2],
}

/// A structure and the reference, which are measured in turns.
struct Pair<'a> {
    index: &'a dyn SpatialIndex,
    reference: &'a dyn SpatialIndex,
    model: &'a RaysModel,
    config: &'a RaysConfig,
}

/// Times of the same work with a structure and with the reference, microseconds, in turns until the budget is spent.
/// `one` does a part of the work and returns its number of queries.
fn in_turns(budget_secs: f64, most: usize, mut one: impl FnMut(usize, bool) -> usize) -> Vec<(f64, f64)> {
    let mut times = Vec::new();
    let start = Instant::now();
    for turn in 0..most {
        if turn >= FEWEST && start.elapsed().as_secs_f64() > budget_secs {
            break;
        }
        let mut us = [0.0; 2];
        // The index and the reference alternate in running first.
        for is_reference in [turn % 2 == 0, turn % 2 != 0] {
            let start = Instant::now();
            let count = one(turn, is_reference);
            us[usize::from(is_reference)] = start.elapsed().as_nanos() as f64 / 1000.0 / count as f64;
        }
        times.push((us[0], us[1]));
    }
    times
}

impl Pair<'_> {
    fn measure(&self, rows: &mut Rows, kind: Contender, queries: &Queries) {
        let Queries { outside, inside, boxes, points } = queries;
        let name = self.model.recording.as_str();
        let [from_outside, from_inside, any, in_box, near, growing] = TASKS;
        let mut of = |task: &str, asked: &TaskTimes| {
            let mut figures = rows.of(task, name, kind.name());
            figures.against(&asked.times).value("exact_tests", "1/question", asked.exact_tests);
            figures.counted("nodes", "1/question", asked.work[0]).counted(
                "boxes",
                "1/question",
                asked.work[1],
            );
        };
        of(from_outside, &self.time(outside, |index, ray, asked| self.nearest(index, ray, asked)));
        of(from_inside, &self.time(inside, |index, ray, asked| self.nearest(index, ray, asked)));
        of(any, &self.time(inside, |index, ray, asked| self.any(index, ray, asked)));
        of(
            in_box,
            &self.time(boxes, |index, bounds, _| {
                let mut found = Vec::new();
                index.box_query(bounds, &mut found)
            }),
        );
        of(
            near,
            &self.time(points, |index, &point, asked| {
                let mut found = Vec::new();
                let mut distance_m = |id: PolygonId| {
                    *asked += 1;
                    self.model.polygons[id.index()].distance_m(point)
                };
                index.nearest(point, NEIGHBOURS, &mut distance_m, &mut found)
            }),
        );
        of(growing, &self.grow(kind, inside));
        let outline = Outline::of(self.index, &self.model.boxes);
        walk_both(rows, kind, &outline, self.model, queries);
    }

    fn nearest(&self, index: &dyn SpatialIndex, ray: &Ray, asked: &mut u64) -> WorkCounts {
        let mut hit = |id: PolygonId| {
            *asked += 1;
            self.model.polygons[id.index()].meet(ray)
        };
        std::hint::black_box(index.ray_nearest(ray, f32::INFINITY, &mut hit));
        WorkCounts::default()
    }

    fn any(&self, index: &dyn SpatialIndex, ray: &Ray, asked: &mut u64) -> WorkCounts {
        let mut hit = |id: PolygonId| {
            *asked += 1;
            self.model.polygons[id.index()].meet(ray)
        };
        std::hint::black_box(index.ray_any(ray, f32::INFINITY, &mut hit));
        WorkCounts::default()
    }

    /// Measures the time of queries, and counts the nodes and boxes per query.
    fn time<Q>(
        &self,
        queries: &[Q],
        ask: impl Fn(&dyn SpatialIndex, &Q, &mut u64) -> WorkCounts,
    ) -> TaskTimes {
        let (mut work, mut asked) = (WorkCounts::default(), 0);
        for question in queries {
            work += ask(self.index, question, &mut asked);
        }
        let count = queries.len() as f64;
        let shares: Vec<&[Q]> = queries.chunks(TOGETHER).collect();
        let ask_all = |index: &dyn SpatialIndex, share: &[Q]| {
            let mut unused = 0;
            for question in share {
                std::hint::black_box(ask(index, question, &mut unused));
            }
        };
        // Both run the same number of queries, so that the caches favour neither.
        let ns = [self.index, self.reference].map(|index| {
            let start = Instant::now();
            ask_all(index, shares[0]);
            start.elapsed().as_nanos() as f64
        });
        let runs = runs_for(ns[0].min(ns[1]), resolution_ns()) as usize;
        let times = in_turns(self.config.budget_secs, MOST, |turn, is_reference| {
            let index = if is_reference { self.reference } else { self.index };
            let share = shares[turn % shares.len()];
            (0..runs).for_each(|_| ask_all(index, share));
            runs * share.len()
        });
        let work = [work.nodes as f64 / count, work.boxes as f64 / count];
        TaskTimes { times, exact_tests: asked as f64 / count, work }
    }

    /// Measures frames that insert some of the last polygons and cast rays.
    fn grow(&self, kind: Contender, rays: &[Ray]) -> TaskTimes {
        let all = self.model.boxes.len();
        let frames = FRAMES.min(all / BATCH);
        let first = all - frames * BATCH;
        let mut subjects =
            [kind, Contender::Own(self.config.reference)].map(|kind| self.model.filled(kind, first));
        let mut asked = 0;
        let times = in_turns(self.config.budget_secs, frames, |turn, is_reference| {
            let index = subjects[usize::from(is_reference)].as_mut();
            let at = first + turn * BATCH;
            (at..at + BATCH).for_each(|at| self.model.insert(index, at));
            index.commit();
            let mut unused = 0;
            let asked = if is_reference { &mut unused } else { &mut asked };
            for ray in rays.iter().cycle().skip(turn * BATCH % rays.len()).take(BATCH) {
                self.nearest(index, ray, asked);
            }
            1
        });
        let exact_tests = asked as f64 / times.len().max(1) as f64 / BATCH as f64;
        TaskTimes { times, exact_tests, work: [0.0; 2] }
    }
}

/// Measures work and times of the two traversal orders, in turns.
fn walk_both(rows: &mut Rows, kind: Contender, outline: &Outline, model: &RaysModel, queries: &Queries) {
    const REPEATS: usize = 3;
    let count = (queries.outside.len() + queries.inside.len()) as f64;
    let mut best_secs = [f64::INFINITY; 2];
    let mut steps = [Steps::default(); 2];
    for _ in 0..REPEATS {
        for (at, order) in [Order::InOrder, Order::BestFirst].into_iter().enumerate() {
            steps[at] = Steps::default();
            let start = Instant::now();
            walk(outline, order, &model.polygons, queries, &mut steps[at]);
            best_secs[at] = best_secs[at].min(start.elapsed().as_secs_f64());
        }
    }
    for ((task, steps), secs) in WALKS.into_iter().zip(steps).zip(best_secs) {
        rows.of(task, &model.recording, kind.name())
            .value("nodes", "1/ray", steps.nodes as f64 / count)
            .value("boxes", "1/ray", steps.boxes as f64 / count)
            .value("exact_tests", "1/ray", steps.exact_tests as f64 / count)
            .value("rays", "million/s", count * 1.0e-6 / secs.max(1.0e-9));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> RaysModel {
        RaysModel::synthetic(3000).expect("it is whole")
    }

    #[test]
    fn an_outline_holds_every_polygon_and_finds_what_the_structure_finds_in_both_orders() {
        let model = model();
        let queries = Queries::new(&model, 60);
        let mut hits = 0;
        for kind in Contender::all() {
            let index = model.filled(kind, model.boxes.len());
            let outline = Outline::of(index.as_ref(), &model.boxes);
            assert_eq!(outline.len(), model.boxes.len(), "{}", kind.name());
            let (mut in_order, mut best_first) = (Steps::default(), Steps::default());
            for ray in queries.outside.iter().chain(&queries.inside) {
                let expected = nearest_hit(index.as_ref(), &model, ray);
                let mut hit = |id: PolygonId| model.polygons[id.index()].meet(ray);
                assert_eq!(
                    outline.nearest(Order::InOrder, ray, &mut hit, &mut in_order),
                    expected,
                    "{}",
                    kind.name()
                );
                let found = outline.nearest(Order::BestFirst, ray, &mut hit, &mut best_first);
                assert_eq!(found, expected, "{}", kind.name());
                hits += usize::from(expected.is_some());
            }
            // No order visits fewer nodes than best first, except for nodes that the ray enters at the same distance.
            assert!(
                best_first.nodes <= in_order.nodes + in_order.nodes / 50,
                "{}: {best_first:?} {in_order:?}",
                kind.name()
            );
        }
        assert!(hits > 1000, "{hits} hits");
    }

    #[test]
    fn a_tree_that_prunes_tests_far_fewer_boxes_than_no_tree() {
        let model = model();
        let queries = Queries::new(&model, 60);
        let boxes = |kind: IndexKind| {
            let index = model.filled(Contender::Own(kind), model.boxes.len());
            let mut steps = Steps::default();
            walk(
                &Outline::of(index.as_ref(), &model.boxes),
                Order::InOrder,
                &model.polygons,
                &queries,
                &mut steps,
            );
            steps.boxes
        };
        let all = boxes(IndexKind::BruteForce);
        for kind in [IndexKind::Osp, IndexKind::BvhSah, IndexKind::KdTree, IndexKind::OspPaper] {
            assert!(boxes(kind) * 4 < all, "{}: {} of {all}", kind.name(), boxes(kind));
        }
    }

    #[test]
    fn osp_looks_at_few_boxes_for_neighbours_and_at_few_polygons_for_any_hit() {
        let model = model();
        let queries = Queries::new(&model, 60);
        let index = model.filled(Contender::Own(IndexKind::Osp), model.boxes.len());
        let mut boxes = 0;
        for &point in &queries.points {
            let mut distance_m = |id: PolygonId| model.polygons[id.index()].distance_m(point);
            boxes += index.nearest(point, NEIGHBOURS, &mut distance_m, &mut Vec::new()).boxes;
        }
        let all = (queries.points.len() * model.boxes.len()) as u64;
        assert!(boxes > 0 && boxes * 10 < all, "{boxes} of {all}");
        for ray in &queries.outside {
            let asked = |any: bool| {
                let mut asked = 0;
                let mut hit = |id: PolygonId| {
                    asked += 1;
                    model.polygons[id.index()].meet(ray)
                };
                let found = match any {
                    true => index.ray_any(ray, f32::INFINITY, &mut hit),
                    false => index.ray_nearest(ray, f32::INFINITY, &mut hit),
                };
                (asked, found.is_some())
            };
            let ((any, is_any), (nearest, is_hit)) = (asked(true), asked(false));
            assert!(is_any == is_hit && any <= nearest, "{any} {nearest}");
        }
    }
}
