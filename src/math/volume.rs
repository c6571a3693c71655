use glam::{Affine3A, DMat4, DVec3, DVec4, Mat4, Vec3, Vec3A};

use super::{
    Aabb, Containment, Corners, Frustum, Obb, Plane, Sphere,
    outward::{EVERYTHING, round_up},
};

/// Largest rounding error of a volume's distance from a plane, relative to the input numbers.
const ROUNDING: f32 = 16.0 * f32::EPSILON;

/// The far plane counts as infinitely far if it is more than 1 / `LEAST_RATIO` times as far as the near plane. With a
/// larger `LEAST_RATIO`, some far planes would cull nothing. With a smaller `LEAST_RATIO`, matrices in `f32` without a
/// far plane would get a far plane.
const LEAST_RATIO: f64 = 1.0e-7;

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
        self.radius_m * direction.length()
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
        let center = volume.center();
        let far = center.abs().max_element() + volume.size_m();
        let mut is_inside = true;
        for plane in self.planes() {
            let distance = plane.signed_distance(center);
            let reach = volume.reach_along(plane.normal);
            let rounding = ROUNDING * (plane.normal.abs().element_sum() * far + plane.d.abs());
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
        let row = |i| clip_from_space.row(i);
        let (x, y, z, w) = (row(0), row(1), row(2), row(3));
        // The row of a plane at infinity has only rounding errors.
        let rounding = f64::from(ROUNDING) * (z.truncate().length() + w.truncate().length());
        let is_plane = |side: DVec4| side.truncate().length() > rounding;
        let space_from_clip = clip_from_space.inverse();
        let corners_at = |clip_z: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(clip_x, clip_y)| space_from_clip * DVec4::new(clip_x, clip_y, clip_z, 1.0))
        };
        let (mut near, mut far) = (corners_at(lowest), corners_at(1.0));
        for (near, far) in near.iter_mut().zip(&mut far) {
            // If a plane is so far away, rounding may move or tilt it arbitrarily, so it counts as infinitely far.
            if far.w < near.w * LEAST_RATIO {
                *far = (far.truncate() * near.w - near.truncate() * far.w).extend(0.0);
            } else if near.w < far.w * LEAST_RATIO {
                *near = (near.truncate() * far.w - far.truncate() * near.w).extend(0.0);
            }
        }
        let corners = Corners { near, far, depth: w };
        Self::new(
            [w + x, w - x, w + y, w - y, z - w * lowest, w - z]
                .map(|side| if is_plane(side) { corners.plane(side) } else { EVERYTHING }),
        )
    }

    /// The frustum with its planes moved outwards by the largest rounding error of a box within `bounds`.
    /// [`Frustum::classify`] and [`Frustum::may_see`] are then conservative for such boxes. Use it for a frustum from
    /// another space ([`Frustum::in_space`]).
    #[must_use]
    pub fn widened_for(&self, bounds: &Aabb) -> Self {
        let far = bounds.min.abs().max(bounds.max.abs()).max_element();
        Self::new(self.planes().map(|Plane { normal, d }| {
            let rounding = ROUNDING * (normal.abs().element_sum() * far + d.abs());
            let d = round_up(f64::from(d) + f64::from(rounding));
            if d.is_finite() { Plane { normal, d } } else { EVERYTHING }
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
