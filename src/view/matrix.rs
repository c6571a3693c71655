use glam::{DMat3, DMat4, DVec3, DVec4, Mat4, Quat};

use super::{Projection, View, ViewWindow, WINDOW_MARGIN};

/// Range of depths in clip space, after the division by w.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// 0 at the near plane, 1 at the far plane: WebGPU, Vulkan, Direct3D, Metal.
    ZeroToOne,
    /// 1 at the near plane, 0 at the far plane or at infinity: reversed depth.
    OneToZero,
    /// -1 at the near plane, 1 at the far plane: OpenGL.
    MinusOneToOne,
}

/// The frustum of a view is wider than the frustum of its matrix by this fraction, because the view's numbers are
/// rounded to `f32`.
const WIDENING: f64 = 1.0e-6;
/// Largest shift of the eye of a `ViewWindow` by rounding, as a fraction of the near distance. A renderer in `f32` shifts
/// its eye by about as much.
const MOST_EYE_ROUNDING: f64 = 1.0e-7;
/// Largest cosine between the screen's axes. A screen with a larger cosine counts as sheared.
const MOST_SHEAR: f64 = 1.0e-4;

impl View {
    /// The view of a perspective matrix from world space to clip space, with x and y from -w to w, y up or down. The
    /// projection may be on-axis or off-axis, and have no far plane. A wrong direction of `depth` has no effect.
    /// `Mat4::from_cols_array` makes a matrix of an array of columns.
    ///
    /// The view is one millionth wider, so that it culls nothing inside the matrix's frustum. `None` for a parallel
    /// projection, a sheared or singular matrix, and numbers that are not finite. `None` also for an eye so far from
    /// the origin that `f32` rounds it by more than a quarter of the near distance.
    pub fn from_matrix(clip_from_world: &Mat4, depth: Depth) -> Option<Self> {
        let matrix_view = MatrixView::new(&clip_from_world.as_dmat4(), depth)?;
        let MatrixView { eye, forward, right, near, far, corners, .. } = matrix_view;
        // The view's eye is `f32`. Rounding it shifts all points relative to the eye.
        let eye_in_world = eye.as_vec3();
        let shift = (eye - eye_in_world.as_dvec3()).length();
        if shift > 0.25 * near {
            return None;
        }
        // The orientation of y makes no difference.
        let up = right.cross(forward);
        let of = |axis: DVec3| {
            let along = corners.map(|corner| corner.dot(axis));
            let low = along.into_iter().fold(f64::INFINITY, f64::min);
            let high = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
            // The margin also grows with the distance from the axis, because the borders of an off-axis screen are far
            // from it.
            let farthest = 1.0 + low.abs().max(high.abs());
            let more = WIDENING * (high - low + farthest) + 2.0 * farthest * shift / near;
            ((low - more) as f32, (high + more) as f32)
        };
        let ((left, right_most), (bottom, top)) = (of(right), of(up));
        let world_from_view =
            Quat::from_rotation_axes(right.as_vec3(), up.as_vec3(), -forward.as_vec3()).normalize();
        let projection = Projection {
            left,
            right: right_most,
            bottom,
            top,
            near_m: (near * (1.0 - WIDENING) - shift) as f32,
            far_m: (far * (1.0 + WIDENING) + shift) as f32,
        };
        let is_wide = projection.left < projection.right && projection.bottom < projection.top;
        let is_sane = is_wide && [left, right_most, bottom, top].iter().all(|t| t.is_finite());
        is_sane.then_some(Self { eye_in_world, world_from_view, projection })
    }
}

impl ViewWindow {
    /// The window of a matrix in `f64`, for the same matrices as [`View::from_matrix`]. Its eye is not rounded to `f32`, so
    /// occlusion culling works at any distance from the origin. As in [`View::window`], the window is wider, and its near
    /// plane farther, by [`WINDOW_MARGIN`].
    ///
    /// `None` for other matrices, and if the rounding of `f64` may move the eye by more than a part in 10^7 of the near
    /// distance.
    pub fn from_double_matrix(clip_from_world: &DMat4, depth: Depth) -> Option<Self> {
        let MatrixView { eye, eye_rounding, forward, near, corners, .. } =
            MatrixView::new(clip_from_world, depth)?;
        let is_known = eye_rounding <= MOST_EYE_ROUNDING * near;
        let middle = corners.iter().sum::<DVec3>() * 0.25;
        let corners = corners.map(|corner| middle + (corner - middle) * (1.0 + WINDOW_MARGIN));
        is_known.then(|| Self::new(eye, forward, corners, near * (1.0 + WINDOW_MARGIN)))?
    }
}

/// The view of a perspective matrix, in `f64`, world space.
struct MatrixView {
    eye: DVec3,
    /// Largest distance by which rounding may have moved the eye.
    eye_rounding: f64,
    /// Direction of view, a unit vector.
    forward: DVec3,
    /// Direction to the right border of the screen, a unit vector.
    right: DVec3,
    /// Distance of the near plane along `forward`.
    near: f64,
    /// Distance of the far plane along `forward`; may be infinite.
    far: f64,
    /// Directions from the eye to the corners of the screen, at distance 1, in order.
    corners: [DVec3; 4],
}

impl MatrixView {
    fn new(clip_from_world: &DMat4, depth: Depth) -> Option<Self> {
        if !clip_from_world.is_finite() {
            return None;
        }
        let rows = clip_from_world.transpose();
        let [x, y, z, w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
        // At the eye x, y and w are zero; they grow linearly with the direction from the eye.
        let clip_from_direction = DMat3::from_cols(x.truncate(), y.truncate(), w.truncate()).transpose();
        let direction_from_clip = clip_from_direction.inverse();
        let eye = direction_from_clip * -DVec3::new(x.w, y.w, w.w);
        let [right, _, forward] = axes_of(clip_from_world)?;
        if !eye.is_finite() || is_sheared(clip_from_world) {
            return None;
        }
        // At the distance t along the axis, the depth is (begin + slope t) / (scale t).
        let (begin, slope) = (z.dot(eye.extend(1.0)), z.truncate().dot(forward));
        let scale = w.truncate().dot(forward);
        let lowest = match depth {
            Depth::ZeroToOne | Depth::OneToZero => 0.0,
            Depth::MinusOneToOne => -1.0,
        };
        let distance_of = |depth: f64| {
            let distance = begin / (depth * scale - slope);
            // If the depth is reached only at infinity, rounding may give any large distance, positive or negative.
            let is_finite = distance > 0.0 && (depth * scale - slope).abs() > 1.0e-7 * scale.max(slope.abs());
            if is_finite { distance } else { f64::INFINITY }
        };
        let (a, b) = (distance_of(lowest), distance_of(1.0));
        let (near, far) = (a.min(b), a.max(b));
        if !near.is_finite() {
            return None;
        }
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| {
            let corner = direction_from_clip * DVec3::new(x, y, 1.0);
            corner / corner.dot(forward)
        });
        // At the eye the three rows are zero, so their computed values are rounding errors.
        let size = |row: DVec4| row.truncate().abs().dot(eye.abs()) + row.w.abs();
        let left_over = DVec3::new(size(x), size(y), size(w)) * (8.0 * f64::EPSILON);
        let inverse = direction_from_clip.to_cols_array().map(f64::abs);
        let eye_rounding = (DMat3::from_cols_array(&inverse) * left_over).length();
        Some(Self { eye, eye_rounding, forward, right, near, far, corners })
    }
}

/// The directions to the right and the upper border of the screen, and the direction of view, unit vectors; `None` for a
/// parallel projection.
fn axes_of(clip_from_world: &DMat4) -> Option<[DVec3; 3]> {
    let [x, y, w] = [0, 1, 3].map(|row| clip_from_world.row(row).truncate());
    let forward = w.try_normalize()?;
    let across = |along: DVec3| (along - forward * along.dot(forward)).try_normalize();
    Some([across(x)?, across(y)?, forward])
}

/// Whether the screen of a perspective matrix is sheared.
pub(crate) fn is_sheared(clip_from_world: &DMat4) -> bool {
    axes_of(clip_from_world).is_some_and(|[right, up, _]| right.dot(up).abs() > MOST_SHEAR)
}
