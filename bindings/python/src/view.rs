use std::fmt::Write;

use numpy::{PyArray1, PyArray2};
use osp::{
    Depth,
    glam::{Mat4, Quat, Vec3, Vec4},
    math::Frustum,
    view::{self, Projection},
};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::arrays;

/// A view frustum: an eye in the world, its direction and its projection.
///
/// The world is right-handed, +y up, in metres; a view looks along its own -z. `View.look_at` and `View.from_matrix`
/// create views.
///
/// >>> view = osp.View.look_at(eye=(0, 1.6, 3), target=(0, 1, 0))
/// >>> view
/// View(eye=(0, 1.6, 3), near_m=0.1, far_m=1000)
/// >>> view.frustum_planes.shape
/// (6, 4)
#[pyclass(module = "osp", frozen, eq, from_py_object)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    pub(crate) view: view::View,
}

#[pymethods]
impl View {
    /// Returns a view from `eye` towards `target`, each three numbers, metres. `up` is the direction that points
    /// upwards on the screen. `fov_y_degrees` is the vertical field of view (1 to 170), and `aspect` is the screen's
    /// width divided by its height. The view shows only distances from `near_m` to `far_m` (which may be `math.inf`),
    /// measured along the view.
    ///
    /// `ValueError`: a number is out of its range, `eye` equals `target`, or `up` points along the view.
    ///
    /// >>> osp.View.look_at((0, 0, 0), (0, 0, -1), fov_y_degrees=90, aspect=1, near_m=1, far_m=50).far_m
    /// 50.0
    #[staticmethod]
    #[pyo3(signature = (eye, target, up=None, fov_y_degrees=60.0, aspect=16.0/9.0, near_m=0.1, far_m=1000.0),
           text_signature = "(eye, target, up=(0.0, 1.0, 0.0), fov_y_degrees=60.0, aspect=1.7777777777777777, near_m=0.1, far_m=1000.0)")]
    fn look_at(
        eye: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
        up: Option<&Bound<'_, PyAny>>,
        fov_y_degrees: f64,
        aspect: f64,
        near_m: f64,
        far_m: f64,
    ) -> PyResult<Self> {
        let (eye, target) = (arrays::vector(eye, "eye")?, arrays::vector(target, "target")?);
        let up = up.map_or(Ok(Vec3::Y), |up| arrays::vector(up, "up"))?;
        let is_in = |ok: bool, what: &str, found: f64| {
            if ok { Ok(()) } else { Err(PyValueError::new_err(format!("{what}; found {found}"))) }
        };
        is_in(
            (1.0..=170.0).contains(&fov_y_degrees),
            "fov_y_degrees: expected a number from 1 to 170",
            fov_y_degrees,
        )?;
        is_in((1.0e-3..=1.0e3).contains(&aspect), "aspect: expected a number from 0.001 to 1000", aspect)?;
        let (near, far) = (near_m as f32, far_m as f32);
        is_in(near > 0.0 && near.is_finite(), "near_m: expected a positive number", near_m)?;
        is_in(far > near, "far_m: expected a number larger than near_m", far_m)?;

        // In f64, so that nothing overflows.
        let along = eye.as_dvec3() - target.as_dvec3();
        let Some(back) = along.try_normalize() else {
            return Err(PyValueError::new_err("target: expected another point than the eye"));
        };
        let across = up.as_dvec3().try_normalize().map_or(along, |up| up).cross(back);
        if across.length_squared() < 1.0e-12 || up == Vec3::ZERO {
            return Err(PyValueError::new_err("up: expected a direction that is not along the view"));
        }
        let right = across.normalize();
        let upward = back.cross(right);
        let axes = [right, upward, back].map(|axis| axis.as_vec3());
        let world_from_view = Quat::from_rotation_axes(axes[0], axes[1], axes[2]).normalize();
        let projection = Projection::symmetric(fov_y_degrees as f32, aspect as f32, near, far);
        Ok(Self { view: view::View { eye_in_world: eye, world_from_view, projection } })
    }

    /// Returns the view of a matrix from the world to clip space. The matrix has four rows in mathematical notation
    /// (`clip = matrix @ [x, y, z, 1]`); many libraries store the transpose. It must be perspective, on-axis or
    /// off-axis.
    ///
    /// `depth` is the range of visible depths after the division by w: `"zero-to-one"` (Vulkan, Direct3D, Metal,
    /// WebGPU; also reversed) or `"minus-one-to-one"` (OpenGL). The view is one millionth wider than the matrix, so
    /// that nothing in the frustum of the matrix is culled. The matrix is converted to float32.
    ///
    /// `ValueError`: a wrong shape, numbers that are not finite, a parallel projection, a sheared or singular matrix,
    /// or a distant eye: its error in float32 exceeds a quarter of the near distance.
    ///
    /// >>> p = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0.1], [0, 0, -1, 0]])  # reversed depth, no far plane
    /// >>> osp.View.from_matrix(p).far_m
    /// inf
    #[staticmethod]
    #[pyo3(signature = (clip_from_world, depth="zero-to-one"))]
    fn from_matrix(clip_from_world: &Bound<'_, PyAny>, depth: &str) -> PyResult<Self> {
        let matrix = arrays::matrix(clip_from_world, "clip_from_world")?;
        let view = view::View::from_matrix(&matrix, clip_depth(depth)?).ok_or_else(|| {
            PyValueError::new_err(
                "clip_from_world: expected a perspective from the world to clip space (is it the transpose? a parallel \
                 projection, a shear or a singular matrix is none)",
            )
        })?;
        Ok(Self { view })
    }

    /// The eye, world space, metres.
    #[getter]
    fn eye<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.view.eye_in_world.to_array())
    }

    /// The direction of view, world space, unit length.
    #[getter]
    fn forward<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        PyArray1::from_slice(py, &self.view.forward_in_world().to_array())
    }

    /// Nearest visible distance, metres along the view.
    #[getter]
    fn near_m(&self) -> f64 {
        shortest(self.view.projection.near_m)
    }

    /// Farthest visible distance, metres along the view; may be infinite.
    #[getter]
    fn far_m(&self) -> f64 {
        shortest(self.view.projection.far_m)
    }

    /// The matrix of four rows from the world to clip space, with reversed depth (near 1, far 0) as in osp's renderer.
    #[getter]
    fn clip_from_world<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let near_m = self.view.projection.near_m;
        let mut matrix = self.view.clip_from_world();
        if self.view.projection.far_m.is_infinite() {
            // With an infinite far distance, the depth is near / distance.
            let nearer = Projection { far_m: near_m * 2.0, ..self.view.projection };
            let rows = view::View { projection: nearer, ..self.view }.clip_from_world().transpose();
            let depth = Vec4::new(0.0, 0.0, 0.0, near_m);
            matrix = Mat4::from_cols(rows.x_axis, rows.y_axis, depth, rows.w_axis).transpose();
        }
        arrays::table(py, &matrix.transpose().to_cols_array_2d())
    }

    /// The six planes against which a culler tests boxes, float32, with `nx, ny, nz, d` in each row. A box is reported
    /// if for each plane `nx * x + ny * y + nz * z + d >= 0` at the corner that lies farthest along the normal.
    #[getter]
    fn frustum_planes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let rows = self.frustum().planes().map(|plane| plane.normal.extend(plane.d).to_array());
        arrays::table(py, &rows)
    }

    fn __repr__(&self) -> String {
        let mut eye = String::new();
        for (i, x) in self.view.eye_in_world.to_array().into_iter().enumerate() {
            let _ = write!(eye, "{}{x}", if i > 0 { ", " } else { "" });
        }
        let Projection { near_m, far_m, .. } = self.view.projection;
        format!("View(eye=({eye}), near_m={near_m}, far_m={far_m})")
    }

    fn __hash__(&self) -> u64 {
        let bits = self.view.eye_in_world.to_array().map(|x| u64::from((x + 0.0).to_bits()));
        bits.into_iter().fold(0, |hash, bits| (hash ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }
}

impl View {
    pub(crate) fn frustum(&self) -> Frustum {
        self.view.frustum()
    }

    /// Converts a `View`, or a matrix with its range of depths.
    pub(crate) fn of(view: &Bound<'_, PyAny>, depth: Option<&str>) -> PyResult<Self> {
        if let Ok(view) = view.cast::<Self>() {
            return match depth {
                None => Ok(*view.get()),
                Some(_) => Err(PyValueError::new_err("depth: expected none, as a View has its own")),
            };
        }
        Self::from_matrix(view, depth.unwrap_or("zero-to-one"))
    }
}

fn clip_depth(name: &str) -> PyResult<Depth> {
    match name {
        "zero-to-one" => Ok(Depth::ZeroToOne),
        "minus-one-to-one" => Ok(Depth::MinusOneToOne),
        _ => {
            let message = format!("depth: expected zero-to-one or minus-one-to-one; found {name:?}");
            Err(PyValueError::new_err(message))
        }
    }
}

/// Converts an `f32` to the number that is printed with the same digits: 0.1 stays 0.1, and not 0.10000000149011612.
fn shortest(v: f32) -> f64 {
    v.to_string().parse().unwrap_or(f64::from(v))
}
