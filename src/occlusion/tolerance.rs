//! The tolerances of occlusion culling. All of them are relative, so doubling the model changes no verdict.

/// A volume counts as beyond a plane only if it is beyond by this fraction of its distance plus its size. This covers the
/// rounding of every `f64` step between the vertices of an occluder and the verdict. If this fraction is larger,
/// polygons that lie close behind their occluder are drawn though hidden.
///
/// It cannot be much smaller: the shadow planes have an error of 2e-16 over [`END_ON_SINE`], or 2e-10. Omitted planes
/// add [`IMPLIED_SINE`], and outlines that count as convex add 1e-10.
pub const QUERY_SLACK: f64 = 1.0e-9;

/// A splitting plane is omitted if the cell reaches behind it by at most this sine. It is the angle by which a shadow
/// may be too wide, so it must stay far below [`QUERY_SLACK`]. It must stay above the rounding of a plane that two
/// occluders share: some 1e-16 over the sine between its edge and the line to the eye. If it is smaller, shared planes
/// cut twice.
pub const IMPLIED_SINE: f64 = 1.0e-13;

/// A piece of an occluder reaches a cell if it extends into the cell by this sine. The value affects only the work: a piece
/// only decides whether an occluder divides a cell, so lost pieces make the shadow smaller. At zero, pieces that only touch
/// a cell are clipped first and then dropped because of [`RELEVANT_AREA_SR`].
pub const RELEVANT_SINE: f64 = 1.0e-9;

/// Pieces of occluders below this solid angle, steradians, are dropped (a pixel of a 4k screen is about 1e-7). If it is
/// larger, builds take less time and shadows are smaller. At zero, slivers that hide no pixel divide cells.
pub const RELEVANT_AREA_SR: f64 = 1.0e-9;

/// An occluder is rejected as edge-on if its plane passes the eye at less than this fraction of its farthest vertex's
/// distance. With a larger value, long floors seen from low above stop occluding. With a smaller one, the error of the
/// plane's depth nears the resolution of a depth buffer in `f32`. This error is 4e-16 times the tangent of the
/// direction over this value.
pub const EDGE_ON_SINE: f64 = 1.0e-5;

/// The smallest accepted product of two sines: between an edge and the line to the eye, and between the edges of the
/// sharpest corner as seen from the eye. Below it, the edge is seen end-on or the corner is a needle. The relative error
/// of the shadow planes (about 2e-16 over this product) nears [`QUERY_SLACK`], so the occluder is rejected.
pub const END_ON_SINE: f64 = 1.0e-6;
