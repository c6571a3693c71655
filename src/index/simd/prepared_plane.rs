use super::{Boxes, prefetch};

/// A plane prepared for boxes in rows. For each axis it stores two rows: the row of the positive vertex, farthest along the
/// normal, and the row of the negative vertex, farthest against it.
#[derive(Clone, Copy, Debug)]
pub struct PreparedPlane {
    pub(super) normal: [f32; 3],
    pub(super) d: f32,
    /// Rows of the positive vertex, times eight: at most 40.
    pub(super) far: [usize; 3],
    /// Rows of the negative vertex, times eight: at most 40.
    pub(super) near: [usize; 3],
}

impl PreparedPlane {
    /// Prefetches the cache lines that [`super::Kernel::behind`] will read.
    #[inline(always)]
    pub fn prefetch(&self, boxes: &Boxes<16>) {
        for row in self.far {
            prefetch(boxes.rows.as_ptr().wrapping_add(row / 8));
        }
    }
}
