use glam::{Vec2, Vec3};

use super::{
    Drops, Pieces, Sample, StrokeSettings, frame,
    knots::{Knot, Knots, Spacing},
};
use crate::brush::{Brush, Surface};

/// Samples nearer than this to the last kept sample get no slice; metres at scale 1.
const LEAST_MOVE_M: f32 = 0.0005;

/// Builds a square perpendicular to the stroke at every sample that its brush keeps. The rotation between neighbouring
/// squares is as small as possible.
///
/// Source of its rules and constants: the slices of Tilt Brush (Apache-2.0).
#[derive(Clone, Debug)]
pub struct SlicesBuilder {
    scale: f32,
    knots: Knots,
    last: Option<Frame>,
    kept: u32,
}

#[derive(Clone, Copy, Debug)]
struct Frame {
    right: Vec3,
    travel: Vec3,
}

impl SlicesBuilder {
    pub fn new(settings: StrokeSettings, brush: &'static Brush) -> Self {
        let spacing = Spacing { length_m: 0.0001, part_of_size: 0.2 };
        Self { scale: settings.scale, knots: Knots::new(&settings, brush, spacing), last: None, kept: 0 }
    }

    /// Processes a sample; replaces a provisional slice.
    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let Some(step) = self.knots.push(sample, drops) else { return };
        out.truncate(self.kept);
        if step.length_m >= LEAST_MOVE_M * self.scale && step.length_m > 0.0 {
            let mut uncounted = Drops::default();
            let drops = if step.is_kept { drops } else { &mut uncounted };
            let frame = match self.last {
                Some(last) => Frame { right: last.turned_to(step.travel), travel: step.travel },
                None => {
                    let [right, _] = frame::ribbon(Vec3::ZERO, step.travel, step.to.sample.orientation);
                    let frame = Frame { right, travel: step.travel };
                    frame.slice(&step.from, out, drops);
                    frame
                }
            };
            frame.slice(&step.to, out, drops);
            if step.is_kept {
                self.last = Some(frame);
            }
        } else if step.is_kept {
            self.last = None;
        }
        if step.is_kept {
            self.kept = out.len();
        }
    }
}

impl Frame {
    /// Right vector of the square after the smallest rotation that turns its direction of travel to `travel`.
    fn turned_to(&self, travel: Vec3) -> Vec3 {
        let half_way = self.travel + travel;
        let right = self.right - half_way * (travel.dot(self.right) / (1.0 + self.travel.dot(travel)));
        frame::perpendicular_part(right, travel).unwrap_or_else(|| frame::any_perpendicular(travel))
    }

    fn slice(&self, knot: &Knot, out: &mut Pieces, drops: &mut Drops) {
        let right = self.right * (0.5 * knot.size_m);
        let up = right.cross(self.travel);
        let middle = knot.sample.position;
        let corners = [middle - right - up, middle - right + up, middle + right + up, middle + right - up];
        let uv = [Vec2::ZERO, Vec2::Y, Vec2::ONE, Vec2::X];
        out.push_quad(corners, Surface::flat(uv, [1.0; 4]), drops);
    }
}
