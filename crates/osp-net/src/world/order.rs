//! The order in which polygons of a session fill blocks.

use std::ops::Range;

use glam::Vec3;

use osp::{math::Aabb, polygon::PolygonId};
use osp_session::scene::Scene;

/// Number of consecutive polygons of a stroke that stay together when a session is sorted by space.
const SECTION_POLYGONS: usize = 16;

/// The order in which polygons fill blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PackOrder {
    /// The order in which the polygons were drawn. Strokes that were drawn one after the other mostly lie near each
    /// other.
    Strokes,
    /// Parts of strokes along a Z-order curve (G. M. Morton, "A Computer Oriented Geodetic Data Base and a New Technique in
    /// File Sequencing", 1966).
    #[default]
    Space,
}

impl PackOrder {
    /// Both orders.
    pub const ALL: &'static [Self] = &[Self::Strokes, Self::Space];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Strokes => "strokes",
            Self::Space => "space",
        }
    }

    /// Sorts the polygons of a model for the blocks. `ids` is in ascending order.
    pub(super) fn sort(self, scene: &Scene, ids: Vec<PolygonId>, bounds: &Aabb) -> Vec<PolygonId> {
        if self == Self::Strokes {
            return ids;
        }
        let mut sections: Vec<(u64, Range<usize>)> = Vec::new();
        let mut begin = 0;
        while begin < ids.len() {
            let stroke: *const _ = scene.stroke_of(ids[begin]);
            let goes_on = |&end: &usize| {
                ids[end].0 == ids[end - 1].0 + 1 && std::ptr::eq(scene.stroke_of(ids[end]), stroke)
            };
            let limit = ids.len().min(begin + SECTION_POLYGONS);
            let end = (begin + 1..limit).take_while(goes_on).last().map_or(begin + 1, |last| last + 1);
            let around = ids[begin..end].iter().fold(Aabb::EMPTY, |all, &id| all.union(&scene.bounds(id)));
            sections.push((along_curve(around.center(), bounds), begin..end));
            begin = end;
        }
        // At the same position, the part drawn first comes first.
        sections.sort_by_key(|(key, range)| (*key, range.start));
        sections.into_iter().flat_map(|(_, range)| ids[range].iter().copied()).collect()
    }
}

/// Position of a point on the curve through a box: the interleaved bits of its cell, 21 bits an axis.
fn along_curve(point: Vec3, bounds: &Aabb) -> u64 {
    let cells = 2_097_151.0;
    // All axes have the same scale, so that the curve's cells are cubes.
    let scale = cells / bounds.extent().max_element().max(f32::MIN_POSITIVE);
    let cell = ((point - bounds.min) * scale).clamp(Vec3::ZERO, Vec3::splat(cells));
    let spread = |x: f32| {
        let mut x = x as u64;
        for (shift, mask) in [
            (32, 0x001f_0000_0000_ffff),
            (16, 0x001f_0000_ff00_00ff),
            (8, 0x100f_00f0_0f00_f00f),
            (4, 0x10c3_0c30_c30c_30c3),
            (2, 0x1249_2492_4924_9249),
        ] {
            x = (x | x << shift) & mask;
        }
        x
    };
    spread(cell.x) | spread(cell.y) << 1 | spread(cell.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_goes_through_one_eighth_after_the_other() {
        let bounds = Aabb::cube(Vec3::ZERO, 2.0);
        let mut keys: Vec<_> = bounds.corners().map(|corner| along_curve(corner * 0.9, &bounds)).to_vec();
        assert!(keys.is_sorted(), "{keys:x?}");
        keys.dedup();
        assert_eq!(keys.len(), 8);
        assert_eq!(along_curve(bounds.max, &bounds), (1 << 63) - 1);
        assert_eq!(along_curve(bounds.min, &bounds), 0);
    }
}
