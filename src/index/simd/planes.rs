use crate::math::Frustum;

/// A plane made ready for boxes in rows: which row holds the corner farthest along the normal, and which the one
/// farthest against it, per axis.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct PreparedPlane {
    pub(in crate::index) normal: [f32; 3],
    pub(in crate::index) d: f32,
    /// Rows of the positive vertex; below 6.
    pub(in crate::index) far: [u8; 3],
    /// Rows of the negative vertex; below 6.
    pub(in crate::index) near: [u8; 3],
}

/// The six planes of a frustum, made ready.
#[derive(Clone, Copy, Debug)]
pub(in crate::index) struct PlaneSet {
    pub(in crate::index) planes: [PreparedPlane; 6],
}

impl PlaneSet {
    /// Mask of all six planes.
    pub(in crate::index) const ALL: u8 = 0b11_1111;

    pub(in crate::index) fn new(frustum: &Frustum) -> Self {
        let planes = frustum.planes().map(|plane| {
            let normal = plane.normal.to_array();
            let pick =
                |axis: usize, along: bool| (axis + if (normal[axis] >= 0.0) == along { 3 } else { 0 }) as u8;
            PreparedPlane {
                normal,
                d: plane.d,
                far: [pick(0, true), pick(1, true), pick(2, true)],
                near: [pick(0, false), pick(1, false), pick(2, false)],
            }
        });
        Self { planes }
    }
}
