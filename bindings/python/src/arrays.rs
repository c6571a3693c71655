//! Reads numbers from Python: anything that numpy converts to an array. The numbers are copied, so that no thread can
//! change them during a call. They become `f32`. Boxes and radii are rounded outwards, so that no visible part is lost.

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use osp::{
    glam::{Mat4, Vec3},
    math::{Aabb, Ray},
};
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
};

/// An array in C order.
struct Numbers<T> {
    shape: Vec<usize>,
    values: Vec<T>,
}

/// Returns `value` as an array, with numpy's letter for its kind of numbers, and the bytes of a number.
fn as_array<'py>(value: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyAny>, String, usize)> {
    let array = value.py().import("numpy")?.call_method1("asarray", (value,))?;
    let dtype = array.getattr("dtype")?;
    let (kind, bytes) = (dtype.getattr("kind")?.extract()?, dtype.getattr("itemsize")?.extract()?);
    Ok((array, kind, bytes))
}

fn copied<T: numpy::Element + Copy>(array: &Bound<'_, PyAny>, dtype: &str) -> PyResult<Numbers<T>> {
    let numpy = array.py().import("numpy")?;
    let array = numpy.call_method1("require", (array, dtype, ["C", "A"]))?;
    let array = array.extract::<PyReadonlyArrayDyn<'_, T>>()?;
    Ok(Numbers { shape: array.shape().to_vec(), values: array.as_slice()?.to_vec() })
}

fn wrong_type(what: &str, expected: &str, array: &Bound<'_, PyAny>) -> PyErr {
    let dtype = array.getattr("dtype").map_or_else(|_| "?".to_owned(), |dtype| dtype.to_string());
    PyTypeError::new_err(format!("{what}: expected {expected}; found the type {dtype}"))
}

fn wrong_shape(what: &str, expected: &str, shape: &[usize]) -> PyErr {
    let found = shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    let comma = if shape.len() == 1 { "," } else { "" };
    PyValueError::new_err(format!(
        "{what}: expected an array of the shape {expected}; found ({found}{comma})"
    ))
}

fn floats(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Numbers<f64>> {
    let (array, kind, bytes) = as_array(value)?;
    match (kind.as_str(), bytes) {
        ("f", 0..=8) | ("i" | "u", _) => copied(&array, "float64"),
        _ => Err(wrong_type(what, "numbers (float32 or float64)", &array)),
    }
}

/// Reads three numbers.
pub(crate) fn vector(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec3> {
    let numbers = floats(value, what)?;
    match (&numbers.shape[..], &numbers.values[..]) {
        ([3], &[x, y, z]) => finite(Vec3::new(x as f32, y as f32, z as f32), || what.to_owned()),
        (shape, _) => Err(wrong_shape(what, "(3,)", shape)),
    }
}

fn finite(v: Vec3, what: impl Fn() -> String) -> PyResult<Vec3> {
    if v.is_finite() {
        return Ok(v);
    }
    Err(PyValueError::new_err(format!(
        "{}: expected finite numbers; found ({}, {}, {})",
        what(),
        v.x,
        v.y,
        v.z
    )))
}

/// Reads a vector from each row.
pub(crate) fn vectors(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<Vec3>> {
    let Numbers { shape, values } = floats(value, what)?;
    if shape.len() != 2 || shape[1] != 3 {
        return Err(wrong_shape(what, "(n, 3)", &shape));
    }
    rows_of_three(&values, what)
}

fn rows_of_three(values: &[f64], what: &str) -> PyResult<Vec<Vec3>> {
    let (rows, _) = values.as_chunks::<3>();
    let vector = |(row, v): (usize, &[f64; 3])| {
        finite(Vec3::from_array(v.map(|v| v as f32)), || format!("{what}, row {row}"))
    };
    rows.iter().enumerate().map(vector).collect()
}

/// Reads three corners for each triangle. The input is an array of the shape (n, 3, 3), or vertices of the shape (n, 3)
/// and faces (m, 3) of vertex numbers.
pub(crate) fn triangles(
    corners: &Bound<'_, PyAny>,
    faces: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<[Vec3; 3]>> {
    let Some(faces) = faces else {
        let Numbers { shape, values } = floats(corners, "triangles")?;
        if shape.len() != 3 || shape[1..] != [3, 3] {
            return Err(wrong_shape("triangles", "(n, 3, 3), or (n, 3) with faces of (m, 3)", &shape));
        }
        let (triangles, _) = values.as_chunks::<9>();
        let triangle = |(row, v): (usize, &[f64; 9])| {
            let corners = rows_of_three(v, "").map_err(|_| {
                PyValueError::new_err(format!("triangles, row {row}: expected finite numbers"))
            })?;
            Ok([corners[0], corners[1], corners[2]])
        };
        return triangles.iter().enumerate().map(triangle).collect();
    };
    let corners = vectors(corners, "vertices")?;
    let (array, kind, _) = as_array(faces)?;
    let is_empty = array.getattr("size")?.extract::<usize>()? == 0;
    if !matches!(kind.as_str(), "i" | "u") && !is_empty {
        return Err(wrong_type("faces", "whole numbers", &array));
    }
    let Numbers { shape, values } = copied::<i64>(&array, "int64")?;
    if shape.len() != 2 || shape[1] != 3 {
        return Err(wrong_shape("faces", "(m, 3)", &shape));
    }
    let (faces, _) = values.as_chunks::<3>();
    let triangle = |(row, face): (usize, &[i64; 3])| {
        let mut triangle = [Vec3::ZERO; 3];
        for (to, &vertex) in triangle.iter_mut().zip(face) {
            let known = usize::try_from(vertex).ok().and_then(|vertex| corners.get(vertex));
            let count = corners.len();
            *to = *known.ok_or_else(|| {
                PyValueError::new_err(format!(
                    "faces, row {row}: expected vertices below {count}; found {vertex}"
                ))
            })?;
        }
        Ok(triangle)
    };
    faces.iter().enumerate().map(triangle).collect()
}

/// Reads `count` truth values.
pub(crate) fn mask(value: &Bound<'_, PyAny>, count: usize, what: &str) -> PyResult<Vec<bool>> {
    let (array, kind, _) = as_array(value)?;
    if kind != "b" {
        return Err(wrong_type(what, "truth values (bool)", &array));
    }
    let Numbers { shape, values } = copied::<bool>(&array, "bool")?;
    if shape != [count] {
        return Err(wrong_shape(what, &format!("({count},)"), &shape));
    }
    Ok(values)
}

/// Reads boxes, which may be empty or not finite, and rounds them outwards. The input is an array of the shape (n, 6),
/// or two arrays of (n, 3) with the smallest and the largest corners. Six numbers, or two arrays of three, are one box.
pub(crate) fn boxes(
    boxes: &Bound<'_, PyAny>,
    maxs: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<[[f32; 3]; 2]>> {
    let maxs = maxs.map(as_rows).transpose()?;
    let corners = corners(&as_rows(boxes)?, maxs.as_ref())?;
    Ok(corners.into_iter().map(|[min, max]| [min.map(round_down), max.map(round_up)]).collect())
}

/// Turns a single row into an array of one row.
fn as_rows<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    value.py().import("numpy")?.call_method1("atleast_2d", (value,))
}

fn corners(boxes: &Bound<'_, PyAny>, maxs: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<[[f64; 3]; 2]>> {
    let Some(maxs) = maxs else {
        let Numbers { shape, values } = floats(boxes, "boxes")?;
        if shape.len() != 2 || shape[1] != 6 {
            return Err(wrong_shape("boxes", "(n, 6), or two of (n, 3)", &shape));
        }
        return Ok(values.as_chunks::<3>().0.as_chunks::<2>().0.to_vec());
    };
    let [mins, maxs] = [floats(boxes, "mins")?, floats(maxs, "maxs")?];
    if mins.shape.len() != 2 || mins.shape[1] != 3 {
        return Err(wrong_shape("mins", "(n, 3)", &mins.shape));
    }
    if maxs.shape != mins.shape {
        return Err(wrong_shape("maxs", &format!("({}, 3), as mins", mins.shape[0]), &maxs.shape));
    }
    let (mins, maxs) = (mins.values.as_chunks::<3>().0, maxs.values.as_chunks::<3>().0);
    Ok(mins.iter().zip(maxs).map(|(&min, &max)| [min, max]).collect())
}

/// Reads one box from its smallest and its largest corner.
pub(crate) fn one_box(min: &Bound<'_, PyAny>, max: &Bound<'_, PyAny>) -> PyResult<Aabb> {
    let corner = |value, what| -> PyResult<[f64; 3]> {
        let Numbers { shape, values } = floats(value, what)?;
        values.try_into().ok().filter(|_| shape == [3]).ok_or_else(|| wrong_shape(what, "(3,)", &shape))
    };
    let (min, max) = (corner(min, "min")?, corner(max, "max")?);
    let bounds = Aabb::new(Vec3::from_array(min.map(round_down)), Vec3::from_array(max.map(round_up)));
    let is_in_order = min.iter().zip(&max).all(|(min, max)| min <= max);
    if is_in_order && bounds.is_valid() {
        return Ok(bounds);
    }
    Err(PyValueError::new_err(format!(
        "box: expected finite numbers (of float32) with min <= max; found {min:?} and {max:?}"
    )))
}

/// Creates a ray. Its direction must not be zero.
pub(crate) fn ray(origin: Vec3, direction: Vec3, what: impl Fn() -> String) -> PyResult<Ray> {
    if direction == Vec3::ZERO {
        return Err(PyValueError::new_err(format!("{}: expected a direction other than zero", what())));
    }
    Ok(Ray::new(origin, direction))
}

/// Reads the length of a ray, in lengths of its direction.
pub(crate) fn t_max(t_max: f64) -> PyResult<f32> {
    if t_max >= 0.0 {
        return Ok(t_max as f32);
    }
    Err(PyValueError::new_err(format!("t_max: expected a number, 0 or more; found {t_max}")))
}

/// Reads a radius in metres, and rounds it up.
pub(crate) fn radius(radius_m: f64) -> PyResult<f32> {
    let radius_m = round_up(radius_m);
    if radius_m >= 0.0 && radius_m.is_finite() {
        return Ok(radius_m);
    }
    Err(PyValueError::new_err(format!("radius_m: expected a finite number, 0 or more; found {radius_m}")))
}

/// Returns the smallest `f32` that is not less than `v`.
fn round_up(v: f64) -> f32 {
    let nearest = v as f32;
    if f64::from(nearest) < v { nearest.next_up() } else { nearest }
}

fn round_down(v: f64) -> f32 {
    -round_up(-v)
}

/// Reads whole numbers from 0 to `most`. A single number counts as an array of one.
pub(crate) fn whole_numbers(value: &Bound<'_, PyAny>, what: &str, most: u64) -> PyResult<Vec<u64>> {
    let (array, kind, _) = as_array(value)?;
    // For numpy, an empty list contains floating point numbers.
    let is_empty = array.getattr("size")?.extract::<usize>()? == 0;
    if is_empty {
        return Ok(Vec::new());
    }
    let checked = |number: i128| {
        let message = || format!("{what}: expected numbers from 0 to {most}; found {number}");
        u64::try_from(number)
            .ok()
            .filter(|&number| number <= most)
            .ok_or_else(|| PyValueError::new_err(message()))
    };
    let (shape, numbers) = match kind.as_str() {
        "u" => {
            let Numbers { shape, values } = copied::<u64>(&array, "uint64")?;
            (shape, values.into_iter().map(|number| checked(number.into())).collect())
        }
        "i" => {
            let Numbers { shape, values } = copied::<i64>(&array, "int64")?;
            (shape, values.into_iter().map(|number| checked(number.into())).collect::<PyResult<Vec<u64>>>())
        }
        _ => return Err(wrong_type(what, "whole numbers", &array)),
    };
    if shape.len() > 1 {
        return Err(wrong_shape(what, "(n,)", &shape));
    }
    numbers
}

/// Reads the sixteen numbers of a matrix with four rows in mathematical notation, which multiplies a column from the
/// left. Returns them in column-major order.
pub(crate) fn columns(value: &Bound<'_, PyAny>, what: &str) -> PyResult<[f64; 16]> {
    let Numbers { shape, values } = floats(value, what)?;
    if shape != [4, 4] {
        return Err(wrong_shape(what, "(4, 4)", &shape));
    }
    Ok(std::array::from_fn(|i| values[4 * (i % 4) + i / 4]))
}

/// Reads a matrix of four rows, in the form of [`columns`].
pub(crate) fn matrix(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Mat4> {
    let matrix = Mat4::from_cols_array(&columns(value, what)?.map(|number| number as f32));
    if matrix.is_finite() {
        return Ok(matrix);
    }
    Err(PyValueError::new_err(format!("{what}: expected finite numbers")))
}

/// Returns rows of equal length as an array of two dimensions.
pub(crate) fn table<'py, const N: usize>(
    py: Python<'py>,
    rows: &[[f32; N]],
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    PyArray1::from_slice(py, rows.as_flattened()).reshape([rows.len(), N])
}

/// Returns corners as an array of three dimensions, with `corners_a_row` corners in each row.
pub(crate) fn cube<'py>(
    py: Python<'py>,
    corners: &[Vec3],
    corners_a_row: usize,
) -> PyResult<Bound<'py, numpy::PyArray3<f32>>> {
    let flat = corners.iter().flat_map(Vec3::to_array).collect::<Vec<f32>>();
    PyArray1::from_vec(py, flat).reshape([corners.len() / corners_a_row, corners_a_row, 3])
}
