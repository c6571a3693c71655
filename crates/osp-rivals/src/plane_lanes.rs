use osp::{
    index::kernels::Kernel,
    math::{Aabb, Frustum},
};

/// The six planes of a frustum as lanes, to test one box against all of them at once. Unused lanes are 0, so every box
/// lies on their inner side.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneLanes {
    normal: [[f32; 8]; 3],
    d: [f32; 8],
    /// For each axis, whether the normal of a plane has a component of at least 0. If so, the corner farthest along the
    /// normal has the box's maximum on this axis.
    rises: [[bool; 8]; 3],
}

impl PlaneLanes {
    /// Prepares the planes of a frustum.
    pub(super) fn new(frustum: &Frustum) -> Self {
        let mut all = Self { normal: [[0.0; 8]; 3], d: [0.0; 8], rises: [[true; 8]; 3] };
        for (i, plane) in frustum.planes().iter().enumerate() {
            for axis in 0..3 {
                all.normal[axis][i] = plane.normal[axis];
                all.rises[axis][i] = plane.normal[axis] >= 0.0;
            }
            all.d[i] = plane.d;
        }
        all
    }

    /// The planes of `mask` that cut a box; `None` if the box lies wholly behind one of them. The kernel argument only
    /// selects the instruction set.
    #[inline(always)]
    pub(super) fn cut<K: Kernel>(&self, _kernel: K, mask: u8, bounds: &Aabb) -> Option<u8> {
        let (min, max) = (bounds.min.to_array(), bounds.max.to_array());
        let distances = |is_far: bool| -> [f32; 8] {
            std::array::from_fn(|i| {
                let at = |axis: usize| if self.rises[axis][i] == is_far { max[axis] } else { min[axis] };
                let [x, y, z] =
                    [self.normal[0][i] * at(0), self.normal[1][i] * at(1), self.normal[2][i] * at(2)];
                ((x + y) + z) + self.d[i]
            })
        };
        let bits = |test: [bool; 8]| (0..8).fold(0, |bits, i| bits | u8::from(test[i]) << i);
        let behind = bits(distances(true).map(|distance| distance < 0.0));
        if behind & mask != 0 {
            return None;
        }
        Some(mask & !bits(distances(false).map(|distance| distance >= 0.0)))
    }
}
