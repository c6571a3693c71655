use glam::{Quat, Vec3};

use super::frame::{any_perpendicular, perpendicular_part};
use osp::math::rotate;

/// A frame of unit vectors. `right` is `ahead` x `up`; in Open Brush the frame is left-handed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) ahead: Vec3,
    up: Vec3,
    right: Vec3,
}

impl Frame {
    fn new(ahead: Vec3, up: Vec3) -> Self {
        let up = perpendicular_part(up, ahead).unwrap_or_else(|| any_perpendicular(ahead));
        Self { ahead, up, right: ahead.cross(up) }
    }

    pub(super) fn first(ahead: Vec3, orientation: Quat) -> Self {
        let up = rotate(orientation, Vec3::Y);
        Self::new(ahead, if up.dot(ahead) < 0.01 { rotate(orientation, Vec3::X) } else { up })
    }

    /// The frame after the smallest rotation that turns `self.ahead` to `ahead`.
    pub(super) fn turned_to(self, ahead: Vec3) -> Self {
        let both = self.ahead + ahead;
        let up = self.up - both * (ahead.dot(self.up) / (1.0 + self.ahead.dot(ahead)).max(1.0e-6));
        Self::new(ahead, up)
    }

    /// Unit vector from the centre outwards, at an angle from the bottom with this cosine and sine.
    pub(super) fn outwards(&self, (cos, sin): (f32, f32)) -> Vec3 {
        -self.up * cos - self.right * sin
    }
}
