use glam::Vec3;

/// Largest distance of the corners of a flat quad from a plane, as a fraction of the longest edge.
pub(crate) const QUAD_FLATNESS: f32 = 1.0e-2;

/// Whether a quad is flat to [`QUAD_FLATNESS`] and has no concave corner.
pub fn is_flat_and_convex([a, b, c, d]: [Vec3; 4]) -> bool {
    let normal = (c - a).cross(d - b);
    let length = normal.length();
    // A quad without area counts as not flat, so that callers divide it into triangles.
    if !length.is_normal() {
        return false;
    }
    let normal = normal / length;
    let longest = [(a, b), (b, c), (c, d), (d, a)].iter().map(|(p, q)| p.distance(*q)).fold(0.0, f32::max);
    // The two diagonals of a planar quad meet; the distance between them along the normal is the bend.
    let flat = normal.dot(b - a).abs() <= QUAD_FLATNESS * longest;
    let corner = |p: Vec3, q: Vec3, r: Vec3| (q - p).cross(r - q).dot(normal) >= 0.0;
    flat && corner(a, b, c) && corner(b, c, d) && corner(c, d, a) && corner(d, a, b)
}
