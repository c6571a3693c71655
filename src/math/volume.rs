use glam::{Affine3A, DMat4, DVec3, DVec4, Mat4, Vec3, Vec3A};

use super::{
    Aabb, Containment, Corners, Frustum, Obb, Plane, Sphere,
    outward::{EVERYTHING, plane_within, round_up},
};

/// Largest rounding error of a volume's distance from a plane, relative to the input numbers.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// Largest error of a depth in clip space, for a matrix in `f64`. The far plane is moved outwards by as much. It is at
/// infinity if it is about `1 / DEPTH_ERROR` times as far away as the near plane.
const DEPTH_ERROR: f64 = 1024.0 * f64::EPSILON;

/// The same for a matrix whose numbers were rounded to `f32`, at depths that are a difference of two rows.
const SINGLE_DEPTH_ERROR: f64 = 2.0 * f32::EPSILON as f64;

/// A convex bounding volume with a centre.
pub trait Volume {
    /// The centre, metres.
    fn center(&self) -> Vec3;

    /// The projected radius along `direction`, times the direction's length.
    fn reach_along(&self, direction: Vec3) -> f32;

    /// Upper bound of the distance of the volume's points from the centre, metres.
    fn size_m(&self) -> f32;
}

impl Volume for Aabb {
    fn center(&self) -> Vec3 {
        self.center()
    }

    fn reach_along(&self, direction: Vec3) -> f32 {
        let half = half_sides(self) * direction.abs();
        half.x + half.y + half.z
    }

    fn size_m(&self) -> f32 {
        half_sides(self).element_sum()
    }
}

/// Half the edge lengths. The corners are halved first, so that the difference does not overflow for huge boxes.
fn half_sides(bounds: &Aabb) -> Vec3 {
    bounds.max * 0.5 - bounds.min * 0.5
}

impl Volume for Sphere {
    fn center(&self) -> Vec3 {
        self.center
    }

    fn reach_along(&self, direction: Vec3) -> f32 {
        // The square of a short direction is 0 in `f32`.
        self.radius_m * direction.as_dvec3().length() as f32
    }

    fn size_m(&self) -> f32 {
        self.radius_m
    }
}

#[doc(hidden)]
impl Volume for Obb {
    fn center(&self) -> Vec3 {
        self.center()
    }

    fn reach_along(&self, direction: Vec3) -> f32 {
        let [a, b, c] = self.axes();
        let half = self.half_sides_m();
        half.x * a.dot(direction).abs() + half.y * b.dot(direction).abs() + half.z * c.dot(direction).abs()
    }

    fn size_m(&self) -> f32 {
        self.half_sides_m().element_sum()
    }
}

impl Frustum {
    /// Tests the position of any volume by its projected radius. The test is conservative: never [`Containment::Outside`]
    /// if a point of the volume is in the frustum, never [`Containment::Inside`] if a point is not. Within the rounding
    /// error of a plane the result is [`Containment::Intersects`].
    ///
    /// For the boxes of indexes use [`Frustum::classify`], whose results are the same everywhere, bit for bit.
    pub fn classify_volume(&self, volume: &impl Volume) -> Containment {
        let center = volume.center().as_dvec3();
        let far = center.abs().max_element() + f64::from(volume.size_m());
        let mut is_inside = true;
        for plane in self.planes() {
            // In `f64` no sum overflows.
            let normal = plane.normal.as_dvec3();
            let distance = normal.dot(center) + f64::from(plane.d);
            let reach = f64::from(volume.reach_along(plane.normal));
            let rounding = ROUNDING * (normal.abs().element_sum() * far + f64::from(plane.d).abs());
            // If the distance is NaN, neither comparison holds.
            if distance < -(reach + rounding) {
                return Containment::Outside;
            }
            is_inside &= distance >= reach + rounding;
        }
        if is_inside { Containment::Inside } else { Containment::Intersects }
    }

    /// The frustum of a matrix from some space to clip space, expressed in that space. In clip space x and y go from -w to
    /// w, z from 0 to w or from w to 0. Normals have unit length. All points lie on the inner side of a plane at infinity.
    ///
    /// Gil Gribb and Klaus Hartmann, "Fast Extraction of Viewing Frustum Planes from the World-View-Projection Matrix"
    /// (2001).
    pub fn from_matrix(clip_from_space: &Mat4) -> Self {
        Self::from_double_matrix(&clip_from_space.as_dmat4(), 0.0)
    }

    /// Does the same as [`Frustum::from_matrix`] for the clip space of OpenGL, where z goes from -w to w or from w to -w.
    pub fn from_opengl_matrix(clip_from_space: &Mat4) -> Self {
        Self::from_double_matrix(&clip_from_space.as_dmat4(), -1.0)
    }

    /// Does the same as [`Frustum::from_matrix`] for a matrix in `f64`, which counts as exact: the inverse is computed in
    /// `f64`, and the planes are then moved outwards for `f32`. `lowest` is the least depth after the division by w; the
    /// largest is 1.
    pub fn from_double_matrix(clip_from_space: &DMat4, lowest: f64) -> Self {
        let middle_at = |inverse: &DMat4, depth: f64| *inverse * DVec4::new(0.0, 0.0, depth, 1.0);
        let inverse = clip_from_space.inverse();
        let (first, last) = (middle_at(&inverse, lowest), middle_at(&inverse, 1.0));
        let nearest = if first.w > last.w { first } else { last };
        let origin = Some(nearest.truncate() / nearest.w).filter(|at| at.is_finite()).unwrap_or_default();
        // Relative to a point near the eye, nothing cancels in the inverse.
        let clip_from_local = *clip_from_space * DMat4::from_translation(origin);
        let local_from_clip = clip_from_local.inverse();
        let corners_at = |clip_z: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(clip_x, clip_y)| local_from_clip * DVec4::new(clip_x, clip_y, clip_z, 1.0))
        };
        let is_single = clip_from_space.as_mat4().as_dmat4() == *clip_from_space;
        let error_at = |depth: f64| if is_single && depth != 0.0 { SINGLE_DEPTH_ERROR } else { DEPTH_ERROR };
        let (mut near, mut far) = (corners_at(lowest), corners_at(1.0));
        for (near, far) in near.iter_mut().zip(&mut far) {
            if far.w < near.w {
                *far = moved_away(*near, *far, error_at(1.0));
            } else if near.w < far.w {
                *near = moved_away(*far, *near, error_at(lowest));
            }
        }
        let row = |i| clip_from_local.row(i);
        let (x, y, z, w) = (row(0), row(1), row(2), row(3));
        let corners = Corners { origin, near, far, depth: w };
        Self::new(
            [w + x, w - x, w + y, w - y, z - w * lowest, w - z].map(|side| corners.plane(side.truncate())),
        )
    }

    /// The frustum of six planes `xyz . p + w = 0` with unit normals, for boxes within `bounds`. Its planes lie
    /// outwards by the rounding error of these boxes only.
    pub(crate) fn within(sides: &[DVec4; 6], bounds: &Aabb) -> Self {
        Self::new(sides.map(|side| plane_within(side, bounds)))
    }

    /// The frustum with its planes moved outwards by the largest rounding error of a box within `bounds`.
    /// [`Frustum::classify`] and [`Frustum::may_see`] are then conservative for such boxes. Use it for a frustum from
    /// another space ([`Frustum::in_space`]).
    #[must_use]
    pub fn widened_for(&self, bounds: &Aabb) -> Self {
        let far = f64::from(bounds.min.abs().max(bounds.max.abs()).max_element());
        Self::new(self.planes().map(|Plane { normal, d }| {
            let size = normal.as_dvec3().abs().element_sum() * far + f64::from(d).abs();
            let d = round_up(f64::from(d) + ROUNDING * size + f64::from(f32::MIN_POSITIVE));
            // Twice as large numbers might overflow in a box test.
            if size <= 0.5 * f64::from(f32::MAX) { Plane { normal, d } } else { EVERYTHING }
        }))
    }

    /// This frustum expressed in another space, to test volumes in the space of a group without transforming them.
    ///
    /// It is exact except for the rounding of the normals. [`Frustum::classify_volume`] allows for this rounding.
    /// [`Frustum::classify`] does not, because it requires the frustum of a view or a matrix in that frustum's own space.
    /// The transform may rotate, move and scale.
    #[must_use]
    pub fn in_space(&self, world_from_space: &Affine3A) -> Self {
        let exactly = |v: Vec3A| Vec3::from(v).as_dvec3();
        let (matrix, origin) = (world_from_space.matrix3, exactly(world_from_space.translation));
        Self::new(self.planes().map(|plane| {
            let of_plane = plane.normal.as_dvec3();
            let along = |axis: Vec3A| of_plane.dot(exactly(axis));
            let normal =
                DVec3::new(along(matrix.x_axis), along(matrix.y_axis), along(matrix.z_axis)).as_vec3();
            // Far from the origin both terms are large and cancel, so the sum is computed in `f64`.
            let d = round_up(of_plane.dot(origin) + f64::from(plane.d));
            if normal.is_finite() && d.is_finite() { Plane { normal, d } } else { EVERYTHING }
        }))
    }
}

/// The far end of an edge, moved away from the near end by an error of its depth in clip space; the edge's direction if
/// the end may be at infinity.
fn moved_away(near: DVec4, far: DVec4, error: f64) -> DVec4 {
    let w = far.w - near.w * error;
    if far.w >= 0.5 * near.w {
        far
    } else if w > 0.0 {
        far.truncate().extend(w)
    } else {
        (far.truncate() * near.w - near.truncate() * far.w).extend(0.0)
    }
}
