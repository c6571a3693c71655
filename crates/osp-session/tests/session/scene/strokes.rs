//! Polygons of samples in difficult cases of motion or outline.

use glam::{Quat, Vec3};
use osp::{math::TOLERANCE_M, polygon::ConvexPolygon};
use osp_session::{
    recording::{NormalRule, Tool},
    stroke::{Drops, Pieces, Sample, StrokeBuilder, StrokeSettings, TUBE_SIDES, split_into_convex},
};
use osp_testkit::Random;

const WIDTH_M: f32 = 0.2;

fn brush(tool: Tool, normal: NormalRule) -> StrokeSettings {
    StrokeSettings { brush: None, tool, width_m: WIDTH_M, thinnest: 0.25, normal, seed: 0, scale: 1.0 }
}

fn sample(position: Vec3, orientation: Quat) -> Sample {
    Sample { position, orientation, pressure: 1.0 }
}

fn draw(brush: StrokeSettings, samples: &[Sample]) -> (Vec<ConvexPolygon>, Drops) {
    let (mut builder, mut out, mut drops) = (StrokeBuilder::new(brush), Pieces::default(), Drops::default());
    samples.iter().for_each(|&sample| builder.push(sample, &mut out, &mut drops));
    builder.finish(&mut out, &mut drops);
    (out.fresh().iter().map(|piece| piece.polygon).collect(), drops)
}

fn area_m2(polygons: &[ConvexPolygon]) -> f32 {
    polygons.iter().map(ConvexPolygon::area_m2).sum()
}

#[test]
fn samples_that_are_no_step_apart_are_no_segment() {
    let at = |x: f32, y: f32| sample(Vec3::new(x, y, 0.0), Quat::IDENTITY);
    for tool in [Tool::Ribbon, Tool::Tube] {
        let beside = 0.6 * TOLERANCE_M;
        let steps = [at(0.0, 0.0), at(0.0, beside), at(1.0, 0.0), at(1.0, beside), at(2.0, 0.0)];
        let (polygons, drops) = draw(brush(tool, NormalRule::Transport), &steps);
        assert_eq!(drops.zero_length, 2, "{tool:?}");
        let (straight, _) =
            draw(brush(tool, NormalRule::Transport), &[at(0.0, 0.0), at(1.0, 0.0), at(2.0, 0.0)]);
        assert_eq!(polygons.len(), straight.len(), "{tool:?}");
    }
}

#[test]
fn a_ribbon_does_not_fold_where_the_hand_turns_over() {
    // The tracker is turned over at every other sample.
    for (rule, axis) in
        [(NormalRule::LocalX, Vec3::Y), (NormalRule::SideX, Vec3::Y), (NormalRule::Travel, Vec3::Y)]
    {
        let samples: Vec<Sample> = (0..8)
            .map(|i| {
                let turned = if i % 2 == 0 { axis } else { -axis };
                let q = match rule {
                    // The forward axis is -z.
                    NormalRule::Travel => Quat::from_rotation_arc(Vec3::NEG_Z, turned),
                    _ => Quat::from_rotation_arc(Vec3::X, turned),
                };
                sample(Vec3::X * i as f32, q)
            })
            .collect();
        let (polygons, _) = draw(brush(Tool::Ribbon, rule), &samples);
        assert_eq!(polygons.len(), 7, "{rule:?}: a quad a step");
        assert!((area_m2(&polygons) - 7.0 * WIDTH_M).abs() < 1.0e-4, "{rule:?}: {}", area_m2(&polygons));
    }
}

#[test]
fn a_tube_does_not_twist_in_a_bend() {
    // A quarter of a circle from +x to +y: the helper axis of the first cross-section changes on the way.
    let samples: Vec<Sample> = (0..=12)
        .map(|i| {
            let angle = i as f32 / 12.0 * std::f32::consts::FRAC_PI_2;
            sample(Vec3::new(angle.sin(), 1.0 - angle.cos(), 0.0) * 2.0, Quat::IDENTITY)
        })
        .collect();
    let (polygons, _) = draw(brush(Tool::Tube, NormalRule::Transport), &samples);
    let longest = 2.0 * std::f32::consts::FRAC_PI_2 / 12.0 * (1.0 + 0.5 * WIDTH_M);
    let sides: Vec<&ConvexPolygon> = polygons.iter().filter(|p| p.area_m2() > 0.012).collect();
    assert!(sides.len() >= 12 * TUBE_SIDES, "{} sides", sides.len());
    for side in sides {
        // From one ring to the next, not around the tube.
        let [a, _, _, d] = *side.vertices() else { panic!("a bend in a plane has flat sides: {side:?}") };
        assert!(a.distance(d) < 1.05 * longest, "{} m from ring to ring", a.distance(d));
    }
}

#[test]
fn a_wall_drawn_by_a_trembling_hand_is_one_plane() {
    let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)];
    let samples: Vec<Sample> = corners
        .iter()
        .enumerate()
        .map(|(i, &(x, y))| sample(Vec3::new(x, y, if i % 2 == 0 { 0.05 } else { -0.05 }), Quat::IDENTITY))
        .collect();
    let (polygons, _) = draw(brush(Tool::Wall, NormalRule::LocalX), &samples);
    assert!(polygons.len() >= 2, "an L is cut");
    let normal = polygons[0].area_vector().normalize();
    let height = polygons[0].vertices()[0].dot(normal);
    for corner in polygons.iter().flat_map(ConvexPolygon::vertices) {
        assert!((corner.dot(normal) - height).abs() < 1.0e-5, "{corner} is off the plane");
    }
}

fn outline_area_m2(corners: &[(f32, f32)]) -> f32 {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(a, b)| a.0 * b.1 - b.0 * a.1).sum::<f32>() * 0.5
}

fn pieces(corners: &[(f32, f32)]) -> Vec<ConvexPolygon> {
    let corners: Vec<Vec3> = corners.iter().map(|&(x, y)| Vec3::new(x, y, 0.0)).collect();
    let (mut out, mut drops) = (Vec::new(), Drops::default());
    split_into_convex(&corners, &mut out, &mut drops);
    out
}

/// Pieces that cover an outline without overlap have its orientation, and their areas add up to its area.
fn assert_covers(corners: &[(f32, f32)], what: &str) {
    let whole = outline_area_m2(corners);
    let pieces = pieces(corners);
    let turning = pieces.iter().map(|piece| piece.area_vector().z * 0.5).sum::<f32>();
    let sum = area_m2(&pieces);
    assert!((turning - whole).abs() < 1.0e-3 * whole.abs(), "{what}: {turning} of {whole}");
    assert!((sum - whole.abs()).abs() < 1.0e-3 * whole.abs(), "{what}: {sum} of {whole}: pieces overlap");
}

#[test]
fn outlines_of_any_shape_are_cut_into_pieces_that_cover_them() {
    let mut random = Random::new(11);
    let mut unit = || random.unit() as f32;
    for round in 0..300 {
        // Star-shaped outlines: fully visible from the middle, with far and near corners.
        let count = 5 + round % 30;
        let mut corners: Vec<(f32, f32)> = (0..count)
            .map(|i| {
                let angle = (i as f32 + 0.8 * unit()) / count as f32 * std::f32::consts::TAU;
                let radius = 0.2 + unit();
                (radius * angle.cos(), radius * angle.sin())
            })
            .collect();
        if round % 2 == 1 {
            corners.reverse();
        }
        assert_covers(&corners, &format!("star {round}"));
    }
    // Combs and spirals are not fully visible from any point.
    let mut comb = vec![(8.0, -1.0), (8.0, 0.0)];
    for tooth in (0..8).rev() {
        let x = tooth as f32;
        comb.extend([(x + 0.9, 3.0), (x + 0.5, 3.0), (x + 0.1, 0.0)]);
    }
    comb.push((0.0, -1.0));
    assert_covers(&comb, "comb");
    let arm = |turn: f32, out: f32| {
        (0..40).map(move |i| {
            let angle = i as f32 * 0.3 * turn;
            let radius = 0.5 + 0.1 * i as f32 + out;
            (radius * angle.cos(), radius * angle.sin())
        })
    };
    let spiral: Vec<(f32, f32)> = arm(1.0, 0.35).chain(arm(1.0, 0.0).rev()).collect();
    assert_covers(&spiral, "spiral");
}

#[test]
fn an_outline_with_a_hole_that_a_slit_leads_to_is_cut_all_the_same() {
    let outer = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.0)];
    let inner = [(1.0, 1.0), (1.0, 3.0), (3.0, 3.0), (3.0, 1.0), (1.0, 1.0)];
    let ring: Vec<(f32, f32)> = outer.into_iter().chain(inner).collect();
    assert!((outline_area_m2(&ring) - 12.0).abs() < 1.0e-6);
    assert_covers(&ring, "a square with a square hole");
}
