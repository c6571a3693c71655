use glam::{Mat4, Vec3, Vec4};

/// Returns the six frustum planes of a matrix. A point is inside if its distance from every plane is positive or zero.
pub(crate) fn planes(clip_from_world: &[f32; 16]) -> [Vec4; 6] {
    let m = Mat4::from_cols_array(clip_from_world).transpose();
    [
        m.w_axis + m.x_axis,
        m.w_axis - m.x_axis,
        m.w_axis + m.y_axis,
        m.w_axis - m.y_axis,
        m.z_axis,
        m.w_axis - m.z_axis,
    ]
}

/// Returns false if the box lies wholly behind a plane.
pub(crate) fn may_see(planes: &[Vec4; 6], min: [f32; 3], max: [f32; 3]) -> bool {
    planes.iter().all(|plane| {
        let n = plane.truncate();
        let farthest = Vec3::select(n.cmpge(Vec3::ZERO), max.into(), min.into());
        n.dot(farthest) + plane.w >= 0.0
    })
}
