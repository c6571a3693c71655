use glam::{DMat4, DVec3, DVec4};
use thiserror::Error;

use crate::{
    math::{Aabb, Frustum, Ray},
    view::{
        View, ViewWindow,
        matrix::{Depth, is_sheared},
    },
};

/// Mask of all layers.
pub const ALL_LAYERS: u32 = u32::MAX;

/// A near plane with at most this slope counts as perpendicular to the direction of view, because `f32` matrices are
/// rounded. If it were larger, the error of the window's near plane would exceed the window's margin.
const MOST_INCLINED: f64 = 5.0e-6;

/// The reason why a matrix defines no camera.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A number is infinite or NaN.
    #[error("clip_from_world: expected finite numbers, found {found} in column {column}, row {row}")]
    NotFinite {
        /// Column of the number, from 0 on.
        column: usize,
        /// Row of the number, from 0 on.
        row: usize,
        /// The number.
        found: f64,
    },
    /// The matrix has no inverse: it maps space to a plane, a line or a point.
    #[error("clip_from_world: expected a matrix that has an inverse")]
    Singular,
    /// The matrix shows nothing in front of an eye, or only its transpose is the matrix of a perspective.
    #[error(
        "clip_from_world: expected the matrix column by column, with something in front of the eye; transpose a matrix \
         that is row by row"
    )]
    Transposed,
}

/// The frustum of a camera or a light in world space, with its options for culling.
///
/// ```
/// use osp::{Camera, Depth};
///
/// // Looks along -z from the origin, 90 degrees wide; near plane at 0.1, depth reversed, no far plane. Columns.
/// let clip_from_world = [
///     1.0, 0.0, 0.0, 0.0, //
///     0.0, 1.0, 0.0, 0.0, //
///     0.0, 0.0, 0.0, -1.0, //
///     0.0, 0.0, 0.1, 0.0_f32,
/// ];
/// let camera = Camera::from_matrix(clip_from_world, Depth::OneToZero)?.hide_by_occluders();
/// let ray = camera.ray(0.0, 0.0);
/// assert_eq!(ray.direction.to_array(), [0.0, 0.0, -1.0]);
/// # Ok::<(), osp::CameraError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    frustum: Frustum,
    /// The exact planes of a parallel projection, with unit normals inwards.
    parallel: Option<[DVec4; 6]>,
    /// The window for occlusion culling; `None` for a parallel projection.
    window: Option<ViewWindow>,
    world_from_clip: DMat4,
    /// Depth of the near plane, clip space.
    near: f64,
    /// Depth of the far plane, clip space.
    far: f64,
    hides: bool,
    layers: u32,
}

impl Camera {
    /// Makes a camera of a matrix from world space to clip space. `clip_from_world` contains the matrix column by
    /// column. In clip space, x and y go from -w to w. The projection may be perspective or parallel, on-axis or
    /// off-axis, mirrored, with y up or down. It may have an oblique near plane, and no far plane. An `f64` matrix
    /// counts as exact, however far from the origin the eye is. For a perspective projection, a wrong direction of
    /// `depth` has no effect.
    ///
    /// # Errors
    /// [`CameraError`]: a number is not finite, the matrix has no inverse, or its numbers are row by row. Not every
    /// matrix by rows is recognised.
    pub fn from_matrix<N: Into<f64> + Copy>(
        clip_from_world: [N; 16],
        depth: Depth,
    ) -> Result<Self, CameraError> {
        let numbers = clip_from_world.map(Into::into);
        if let Some(at) = numbers.iter().position(|number| !number.is_finite()) {
            return Err(CameraError::NotFinite { column: at / 4, row: at % 4, found: numbers[at] });
        }
        let clip_from_world = DMat4::from_cols_array(&numbers);
        let world_from_clip = clip_from_world.inverse();
        if !world_from_clip.is_finite() {
            return Err(CameraError::Singular);
        }
        let (near, far) = match depth {
            Depth::ZeroToOne => (0.0, 1.0),
            Depth::OneToZero => (1.0, 0.0),
            Depth::MinusOneToOne => (-1.0, 1.0),
        };
        // A perspective matrix itself determines which plane is nearer, because nearer points have a larger w in world
        // space.
        let w_of = |depth| (world_from_clip * DVec4::new(0.0, 0.0, depth, 1.0)).w;
        let is_turned = w_of(near) < w_of(far) * (1.0 - 1.0e-9);
        let (near, far) = if is_turned { (far, near) } else { (near, far) };
        if is_behind_eye(&world_from_clip, near, far) || is_transposed(&clip_from_world, depth) {
            return Err(CameraError::Transposed);
        }
        Ok(Self {
            frustum: Frustum::from_double_matrix(&clip_from_world, near.min(far)),
            parallel: parallel_planes(&clip_from_world, near.min(far)),
            window: window_of(&clip_from_world, depth),
            world_from_clip,
            near,
            far,
            hides: false,
            layers: ALL_LAYERS,
        })
    }

    /// The same camera with occlusion culling. Occlusion culling has no effect with a parallel projection, an oblique near
    /// plane or a sheared screen.
    #[must_use]
    pub fn hide_by_occluders(self) -> Self {
        Self { hides: true, ..self }
    }

    /// The same camera, limited to objects on at least one of `layers`, a mask with a bit for each layer. The default
    /// is [`ALL_LAYERS`].
    #[must_use]
    pub fn on_layers(self, layers: u32) -> Self {
        Self { layers, ..self }
    }

    /// The ray through a point of the screen, with coordinates from -1 to 1 as in the matrix. The ray starts at the near
    /// plane. Its parameter is the distance from this plane, metres.
    pub fn ray(&self, x: f32, y: f32) -> Ray {
        let at = |depth| self.world_from_clip * DVec4::new(f64::from(x), f64::from(y), depth, 1.0);
        let (near, far) = (at(self.near), at(self.far));
        let along = far.truncate() * near.w - near.truncate() * far.w;
        let start: DVec3 = near.truncate() / near.w;
        Ray::new(start.as_vec3(), along.normalize_or_zero().as_vec3())
    }

    /// The six planes, world space. They lie outwards by the rounding errors of all boxes in view.
    pub fn frustum(&self) -> &Frustum {
        &self.frustum
    }

    /// The six planes for boxes within `bounds`. For a parallel projection with distant ends they lie closer than those of
    /// [`Camera::frustum`], because the errors grow with the distance of the boxes from the origin.
    pub(super) fn frustum_within(&self, bounds: impl FnOnce() -> Aabb) -> Frustum {
        self.parallel.as_ref().map_or(self.frustum, |planes| Frustum::within(planes, &bounds()))
    }

    /// The window for the selection of occluders; `None` without occlusion culling.
    pub(super) fn hiding_window(&self) -> Option<&ViewWindow> {
        self.window.as_ref().filter(|_| self.hides)
    }

    pub(super) fn asks_to_hide(&self) -> bool {
        self.hides
    }

    pub(super) fn world_from_clip(&self) -> &DMat4 {
        &self.world_from_clip
    }

    /// Depths of the near and the far plane, clip space.
    pub(super) fn depths(&self) -> (f64, f64) {
        (self.near, self.far)
    }

    pub(super) fn layers(&self) -> u32 {
        self.layers
    }
}

impl From<&View> for Camera {
    /// The camera of a view, on all layers, without occlusion culling.
    fn from(view: &View) -> Self {
        Self {
            frustum: view.frustum(),
            parallel: None,
            window: view.window(),
            world_from_clip: view.clip_from_world().as_dmat4().inverse(),
            near: 1.0,
            far: 0.0,
            hides: false,
            layers: ALL_LAYERS,
        }
    }
}

/// The planes of a parallel projection, with unit normals inwards; `None` for a perspective.
fn parallel_planes(clip_from_world: &DMat4, lowest: f64) -> Option<[DVec4; 6]> {
    let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
    let planes = [w + x, w - x, w + y, w - y, z - w * lowest, w - z];
    (w.truncate() == DVec3::ZERO).then(|| planes.map(|plane| plane / plane.truncate().length()))
}

/// The window for occlusion culling; `None` for a parallel projection, an oblique near plane or a sheared screen.
fn window_of(clip_from_world: &DMat4, depth: Depth) -> Option<ViewWindow> {
    let window = ViewWindow::from_double_matrix(clip_from_world, depth);
    window.filter(|_| has_perpendicular_near_plane(clip_from_world))
}

/// Whether all of the frustum lies behind the eye. The middle alone does not decide this: the frustum of a horizontal
/// mirror, whose near plane is oblique, may lie beside the middle of the screen.
fn is_behind_eye(world_from_clip: &DMat4, near: f64, far: f64) -> bool {
    let w = world_from_clip.row(3);
    w.x.abs() + w.y.abs() + (w.z * near).max(w.z * far) + w.w <= 0.0
}

/// Whether a matrix of a perspective was given row by row. The transpose of a perspective has a sheared screen, except for
/// some cameras near the origin that are turned about one axis at most.
fn is_transposed(clip_from_world: &DMat4, depth: Depth) -> bool {
    is_sheared(clip_from_world) && window_of(&clip_from_world.transpose(), depth).is_some()
}

/// Whether the near plane is perpendicular to the direction of view. A [`ViewWindow`] requires this.
fn has_perpendicular_near_plane(clip_from_world: &DMat4) -> bool {
    let (depth, distance) = (clip_from_world.row(2).truncate(), clip_from_world.row(3).truncate());
    let Some(forward) = distance.try_normalize() else { return false };
    let sideways = depth - forward * depth.dot(forward);
    sideways.length() <= MOST_INCLINED * depth.length().max(distance.length())
}
