//! Brushes without ribbons: particles, sprays, hulls and tubes.

use glam::{Quat, Vec3};
use osp::polygon::{Change, ConvexPolygon, PolygonId};
use osp_session::{
    brush,
    recording::{Event, NormalRule, Paint, StrokeId},
    scene::Scene,
    stroke::{Drops, MAX_SCATTERED, Piece, Pieces, Sample, StrokeBuilder, StrokeSettings},
};
use osp_testkit::events::{Begin, point, polygon};
use proptest::prelude::*;

use super::brush_strokes::{Stroke, named};

fn settings(name: &str, width_m: f32) -> StrokeSettings {
    super::brush_strokes::settings(named(name), width_m)
}

fn at(x: f32, y: f32, z: f32) -> Sample {
    pressed(x, y, z, 1.0)
}

fn pressed(x: f32, y: f32, z: f32, pressure: f32) -> Sample {
    Sample { position: Vec3::new(x, y, z), orientation: Quat::IDENTITY, pressure }
}

/// Adds all samples at once.
fn draw(settings: StrokeSettings, samples: &[Sample]) -> (Vec<Piece>, Drops) {
    let (mut builder, mut out, mut drops) =
        (StrokeBuilder::new(settings), Pieces::default(), Drops::default());
    samples.iter().for_each(|&sample| builder.push(sample, &mut out, &mut drops));
    builder.finish(&mut out, &mut drops);
    let (mut pieces, mut painted) = (out.fresh().to_vec(), Vec::new());
    builder.repaint(&mut painted);
    painted.into_iter().for_each(|(place, surface)| pieces[place as usize].surface = surface);
    (pieces, drops)
}

fn middle(polygon: &ConvexPolygon) -> Vec3 {
    let vertices = polygon.vertices();
    vertices.iter().sum::<Vec3>() / vertices.len() as f32
}

#[test]
fn particles_stand_at_even_distances_whatever_the_samples() {
    // Dots: ten intervals of 0.025 m, without spread.
    let settings = settings("Dots", 0.04);
    let samples = [at(0.0, 0.0, 0.0), at(0.03, 0.0, 0.0), at(0.03, 0.2, 0.0), at(0.03, 0.235, 0.0)];
    let (pieces, drops) = draw(settings, &samples);
    assert_eq!((pieces.len(), drops), (11, Drops::default()));
    for (i, piece) in pieces.iter().enumerate() {
        let along_m = 0.025 * i as f32;
        let place = Vec3::new(along_m.min(0.03), (along_m - 0.03).max(0.0), 0.0);
        assert!(middle(&piece.polygon).distance(place) < 1.0e-6, "{i}: {}", middle(&piece.polygon));
        assert!(piece.surface.is_facing());
        assert!((piece.polygon.area_m2() - 0.04 * 0.04).abs() < 1.0e-6, "pressed fully");
        assert_eq!((piece.surface.uv(0).x.round(), piece.surface.uv(2).y.round()), (0.0, 1.0));
    }
    // Alphas are random.
    assert!(pieces.windows(2).any(|pair| pair[0].surface.alpha(0) != pair[1].surface.alpha(0)));
}

#[test]
fn a_leap_makes_a_bounded_number_of_pieces() {
    for name in ["Snow", "Splatter"] {
        let (pieces, drops) =
            draw(settings(name, 0.1), &[at(0.0, 0.0, 0.0), at(1.0e7, 0.0, 0.0), at(1.0e7, 9.0, 0.0)]);
        assert!(pieces.len() as u64 <= 2 * MAX_SCATTERED + 1, "{name}: {}", pieces.len());
        assert!(drops.excess_pieces > 100_000_000, "{name}: {drops:?}");
    }
}

/// Twice the area, and six times the volume; for a closed surface the volume does not depend on the origin.
fn area_and_volume(pieces: &[Piece]) -> (f32, f32) {
    let area = pieces.iter().map(|piece| piece.polygon.area_m2()).sum();
    let about = pieces[0].polygon.vertices()[0];
    let volume = pieces
        .iter()
        .map(|piece| (piece.polygon.vertices()[0] - about).dot(piece.polygon.area_vector()) / 6.0)
        .sum();
    (area, volume)
}

#[test]
fn a_hull_is_closed_faces_outwards_and_holds_half_balls() {
    let settings = settings("MatteHull", 0.2);
    let (pieces, drops) = draw(settings, &[at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0)]);
    assert_eq!(drops, Drops::default());
    // The first point, four sides of a pyramid up to the ring at 90 degrees, then the rings and the tip.
    let (_, volume) = area_and_volume(&pieces);
    // A pyramid on a square of diagonal 0.2 m, and a frustum and a pyramid of the half ball.
    let (wide, narrow, h) = (0.02_f32, 0.01_f32, 0.1 * std::f32::consts::FRAC_1_SQRT_2);
    let expected = wide / 3.0 + h / 3.0 * (wide + narrow + (wide * narrow).sqrt()) + (0.1 - h) / 3.0 * narrow;
    assert!((volume - expected).abs() < 1.0e-5, "{volume} instead of {expected} cubic metres");
    let farthest = pieces.iter().flat_map(|piece| piece.polygon.vertices()).map(|p| p.x).fold(0.0, f32::max);
    assert!((farthest - 1.1).abs() < 1.0e-6);
    let inside = Vec3::X * 0.9;
    for piece in &pieces {
        let outwards = piece.polygon.area_vector().dot(piece.polygon.vertices()[0] - inside);
        assert!(outwards > 0.0, "{piece:?}");
        assert_eq!(piece.surface, brush::Surface::PLAIN);
    }
}

#[test]
fn points_inside_a_hull_replace_nothing_and_an_end_is_replaced() {
    let mut builder = StrokeBuilder::new(settings("UnlitHull", 0.2));
    let (mut out, mut drops) = (Pieces::default(), Drops::default());
    let mut count = 0;
    let mut push = |sample: Sample| {
        out.begin(count, 0);
        builder.push(sample, &mut out, &mut drops);
        count = out.len();
        (out.kept(), out.fresh().to_vec())
    };
    let farthest = |pieces: &[Piece]| {
        pieces.iter().flat_map(|piece| piece.polygon.vertices()).map(|p| p.x).fold(0.0, f32::max)
    };
    push(at(0.0, 0.0, 0.0));
    let (_, first) = push(at(1.0, 0.0, 0.0));
    // A sample back inside the hull: the half ball of lower pressure lies in the hull.
    let (kept, fresh) = push(pressed(0.7, 0.0, 0.0, 0.0));
    assert_eq!((kept as usize, fresh.len()), (first.len(), 0));
    push(at(1.0, 0.0, 0.0));
    // The sample is nearer than 0.002 m to the last kept one, so it is provisional.
    let (kept, with_end) = push(at(1.0018, 0.0, 0.0));
    assert!(kept == 0 && farthest(&with_end) > 1.1015, "{}", farthest(&with_end));
    let (kept, without) = push(at(0.9995, 0.0, 0.0));
    assert!(kept == 0 && farthest(&without) < 1.1005, "{}", farthest(&without));
}

#[test]
fn a_smooth_hull_has_normals_at_its_corners() {
    let (pieces, _) =
        draw(settings("SmoothHull", 0.2), &[at(0.0, 0.0, 0.0), at(0.05, 0.0, 0.0), at(0.1, 0.0, 0.0)]);
    assert!(!pieces.is_empty());
    for piece in &pieces {
        for (corner, vertex) in piece.polygon.vertices().iter().enumerate() {
            let normal = piece.surface.normal(corner).expect("smooth");
            assert!(normal.dot(*vertex - Vec3::X * 0.06) > 0.0, "{normal} at {vertex}");
        }
    }
}

#[test]
fn a_hull_without_width_is_counted() {
    let (pieces, drops) =
        draw(settings("MatteHull", 0.0), &[at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(1.0, 1.0, 0.0)]);
    assert_eq!((pieces.len(), drops.degenerate), (0, 1));
}

/// Number of polygons at each edge, by the bits of the edge's ends.
fn edges(pieces: &[Piece]) -> std::collections::BTreeMap<[[u32; 3]; 2], u32> {
    let mut edges = std::collections::BTreeMap::new();
    for piece in pieces {
        let vertices = piece.polygon.vertices();
        for (i, a) in vertices.iter().enumerate() {
            // Minus zero is converted to zero.
            let mut edge =
                [*a, vertices[(i + 1) % vertices.len()]].map(|p| (p + 0.0).to_array().map(f32::to_bits));
            edge.sort_unstable();
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    edges
}

#[test]
fn a_tube_is_round_closed_and_as_long_as_its_samples() {
    // TubeDiffuse: eight corners, cones of 0.8 radii. Samples are kept at 0.002 m plus a fifth of the width.
    let settings = settings("TubeDiffuse", 0.1);
    let samples: Vec<Sample> = (0..=10).map(|i| at(0.03 * i as f32, 0.0, 0.0)).collect();
    let (pieces, drops) = draw(settings, &samples);
    assert_eq!((pieces.len(), drops), (10 * 8 + 2 * 8, Drops::default()));
    assert!(edges(&pieces).values().all(|&count| count == 2), "closed");
    let octagon_m2 = 8.0 * 0.5 * 0.05_f32.powi(2) * (std::f32::consts::FRAC_PI_4).sin();
    // The end knots are not smoothed; the second and the last but one are, along the line.
    let (_, volume) = area_and_volume(&pieces);
    let expected = octagon_m2 * (0.3 + 2.0 * 0.8 * 0.05 / 3.0);
    assert!((volume - expected).abs() < 1.0e-5, "{volume} instead of {expected} cubic metres");
    for piece in &pieces {
        for (corner, vertex) in piece.polygon.vertices().iter().enumerate() {
            let aside = Vec3::new(0.0, vertex.y, vertex.z);
            let normal = piece.surface.normal(corner).expect("soft");
            if aside.length() > 1.0e-6 {
                assert!(
                    (aside.length() - 0.05).abs() < 1.0e-6 && normal.dot(aside) > 0.049,
                    "{vertex} {normal}"
                );
            } else {
                assert!(normal.x.abs() > 0.999, "{normal} at a tip");
            }
        }
    }
}

#[test]
fn a_tube_keeps_its_width_through_very_many_turns() {
    let settings = settings("TubeDiffuse", 0.02);
    let samples: Vec<Sample> = (0..600)
        .map(|i| {
            let (sin, cos) = libm::sincosf(0.1 * i as f32);
            at(0.2 * cos, 0.2 * sin, 0.003 * i as f32)
        })
        .collect();
    let (pieces, _) = draw(settings, &samples);
    assert!(pieces.len() > 500 * 8);
    let mut edge_m: Vec<f32> = pieces
        .iter()
        .filter(|piece| piece.polygon.vertices().len() == 4)
        .map(|piece| piece.polygon.vertices()[0].distance(piece.polygon.vertices()[1]))
        .collect();
    edge_m.sort_by(f32::total_cmp);
    let side_m = 0.02 * (std::f32::consts::PI / 8.0).sin();
    assert!(edge_m.iter().all(|edge_m| (edge_m - side_m).abs() < 1.0e-5), "{:?}", edge_m.last());
}

#[test]
fn a_tube_breaks_at_a_sharp_turn_into_two_closed_ones() {
    let settings = settings("TubeDiffuse", 0.1);
    // Back and forth: steps of 0.023 m may turn by 8 * atan(0.23) = 104 degrees.
    let there = (0..10).map(|i| at(0.023 * i as f32, 0.0, 0.0));
    let back = (0..10).map(|i| at(0.022 * (9 - i) as f32, 0.001 * i as f32, 0.0));
    let (pieces, _) = draw(settings, &there.chain(back).collect::<Vec<_>>());
    let caps = pieces
        .iter()
        .filter(|piece| {
            let vertices = piece.polygon.vertices();
            vertices.len() == 3 && piece.surface.normal(2).is_some_and(|normal| normal.x.abs() > 0.99)
        })
        .count();
    assert_eq!(caps, 4 * 8, "four cones");
    assert!(edges(&pieces).values().all(|&count| count == 2), "closed");
}

#[test]
fn a_scene_shapes_a_tube_once_a_frame() {
    let paint = Some(Box::new(Paint::new("Lofted", 1)));
    let (stroke, color) = (StrokeId(1), (1.0, 1.0, 1.0, 1.0));
    let begin =
        Begin { color, normal: NormalRule::Travel, thinnest: 0.0, paint, ..Begin::of(stroke) }.event();
    let point = |i: u32| point(stroke, Vec3::X * 0.03 * i as f32);
    let points: Vec<Event> = (0..200).map(point).collect();
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    scene.apply_all(std::iter::once(&begin).chain(&points), &mut changes);
    let count = scene.polygon_count();
    assert!(count > 190 * 4, "{count}");
    assert!(changes.iter().all(|change| matches!(change, Change::Insert(_))), "nothing was drawn twice");
    changes.clear();
    scene.apply_all([&point(200)], &mut changes);
    assert!(changes.iter().any(|change| matches!(change, Change::Update(_))), "its end has moved");
}

/// Samples of a hand or of random values.
fn samples() -> impl Strategy<Value = Vec<Sample>> {
    let near = (-0.02f32..0.05, -0.02f32..0.03, -0.02f32..0.02);
    let step = prop_oneof![
        12 => near.prop_map(|(x, y, z)| Vec3::new(x, y, z)),
        2 => Just(Vec3::ZERO),
        1 => Just(Vec3::X * 1.0e-5),
        1 => (-2.0f32..2.0).prop_map(|x| Vec3::new(x, -x, 0.5 * x)),
        1 => prop_oneof![Just(Vec3::splat(1.0e15)), Just(Vec3::X * 3.0e38), Just(Vec3::NAN), Just(Vec3::Z * 1.0e-38)],
    ];
    let turn =
        (-3.0f32..3.0, -3.0f32..3.0).prop_map(|(a, b)| Quat::from_rotation_y(a) * Quat::from_rotation_x(b));
    proptest::collection::vec((step, turn, 0.0f32..1.0), 0..60).prop_map(|steps| {
        let mut position = Vec3::ZERO;
        let mut at = |step: Vec3| {
            // Values out of range affect one sample only, not later ones.
            let to = position + step;
            if step.abs().max_element() < 1.0e3 {
                position = to;
            }
            to
        };
        steps
            .into_iter()
            .map(|(step, orientation, pressure)| Sample { position: at(step), orientation, pressure })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(900))]

    #[test]
    fn frames_of_any_size_give_the_same_as_all_at_once(
        samples in samples(),
        brush in prop::sample::select(brush::all()),
        frame in prop::sample::select(&[1, 2, 7, 40][..]),
        width_m in prop_oneof![Just(0.0f32), 0.001f32..0.3, Just(1.0e15f32), Just(1.0e30), Just(1.0e-20)],
        scale in prop_oneof![Just(1.0f32), 0.01f32..20.0, Just(1.0e-30f32), Just(1.0e15), Just(0.0)],
    ) {
        let settings = StrokeSettings { scale, ..settings(&brush.name, width_m) };
        let (at_once, _) = draw(settings, &samples);
        prop_assert_eq!(&Stroke::in_frames(settings, &samples, frame, |_, _| {}).pieces, &at_once);
        for piece in &at_once {
            prop_assert!(piece.polygon.vertices().iter().all(|p| p.is_finite()));
            prop_assert!(piece.polygon.area_m2() > 0.0, "{:?}", piece);
        }
    }
}

/// A step back begins a segment at a provisional end. The next sample takes that back.
#[test]
fn the_start_of_a_segment_is_painted_until_its_end_is_certain() {
    let line = (0..12).map(|i| 0.04 * i as f32);
    let samples: Vec<Sample> = line.chain([0.43, 0.48]).map(|x| at(x, 0.0, 0.0)).collect();
    let settings = StrokeSettings { scale: 11.0, ..settings("TaperedMarkerGeo", 0.001) };
    let in_frames = Stroke::in_frames(settings, &samples, 1, |_, _| {});
    assert_eq!(in_frames.pieces, draw(settings, &samples).0);
}

#[test]
fn a_polygon_that_joins_a_hull_while_it_is_drawn_is_kept() {
    let stroke = StrokeId(3);
    let paint = Some(Box::new(Paint::new("MatteHull", 1)));
    let begin = Begin { normal: NormalRule::Travel, thinnest: 0.0, paint, ..Begin::of(stroke) }.event();
    let point = |x: f32, y: f32| point(stroke, Vec3::new(x, y, 0.0));
    let far = [Vec3::new(9.0, 0.0, 0.0), Vec3::new(9.0, 1.0, 0.0), Vec3::new(8.0, 0.0, 0.0)];
    let face = polygon(Some(stroke), far, (1.0, 1.0, 1.0, 1.0));
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    let events = [begin, point(0.0, 0.0), point(0.5, 0.0), point(0.5, 0.5), face];
    events.iter().for_each(|event| scene.apply(event, &mut changes));
    let id = PolygonId(scene.polygon_count() as u32 - 1);
    for event in [point(1.0, 1.0), point(0.0, 2.0), Event::End { t: 0.0, stroke }] {
        scene.apply(&event, &mut changes);
        assert_eq!(scene.polygon(id).vertices(), far);
    }
    let top = scene.visible_ids().map(|id| scene.bounds(id).max.y).fold(0.0, f32::max);
    assert!(top > 2.0, "the hull has grown on: {top}");
}
