//! Rotations in plain `f64` arithmetic, the same on every machine.

use glam::DVec3;

/// `v` rotated about the unit vector `axis` (Rodrigues).
pub(super) fn turned(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (sin, cos) = libm::sincos(angle);
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// The component of `v` perpendicular to the unit vector `axis`, normalised.
pub(super) fn perpendicular(v: DVec3, axis: DVec3) -> DVec3 {
    let part = v - axis * v.dot(axis);
    if part.length_squared() > 1e-12 * v.length_squared() {
        part.normalize()
    } else {
        any_perpendicular(axis)
    }
}

fn any_perpendicular(axis: DVec3) -> DVec3 {
    let helper = if axis.x.abs() < 0.6 { DVec3::X } else { DVec3::Y };
    axis.cross(helper).normalize()
}

/// The unit quaternion (x, y, z, w) that rotates X, Y and Z to three perpendicular unit vectors (S. W. Shepperd, 1978:
/// computes the largest component first).
pub(super) fn quaternion(x: DVec3, y: DVec3, z: DVec3) -> [f64; 4] {
    let candidates =
        [1.0 + x.x - y.y - z.z, 1.0 - x.x + y.y - z.z, 1.0 - x.x - y.y + z.z, 1.0 + x.x + y.y + z.z];
    let mut largest = 3;
    for (i, candidate) in candidates.iter().enumerate() {
        if *candidate > candidates[largest] {
            largest = i;
        }
    }
    let root = candidates[largest].sqrt();
    let (whole, part) = (0.5 * root, 0.5 / root);
    match largest {
        0 => [whole, (x.y + y.x) * part, (z.x + x.z) * part, (y.z - z.y) * part],
        1 => [(x.y + y.x) * part, whole, (y.z + z.y) * part, (z.x - x.z) * part],
        2 => [(z.x + x.z) * part, (y.z + z.y) * part, whole, (x.y - y.x) * part],
        _ => [(y.z - z.y) * part, (z.x - x.z) * part, (x.y - y.x) * part, whole],
    }
}

/// The horizontal direction of `v`; `fallback` if `v` is vertical.
pub(super) fn level(v: DVec3, fallback: DVec3) -> DVec3 {
    DVec3::new(v.x, 0.0, v.z).try_normalize().unwrap_or(fallback)
}
