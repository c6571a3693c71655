use glam::Vec3;

use super::polygon::push_quad;
use super::{Drops, Sample, StrokeSettings, frame, split_into_convex};
use osp::polygon::ConvexPolygon;

/// Number of sides of a tube's cross-section. A larger number gives rounder tubes, and more polygons for each sample.
pub const TUBE_SIDES: usize = 8;

/// Cosine and sine of the multiples of 45 degrees, the same bits on every machine.
const CIRCLE: [(f32, f32); TUBE_SIDES] = {
    const H: f32 = std::f32::consts::FRAC_1_SQRT_2;
    [(1.0, 0.0), (H, H), (0.0, 1.0), (-H, H), (-1.0, 0.0), (-H, -H), (0.0, -1.0), (H, -H)]
};

/// Builds a closed tube: a ring of quads between two consecutive samples, and a cap at each end. Its frame is
/// rotation-minimising.
#[derive(Clone, Debug)]
pub struct TubeBuilder {
    settings: StrokeSettings,
    last: Option<Sample>,
    ring: Option<[Vec3; TUBE_SIDES]>,
    side: Option<Vec3>,
}

impl TubeBuilder {
    pub fn new(settings: StrokeSettings) -> Self {
        Self { settings, last: None, ring: None, side: None }
    }

    pub fn push(&mut self, sample: Sample, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
        let Some(last) = self.last else {
            self.last = Some(sample);
            return;
        };
        let Some(travel) = frame::travel(&last, &sample, drops) else { return };
        let side = self
            .side
            .and_then(|s| frame::perpendicular_part(s, travel))
            .unwrap_or_else(|| frame::any_perpendicular(travel));
        let ring = match self.ring {
            Some(ring) => ring,
            None => {
                let first = self.ring_at(&last, side, travel);
                split_into_convex(&first, out, drops);
                first
            }
        };
        let next = self.ring_at(&sample, side, travel);
        for i in 0..TUBE_SIDES {
            let j = (i + 1) % TUBE_SIDES;
            push_quad([ring[i], ring[j], next[j], next[i]], out, drops);
        }
        (self.last, self.ring, self.side) = (Some(sample), Some(next), Some(side));
    }

    pub fn finish(&mut self, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
        if let Some(ring) = self.ring.take() {
            split_into_convex(&ring, out, drops);
        }
    }

    fn ring_at(&self, sample: &Sample, side: Vec3, travel: Vec3) -> [Vec3; TUBE_SIDES] {
        let radius_m = self.settings.half_width_m(sample.pressure);
        let up = travel.cross(side);
        CIRCLE.map(|(cos, sin)| sample.position + (side * cos + up * sin) * radius_m)
    }
}
