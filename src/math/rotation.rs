use glam::{DVec3, Quat, Vec3};

/// The quaternion scaled to unit length. The length of quaternions in files differs from 1 by a few per mille.
pub fn unit(q: Quat) -> Quat {
    let length = (((q.x * q.x + q.y * q.y) + q.z * q.z) + q.w * q.w).sqrt();
    if length > 0.0 && length.is_finite() {
        Quat::from_xyzw(q.x / length, q.y / length, q.z / length, q.w / length)
    } else {
        Quat::IDENTITY
    }
}

/// Rotates `v` by the unit quaternion `q`.
///
/// The steps are plain `f32`, because a replay must give the same bits on every machine. `glam`'s own product has another
/// order of operations on each SIMD target.
pub fn rotate(q: Quat, v: Vec3) -> Vec3 {
    let u = Vec3::new(q.x, q.y, q.z);
    let t = u.cross(v) * 2.0;
    v + t * q.w + u.cross(t)
}

/// Does the same as [`rotate`] in `f64`, for bounds that have to be conservative.
pub fn rotate_exactly(q: Quat, v: DVec3) -> DVec3 {
    let u = Vec3::new(q.x, q.y, q.z).as_dvec3();
    let t = u.cross(v) * 2.0;
    v + t * f64::from(q.w) + u.cross(t)
}
