use glam::DVec3;

use crate::math::Aabb;

/// Sixteen boxes relative to an eye, which is the origin: a row for each number, in `f64`.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct EyeBoxes {
    /// Centres: x, y, z.
    pub(crate) center: [[f64; 16]; 3],
    /// Half edges: x, y, z.
    pub(crate) half: [[f64; 16]; 3],
    /// For each box, the least distance behind a plane at which the box counts as beyond the plane.
    pub(crate) slack: [f64; 16],
}

impl EyeBoxes {
    /// Converts at most sixteen boxes from world space; the other lanes are unspecified. The slack of a box is `slack`
    /// times the sum of its three largest absolute coordinates, relative to the eye.
    #[inline(always)]
    pub(crate) fn new(boxes: &[Aabb], eye_in_world: DVec3, slack: f64) -> Self {
        let mut rows = [[0.0_f32; 16]; 6];
        for (lane, bounds) in boxes.iter().take(16).enumerate() {
            let numbers = [bounds.min.to_array(), bounds.max.to_array()];
            for (row, number) in rows.iter_mut().zip(numbers.as_flattened()) {
                row[lane] = *number;
            }
        }
        let mut eye_boxes = Self { center: [[0.0; 16]; 3], half: [[0.0; 16]; 3], slack: [0.0; 16] };
        for axis in 0..3 {
            let eye = eye_in_world[axis];
            let (lows, highs) = (&rows[axis], &rows[axis + 3]);
            for (lane, (&low, &high)) in lows.iter().zip(highs).enumerate() {
                let (low, high) = (f64::from(low) - eye, f64::from(high) - eye);
                eye_boxes.center[axis][lane] = (low + high) * 0.5;
                eye_boxes.half[axis][lane] = ((high - low) * 0.5).abs();
            }
        }
        for lane in 0..16 {
            let size = |axis: usize| eye_boxes.center[axis][lane].abs() + eye_boxes.half[axis][lane];
            eye_boxes.slack[lane] = slack * (size(0) + size(1) + size(2));
        }
        eye_boxes
    }
}
