use numpy::PyArray1;
use osp::{ALL_LAYERS, Depth};
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{arrays, view::View};

/// A camera or a light, for `Culler.cull`: a matrix from the world to clip space, and options.
///
/// `clip_from_world` has four rows in mathematical notation (`clip = matrix @ [x, y, z, 1]`); many libraries store the
/// transpose. It may be perspective or parallel, on-axis or off-axis, mirrored, with a far plane or without. float64
/// keeps its precision, even for an eye far from the origin. `depth` is the range of visible depths after the division
/// by w: `"zero-to-one"` (Vulkan, Direct3D, Metal, WebGPU), `"one-to-zero"` (reversed) or `"minus-one-to-one"`
/// (OpenGL). A `View` is also possible, without `depth`.
///
/// With `hide_by_occluders`, the results omit objects behind occluders; this has no effect for a parallel projection.
/// `layers` has a bit for each layer that the camera sees.
///
/// `ValueError`: a wrong shape, numbers that are not finite, a matrix without an inverse, an unknown depth.
///
/// >>> reversed_depth = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0.1], [0, 0, -1, 0]])
/// >>> camera = osp.Camera(reversed_depth, "one-to-zero", hide_by_occluders=True)
/// >>> origin, direction = camera.ray(0, 0)
/// >>> direction
/// array([ 0.,  0., -1.], dtype=float32)
#[pyclass(module = "osp", frozen)]
#[derive(Debug)]
pub(crate) struct Camera {
    /// Boxed, because Python's memory is aligned to only 16 bytes.
    camera: Box<osp::Camera>,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (clip_from_world, depth=None, *, hide_by_occluders=false, layers=ALL_LAYERS),
           text_signature = "(clip_from_world, depth=None, *, hide_by_occluders=False, layers=4294967295)")]
    fn new(
        clip_from_world: &Bound<'_, PyAny>,
        depth: Option<&str>,
        hide_by_occluders: bool,
        layers: u32,
    ) -> PyResult<Self> {
        let camera = camera_of(clip_from_world, depth)?.on_layers(layers);
        let camera = if hide_by_occluders { camera.hide_by_occluders() } else { camera };
        Ok(Self { camera: Box::new(camera) })
    }

    /// The ray through a point of the screen, with `x` and `y` from -1 to 1 in the directions of the matrix. Returns
    /// its origin on the near plane, and its direction of length 1.
    fn ray<'py>(
        &self,
        py: Python<'py>,
        x: f32,
        y: f32,
    ) -> (Bound<'py, PyArray1<f32>>, Bound<'py, PyArray1<f32>>) {
        let ray = self.camera.ray(x, y);
        let array = |v: osp::glam::Vec3| PyArray1::from_slice(py, &v.to_array());
        (array(ray.origin), array(ray.direction))
    }

    fn __repr__(&self) -> &'static str {
        "<osp.Camera>"
    }
}

/// Returns the camera of a `View`, or of a matrix with its depth.
fn camera_of(value: &Bound<'_, PyAny>, depth: Option<&str>) -> PyResult<osp::Camera> {
    if value.is_instance_of::<View>() {
        return Ok(osp::Camera::from(&View::of(value, depth)?.view));
    }
    let depth = match depth {
        None | Some("zero-to-one") => Depth::ZeroToOne,
        Some("one-to-zero") => Depth::OneToZero,
        Some("minus-one-to-one") => Depth::MinusOneToOne,
        Some(name) => {
            let message =
                format!("depth: expected zero-to-one, one-to-zero or minus-one-to-one; found {name:?}");
            return Err(PyValueError::new_err(message));
        }
    };
    let columns = arrays::columns(value, "clip_from_world")?;
    osp::Camera::from_matrix(columns, depth).map_err(|why| PyValueError::new_err(why.to_string()))
}

/// Reads a `Camera`, a `View`, or a matrix with the depth from zero to one. The latter two see all layers and ignore
/// occluders.
pub(crate) fn any_camera(value: &Bound<'_, PyAny>) -> PyResult<osp::Camera> {
    match value.cast::<Camera>() {
        Ok(camera) => Ok(*camera.get().camera),
        Err(_) => camera_of(value, None),
    }
}
