//! Rays, ranges and neighbours: the nearest hit, any hit, what is in a box and the nearest polygons of a point, with every
//! structure, in a model that is complete and in one that grows; the two orders of a ray's walk; and what becomes of a
//! tree whose boxes are refitted as polygons move.
//!
//! Times are those of a structure's own query, beside the reference's in turns. Nodes and boxes of a ray are those of one
//! walk that is the same for all ([`outline`]), so that they tell the trees apart and not the code.

mod model;
mod moves;
mod outline;
pub(super) mod show;

use osp_session::platform::time::Instant;

use glam::Vec3;
use serde::Serialize;

use self::{
    model::Questions,
    outline::{Order, Outline, Steps, walk},
};
use super::{Contender, Estimate};
use crate::clock::{resolution_ns, runs_for};
use osp::{
    index::{SpatialIndex, WorkCounts},
    math::{Aabb, Ray},
    polygon::PolygonId,
};
use osp_rivals::IndexKind;

pub use model::RaysModel;
pub use moves::MovedRow;

/// Neighbours asked for.
pub(super) const NEIGHBOURS: usize = 8;
/// Polygons that a frame of the growing model inserts, and rays that it casts.
const BATCH: usize = 8;
/// Frames of the growing model, at most.
const FRAMES: usize = 60;
/// Values that a budget leaves at least, and that are taken at most.
const FEWEST: usize = 3;
const MOST: usize = 2000;
/// Questions that are timed at a time.
const TOGETHER: usize = 16;

/// Settings of [`cast_rays`].
#[derive(Clone, Debug, PartialEq)]
pub struct RaysConfig {
    /// The structures.
    pub kinds: Vec<Contender>,
    /// The one that the others are compared with.
    pub reference: IndexKind,
    /// Rays from outside, rays from inside, boxes and points, each so many.
    pub questions: usize,
    /// Time for each kind of question with a structure, seconds.
    pub budget_secs: f64,
}

/// A question's time with a structure.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Asked {
    /// Microseconds a question (of a growing model: a frame).
    pub us: Estimate,
    /// The reference's time for the same questions, microseconds.
    pub reference_us: Estimate,
    /// Divided by the reference's time for the same questions.
    pub ratio: Estimate,
    /// Polygons that the exact test was asked about, a question.
    pub polygons_asked: f64,
}

impl Asked {
    /// Millions of questions a second.
    pub fn millions_a_second(&self) -> f64 {
        1.0 / self.us.median.max(1.0e-9)
    }
}

/// What a walk along the rays looks at, a ray.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Walked {
    /// Nodes.
    pub nodes: f64,
    /// Boxes, of nodes and of polygons.
    pub boxes: f64,
    /// Polygons that the exact test was asked about.
    pub polygons_asked: f64,
    /// Millions of rays a second of this walk.
    pub mrays_per_sec: f64,
}

/// One structure in one model.
#[derive(Clone, Debug, Serialize)]
pub struct RayRow {
    /// Name of the structure.
    pub index: String,
    /// Nearest hit of rays from outside.
    pub outside: Asked,
    /// Nearest hit of rays from inside.
    pub inside: Asked,
    /// Any hit of rays from inside.
    pub any: Asked,
    /// What is in a box, without an exact test.
    pub range: Asked,
    /// Nodes and boxes that this looked at.
    pub range_work: [f64; 2],
    /// The nearest polygons of a point.
    pub neighbours: Asked,
    /// Nodes and boxes that this looked at.
    pub neighbours_work: [f64; 2],
    /// A frame that inserts polygons and casts as many rays from inside.
    pub growing: Asked,
    /// The walk in order, all rays.
    pub in_order: Walked,
    /// The walk best first, all rays.
    pub best_first: Walked,
}

/// What was found in one model.
#[derive(Clone, Debug, Serialize)]
pub struct RaysResult {
    /// Its name.
    pub recording: String,
    /// Polygons.
    pub polygons: usize,
    /// Share of the rays from outside that hit something, and of those from inside.
    pub hit_share: [f64; 2],
    /// One row for each structure.
    pub rows: Vec<RayRow>,
    /// Structures whose answers differ from the reference's: none, unless something is wrong.
    pub disagree: Vec<String>,
    /// What becomes of trees as polygons move.
    pub moved: Vec<MovedRow>,
}

/// Measures every structure in a model. `progress` hears what comes next. `None` for a model without polygons.
pub fn cast_rays(
    config: &RaysConfig,
    model: &RaysModel,
    mut progress: impl FnMut(&str),
) -> Option<RaysResult> {
    if model.boxes.is_empty() {
        return None;
    }
    let questions = Questions::new(model, config.questions.max(1));
    let reference = model.filled(Contender::Own(config.reference), model.boxes.len());
    let expected = answers(reference.as_ref(), model, &questions);
    let (mut rows, mut disagree) = (Vec::new(), Vec::new());
    for &kind in &config.kinds {
        progress(kind.name());
        let index = model.filled(kind, model.boxes.len());
        if answers(index.as_ref(), model, &questions) != expected {
            disagree.push(kind.name().to_owned());
        }
        let pair = Pair { index: index.as_ref(), reference: reference.as_ref(), model, config };
        rows.push(pair.row(kind, &questions));
    }
    progress("moving polygons");
    let share = |rays: &[Ray]| {
        let hits = rays.iter().filter(|ray| nearest_hit(reference.as_ref(), model, ray).is_some()).count();
        hits as f64 / rays.len() as f64
    };
    Some(RaysResult {
        recording: model.recording.clone(),
        polygons: model.boxes.len(),
        hit_share: [share(&questions.outside), share(&questions.inside)],
        rows,
        disagree,
        moved: moves::refit_against_rebuild(model, &questions),
    })
}

fn nearest_hit(index: &dyn SpatialIndex, model: &RaysModel, ray: &Ray) -> Option<(PolygonId, f32)> {
    index.ray_nearest(ray, f32::INFINITY, &mut |id| model.polygons[id.index()].meet(ray))
}

/// What has to be the same with every structure.
#[derive(PartialEq)]
struct Answers {
    hits: Vec<Option<(PolygonId, f32)>>,
    in_boxes: Vec<Vec<PolygonId>>,
    near: Vec<Vec<(PolygonId, f32)>>,
}

fn answers(index: &dyn SpatialIndex, model: &RaysModel, questions: &Questions) -> Answers {
    let rays = questions.outside.iter().chain(&questions.inside);
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
        in_boxes: questions.boxes.iter().map(in_box).collect(),
        near: questions.points.iter().map(near).collect(),
    }
}

/// A structure and the reference, measured in turns.
struct Pair<'a> {
    index: &'a dyn SpatialIndex,
    reference: &'a dyn SpatialIndex,
    model: &'a RaysModel,
    config: &'a RaysConfig,
}

/// Times of the same work with a structure and with the reference, microseconds.
#[derive(Default)]
struct Times(Vec<(f64, f64)>);

impl Times {
    /// Measures in turns until the budget is spent; `one` does a share of the work (told its number) and says how many
    /// questions it was, or 0 if there are no more.
    fn measure(budget_secs: f64, most: usize, mut one: impl FnMut(usize, bool) -> usize) -> Self {
        let mut times = Vec::new();
        let start = Instant::now();
        for turn in 0..most {
            if turn >= FEWEST && start.elapsed().as_secs_f64() > budget_secs {
                break;
            }
            let mut us = [0.0; 2];
            // Neither always comes first.
            for is_reference in [turn % 2 == 0, turn % 2 != 0] {
                let start = Instant::now();
                let count = one(turn, is_reference);
                us[usize::from(is_reference)] = start.elapsed().as_nanos() as f64 / 1000.0 / count as f64;
            }
            times.push((us[0], us[1]));
        }
        Self(times)
    }

    fn asked(&self, polygons_asked: f64) -> Asked {
        let estimate = |value: fn(&(f64, f64)) -> f64| {
            Estimate::of(&mut self.0.iter().map(value).collect::<Vec<_>>()).unwrap_or_default()
        };
        Asked {
            us: estimate(|&(us, _)| us),
            reference_us: estimate(|&(_, reference_us)| reference_us),
            ratio: estimate(|&(us, reference_us)| us / reference_us.max(1.0e-3)),
            polygons_asked,
        }
    }
}

impl Pair<'_> {
    fn row(&self, kind: Contender, questions: &Questions) -> RayRow {
        let Questions { outside, inside, boxes, points } = questions;
        let (range, range_work) = self.time(boxes, |index, bounds, _| {
            let mut found = Vec::new();
            index.box_query(bounds, &mut found)
        });
        let (neighbours, neighbours_work) = self.time(points, |index, &point, asked| {
            let mut found = Vec::new();
            let mut distance_m = |id: PolygonId| {
                *asked += 1;
                self.model.polygons[id.index()].distance_m(point)
            };
            index.nearest(point, NEIGHBOURS, &mut distance_m, &mut found)
        });
        let outline = Outline::of(self.index, &self.model.boxes);
        let [in_order, best_first] = walk_both(&outline, self.model, questions);
        RayRow {
            index: kind.name().to_owned(),
            outside: self.time(outside, |index, ray, asked| self.nearest(index, ray, asked)).0,
            inside: self.time(inside, |index, ray, asked| self.nearest(index, ray, asked)).0,
            any: self.time(inside, |index, ray, asked| self.any(index, ray, asked)).0,
            range,
            range_work,
            neighbours,
            neighbours_work,
            growing: self.grow(kind, inside),
            in_order,
            best_first,
        }
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

    /// Times questions, and counts the nodes and boxes of one.
    fn time<Q>(
        &self,
        questions: &[Q],
        ask: impl Fn(&dyn SpatialIndex, &Q, &mut u64) -> WorkCounts,
    ) -> (Asked, [f64; 2]) {
        let (mut work, mut asked) = (WorkCounts::default(), 0);
        for question in questions {
            work += ask(self.index, question, &mut asked);
        }
        let count = questions.len() as f64;
        let shares: Vec<&[Q]> = questions.chunks(TOGETHER).collect();
        let ask_all = |index: &dyn SpatialIndex, share: &[Q]| {
            let mut unused = 0;
            for question in share {
                std::hint::black_box(ask(index, question, &mut unused));
            }
        };
        // Both are asked as often, so that neither has warmer caches.
        let ns = [self.index, self.reference].map(|index| {
            let start = Instant::now();
            ask_all(index, shares[0]);
            start.elapsed().as_nanos() as f64
        });
        let runs = runs_for(ns[0].min(ns[1]), resolution_ns()) as usize;
        let times = Times::measure(self.config.budget_secs, MOST, |turn, is_reference| {
            let index = if is_reference { self.reference } else { self.index };
            let share = shares[turn % shares.len()];
            (0..runs).for_each(|_| ask_all(index, share));
            runs * share.len()
        });
        (times.asked(asked as f64 / count), [work.nodes as f64 / count, work.boxes as f64 / count])
    }

    /// Frames that each insert some of the last polygons and cast rays.
    fn grow(&self, kind: Contender, rays: &[Ray]) -> Asked {
        let all = self.model.boxes.len();
        let frames = FRAMES.min(all / BATCH);
        let first = all - frames * BATCH;
        let mut subjects =
            [kind, Contender::Own(self.config.reference)].map(|kind| self.model.filled(kind, first));
        let mut asked = 0;
        let times = Times::measure(self.config.budget_secs, frames, |turn, is_reference| {
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
        let frames = times.0.len().max(1) as f64;
        times.asked(asked as f64 / frames / BATCH as f64)
    }
}

/// What the two orders look at and how fast they are, in turns.
fn walk_both(outline: &Outline, model: &RaysModel, questions: &Questions) -> [Walked; 2] {
    const REPEATS: usize = 3;
    let count = (questions.outside.len() + questions.inside.len()) as f64;
    let mut best_secs = [f64::INFINITY; 2];
    let mut steps = [Steps::default(); 2];
    for _ in 0..REPEATS {
        for (at, order) in [Order::InOrder, Order::BestFirst].into_iter().enumerate() {
            steps[at] = Steps::default();
            let start = Instant::now();
            walk(outline, order, &model.polygons, questions, &mut steps[at]);
            best_secs[at] = best_secs[at].min(start.elapsed().as_secs_f64());
        }
    }
    [0, 1].map(|at| Walked {
        nodes: steps[at].nodes as f64 / count,
        boxes: steps[at].boxes as f64 / count,
        polygons_asked: steps[at].asked as f64 / count,
        mrays_per_sec: count * 1.0e-6 / best_secs[at].max(1.0e-9),
    })
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
        let questions = Questions::new(&model, 60);
        let mut hits = 0;
        for kind in Contender::all() {
            let index = model.filled(kind, model.boxes.len());
            let outline = Outline::of(index.as_ref(), &model.boxes);
            assert_eq!(outline.len(), model.boxes.len(), "{}", kind.name());
            let (mut in_order, mut best_first) = (Steps::default(), Steps::default());
            for ray in questions.outside.iter().chain(&questions.inside) {
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
            // No order looks at fewer nodes than best first, but for nodes entered at the same place.
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
        let questions = Questions::new(&model, 60);
        let boxes = |kind: IndexKind| {
            let index = model.filled(Contender::Own(kind), model.boxes.len());
            let mut steps = Steps::default();
            walk(
                &Outline::of(index.as_ref(), &model.boxes),
                Order::InOrder,
                &model.polygons,
                &questions,
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
        let questions = Questions::new(&model, 60);
        let index = model.filled(Contender::Own(IndexKind::Osp), model.boxes.len());
        let mut boxes = 0;
        for &point in &questions.points {
            let mut distance_m = |id: PolygonId| model.polygons[id.index()].distance_m(point);
            boxes += index.nearest(point, NEIGHBOURS, &mut distance_m, &mut Vec::new()).boxes;
        }
        let all = (questions.points.len() * model.boxes.len()) as u64;
        assert!(boxes > 0 && boxes * 10 < all, "{boxes} of {all}");
        for ray in &questions.outside {
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

    #[test]
    fn all_structures_give_the_same_answers_and_a_model_without_polygons_none() {
        let config = RaysConfig {
            kinds: Contender::all(),
            reference: IndexKind::Osp,
            questions: 20,
            budget_secs: 0.0,
        };
        let model = RaysModel::synthetic(700).expect("it is whole");
        let result = cast_rays(&config, &model, |_| {}).expect("polygons");
        assert_eq!(result.disagree, Vec::<String>::new());
        assert_eq!(result.rows.len(), config.kinds.len());
        for row in &result.rows {
            assert!(
                row.outside.polygons_asked > 0.0 && row.any.polygons_asked <= row.inside.polygons_asked,
                "{row:?}"
            );
            assert!(
                row.growing.us.values >= FEWEST && row.neighbours.polygons_asked >= NEIGHBOURS as f64,
                "{row:?}"
            );
        }
        let empty = RaysModel::new("nothing", Vec::new(), Aabb::cube(Vec3::ZERO, 1.0));
        assert!(cast_rays(&config, &empty, |_| {}).is_none());
    }
}
