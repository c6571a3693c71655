//! A stroke of very many samples: the cost of a frame does not grow with its length, and the result equals that of a
//! single call.

use std::collections::BTreeMap;

use glam::{Quat, Vec3};
use osp_session::{
    brush,
    recording::{NormalRule, Tool},
    stroke::{Drops, Piece, Pieces, Sample, StrokeBuilder, StrokeSettings},
};

/// Brushes whose strokes change as a whole when they grow.
const TUBES: [&str; 6] = ["Comet", "Petal", "Lofted", "Lofted (Hue Shift)", "Spikes", "Sparks"];
const RIBBONS: [&str; 4] = ["Electricity", "DoubleTaperedMarker", "DoubleTaperedFlat", "Ink"];

fn like_a_whole() -> impl Iterator<Item = &'static str> {
    TUBES.into_iter().chain(RIBBONS)
}

fn settings(name: &str) -> StrokeSettings {
    let brush = brush::find(name).expect("a brush of the table");
    StrokeSettings {
        brush: Some(brush),
        tool: Tool::Ribbon,
        width_m: 0.05,
        thinnest: brush.pressure_size_min,
        normal: NormalRule::Travel,
        seed: 7,
        scale: 1.0,
    }
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

/// The polygons of a stroke, and the numbers of polygons built and repainted in total.
struct Drawn {
    builder: StrokeBuilder,
    out: Pieces,
    drops: Drops,
    pieces: Vec<Piece>,
    work: usize,
}

impl Drawn {
    fn new(settings: StrokeSettings) -> Self {
        Self {
            builder: StrokeBuilder::new(settings),
            out: Pieces::default(),
            drops: Drops::default(),
            pieces: Vec::new(),
            work: 0,
        }
    }

    fn change(&mut self, with: impl FnOnce(&mut StrokeBuilder, &mut Pieces, &mut Drops)) {
        self.out.begin(self.pieces.len() as u32, 0);
        with(&mut self.builder, &mut self.out, &mut self.drops);
        self.pieces.truncate(self.out.kept() as usize);
        self.pieces.extend(self.out.fresh());
        self.work += self.out.fresh().len();
    }

    fn repaint(&mut self) {
        let mut painted = Vec::new();
        self.builder.repaint(&mut painted);
        self.work += painted.len();
        for (place, surface) in painted {
            self.pieces[place as usize].surface = surface;
        }
    }

    fn finish(mut self) -> Self {
        self.change(|builder, out, drops| builder.finish(out, drops));
        self.repaint();
        self
    }

    fn at_once(settings: StrokeSettings, samples: &[Sample]) -> Self {
        let mut drawn = Self::new(settings);
        for &sample in samples {
            drawn.change(|builder, out, drops| builder.push(sample, out, drops));
        }
        drawn.finish()
    }

    /// Calls `each` after every frame with the samples so far.
    fn by_frames(
        settings: StrokeSettings,
        samples: &[Sample],
        frame: usize,
        mut each: impl FnMut(&Self, &[Sample]),
    ) -> Self {
        let mut drawn = Self::new(settings);
        let mut count = 0;
        for samples_of_frame in samples.chunks(frame) {
            for &sample in samples_of_frame {
                drawn.change(|builder, out, drops| builder.push(sample, out, drops));
            }
            drawn.change(|builder, out, drops| builder.settle(out, drops));
            drawn.repaint();
            count += samples_of_frame.len();
            each(&drawn, &samples[..count]);
        }
        drawn.finish()
    }
}

#[test]
fn a_long_stroke_costs_little_more_a_sample_than_a_short_one() {
    for name in like_a_whole() {
        let samples = wave(5000, false);
        let drawn = Drawn::by_frames(settings(name), &samples, 1, |_, _| {});
        let most = drawn.pieces.len() * 8 * samples.len().ilog2() as usize;
        assert!(drawn.work < most, "{name}: {} for {} polygons", drawn.work, drawn.pieces.len());
    }
}

#[test]
fn a_long_stroke_ends_as_if_it_had_been_drawn_at_once() {
    for name in like_a_whole() {
        for has_breaks in [false, true] {
            let samples = wave(2500, has_breaks);
            let at_once = Drawn::at_once(settings(name), &samples);
            assert!(at_once.pieces.len() > 1000);
            for frame in [1, 3, 16, 1000] {
                let drawn = Drawn::by_frames(settings(name), &samples, frame, |_, _| {});
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
        Drawn::by_frames(settings(name), &samples, 1, |drawn, samples| {
            let count = samples.len();
            if count < 100 || count % 7 != 0 {
                return;
            }
            let at_once = Drawn::at_once(settings(name), samples);
            assert_eq!(drawn.pieces.len(), at_once.pieces.len(), "{name} at {count}");
            assert_eq!(count_rims(&drawn.pieces), count_rims(&at_once.pieces), "{name} at {count}");
            let near_end = at_once.pieces.len() - 16..;
            for (drawn, at_end) in drawn.pieces[near_end.clone()].iter().zip(&at_once.pieces[near_end]) {
                assert_eq!(drawn.polygon, at_end.polygon, "{name} at {count}");
            }
        });
    }
}
