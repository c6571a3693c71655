//! Refit and rebuild compared: work of ray traversal in a tree whose polygons have moved.

use osp_session::platform::time::Instant;

use glam::Vec3;

use super::{
    model::{Queries, RaysModel},
    outline::{Order, Outline, Steps, walk},
};
use crate::{
    Contender,
    rows::{Curves, Rows},
    scenes::Random,
};
use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, PolygonId},
};
use osp_rivals::IndexKind;

const MEASURED_AFTER: [u32; 7] = [0, 1, 2, 4, 8, 16, 32];
/// Length of one move of a polygon, as a fraction of the model's diagonal. Each polygon always moves in its own
/// direction.
const STEP: f32 = 0.005;
/// Largest model, polygons, because a rebuild per move takes too long in larger ones.
const MOST_POLYGONS: usize = 300_000;

/// The trees. The updates of the first three are timed.
const TREES: [&str; 5] = ["bvh-sah", "dynamic-bvh", "osp", "sah-refitted", "sah-rebuilt"];
const TASK: &str = "rays/moved";

/// Moves all polygons repeatedly and measures the trees in between. Larger models are skipped.
pub(super) fn refit_against_rebuild(rows: &mut Rows, model: &RaysModel, queries: &Queries) {
    if model.boxes.len() > MOST_POLYGONS {
        return;
    }
    let kinds = [IndexKind::BvhSah, IndexKind::DynamicBvh, IndexKind::Osp].map(Contender::Own);
    let mut indexes = kinds.map(|kind| model.filled(kind, model.boxes.len()));
    let mut refitted = Outline::of(indexes[0].as_ref(), &model.boxes);
    let mut random = Random::new(2);
    let step_m = model.around().extent().length() * STEP;
    let directions: Vec<Vec3> = model.boxes.iter().map(|_| random.direction().as_vec3() * step_m).collect();
    let mut boxes_a_ray: Vec<(u32, [f64; 5])> = Vec::new();
    let mut update_ns = [0.0; 3];
    for moves in 0..=MEASURED_AFTER[MEASURED_AFTER.len() - 1] {
        let by = |at: usize| directions[at] * moves as f32;
        let polygons: Vec<ConvexPolygon> =
            model.polygons.iter().enumerate().map(|(at, polygon)| polygon.map(|p| p + by(at))).collect();
        let boxes: Vec<Aabb> = polygons.iter().map(ConvexPolygon::bounds).collect();
        if moves > 0 {
            for (index, ns) in indexes.iter_mut().zip(&mut update_ns) {
                let start = Instant::now();
                for (at, bounds) in boxes.iter().enumerate() {
                    // The polygons are in the index and their boxes are finite, so no error can occur.
                    let updated = index.update(PolygonId(at as u32), bounds);
                    debug_assert_eq!(updated, Ok(()));
                }
                index.commit();
                *ns = start.elapsed().as_nanos() as f64 / boxes.len() as f64;
            }
        }
        if !MEASURED_AFTER.contains(&moves) {
            continue;
        }
        refitted.refit(&boxes);
        let moved = RaysModel { recording: String::new(), polygons, boxes, root: model.root };
        let rebuilt = moved.filled(kinds[0], moved.boxes.len());
        let tests = |outline: &Outline| {
            let mut steps = Steps::default();
            walk(outline, Order::InOrder, &moved.polygons, queries, &mut steps);
            steps.boxes as f64 / (queries.outside.len() + queries.inside.len()) as f64
        };
        let [bvh_sah, dynamic_bvh, osp] =
            indexes.each_ref().map(|index| tests(&Outline::of(index.as_ref(), &moved.boxes)));
        let rebuilt = tests(&Outline::of(rebuilt.as_ref(), &moved.boxes));
        boxes_a_ray.push((moves, [bvh_sah, dynamic_bvh, osp, tests(&refitted), rebuilt]));
    }
    for (at, tree) in TREES.into_iter().enumerate() {
        let mut figures = rows.of(TASK, &model.recording, tree);
        for (moves, boxes) in &boxes_a_ray {
            figures.value(&format!("boxes_after_{moves}_moves"), "1/ray", boxes[at]);
        }
        figures.maybe("update", "ns/polygon", update_ns.get(at).copied());
    }
    let line = |at: usize| {
        let points =
            boxes_a_ray.iter().map(|&(moves, boxes)| (f64::from(moves * 100) * f64::from(STEP), boxes[at]));
        (TREES[at].to_owned(), points.collect())
    };
    rows.curves.push(Curves {
        part: "rays",
        title: format!("{}: refit against rebuild as polygons move", model.recording),
        x: "moved, % of the model's diagonal",
        y: "boxes a ray",
        lines: (0..TREES.len()).map(line).collect(),
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refitted_tree_gets_worse_and_a_rebuilt_one_does_not() {
        let model = RaysModel::synthetic(2000).expect("it is whole");
        let mut rows = Rows::default();
        refit_against_rebuild(&mut rows, &model, &Queries::new(&model, 50));
        let boxes = |tree: &str, moves: u32| {
            rows.value(TASK, "scribble-2000", tree, &format!("boxes_after_{moves}_moves")).expect("a look")
        };
        assert_eq!(boxes("sah-refitted", 0), boxes("sah-rebuilt", 0));
        assert!(boxes("sah-refitted", 32) > 2.0 * boxes("sah-rebuilt", 32));
        // A tree with better splits need not be better for these very rays.
        assert!(MEASURED_AFTER.iter().all(|&at| boxes("sah-rebuilt", at) <= boxes("sah-refitted", at) * 1.1));
        assert!(boxes("bvh-sah", 32) < boxes("sah-refitted", 32), "it is rebuilt in time");
    }
}
