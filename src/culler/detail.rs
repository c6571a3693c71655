use glam::{DMat4, DVec4, Vec3};

use super::camera::Camera;
use crate::math::Aabb;

/// Largest number of limits between levels of detail.
const MOST_LIMITS: usize = 7;

/// From which distance and at which size a camera draws an object, and in which level of detail. A distance is that from the
/// eye to the nearest point of the object's box, metres. A parallel projection has no eye, so it ignores distances.
///
/// ```
/// use osp::{Camera, Culler, Depth, Detail, ViewState};
///
/// let mut culler = Culler::<u32>::new();
/// culler.set(7, [[-1.0, -1.0, -31.0], [1.0, 1.0, -30.0_f32]]);
/// culler.set_detail(7, Detail::default().within(100.0).levels(&[10.0, 25.0]).margin(0.1));
/// culler.commit();
/// let clip = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.1, 0.0_f32];
/// let camera = Camera::from_matrix(clip, Depth::OneToZero)?;
/// let mut state = ViewState::default();
/// assert!(culler.cull_view(&camera, &mut state).levels().eq([(7, 2)]));
/// # Ok::<(), osp::CameraError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    near_m: f32,
    far_m: f32,
    least_size: f32,
    limits_m: [f32; MOST_LIMITS],
    margin: f32,
}

impl Default for Detail {
    /// At every distance and size, in level 0.
    fn default() -> Self {
        Self {
            near_m: 0.0,
            far_m: f32::INFINITY,
            least_size: 0.0,
            limits_m: [f32::INFINITY; MOST_LIMITS],
            margin: 0.0,
        }
    }
}

impl Detail {
    /// Draws the object from this distance on.
    #[must_use]
    pub fn beyond(self, near_m: f32) -> Self {
        Self { near_m, ..self }
    }

    /// Draws the object up to this distance.
    #[must_use]
    pub fn within(self, far_m: f32) -> Self {
        Self { far_m, ..self }
    }

    /// Draws the object if the sphere around its box is at least this part of the screen's height.
    #[must_use]
    pub fn at_least(self, part_of_height: f32) -> Self {
        Self { least_size: part_of_height, ..self }
    }

    /// Draws the object in level 0 up to the first distance, in level 1 up to the second, and so on. The distances ascend;
    /// the first seven count.
    #[must_use]
    pub fn levels(self, limits_m: &[f32]) -> Self {
        let limit = |at: usize| limits_m.get(at).copied().unwrap_or(f32::INFINITY);
        Self { limits_m: std::array::from_fn(limit), ..self }
    }

    /// Keeps an object as it was drawn in the last frame of a view until it is this part beyond a limit, so that it does
    /// not flicker.
    #[must_use]
    pub fn margin(self, part: f32) -> Self {
        Self { margin: part.max(0.0), ..self }
    }

    /// Whether there are distances or sizes at which the object is not drawn.
    pub(super) fn is_limited(&self) -> bool {
        self.near_m > 0.0 || self.far_m < f32::INFINITY || self.least_size > 0.0
    }

    /// The level in which a camera draws a box; `None` if it does not. `last` is the level of the last frame. A NaN in a
    /// setting draws the object.
    pub(super) fn level(&self, eye: &Eye, bounds: &Aabb, last: Option<u8>) -> Option<u8> {
        let margin = 1.0 + self.margin;
        let slack = if last.is_some() { margin } else { 1.0 };
        let (distance_m, size) = eye.measure(bounds);
        let is_out = distance_m > self.far_m * slack
            || distance_m * slack < self.near_m
            || size * slack < self.least_size;
        let level = self.limits_m.iter().filter(|limit_m| distance_m > **limit_m).count();
        let stays = |last: &usize| {
            let low = last.checked_sub(1).map_or(0.0, |below| self.limits_m[below.min(MOST_LIMITS - 1)]);
            let high = self.limits_m.get(*last).copied().unwrap_or(f32::INFINITY);
            distance_m * margin >= low && distance_m <= high * margin
        };
        let level = last.map(usize::from).filter(stays).unwrap_or(level);
        (!is_out).then_some(level as u8)
    }
}

/// Where a camera measures distances from, and sizes on its screen.
pub(super) struct Eye {
    /// `None` for a parallel projection.
    eye: Option<Vec3>,
    /// Size on the screen of a metre, at a distance of a metre or in a parallel projection; the screen's height is 1.
    scale: f32,
}

impl Eye {
    pub(super) fn new(camera: &Camera) -> Self {
        let world_from_clip: &DMat4 = camera.world_from_clip();
        let clip_from_world = world_from_clip.inverse();
        let (up, depth) =
            (clip_from_world.row(1).truncate().length(), clip_from_world.row(3).truncate().length());
        // The point of the world whose x, y and w are 0 in clip space.
        let eye = *world_from_clip * DVec4::Z;
        if depth > 1.0e-9 * up && eye.w != 0.0 {
            return Self { eye: Some((eye.truncate() / eye.w).as_vec3()), scale: (0.5 * up / depth) as f32 };
        }
        Self { eye: None, scale: 0.5 * (up / clip_from_world.row(3).w.abs()) as f32 }
    }

    /// The distance of a box, metres, NaN in a parallel projection; and the size of the sphere around it, as a part of the screen's height.
    fn measure(&self, bounds: &Aabb) -> (f32, f32) {
        let size = bounds.extent().length() * self.scale;
        match self.eye {
            // From inside, a box is as large as can be.
            Some(eye) => {
                let distance_m = bounds.distance_squared(eye).sqrt();
                (distance_m, if distance_m > 0.0 { size / distance_m } else { f32::INFINITY })
            }
            None => (f32::NAN, size),
        }
    }
}
