//! A stroke of very many samples: the cost of a frame does not grow with its length, and the result equals that of a
//! single call.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};
use osp_session::stroke::{Piece, Sample};

use super::brush_strokes::{Stroke, named, settings};

/// Brushes whose strokes change as a whole when they grow.
const TUBES: [&str; 6] = ["Comet", "Petal", "Lofted", "Lofted (Hue Shift)", "Spikes", "Sparks"];
const RIBBONS: [&str; 4] = ["Electricity", "DoubleTaperedMarker", "DoubleTaperedFlat", "Ink"];

fn like_a_whole() -> impl Iterator<Item = &'static str> {
    TUBES.into_iter().chain(RIBBONS)
}

/// A wave. With breaks, the hand jumps back every 700 samples.
fn wave(count: u16, has_breaks: bool) -> Vec<Sample> {
    (0..count)
        .map(|i| {
            let along = f32::from(i);
            let back = if has_breaks { 8.0 * f32::from(i / 700) } else { 0.0 };
            let pressure = 0.6 + 0.4 * libm::sinf(along * 0.01);
            Sample {
                position: Vec3::new(along * 0.012 - back, 0.1 * libm::sinf(along * 0.05), back),
                orientation: Quat::IDENTITY,
                pressure,
            }
        })
        .collect()
}

fn in_frames(name: &str, samples: &[Sample], frame: usize) -> Stroke {
    Stroke::in_frames(settings(named(name), 0.05), samples, frame, |_, _| {})
}

#[test]
fn a_long_stroke_costs_little_more_a_sample_than_a_short_one() {
    for name in like_a_whole() {
        let samples = wave(5000, false);
        let drawn = in_frames(name, &samples, 1);
        let most = drawn.pieces.len() * 8 * samples.len().ilog2() as usize;
        assert!(drawn.work < most, "{name}: {} for {} polygons", drawn.work, drawn.pieces.len());
    }
}

#[test]
fn a_long_stroke_ends_as_if_it_had_been_drawn_at_once() {
    for name in like_a_whole() {
        for has_breaks in [false, true] {
            let samples = wave(2500, has_breaks);
            let at_once = in_frames(name, &samples, samples.len());
            assert!(at_once.pieces.len() > 1000);
            for frame in [1, 3, 16, 1000] {
                let drawn = in_frames(name, &samples, frame);
                assert!(drawn.pieces == at_once.pieces, "{name} in frames of {frame}");
                assert_eq!(drawn.drops, at_once.drops, "{name} in frames of {frame}");
            }
        }
    }
}

/// Edges that belong to only one polygon.
fn count_rims(pieces: &[Piece]) -> usize {
    let mut edges = BTreeMap::new();
    for piece in pieces {
        let corners: Vec<[u32; 3]> =
            piece.polygon.vertices().iter().map(|corner| corner.to_array().map(f32::to_bits)).collect();
        for (i, &corner) in corners.iter().enumerate() {
            let next = corners[(i + 1) % corners.len()];
            *edges.entry([corner.min(next), corner.max(next)]).or_insert(0) += 1;
        }
    }
    edges.values().filter(|&&owners| owners == 1).count()
}

#[test]
fn a_tube_that_grows_is_drawn_to_its_end_without_gaps() {
    for name in TUBES {
        let samples = wave(1000, false);
        Stroke::in_frames(settings(named(name), 0.05), &samples, 1, |drawn, samples| {
            let count = samples.len();
            if count < 100 || count % 7 != 0 {
                return;
            }
            let at_once = in_frames(name, samples, samples.len());
            assert_eq!(drawn.pieces.len(), at_once.pieces.len(), "{name} at {count}");
            assert_eq!(count_rims(&drawn.pieces), count_rims(&at_once.pieces), "{name} at {count}");
            let near_end = at_once.pieces.len() - 16..;
            for (drawn, at_end) in drawn.pieces[near_end.clone()].iter().zip(&at_once.pieces[near_end]) {
                assert_eq!(drawn.polygon, at_end.polygon, "{name} at {count}");
            }
        });
    }
}
