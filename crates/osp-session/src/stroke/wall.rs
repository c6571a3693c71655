use glam::Vec3;

use super::{Drops, Sample, split_into_convex, triangulate::flatten};
use crate::recording::Event;
use osp::polygon::ConvexPolygon;

/// Builds one planar polygon, whose corners are the samples, when the stroke ends.
#[derive(Clone, Debug, Default)]
pub struct WallBuilder {
    corners: Vec<Vec3>,
}

impl WallBuilder {
    /// Adds a corner. A corner beyond [`Event::MAX_VERTICES`] replaces the last corner.
    pub fn push(&mut self, sample: Sample, drops: &mut Drops) {
        if self.corners.len() == Event::MAX_VERTICES {
            self.corners.pop();
            drops.excess_corners += 1;
        }
        self.corners.push(sample.position);
    }

    /// Projects the corners onto their mean plane and appends the wall, in convex pieces if it is not convex.
    pub fn finish(&mut self, out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
        flatten(&mut self.corners);
        split_into_convex(&self.corners, out, drops);
        self.corners.clear();
    }
}
