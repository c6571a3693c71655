//! Ribbons of brushes: the polygons of each sample.

use glam::{Quat, Vec2, Vec3};
use osp_session::{
    brush::{self, Brush, Family, Outline},
    stroke::{Piece, Sample, StrokeSettings},
};
use rand_pcg::{Pcg64, rand_core::Rng};

use super::brush_strokes::{Stroke, named, settings};

const WIDTH_M: f32 = 0.1;

fn pressed_fully(brush: &'static Brush) -> StrokeSettings {
    StrokeSettings { thinnest: 1.0, ..settings(brush, WIDTH_M) }
}

fn drawn_in_frames(brush: &'static Brush, samples: &[Sample], frame: usize) -> Stroke {
    Stroke::in_frames(pressed_fully(brush), samples, frame, |_, _| {})
}

fn drawn(brush: &'static Brush, samples: &[Sample]) -> Stroke {
    drawn_in_frames(brush, samples, samples.len().max(1))
}

fn quad_strips() -> impl Iterator<Item = &'static Brush> {
    brush::all().iter().filter(|brush| matches!(brush.family, Family::QuadStrip(_)))
}

fn ribbons() -> impl Iterator<Item = &'static Brush> {
    let is_ribbon = |family| {
        matches!(
            family,
            Family::QuadStrip(_)
                | Family::Welded { .. }
                | Family::ThickRibbon
                | Family::BoxSection
                | Family::Slices
        )
    };
    brush::all().iter().filter(move |brush| is_ribbon(brush.family))
}

fn at(x: f32, y: f32) -> Sample {
    Sample { position: Vec3::new(x, y, 0.0), orientation: Quat::IDENTITY, pressure: 1.0 }
}

fn line(count: u32, step_m: f32) -> Vec<Sample> {
    (0..count).map(|i| at(i as f32 * step_m, 0.0)).collect()
}

/// A stroke that wanders, reverses, rests and jumps.
fn wild(random: &mut Pcg64, count: u32) -> Vec<Sample> {
    let mut unit = move || (random.next_u64() % 65536) as f32 / 65536.0;
    let (mut p, mut way) = (Vec3::ZERO, Vec3::X);
    (0..count)
        .map(|_| {
            let turn = match (unit() * 12.0) as u32 {
                0 => 4.0,
                1..4 => 1.0,
                _ => 0.1,
            };
            way = (way + Vec3::new(unit() - 0.5, unit() - 0.5, unit() - 0.5) * turn).normalize_or(Vec3::Y);
            p += way * [0.0, 1.0e-8, 0.0007, 0.004, 0.02, 0.02, 0.05, 0.3][(unit() * 8.0) as usize];
            let axis = Vec3::new(unit() - 0.5, unit() - 0.5, unit() + 0.1).normalize();
            let orientation = Quat::from_axis_angle(axis, unit());
            Sample { position: p, orientation, pressure: unit() }
        })
        .collect()
}

fn close(a: Vec2, b: Vec2) -> bool {
    a.distance(b) < 1.0e-3
}

#[test]
fn a_straight_stroke_is_a_row_of_rectangles_with_the_texture_along_it() {
    let stroke = drawn(named("CelVinyl"), &line(11, 0.03));
    assert_eq!(stroke.pieces.len(), 10);
    for (i, piece) in stroke.pieces.iter().enumerate() {
        let x = |k: usize| k as f32 * 0.03;
        // The tracker points along -z, so the ribbon faces it, and its width is along y.
        let half = 0.5 * WIDTH_M;
        let corners = [(x(i), -half), (x(i), half), (x(i + 1), half), (x(i + 1), -half)];
        let vertices = piece.polygon.vertices();
        let side = if vertices[0].y < 0.0 { 1.0 } else { -1.0 };
        for (vertex, (x, y)) in vertices.iter().zip(corners) {
            assert!(vertex.distance(Vec3::new(x, side * y, 0.0)) < 1.0e-6, "{vertex} is not ({x}, {y})");
        }
        let (u0, u1) = (i as f32 / 10.0, (i + 1) as f32 / 10.0);
        let uv = [(u0, 0.0), (u0, 1.0), (u1, 1.0), (u1, 0.0)].map(Vec2::from);
        for (corner, uv) in uv.into_iter().enumerate() {
            assert!(close(piece.surface.uv(corner), uv), "{} is not {uv}", piece.surface.uv(corner));
            let normal = piece.surface.normal(corner).expect("smooth");
            assert!(normal.z.abs() > 0.999, "{normal}");
        }
    }
}

#[test]
fn the_end_is_where_the_hand_is_and_the_next_sample_replaces_it() {
    // A quad is kept after 0.0215 m.
    let mut samples = line(5, 0.03);
    let mut ends = Vec::new();
    for x in [0.13, 0.135, 0.14] {
        samples.push(at(x, 0.0));
        let stroke = drawn(named("CelVinyl"), &samples);
        assert_eq!(stroke.pieces.len(), 5);
        ends.push(stroke.pieces[4].polygon.vertices()[2].x);
    }
    assert!(ends.iter().zip([0.13, 0.135, 0.14]).all(|(a, b)| (a - b).abs() < 1.0e-6), "{ends:?}");
    samples.push(at(0.142, 0.0));
    samples.push(at(0.16, 0.0));
    let stroke = drawn(named("CelVinyl"), &samples);
    assert_eq!(stroke.pieces.len(), 6);
}

#[test]
fn where_the_hand_turns_back_a_new_segment_begins_with_its_own_texture() {
    let mut samples = line(6, 0.03);
    samples.extend((0..5).map(|i| at(0.13 - i as f32 * 0.03, 0.01)));
    let stroke = drawn(named("CelVinyl"), &samples);
    let u: Vec<[f32; 2]> = stroke.pieces.iter().map(|p| [p.surface.uv(0).x, p.surface.uv(2).x]).collect();
    assert_eq!(u.len(), 10, "{u:?}");
    for (segment, name) in [(&u[..5], "there"), (&u[5..], "back")] {
        assert!(segment[0][0].abs() < 1.0e-3 && (segment[4][1] - 1.0).abs() < 1.0e-3, "{name}: {u:?}");
        assert!(segment.windows(2).all(|pair| (pair[0][1] - pair[1][0]).abs() < 1.0e-3), "{name}: {u:?}");
    }
    // A single quad between two breaks is not drawn.
    let mut samples = line(4, 0.03);
    samples.push(at(0.06, 0.001));
    samples.extend((0..4).map(|i| at(0.09 + i as f32 * 0.03, 0.002)));
    let stroke = drawn(named("CelVinyl"), &samples);
    assert_eq!(stroke.pieces.len(), 3 + 4);
}

#[test]
fn quads_of_a_segment_share_their_edges() {
    let arc: Vec<Sample> = (0..60)
        .map(|i| {
            let angle = i as f32 * 0.1;
            let position = Vec3::new(angle.cos(), angle.sin(), 0.05 * i as f32) * 0.3;
            Sample { position, orientation: Quat::from_rotation_x(angle), pressure: 0.5 + 0.5 * angle.sin() }
        })
        .collect();
    for brush in quad_strips() {
        let stroke = drawn(brush, &arc);
        assert!(stroke.pieces.len() >= 58, "{}: {}", brush.name, stroke.pieces.len());
        let shared = |a: &Piece, b: &Piece| {
            let (a, b) = (a.polygon.vertices(), b.polygon.vertices());
            a.iter().filter(|corner| b.contains(corner)).count()
        };
        for pair in stroke.pieces.windows(2) {
            assert!(shared(&pair[0], &pair[1]) >= 2, "{}: {pair:?}", brush.name);
        }
    }
}

#[test]
fn in_a_turn_tighter_than_the_ribbon_is_wide_nothing_is_turned_over() {
    for radius_m in [0.03, 0.045, 0.06, 0.2] {
        for way in [1.0, -1.0] {
            let samples: Vec<Sample> = (0..200)
                .map(|i| i as f32 * 0.025 / radius_m)
                .take_while(|angle| *angle < 3.0)
                .map(|angle| at(radius_m * angle.sin(), way * radius_m * (1.0 - angle.cos())))
                .collect();
            let stroke = drawn(named("CelVinyl"), &samples);
            assert!(stroke.pieces.len() >= 3, "{radius_m}: {}", stroke.pieces.len());
            let z: Vec<f32> = stroke.pieces.iter().map(|piece| piece.polygon.area_vector().z).collect();
            assert!(z.iter().all(|each| each * z[0] > 0.0), "radius {radius_m} m, {way}: {z:?}");
        }
    }
}

/// Here the end that fades has more quads than may still change their shape.
#[test]
fn a_thin_line_in_small_frames_is_painted_as_in_one() {
    for brush in ribbons() {
        let settings = StrokeSettings { width_m: 0.002, ..pressed_fully(brush) };
        let pieces = |frame| Stroke::in_frames(settings, &line(100, 0.002), frame, |_, _| {}).pieces;
        assert!(pieces(1) == pieces(100), "{}", brush.name);
    }
}

#[test]
fn a_sample_replaces_few_polygons_however_long_the_stroke_is() {
    let mut random = Pcg64::new(4, 7);
    let samples = wild(&mut random, 3000);
    for brush in ribbons() {
        let stroke = drawn_in_frames(brush, &samples, 3);
        assert!(stroke.pieces.len() > 200, "{}: {}", brush.name, stroke.pieces.len());
        match brush.family {
            // A ribbon that is pointed at both ends is rebuilt as a whole, but only each time it has grown by an
            // eighth.
            Family::Welded { shape: Outline::DoubleTaper | Outline::Bolt, .. } => {}
            _ => assert!(stroke.most_replaced <= 26, "{}: {}", brush.name, stroke.most_replaced),
        }
    }
    let arc = arc(2000);
    for name in ["DoubleTaperedMarker", "Electricity"] {
        let mut stroke = Stroke::new(pressed_fully(named(name)));
        let mut replaced = 0;
        for &sample in &arc {
            stroke.most_replaced = 0;
            stroke.push(sample);
            replaced += stroke.most_replaced;
        }
        stroke.finish();
        let a_piece = replaced / stroke.pieces.len();
        assert!(a_piece < 16, "{name}: each polygon was made {a_piece} times");
    }
}

/// A long, gentle spiral.
fn arc(count: u32) -> Vec<Sample> {
    (0..count).map(|i| i as f32 * 0.03).map(|x| at(x.cos() + 0.05 * x, x.sin())).collect()
}

#[test]
fn thick_ribbons_and_bars_are_closed() {
    for (brush, pieces) in [("ThickGeometry", 4 * 18 + 2 * 8), ("SquarePaper", 4 * 20 + 2)] {
        let stroke = drawn(named(brush), &line(21, 0.03));
        // The first and the last pieces of the thick ribbon are bent, because their height rises from 0.
        assert_eq!(stroke.pieces.len(), pieces, "{brush}");
        // The area vectors of a closed surface add up to zero, and its volume is positive.
        let sum: Vec3 = stroke.pieces.iter().map(|piece| piece.polygon.area_vector()).sum();
        assert!(sum.length() < 1.0e-5, "{brush}: {sum}");
        let outward = stroke
            .pieces
            .iter()
            .filter(|piece| piece.polygon.area_vector().dot(piece.polygon.vertices()[0]) > 0.0);
        assert!(outward.count() >= pieces / 2 - 4, "{brush}");
        for piece in &stroke.pieces {
            if let Some(normal) = piece.surface.normal(0) {
                let turned = piece.polygon.area_vector().normalize().dot(normal);
                assert!(turned > 0.8, "{brush}: {turned}");
            }
        }
    }
}
