use std::collections::VecDeque;

use glam::{DVec3, Vec3};

use super::{
    Drops, Pieces, Sample, StrokeSettings,
    convex_hull::ConvexHull,
    hull::{TOLERANCE_M, draw_hull, insert},
    knots::{Knots, Spacing},
};
use crate::brush::Brush;
use osp::math::rotate;

/// Number of consecutive samples that form a hull.
const WINDOW: usize = 5;

/// Builds the convex hull of every five consecutive samples. Each sample is a line segment along the hand's x axis.
#[derive(Clone, Debug)]
pub struct WindowedHullBuilder {
    brush: &'static Brush,
    width_m: f32,
    tolerance_m: f64,
    knots: Knots,
    has_begun: bool,
    /// The line segments at the last kept samples, at most four.
    window: VecDeque<[DVec3; 2]>,
    /// Number of polygons of the final hulls.
    done: u32,
}

impl WindowedHullBuilder {
    pub fn new(settings: &StrokeSettings, brush: &'static Brush) -> Self {
        let spacing = Spacing { length_m: brush.min_length_m, part_of_size: 0.0 };
        Self {
            brush,
            width_m: settings.width_m,
            tolerance_m: TOLERANCE_M * f64::from(settings.scale),
            knots: Knots::new(settings, brush, spacing),
            has_begun: false,
            window: VecDeque::with_capacity(WINDOW),
            done: 0,
        }
    }

    pub fn push(&mut self, sample: Sample, out: &mut Pieces, drops: &mut Drops) {
        let is_first = !std::mem::replace(&mut self.has_begun, true);
        let Some(step) = self.knots.push(sample, drops) else {
            if is_first {
                self.done = out.len();
                self.window.push_back(self.segment(&sample, 0.0));
            }
            return;
        };
        let segment = self.segment(&sample, sample.pressure);
        out.truncate(self.done);
        let mut hull = ConvexHull::new(self.tolerance_m);
        let mut ignored = Drops::default();
        let counted = if step.is_kept { drops } else { &mut ignored };
        for points in self.window.iter().chain([&segment]) {
            insert(&mut hull, points, counted);
        }
        draw_hull(&hull, true, out);
        if step.is_kept {
            counted.degenerate += u64::from(hull.is_flat());
            self.done = out.len();
            self.window.push_back(segment);
            if self.window.len() == WINDOW {
                self.window.pop_front();
            }
        }
    }

    fn segment(&self, sample: &Sample, pressure: f32) -> [DVec3; 2] {
        let half_m = 0.5 * self.width_m * self.brush.size(pressure);
        let half = (rotate(sample.orientation, Vec3::X) * half_m).as_dvec3();
        let middle = sample.position.as_dvec3();
        [middle - half, middle + half]
    }
}
