use glam::Vec3;

use super::polygon::push_quad;
use super::{Drops, Sample, StrokeSettings, frame};
use osp::polygon::ConvexPolygon;

/// Builds a ribbon: one quad between two consecutive samples. [`crate::recording::NormalRule`] determines the direction
/// of its width.
///
/// Source: "A Study on the Real Time Culling of Infinite Sets of Geometries Using OSP Tree", Fig. 17. In the figure,
/// the polygon between two samples has the tracker's X axis as its normal.
#[derive(Clone, Debug)]
pub struct RibbonBuilder {
    settings: StrokeSettings,
    last: Option<Sample>,
    /// The left and right border at the last sample; `None` until the stroke has a direction.
    border: Option<[Vec3; 2]>,
    side: Option<Vec3>,
}

impl RibbonBuilder {
    pub fn new(settings: StrokeSettings) -> Self {
        Self { settings, last: None, border: None, side: None }
    }

    /// Processes a sample and appends the quad from the previous sample: one planar polygon or two triangles.
    pub fn push(&mut self, sample: Sample, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
        let Some(last) = self.last else {
            self.last = Some(sample);
            return;
        };
        // Without a direction of travel the border stays. The next sample then continues it without a gap.
        let Some(travel) = frame::travel(&last, &sample, drops) else { return };
        let [left, right] = match self.border {
            Some(border) => border,
            None => {
                let side = frame::side(self.settings.normal, &last, travel, None);
                self.side = Some(side);
                self.border_at(&last, side)
            }
        };
        let side = frame::side(self.settings.normal, &sample, travel, self.side);
        let [next_left, next_right] = self.border_at(&sample, side);
        push_quad([left, right, next_right, next_left], out, drops);
        self.border = Some([next_left, next_right]);
        self.side = Some(side);
        self.last = Some(sample);
    }

    fn border_at(&self, sample: &Sample, side: Vec3) -> [Vec3; 2] {
        let half = side * self.settings.half_width_m(sample.pressure);
        [sample.position + half, sample.position - half]
    }
}
