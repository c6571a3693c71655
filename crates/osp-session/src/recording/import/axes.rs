//! Conversions of axes, and the products of rotations that they need.
//!
//! Unity's axes are left-handed: +x right, +y up, +z forward. The axes of osp are right-handed with -z forward, so the
//! conversion is the mirror z → -z. A mirrored rotation keeps its angle. Its axis is a pseudovector: its x and y
//! components change sign, and z does not.
//!
//! The products are written as scalar operations, so that every machine computes the same bits; see
//! [`rotate`](osp::math::rotate).

use glam::{Quat, Vec3};

/// Converts a position or direction from Unity's axes to those of osp, or the reverse.
pub(crate) fn position_from_unity(p: Vec3) -> Vec3 {
    Vec3::new(p.x, p.y, -p.z)
}

/// Converts a rotation from Unity's axes to those of osp, or the reverse. Unity's local +z becomes local -z.
pub(crate) fn rotation_from_unity(q: Quat) -> Quat {
    Quat::from_xyzw(-q.x, -q.y, q.z, q.w)
}

/// The rotation `b`, followed by `a`.
pub(super) fn product(a: Quat, b: Quat) -> Quat {
    Quat::from_xyzw(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    )
}

/// Normalises `q`; NaN if its length is 0.
pub(super) fn unit(q: Quat) -> Quat {
    let length = (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w).sqrt();
    Quat::from_xyzw(q.x / length, q.y / length, q.z / length, q.w / length)
}

/// The inverse of a unit quaternion.
pub(super) fn inverse(q: Quat) -> Quat {
    Quat::from_xyzw(-q.x, -q.y, -q.z, q.w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::math::rotate;

    #[test]
    fn rotating_commutes_with_the_change_of_axes() {
        let q = unit(Quat::from_xyzw(0.1, -0.7, 0.3, 0.4));
        for v in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::new(0.3, -2.0, 5.0)] {
            let ours = rotate(rotation_from_unity(q), position_from_unity(v));
            assert!(ours.abs_diff_eq(position_from_unity(rotate(q, v)), 1e-5), "{v}: {ours}");
        }
        assert_eq!(position_from_unity(Vec3::Z), Vec3::NEG_Z, "forward stays forward");
    }
}
