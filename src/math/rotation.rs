use glam::{Quat, Vec3};

/// Rotates `v` by the unit quaternion `q`.
///
/// Written out in plain `f32` steps because `glam`'s own product takes another order of operations on each SIMD
/// target, and a replay has to give the same bits on every machine.
pub fn rotate(q: Quat, v: Vec3) -> Vec3 {
    let u = Vec3::new(q.x, q.y, q.z);
    let t = u.cross(v) * 2.0;
    v + t * q.w + u.cross(t)
}
