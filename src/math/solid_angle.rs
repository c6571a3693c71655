use glam::DVec3;

/// The solid angle of the triangle between three directions of any length, steradians; positive for both orientations.
///
/// A. Van Oosterom, J. Strackee, "The Solid Angle of a Plane Triangle", 1983.
pub(crate) fn triangle_solid_angle_sr(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    (2.0 * libm::atan2(numerator, denominator)).abs()
}
