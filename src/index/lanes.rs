use std::ops::Range;

use super::{WorkCounts, by_id::NO_POLYGON, flat_tree::Item, sink::Sink};
use crate::{
    math::{Aabb, Frustum, PlaneMask},
    scene::PolygonId,
};

/// Boxes tested at once against a plane. A whole leaf of most trees; four, two or one vector operations wide.
pub(super) const LANES: usize = 16;

/// The exact test of up to [`LANES`] boxes given side by side (`min` x, y, z, `max` x, y, z): appends those that are
/// behind no plane of `mask`. Lanes from `ids.len()` on, and those of [`NO_POLYGON`], are not looked at.
#[inline]
pub(super) fn cull_lanes(
    ids: &[PolygonId],
    sides: [&[f32; LANES]; 6],
    frustum: &Frustum,
    mask: PlaneMask,
    sink: &mut impl Sink,
    work: &mut WorkCounts,
) {
    let mut behind = [0u32; LANES];
    for (i, plane) in frustum.planes().iter().enumerate() {
        if !mask.contains(i) {
            continue;
        }
        let (n, d) = (plane.normal, plane.d);
        let x = if n.x >= 0.0 { sides[3] } else { sides[0] };
        let y = if n.y >= 0.0 { sides[4] } else { sides[1] };
        let z = if n.z >= 0.0 { sides[5] } else { sides[2] };
        for lane in 0..LANES {
            // The one expression of the crate (see `crate::math`), on the positive vertex.
            let distance = ((n.x * x[lane] + n.y * y[lane]) + n.z * z[lane]) + d;
            behind[lane] |= u32::from(distance < 0.0);
        }
    }
    let mut seen = [NO_POLYGON; LANES];
    let mut count = 0;
    for (lane, &id) in ids.iter().enumerate().take(LANES) {
        seen[count] = id;
        count += usize::from(behind[lane] == 0 && id != NO_POLYGON);
    }
    work.boxes += ids.len() as u64;
    work.planes += ids.len() as u64 * u64::from(mask.bits().count_ones());
    work.reported += count as u64;
    sink.put(&seen[..count]);
}

/// Boxes with their ids, each side in an array of its own, so that one plane is tested against many boxes at once.
#[derive(Clone, Debug, Default)]
pub(super) struct BoxLanes {
    ids: Vec<PolygonId>,
    /// `min` x, y, z, `max` x, y, z. Each is [`LANES`] longer than `ids` once finished, so that a wide test may start at
    /// any box.
    sides: [Vec<f32>; 6],
}

impl BoxLanes {
    pub(super) fn len(&self) -> usize {
        self.ids.len()
    }

    pub(super) fn clear(&mut self) {
        self.ids.clear();
        self.sides.iter_mut().for_each(Vec::clear);
    }

    pub(super) fn reserve(&mut self, additional: usize) {
        self.ids.reserve(additional);
        self.sides.iter_mut().for_each(|side| side.reserve(additional + LANES));
    }

    /// Appends boxes. [`BoxLanes::finish`] has to follow before the next test.
    pub(super) fn append(&mut self, items: &[Item]) {
        self.ids.extend(items.iter().map(|item| item.id));
        let [min_x, min_y, min_z, max_x, max_y, max_z] = &mut self.sides;
        min_x.extend(items.iter().map(|item| item.bounds.min.x));
        min_y.extend(items.iter().map(|item| item.bounds.min.y));
        min_z.extend(items.iter().map(|item| item.bounds.min.z));
        max_x.extend(items.iter().map(|item| item.bounds.max.x));
        max_y.extend(items.iter().map(|item| item.bounds.max.y));
        max_z.extend(items.iter().map(|item| item.bounds.max.z));
    }

    /// Makes every array long enough for a wide test of the last box.
    pub(super) fn finish(&mut self) {
        let len = self.ids.len() + LANES;
        self.sides.iter_mut().for_each(|side| side.resize(len, 0.0));
    }

    pub(super) fn set(&mut self, at: usize, bounds: &Aabb) {
        for axis in 0..3 {
            self.sides[axis][at] = bounds.min[axis];
            self.sides[axis + 3][at] = bounds.max[axis];
        }
    }

    /// Makes a hole: the box stays, but is nobody's.
    pub(super) fn vacate(&mut self, at: usize) {
        self.ids[at] = NO_POLYGON;
    }

    pub(super) fn get(&self, at: usize) -> Aabb {
        let corner = |first: usize| std::array::from_fn(|axis| self.sides[first + axis][at]).into();
        Aabb::new(corner(0), corner(3))
    }

    pub(super) fn ids(&self) -> &[PolygonId] {
        &self.ids
    }

    /// The smallest box around a range.
    pub(super) fn bounds(&self, range: Range<usize>) -> Aabb {
        let mut all = Aabb::EMPTY;
        for axis in 0..3 {
            all.min[axis] = self.sides[axis][range.clone()].iter().fold(f32::INFINITY, |m, &x| m.min(x));
            all.max[axis] =
                self.sides[axis + 3][range.clone()].iter().fold(f32::NEG_INFINITY, |m, &x| m.max(x));
        }
        all
    }

    /// Tests each box of a range against the planes of `mask`.
    pub(super) fn cull(
        &self,
        range: Range<usize>,
        frustum: &Frustum,
        mask: PlaneMask,
        sink: &mut impl Sink,
        work: &mut WorkCounts,
    ) {
        for at in range.clone().step_by(LANES) {
            let ids = &self.ids[at..range.end.min(at + LANES)];
            let lanes = |side: usize| {
                self.sides[side][at..]
                    .first_chunk()
                    .expect("the arrays are longer than the ids by a whole test")
            };
            let sides = [lanes(0), lanes(1), lanes(2), lanes(3), lanes(4), lanes(5)];
            cull_lanes(ids, sides, frustum, mask, sink, work);
        }
    }

    pub(super) fn bytes(&self) -> usize {
        let sides: usize = self.sides.iter().map(Vec::capacity).sum();
        self.ids.capacity() * size_of::<PolygonId>() + sides * size_of::<f32>()
    }
}
