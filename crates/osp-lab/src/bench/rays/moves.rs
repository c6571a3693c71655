//! Refit against rebuild: what the rays' walk tests in a tree whose polygons have moved.

use osp_session::platform::time::Instant;

use glam::Vec3;
use serde::Serialize;

use super::{
    model::{Questions, RaysModel},
    outline::{Order, Outline, Steps, walk},
};
use crate::{Contender, scenes::Random};
use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, PolygonId},
};
use osp_rivals::IndexKind;

/// How often every polygon has moved when the trees are looked at.
const LOOKS: [u32; 7] = [0, 1, 2, 4, 8, 16, 32];
/// How far a polygon goes in one move, of the model's diagonal: always in the same direction, each its own.
const STEP: f32 = 0.005;
/// Larger models are left out: a rebuild a move takes too long.
const MOST_POLYGONS: usize = 300_000;

/// Boxes that a walk tests in trees after so many moves.
#[derive(Clone, Debug, Serialize)]
pub struct MovedRow {
    /// Moves of every polygon.
    pub moves: u32,
    /// How far each is from where it was, of the model's diagonal.
    pub moved_share: f64,
    /// Box tests a ray in a SAH tree as it was built at first, its boxes refitted.
    pub refitted: f64,
    /// In a SAH tree built after the last move.
    pub rebuilt: f64,
    /// In `bvh-sah`, which refits until its boxes have grown by half, and then rebuilds.
    pub bvh_sah: f64,
    /// In `dynamic-bvh`, each polygon taken out and filed again.
    pub dynamic_bvh: f64,
    /// In `osp`, each polygon updated.
    pub osp: f64,
    /// The last move of all polygons with `bvh-sah`, `dynamic-bvh` and `osp`, nanoseconds a polygon.
    pub update_ns_per_polygon: [f64; 3],
}

/// Moves all polygons and looks at the trees in between; nothing for models that are too large.
pub(super) fn refit_against_rebuild(model: &RaysModel, questions: &Questions) -> Vec<MovedRow> {
    if model.boxes.len() > MOST_POLYGONS {
        return Vec::new();
    }
    let kinds = [IndexKind::BvhSah, IndexKind::DynamicBvh, IndexKind::Osp].map(Contender::Own);
    let mut indexes = kinds.map(|kind| model.filled(kind, model.boxes.len()));
    let mut refitted = Outline::of(indexes[0].as_ref(), &model.boxes);
    let mut random = Random::new(2);
    let step_m = model.around().extent().length() * STEP;
    let directions: Vec<Vec3> = model.boxes.iter().map(|_| random.direction().as_vec3() * step_m).collect();
    let mut rows = Vec::new();
    let mut update_ns = [0.0; 3];
    for moves in 0..=LOOKS[LOOKS.len() - 1] {
        let by = |at: usize| directions[at] * moves as f32;
        let polygons: Vec<ConvexPolygon> =
            model.polygons.iter().enumerate().map(|(at, polygon)| polygon.map(|p| p + by(at))).collect();
        let boxes: Vec<Aabb> = polygons.iter().map(ConvexPolygon::bounds).collect();
        if moves > 0 {
            for (index, ns) in indexes.iter_mut().zip(&mut update_ns) {
                let start = Instant::now();
                for (at, bounds) in boxes.iter().enumerate() {
                    // The polygons are filed and their boxes finite.
                    let updated = index.update(PolygonId(at as u32), bounds);
                    debug_assert_eq!(updated, Ok(()));
                }
                index.commit();
                *ns = start.elapsed().as_nanos() as f64 / boxes.len() as f64;
            }
        }
        if !LOOKS.contains(&moves) {
            continue;
        }
        refitted.refit(&boxes);
        let moved = RaysModel { recording: String::new(), polygons, boxes, root: model.root };
        let rebuilt = moved.filled(kinds[0], moved.boxes.len());
        let tests = |outline: &Outline| {
            let mut steps = Steps::default();
            walk(outline, Order::InOrder, &moved.polygons, questions, &mut steps);
            steps.boxes as f64 / (questions.outside.len() + questions.inside.len()) as f64
        };
        let [bvh_sah, dynamic_bvh, osp] =
            indexes.each_ref().map(|index| tests(&Outline::of(index.as_ref(), &moved.boxes)));
        rows.push(MovedRow {
            moves,
            moved_share: f64::from(STEP) * f64::from(moves),
            refitted: tests(&refitted),
            rebuilt: tests(&Outline::of(rebuilt.as_ref(), &moved.boxes)),
            bvh_sah,
            dynamic_bvh,
            osp,
            update_ns_per_polygon: update_ns,
        });
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refitted_tree_gets_worse_and_a_rebuilt_one_does_not() {
        let model = RaysModel::synthetic(2000).expect("it is whole");
        let rows = refit_against_rebuild(&model, &Questions::new(&model, 50));
        assert_eq!(rows.iter().map(|row| row.moves).collect::<Vec<_>>(), LOOKS);
        let (first, last) = (&rows[0], &rows[rows.len() - 1]);
        assert_eq!(first.refitted, first.rebuilt);
        assert!(last.refitted > 2.0 * last.rebuilt, "{last:?}");
        // A tree of good splits is not always the best for these very rays.
        assert!(rows.iter().all(|row| row.rebuilt <= row.refitted * 1.1), "{rows:?}");
        assert!(last.bvh_sah < last.refitted, "it is built anew in time: {last:?}");
    }
}
