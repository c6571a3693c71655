use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use numpy::{IntoPyArray, PyArray1, PyArray2};
use osp::{
    glam::Vec3,
    math::{Aabb, Ray},
};
use pyo3::{
    exceptions::{PyKeyError, PyValueError},
    prelude::*,
    types::PyTuple,
};

use crate::{arrays, camera::any_camera, errors};

type Keys<'py> = Bound<'py, PyArray1<u64>>;

/// Finds the objects that cameras see. Objects can be added, moved and removed at any time. Each has a key of your
/// choice, any whole number from 0 to 2**64 - 1, and a box. The culler needs no size of the world and no capacity.
///
/// In each frame, call `set` and `remove` for the changes, then `cull` with all cameras. Boxes are in world space,
/// metres, float32; float64 is rounded outwards. Results are arrays of keys (uint64), in no particular order. They
/// contain every visible object.
///
/// All methods release the interpreter's lock while they work; queries of several threads run at the same time.
///
/// >>> culler = osp.Culler()
/// >>> culler.set([7, 8], [[-1, 0, -6, 1, 2, -5], [-9, -9, -20, 9, 9, -20]])   # min and max corner of each box
/// >>> culler.set_occluder(8, [[-9, -9, -20], [9, -9, -20], [9, 9, -20], [-9, 9, -20]])   # a wall
/// >>> culler.set(9, [-1, -1, -40, 1, 1, -30])                                  # behind it
/// >>> view = osp.View.look_at((0, 1, 0), (0, 1, -1))
/// >>> seen, in_view = culler.cull(osp.Camera(view, hide_by_occluders=True), view)
/// >>> sorted(seen.tolist()), sorted(in_view.tolist())
/// ([7, 8], [7, 8, 9])
#[pyclass(module = "osp", frozen)]
#[derive(Debug)]
pub(crate) struct Culler {
    /// Boxed, because Python's memory is aligned to only 16 bytes.
    inner: Box<RwLock<osp::Culler<u64>>>,
}

#[pymethods]
impl Culler {
    #[new]
    fn new() -> Self {
        Self { inner: Box::new(RwLock::new(osp::Culler::new())) }
    }

    /// Inserts objects, or moves objects that exist. There is a box for each key: `boxes` of the shape (n, 6), or
    /// `boxes` and `maxs` of (n, 3) with the smallest and the largest corners. One key and six numbers are one object.
    ///
    /// A box that is not finite or has min > max is refused, and `refused` lists it. Its object is skipped until it
    /// gets a valid box. An object that moves loses its occluder, unless the new box contains the old one.
    ///
    /// `ValueError`: a wrong shape, or different numbers of boxes and keys. `TypeError`: not numbers.
    #[pyo3(signature = (keys, boxes, maxs=None))]
    fn set(
        &self,
        py: Python<'_>,
        keys: &Bound<'_, PyAny>,
        boxes: &Bound<'_, PyAny>,
        maxs: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (keys, boxes) = (keys_of(keys)?, arrays::boxes(boxes, maxs)?);
        as_many(keys.len(), boxes.len(), "boxes")?;
        py.detach(|| {
            let mut culler = self.change()?;
            keys.iter().zip(boxes).for_each(|(&key, bounds)| culler.set(key, bounds));
            Ok(())
        })
    }

    /// Removes objects, with their occluders and layers. Ignores keys without an object.
    fn remove(&self, py: Python<'_>, keys: &Bound<'_, PyAny>) -> PyResult<()> {
        let keys = keys_of(keys)?;
        py.detach(|| {
            let mut culler = self.change()?;
            keys.iter().for_each(|&key| culler.remove(key));
            Ok(())
        })
    }

    /// Removes everything.
    fn clear(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            *self.change()? = osp::Culler::new();
            Ok(())
        })
    }

    /// Sets the layers of objects. `layers` is a mask for all keys, or a mask for each key, with a bit for each layer.
    /// A camera sees an object if both have a layer in common. The default is the first layer, mask 1.
    fn set_layers(&self, py: Python<'_>, keys: &Bound<'_, PyAny>, layers: &Bound<'_, PyAny>) -> PyResult<()> {
        let (keys, layers) = (keys_of(keys)?, arrays::whole_numbers(layers, "layers", u32::MAX.into())?);
        if layers.len() != 1 {
            as_many(keys.len(), layers.len(), "layers")?;
        }
        py.detach(|| {
            let mut culler = self.change()?;
            let masks = layers.iter().cycle().map(|&mask| mask as u32);
            keys.iter().zip(masks).for_each(|(&key, mask)| culler.set_layers(key, mask));
            Ok(())
        })
    }

    /// Sets the occluder of an object, in place of the former occluder; world space, metres. `corners` of the shape (4,
    /// 3) is a flat, convex quad with its corners in clockwise or counter-clockwise order. `corners` of (2, 3) is a box
    /// from its smallest to its largest corner. With `faces` of (m, 3), `corners` are the vertices of a mesh.
    ///
    /// An occluder is opaque from both sides, and hides the objects behind it. It must be drawn itself, or lie inside a
    /// drawn, opaque object. It stays in place until the object moves or is removed. A key without a box may have an
    /// occluder, which hides objects, but is in no result.
    ///
    /// `ValueError`: a wrong shape, numbers that are not finite, a bent or crossed quad, a face without a vertex, no
    /// area.
    #[pyo3(signature = (key, corners, faces=None))]
    fn set_occluder(
        &self,
        py: Python<'_>,
        key: u64,
        corners: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let occluder = match faces {
            Some(faces) => {
                let vertices = arrays::triangles(corners, Some(faces))?.into_flattened();
                let indices: Vec<u32> = (0..vertices.len() as u32).collect();
                osp::Occluder::mesh(&vertices, &indices)
            }
            None => match arrays::vectors(corners, "corners")?[..] {
                [min, max] => osp::Occluder::cuboid([min, max]),
                [a, b, c, d] => osp::Occluder::quad([a, b, c, d]),
                ref other => {
                    let message = format!(
                        "corners: expected four of a quad, two of a box, or those of a mesh with its faces; found {}",
                        other.len()
                    );
                    return Err(PyValueError::new_err(message));
                }
            },
        };
        let occluder = occluder.map_err(|why| PyValueError::new_err(format!("occluder: {why}")))?;
        py.detach(|| {
            self.change()?.set_occluder(key, occluder);
            Ok(())
        })
    }

    /// Removes an object's occluder. Has no effect if the object has no occluder.
    fn remove_occluder(&self, py: Python<'_>, key: u64) -> PyResult<()> {
        py.detach(|| {
            self.change()?.remove_occluder(key);
            Ok(())
        })
    }

    /// Finds the objects that each camera sees. Returns a tuple with an array of keys for each camera. A camera is a
    /// `Camera`, a `View`, or a matrix with the depth from zero to one. The cameras may be two eyes, a camera and its
    /// lights, or the faces of a cube map.
    ///
    /// `ValueError`, `TypeError`: the same as for `Camera`.
    #[pyo3(signature = (*cameras))]
    fn cull<'py>(&self, py: Python<'py>, cameras: &Bound<'py, PyTuple>) -> PyResult<Bound<'py, PyTuple>> {
        let cameras = cameras.iter().map(|camera| any_camera(&camera)).collect::<PyResult<Vec<_>>>()?;
        let seen = py.detach(|| {
            let mut culler = self.change()?;
            let frame = culler.cull(&cameras);
            Ok::<_, PyErr>(frame.iter().map(|seen| seen.iter().collect::<Vec<u64>>()).collect::<Vec<_>>())
        })?;
        PyTuple::new(py, seen.into_iter().map(|keys| keys.into_pyarray(py)))
    }

    /// Finds for each box whether it is completely off a camera's screen or, with `hide_by_occluders`, behind the
    /// occluders. Returns an array of truth values. The boxes have the form of `set`, but need not belong to objects:
    /// they may surround sounds, characters or triggers. A box that is not finite or has min > max is not hidden.
    /// Applies all changes, as `cull` does.
    #[pyo3(signature = (camera, boxes, maxs=None))]
    fn are_hidden<'py>(
        &self,
        py: Python<'py>,
        camera: &Bound<'py, PyAny>,
        boxes: &Bound<'py, PyAny>,
        maxs: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let (camera, boxes) = (any_camera(camera)?, arrays::boxes(boxes, maxs)?);
        let hidden = py.detach(|| Ok::<_, PyErr>(self.change()?.are_hidden(&camera, &boxes)))?;
        Ok(hidden.into_pyarray(py))
    }

    /// Applies all changes, so that `in_box`, `in_sphere`, `on_ray`, `pick`, `rays` and `nearest` use them. `cull`
    /// applies them, too.
    fn commit(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            self.change()?.commit();
            Ok(())
        })
    }

    /// The refusals between the last two calls of `cull`: pairs of a key and a reason. Only the first 4096 are listed.
    #[getter]
    fn refused(&self, py: Python<'_>) -> PyResult<Vec<(u64, String)>> {
        py.detach(|| Ok(self.read()?.refused().map(|(key, why)| (key, why.to_string())).collect()))
    }

    /// The last valid box of an object: the smallest and the largest corner, float32, of the shape (2, 3).
    ///
    /// `KeyError`: no object has this key.
    fn bounds<'py>(&self, py: Python<'py>, key: u64) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let bounds = py.detach(|| Ok::<_, PyErr>(self.read()?.bounds(key)))?;
        let unknown = || PyKeyError::new_err(format!("key {key}: no object has it"));
        arrays::table(py, &bounds.ok_or_else(unknown)?)
    }

    /// The objects whose boxes have a point in common with the box from `min` to `max`, each three numbers; touching
    /// counts.
    fn in_box<'py>(
        &self,
        py: Python<'py>,
        min: &Bound<'py, PyAny>,
        max: &Bound<'py, PyAny>,
    ) -> PyResult<Keys<'py>> {
        let bounds = arrays::one_box(min, max)?;
        let keys =
            py.detach(|| Ok::<_, PyErr>(self.read()?.in_box([bounds.min, bounds.max]).collect::<Vec<_>>()))?;
        Ok(keys.into_pyarray(py))
    }

    /// The objects whose boxes have a point in common with a sphere; touching counts.
    fn in_sphere<'py>(
        &self,
        py: Python<'py>,
        center: &Bound<'py, PyAny>,
        radius_m: f64,
    ) -> PyResult<Keys<'py>> {
        let center = arrays::vector(center, "center")?;
        let radius_m = arrays::radius(radius_m)?;
        let keys =
            py.detach(|| Ok::<_, PyErr>(self.read()?.in_sphere(center, radius_m).collect::<Vec<_>>()))?;
        Ok(keys.into_pyarray(py))
    }

    /// The objects whose boxes a ray enters, the nearest first. Returns their keys, and the `t` of each entry
    /// (float32): the point is `origin + t * direction`, with `t` at most `t_max`, and 0 for a ray that starts in a
    /// box.
    #[pyo3(signature = (origin, direction, t_max=f64::INFINITY))]
    fn on_ray<'py>(
        &self,
        py: Python<'py>,
        origin: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        t_max: f64,
    ) -> PyResult<(Keys<'py>, Bound<'py, PyArray1<f32>>)> {
        Ok(columns(py, self.candidates(py, origin, direction, t_max)?))
    }

    /// The first object that a ray hits, as `(key, t)`, or None. `hit(key)` returns the `t` at which the ray hits an
    /// object itself, or None. It is called for objects in the order in which the ray enters their boxes, until no
    /// further box can contain a nearer hit. Without `hit`, the boxes count as the objects.
    #[pyo3(signature = (origin, direction, hit=None, t_max=f64::INFINITY))]
    fn pick(
        &self,
        py: Python<'_>,
        origin: &Bound<'_, PyAny>,
        direction: &Bound<'_, PyAny>,
        hit: Option<&Bound<'_, PyAny>>,
        t_max: f64,
    ) -> PyResult<Option<(u64, f64)>> {
        let mut nearest: Option<(u64, f64)> = None;
        for (key, entered) in self.candidates(py, origin, direction, t_max)? {
            let limit = nearest.map_or(t_max, |(_, t)| t);
            if f64::from(entered) > limit {
                break;
            }
            let t = match hit {
                Some(hit) => hit.call1((key,))?.extract::<Option<f64>>()?,
                None => Some(f64::from(entered)),
            };
            if let Some(t) = t.filter(|&t| t <= t_max && nearest.is_none_or(|(_, nearest)| t < nearest)) {
                nearest = Some((key, t));
            }
        }
        Ok(nearest)
    }

    /// The first boxes that many rays enter: `origins` and `directions` of the shape (n, 3). Returns the keys and the
    /// `t` (float32). A ray that enters nothing has key 0 and an infinite `t`.
    #[pyo3(signature = (origins, directions, t_max=f64::INFINITY))]
    fn rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_max: f64,
    ) -> PyResult<(Keys<'py>, Bound<'py, PyArray1<f32>>)> {
        let origins = arrays::vectors(origins, "origins")?;
        let directions = arrays::vectors(directions, "directions")?;
        if origins.len() != directions.len() {
            let (origins, directions) = (origins.len(), directions.len());
            let message = format!("directions: expected {origins}, as many as origins; found {directions}");
            return Err(PyValueError::new_err(message));
        }
        let t_max = arrays::t_max(t_max)?;
        let hits = py.detach(|| {
            let culler = self.read()?;
            let enter = |key: u64, ray: &Ray| {
                let [min, max] = culler.bounds(key)?;
                ray.enter_box(&Aabb::new(min.into(), max.into()), t_max)
            };
            let hit = |(row, (&origin, &direction)): (usize, (&Vec3, &Vec3))| {
                let ray = arrays::ray(origin, direction, || format!("directions, row {row}"))?;
                Ok(culler.pick(ray, enter).unwrap_or((0, f32::INFINITY)))
            };
            origins.iter().zip(&directions).enumerate().map(hit).collect::<PyResult<Vec<_>>>()
        })?;
        Ok(columns(py, hits))
    }

    /// The `count` objects whose boxes are nearest to a point. Returns their keys, the nearest first, and their
    /// distances in metres (float32; 0 for a box that contains the point). The result is shorter if there are fewer
    /// objects.
    #[pyo3(signature = (point, count=1))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'py, PyAny>,
        count: usize,
    ) -> PyResult<(Keys<'py>, Bound<'py, PyArray1<f32>>)> {
        let point = arrays::vector(point, "point")?;
        let found = py.detach(|| Ok::<_, PyErr>(self.read()?.nearest(point, count).collect::<Vec<_>>()))?;
        Ok(columns(py, found))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        py.detach(|| Ok(self.read()?.len()))
    }

    fn __contains__(&self, py: Python<'_>, key: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(key) = key.extract::<u64>() else { return Ok(false) };
        py.detach(|| Ok(self.read()?.bounds(key).is_some()))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<osp.Culler of {} objects>", self.__len__(py)?))
    }
}

impl Culler {
    fn read(&self) -> PyResult<RwLockReadGuard<'_, osp::Culler<u64>>> {
        self.inner.read().map_err(|_: PoisonError<_>| errors::broken())
    }

    fn change(&self) -> PyResult<RwLockWriteGuard<'_, osp::Culler<u64>>> {
        self.inner.write().map_err(|_: PoisonError<_>| errors::broken())
    }

    fn candidates(
        &self,
        py: Python<'_>,
        origin: &Bound<'_, PyAny>,
        direction: &Bound<'_, PyAny>,
        t_max: f64,
    ) -> PyResult<Vec<(u64, f32)>> {
        let (origin, direction): (Vec3, Vec3) =
            (arrays::vector(origin, "origin")?, arrays::vector(direction, "direction")?);
        let ray: Ray = arrays::ray(origin, direction, || "direction".to_owned())?;
        let t_max = arrays::t_max(t_max)?;
        py.detach(|| Ok(self.read()?.on_ray(ray, t_max).collect()))
    }
}

/// Returns keys, and a number for each, as two arrays.
fn columns(py: Python<'_>, rows: Vec<(u64, f32)>) -> (Keys<'_>, Bound<'_, PyArray1<f32>>) {
    let (keys, numbers): (Vec<_>, Vec<_>) = rows.into_iter().unzip();
    (keys.into_pyarray(py), numbers.into_pyarray(py))
}

/// Reads keys: whole numbers of 64 bits.
fn keys_of(value: &Bound<'_, PyAny>) -> PyResult<Vec<u64>> {
    arrays::whole_numbers(value, "keys", u64::MAX)
}

fn as_many(keys: usize, found: usize, what: &str) -> PyResult<()> {
    if keys == found {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{what}: expected {keys}, as many as keys; found {found}")))
}
