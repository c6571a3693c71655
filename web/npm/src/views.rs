//! Frusta and views from sixteen numbers, or from planes.

use osp::{
    glam::{DMat4, Vec3},
    math::{Aabb, Frustum, Plane},
};

use crate::refusal::{Outcome, refused};

/// A matrix from world to clip space and its range of depths, in their original form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    clip_from_world: [f64; 16],
    is_webgl: bool,
}

impl Camera {
    /// Checks the first sixteen numbers.
    pub(crate) fn new(numbers: &[f64; 24], is_webgl: bool) -> Outcome<Self> {
        let clip_from_world: [f64; 16] = std::array::from_fn(|i| numbers[i]);
        let camera = Self { clip_from_world, is_webgl };
        let matrix = camera.matrix();
        // The matrix is so large that the planes in single precision would be infinite.
        if !matrix.as_mat4().is_finite() || !matrix.is_finite() {
            return refused("clipFromWorld: expected finite numbers");
        }
        let determinant = matrix.determinant();
        if determinant == 0.0 || !determinant.is_finite() {
            return refused("clipFromWorld: expected a matrix with an inverse");
        }
        Ok(camera)
    }

    fn matrix(&self) -> DMat4 {
        DMat4::from_cols_array(&self.clip_from_world)
    }

    /// Returns a frustum that contains the whole view of the matrix.
    pub(crate) fn frustum(&self) -> Frustum {
        Frustum::from_double_matrix(&self.matrix(), if self.is_webgl { -1.0 } else { 0.0 })
    }
}

/// Returns the frustum of at most six planes a b c d, for boxes within `bounds`; inside is `a x + b y + c z + d >= 0`.
/// The frustum is enlarged by the largest error from rounding the planes and the test to `f32`.
pub(crate) fn frustum_of_planes(numbers: &[f64], bounds: &Aabb) -> Outcome<Frustum> {
    let is_taken = |number: &f64| (*number as f32).is_finite();
    if !numbers.iter().all(is_taken) {
        return refused("planes: expected finite numbers");
    }
    let mut planes = *Frustum::everything().planes();
    for (plane, numbers) in planes.iter_mut().zip(numbers.as_chunks().0) {
        let [a, b, c, d] = numbers.map(|number: f64| number as f32);
        *plane = Plane { normal: Vec3::new(a, b, c), d };
    }
    Ok(Frustum::new(planes).widened_for(bounds))
}
