use crate::brush::{Effect, TubeShape};

/// Number of knots over which a double taper rises, and over which it falls.
const TAPERED: f32 = 5.0;

/// Smallest number of knots of a double taper.
const FEWEST_TAPERED: f32 = 3.0;

/// Distance by which petals move outwards, as a fraction of the width.
const PETAL: f32 = 1.5;

/// Change of a tube's radius along a segment.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub(super) kind: TubeShape,
    pub(super) taper: f32,
    /// Full width at full pressure, metres.
    pub(super) width_m: f32,
}

/// Properties of a segment on which its shape depends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) count: usize,
    pub(super) length_m: f32,
    /// Distance of the provisional end from the last kept knot, as a fraction of the distance at which it is kept.
    pub(super) progress: f32,
}

impl Shape {
    /// Factor of the radius at the knot with index `number`, at the fraction `t` of the segment's length.
    pub(super) fn curve(&self, span: &Span, number: usize, t: f32) -> f32 {
        match self.kind {
            TubeShape::Plain => 1.0,
            TubeShape::Taper => self.taper * (1.0 - t),
            TubeShape::Sine | TubeShape::Petal => libm::sinf(std::f32::consts::PI * t).abs(),
            TubeShape::Comet => libm::sinf(1.5 * t + 1.55),
            TubeShape::DoubleTaper => double_taper(span, number as f32),
        }
    }

    /// Distance by which the sides move outwards at the fraction `t`, metres.
    pub(super) fn petal_m(&self, t: f32, pressure: f32) -> f32 {
        if self.kind == TubeShape::Petal { t * t * t * PETAL * self.width_m * pressure } else { 0.0 }
    }
}

/// The factor rises over the first knots and falls over the last knots. It changes smoothly while the hand approaches
/// the next knot.
fn double_taper(span: &Span, number: f32) -> f32 {
    let count = span.count as f32;
    if count < FEWEST_TAPERED {
        return 0.0;
    }
    let among = |count: f32| {
        let half = (0.5 * count).min(TAPERED).ceil();
        let from_end = count - number - 1.0;
        if number < half {
            number / (half - 1.0)
        } else if from_end < half {
            (from_end - 1.0).max(0.0) / (half - 1.0).max(1.0)
        } else {
            1.0
        }
    };
    let (now, next) = (among(count), among(count + 1.0));
    // The original application's blend, which prevents a dent at the start.
    let now = now + (next - now) * 0.185;
    let blended = now + (next - now) * span.progress;
    let room = 2.0 * TAPERED - FEWEST_TAPERED;
    (blended * ((count - FEWEST_TAPERED + span.progress) / room).clamp(0.0, 1.0)).clamp(0.0, 1.0)
}

/// Factor of the radius at a corner of a tube. `u` is the position along the tube, and `around` the position around it,
/// 0 to 1. The factor has period 1 in `u`.
pub(super) fn swelling(effect: Effect, u: f32, around: f32) -> f32 {
    let pi = std::f32::consts::PI;
    match effect {
        // Bulbs on a wire.
        Effect::LightWire if libm::sinf(pi * (2.0 * u).rem_euclid(1.0)) < 0.15 => 1.9,
        // Lumps: about three around the tube, and three for each length of 1 in `u`.
        Effect::Disco => {
            let wave = libm::sinf(3.0 * pi * (u + around));
            1.0 + 0.6 * wave * wave
        }
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_what_their_names_say() {
        let span = Span { count: 20, length_m: 1.0, progress: 1.0 };
        let of = |kind: TubeShape| {
            let shape = Shape { kind, taper: 1.1, width_m: 0.1 };
            move |number: usize| shape.curve(&span, number, (number + 1) as f32 / 20.0)
        };
        let near =
            |value: f32, expected: f32| assert!((value - expected).abs() < 1.0e-3, "{value}, {expected}");
        near(of(TubeShape::Plain)(3), 1.0);
        near(of(TubeShape::Taper)(9), 0.55);
        near(of(TubeShape::Taper)(19), 0.0);
        near(of(TubeShape::Sine)(9), 1.0);
        near(of(TubeShape::Sine)(19), 0.0);
        near(of(TubeShape::Comet)(0), libm::sinf(1.625));
        let lofted = of(TubeShape::DoubleTaper);
        for (number, expected) in [(0, 0.0), (1, 0.25), (2, 0.5), (4, 1.0), (10, 1.0), (17, 0.5), (19, 0.0)] {
            near(lofted(number), expected);
        }
        let few = |count: usize| double_taper(&Span { count, ..span }, 1.0);
        assert_eq!(few(2), 0.0);
        assert!(few(3) > 0.0 && few(3) < few(6), "{} {}", few(3), few(6));
        let petal = Shape { kind: TubeShape::Petal, taper: 1.0, width_m: 0.1 };
        near(petal.petal_m(0.5, 0.8), 0.125 * 1.5 * 0.08);
    }
}
