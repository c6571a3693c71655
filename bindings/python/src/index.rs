use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use numpy::{IntoPyArray, PyArray1, PyArray2};
use osp::{
    glam::Vec3,
    index::{IndexConfig, IndexError, Osp, SpatialIndex},
    math::{Aabb, Ray, Sphere},
    polygon::{PolygonId, VisibleBlocks},
};
use pyo3::{
    exceptions::{PyKeyError, PyMemoryError, PyValueError},
    prelude::*,
};

use crate::{arrays, errors, view::View};

/// A column of an answer.
type Column<'py, T> = Bound<'py, PyArray1<T>>;

/// A spatial index of boxes: they come, move and go at any time, and nothing is ever rebuilt.
///
/// Each box has an id: a whole number that you choose, or that `insert` counts up. Small ids without gaps cost the least
/// memory (the index keeps arrays as long as the largest id). Boxes are float32; float64 is rounded outwards, so that no
/// query misses a box. Answers are arrays of ids (uint32), ascending.
///
/// All methods release the interpreter's lock while they work; queries of several threads run at once.
///
/// `root_center` and `root_size_m` name a cube around most of what will come, `capacity` how many boxes: hints for speed,
/// not limits.
///
/// >>> index = osp.Index()
/// >>> index.insert([[0, 0, -5, 1, 1, -4], [0, 0, 4, 1, 1, 5]])
/// array([0, 1], dtype=uint32)
/// >>> index.frustum(osp.View.look_at((0, 0, 0), (0, 0, -1)))
/// array([0], dtype=uint32)
#[pyclass(module = "osp", frozen)]
#[derive(Debug)]
pub(crate) struct Index {
    /// Not in the object itself: Python's memory is aligned to 16 bytes only.
    inner: Box<RwLock<Inner>>,
}

struct Inner {
    osp: Osp,
    /// By id; empty for an id that is not in use.
    boxes: Vec<Aabb>,
}

impl std::fmt::Debug for Inner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Inner").field("len", &self.osp.len()).finish_non_exhaustive()
    }
}

#[pymethods]
impl Index {
    #[new]
    #[pyo3(signature = (root_center=None, root_size_m=4.0, capacity=0),
           text_signature = "(root_center=(0.0, 1.5, 0.0), root_size_m=4.0, capacity=0)")]
    fn new(root_center: Option<&Bound<'_, PyAny>>, root_size_m: f64, capacity: usize) -> PyResult<Self> {
        let center = match root_center {
            Some(center) => arrays::vector(center, "root_center")?,
            None => IndexConfig::default().root.center(),
        };
        let root = Aabb::cube(center, root_size_m as f32);
        if !(root_size_m > 0.0 && root.is_valid()) {
            let message = format!("root_size_m: expected a positive number; found {root_size_m}");
            return Err(PyValueError::new_err(message));
        }
        let most = PolygonId::LIMIT as usize;
        if capacity > most {
            let message = format!("capacity: expected at most {most} boxes; found {capacity}");
            return Err(PyValueError::new_err(message));
        }
        let osp = Osp::new(&IndexConfig { root, capacity });
        Ok(Self { inner: Box::new(RwLock::new(Inner { osp, boxes: Vec::new() })) })
    }

    /// Inserts boxes and returns their ids: `boxes` of the shape (n, 6) with `min_x, min_y, min_z, max_x, max_y, max_z` a row,
    /// or `boxes` and `maxs` of (n, 3) with the smallest and the largest corners. Without `ids` they are numbered from the
    /// largest id that was ever in use.
    ///
    /// `ValueError`: a box is not finite or has min > max, an id is in use or given twice. `TypeError`: no numbers. The
    /// index is then as it was.
    #[pyo3(signature = (boxes, maxs=None, *, ids=None))]
    fn insert<'py>(
        &self,
        py: Python<'py>,
        boxes: &Bound<'py, PyAny>,
        maxs: Option<&Bound<'py, PyAny>>,
        ids: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Column<'py, u32>> {
        let boxes = arrays::boxes(boxes, maxs)?;
        let ids = ids.map(arrays::ids).transpose()?;
        let ids = py.detach(|| self.change(|inner| inner.insert(ids, &boxes)))?;
        Ok(numbers(py, ids))
    }

    /// Gives boxes that are in the index another place: `ids`, and boxes as for `insert`.
    ///
    /// `KeyError`: an id is not in the index. `ValueError`: as for `insert`. The index is then as it was.
    #[pyo3(signature = (ids, boxes, maxs=None))]
    fn update(
        &self,
        py: Python<'_>,
        ids: &Bound<'_, PyAny>,
        boxes: &Bound<'_, PyAny>,
        maxs: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let (ids, boxes) = (arrays::ids(ids)?, arrays::boxes(boxes, maxs)?);
        py.detach(|| self.change(|inner| inner.update(&ids, &boxes)))
    }

    /// Takes boxes out.
    ///
    /// `KeyError`: an id is not in the index. `ValueError`: an id is given twice. The index is then as it was.
    fn remove(&self, py: Python<'_>, ids: &Bound<'_, PyAny>) -> PyResult<()> {
        let ids = arrays::ids(ids)?;
        py.detach(|| self.change(|inner| inner.remove(&ids)))
    }

    /// Takes all boxes out and keeps the memory. Ids are counted from 0 again.
    fn clear(&self, py: Python<'_>) -> PyResult<()> {
        py.detach(|| {
            self.change(|inner| {
                inner.osp.clear();
                inner.boxes.clear();
                Ok(())
            })
        })
    }

    /// The boxes of these ids, float32, of the shape (n, 6), as the index holds them.
    ///
    /// `KeyError`: an id is not in the index.
    fn boxes<'py>(&self, py: Python<'py>, ids: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let ids = arrays::ids(ids)?;
        let rows = py.detach(|| {
            let inner = self.read()?;
            let row = |&id: &PolygonId| {
                let Aabb { min, max } = inner.get(id).ok_or_else(|| unknown(id))?;
                Ok([min.x, min.y, min.z, max.x, max.y, max.z])
            };
            ids.iter().map(row).collect::<PyResult<Vec<_>>>()
        })?;
        arrays::table(py, &rows)
    }

    /// All ids, ascending.
    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Column<'py, u32>> {
        let ids = py.detach(|| {
            let inner = self.read()?;
            let in_use = (0..inner.boxes.len() as u32).map(PolygonId);
            Ok::<_, PyErr>(in_use.filter(|&id| inner.get(id).is_some()).collect::<Vec<_>>())
        })?;
        Ok(numbers(py, ids))
    }

    /// Memory held, bytes.
    #[getter]
    fn memory_bytes(&self, py: Python<'_>) -> PyResult<usize> {
        py.detach(|| {
            let inner = self.read()?;
            Ok(inner.osp.bytes() + inner.boxes.capacity() * size_of::<Aabb>())
        })
    }

    /// The boxes that a camera may see: those that share a point with the frustum of `view`, and no box is missed. (A few
    /// beside a corner of the frustum may be reported, as boxes are tested against one plane after the other.)
    ///
    /// `view` is a `View`, or a matrix with its `depth` as `View.from_matrix` takes them. A matrix may also be a parallel
    /// projection, as the maps of a sun's shadows have.
    ///
    /// `ValueError`: as for `View.from_matrix`.
    #[pyo3(signature = (view, depth=None))]
    fn frustum<'py>(
        &self,
        py: Python<'py>,
        view: &Bound<'py, PyAny>,
        depth: Option<&str>,
    ) -> PyResult<Column<'py, u32>> {
        let frustum = View::frustum_of(view, depth)?;
        self.ask(py, |inner| {
            let mut visible = VisibleBlocks::new();
            inner.osp.frustum_cull_blocks(&frustum, &mut visible);
            visible.to_vec()
        })
    }

    /// The boxes that share a point with the box from `min` to `max`, each three numbers; touching counts.
    #[pyo3(name = "box")]
    fn in_box<'py>(
        &self,
        py: Python<'py>,
        min: &Bound<'py, PyAny>,
        max: &Bound<'py, PyAny>,
    ) -> PyResult<Column<'py, u32>> {
        let bounds = arrays::one_box(min, max)?;
        self.ask(py, |inner| {
            let mut ids = Vec::new();
            inner.osp.box_query(&bounds, &mut ids);
            ids
        })
    }

    /// The boxes that share a point with a ball; touching counts.
    fn sphere<'py>(
        &self,
        py: Python<'py>,
        center: &Bound<'py, PyAny>,
        radius_m: f64,
    ) -> PyResult<Column<'py, u32>> {
        let center = arrays::vector(center, "center")?;
        let radius_m = arrays::radius(radius_m)?;
        self.ask(py, |inner| {
            let mut ids = Vec::new();
            let sphere = Sphere { center, radius_m };
            let is_in = |id| inner.distance_squared(id, center) <= radius_m * radius_m;
            inner.osp.sphere_query(&sphere, &mut { is_in }, &mut ids);
            ids
        })
    }

    /// The box that a ray enters first, and where: `(id, t)`, the point being `origin + t * direction`; None if it enters
    /// none at `t <= t_max`. A ray that starts in a box enters it at 0. Of several at the same `t`, the lowest id.
    #[pyo3(signature = (origin, direction, t_max=f64::INFINITY))]
    fn ray(
        &self,
        py: Python<'_>,
        origin: &Bound<'_, PyAny>,
        direction: &Bound<'_, PyAny>,
        t_max: f64,
    ) -> PyResult<Option<(u32, f32)>> {
        let (origin, direction) =
            (arrays::vector(origin, "origin")?, arrays::vector(direction, "direction")?);
        let ray = arrays::ray(origin, direction, || "direction".to_owned())?;
        let t_max = arrays::t_max(t_max)?;
        py.detach(|| Ok(self.read()?.first_hit(&ray, t_max).map(|(id, t)| (id.0, t))))
    }

    /// `ray` for many rays: `origins` and `directions` of the shape (n, 3). Returns the ids (int64; -1 where a ray enters
    /// nothing) and the `t` (float32; infinite there).
    #[pyo3(signature = (origins, directions, t_max=f64::INFINITY))]
    fn rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_max: f64,
    ) -> PyResult<(Column<'py, i64>, Column<'py, f32>)> {
        let (origins, directions) =
            (arrays::vectors(origins, "origins")?, arrays::vectors(directions, "directions")?);
        if origins.len() != directions.len() {
            let (origins, directions) = (origins.len(), directions.len());
            let message = format!("directions: expected {origins}, as many as origins; found {directions}");
            return Err(PyValueError::new_err(message));
        }
        let t_max = arrays::t_max(t_max)?;
        let hits = py.detach(|| {
            let inner = self.read()?;
            let hit = |(row, (&origin, &direction)): (usize, (&Vec3, &Vec3))| {
                let ray = arrays::ray(origin, direction, || format!("directions, row {row}"))?;
                let hit = inner.first_hit(&ray, t_max);
                Ok(hit.map_or((-1, f32::INFINITY), |(id, t)| (i64::from(id.0), t)))
            };
            origins.iter().zip(&directions).enumerate().map(hit).collect::<PyResult<Vec<_>>>()
        })?;
        let (ids, ts): (Vec<_>, Vec<_>) = hits.into_iter().unzip();
        Ok((ids.into_pyarray(py), ts.into_pyarray(py)))
    }

    /// The `count` boxes nearest to a point: their ids, the nearest first (of those at the same distance the lower ids), and
    /// their distances in metres (float32; 0 for a box that holds the point). Fewer if there are fewer.
    #[pyo3(signature = (point, count=1))]
    fn nearest<'py>(
        &self,
        py: Python<'py>,
        point: &Bound<'py, PyAny>,
        count: usize,
    ) -> PyResult<(Column<'py, u32>, Column<'py, f32>)> {
        let point = arrays::vector(point, "point")?;
        let found = py.detach(|| {
            let inner = self.read()?;
            let mut found = Vec::new();
            let mut distance_m = |id| inner.distance_squared(id, point).sqrt();
            // More than there are would only be reserved.
            inner.osp.nearest(point, count.min(inner.osp.len()), &mut distance_m, &mut found);
            Ok::<_, PyErr>(found)
        })?;
        let (ids, distances): (Vec<_>, Vec<_>) = found.into_iter().map(|(id, m)| (id.0, m)).unzip();
        Ok((ids.into_pyarray(py), distances.into_pyarray(py)))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        py.detach(|| Ok(self.read()?.osp.len()))
    }

    fn __contains__(&self, py: Python<'_>, id: &Bound<'_, PyAny>) -> PyResult<bool> {
        let Ok(id) = id.extract::<u32>() else { return Ok(false) };
        py.detach(|| Ok(self.read()?.get(PolygonId(id)).is_some()))
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<osp.Index of {} boxes>", self.__len__(py)?))
    }
}

impl Index {
    fn read(&self) -> PyResult<RwLockReadGuard<'_, Inner>> {
        self.inner.read().map_err(|_: PoisonError<_>| errors::broken())
    }

    /// Changes the index; queries see it at once.
    fn change<T>(&self, change: impl FnOnce(&mut Inner) -> PyResult<T>) -> PyResult<T> {
        let mut inner = self.inner.write().map_err(|_| errors::broken())?;
        let outcome = change(&mut inner)?;
        inner.osp.commit();
        Ok(outcome)
    }

    fn ask<'py>(
        &self,
        py: Python<'py>,
        query: impl Fn(&Inner) -> Vec<PolygonId> + Send + Sync,
    ) -> PyResult<Column<'py, u32>> {
        let ids = py.detach(|| {
            let inner = self.read()?;
            let mut ids = query(&inner);
            ids.sort_unstable();
            Ok::<_, PyErr>(ids)
        })?;
        Ok(numbers(py, ids))
    }
}

impl Inner {
    fn get(&self, id: PolygonId) -> Option<&Aabb> {
        self.boxes.get(id.index()).filter(|bounds| !bounds.is_empty())
    }

    fn distance_squared(&self, id: PolygonId, p: Vec3) -> f32 {
        self.get(id).map_or(f32::NAN, |bounds| bounds.distance_squared(p))
    }

    fn first_hit(&self, ray: &Ray, t_max: f32) -> Option<(PolygonId, f32)> {
        self.osp.ray_nearest(ray, t_max, &mut |id| ray.enter_box(self.get(id)?, t_max))
    }

    fn insert(&mut self, ids: Option<Vec<PolygonId>>, boxes: &[Aabb]) -> PyResult<Vec<PolygonId>> {
        let ids = match ids {
            Some(ids) => ids,
            None => {
                let (first, end) = (self.boxes.len(), self.boxes.len() + boxes.len());
                let most = PolygonId::LIMIT as usize;
                if end > most {
                    return Err(PyValueError::new_err(format!(
                        "ids: expected numbers below {most}; found {end}"
                    )));
                }
                (first as u32..end as u32).map(PolygonId).collect()
            }
        };
        same_number(&ids, boxes)?;
        once(&ids)?;
        if let Some(&known) = ids.iter().find(|&&id| self.get(id).is_some()) {
            return Err(PyValueError::new_err(format!("id {}: it is in the index already", known.0)));
        }
        let end = ids.iter().map(|id| id.index() + 1).max().unwrap_or(0);
        if let Some(more) = end.checked_sub(self.boxes.len()) {
            let reserved = self.boxes.try_reserve(more);
            reserved.map_err(|_| PyMemoryError::new_err(format!("no room for ids up to {end}")))?;
            self.boxes.resize(end, Aabb::EMPTY);
        }
        for (&id, bounds) in ids.iter().zip(boxes) {
            self.osp.insert(id, bounds).map_err(refused)?;
            self.boxes[id.index()] = *bounds;
        }
        Ok(ids)
    }

    fn update(&mut self, ids: &[PolygonId], boxes: &[Aabb]) -> PyResult<()> {
        same_number(ids, boxes)?;
        self.check_known(ids)?;
        for (&id, bounds) in ids.iter().zip(boxes) {
            self.osp.update(id, bounds).map_err(refused)?;
            self.boxes[id.index()] = *bounds;
        }
        Ok(())
    }

    fn remove(&mut self, ids: &[PolygonId]) -> PyResult<()> {
        self.check_known(ids)?;
        for &id in ids {
            self.osp.remove(id).map_err(refused)?;
            self.boxes[id.index()] = Aabb::EMPTY;
        }
        Ok(())
    }

    fn check_known(&self, ids: &[PolygonId]) -> PyResult<()> {
        match ids.iter().find(|&&id| self.get(id).is_none()) {
            Some(&id) => Err(unknown(id)),
            None => once(ids),
        }
    }
}

fn same_number(ids: &[PolygonId], boxes: &[Aabb]) -> PyResult<()> {
    if ids.len() == boxes.len() {
        return Ok(());
    }
    let (boxes, ids) = (boxes.len(), ids.len());
    Err(PyValueError::new_err(format!("ids: expected {boxes}, as many as boxes; found {ids}")))
}

/// Refuses an id that is given twice.
fn once(ids: &[PolygonId]) -> PyResult<()> {
    let mut sorted = ids.to_vec();
    sorted.sort_unstable();
    match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(PyValueError::new_err(format!("id {}: it is given twice", pair[0].0))),
        None => Ok(()),
    }
}

fn unknown(id: PolygonId) -> PyErr {
    PyKeyError::new_err(format!("id {}: it is not in the index", id.0))
}

/// What the index refuses although it was checked before.
fn refused(error: IndexError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn numbers(py: Python<'_>, ids: Vec<PolygonId>) -> Column<'_, u32> {
    ids.into_iter().map(|id| id.0).collect::<Vec<_>>().into_pyarray(py)
}
