use std::sync::OnceLock;

use numpy::{IntoPyArray, PyArray1, PyArray3};
use osp::{
    glam::Vec3,
    index::{IndexConfig, Osp, SpatialIndex},
    math::Aabb,
    occlusion::{OccluderPool, OcclusionConfig, PoolConfig, SelectConfig, ViewInput, ViewOcclusion},
    polygon::{Change, ConvexPolygon, Geometry, PolygonId, VisibleBlocks},
};
use osp_lab::Method;
use pyo3::{exceptions::PyValueError, prelude::*};

use crate::{arrays, names, view::View};

/// Number of occluders of a view, if the caller gives none.
const OCCLUDERS: usize = 64;
/// Largest number of occluders of a view. The structure built from the occluders grows faster than their number.
const MOST_OCCLUDERS: usize = 4096;

/// Triangles that several views can cull. The index of the triangles is built only once.
///
/// Without `faces`, `triangles` contains the corners, an array of the shape (n, 3, 3). With `faces`, `triangles`
/// contains vertices of the shape (n, 3), and `faces` their numbers for each triangle, of the shape (m, 3). A mesh of
/// trimesh fits: `osp.Mesh(mesh.vertices, mesh.faces)`. Float64 becomes float32. `opaque` is an array of truth values,
/// one for each triangle: whether it hides the triangles behind it (default: true). Opaque triangles hide from both
/// sides.
///
/// `ValueError`: a wrong shape, numbers that are not finite, a face with the number of a missing vertex. `TypeError`:
/// not numbers.
///
/// >>> wall = [[-4, -4, -2], [4, -4, -2], [0, 8, -2]]
/// >>> behind = [[-0.1, -0.1, -9], [0.1, -0.1, -9], [0, 0.1, -9]]
/// >>> mesh = osp.Mesh([wall, behind])
/// >>> view = osp.View.look_at((0, 0, 0), (0, 0, -1))
/// >>> mesh.visible(view)
/// array([ True,  True])
/// >>> mesh.visible(view, occlusion="msvbsp")
/// array([ True, False])
#[pyclass(module = "osp", frozen)]
pub(crate) struct Mesh {
    triangles: Triangles,
    /// Boxed, because Python's memory is aligned to only 16 bytes.
    index: Box<Osp>,
    /// The candidates for occluders. The first call with a method of occlusion culling finds them.
    pool: OnceLock<Box<OccluderPool>>,
}

impl std::fmt::Debug for Mesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Mesh").field("triangles", &self.triangles.corners.len()).finish_non_exhaustive()
    }
}

/// Triangles in the form that osp requires.
struct Triangles {
    corners: Vec<[Vec3; 3]>,
    opaque: Option<Vec<bool>>,
}

impl Geometry for Triangles {
    fn id_end(&self) -> usize {
        self.corners.len()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.corners.len()
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        self.corners.get(id.index()).map_or(Aabb::EMPTY, |corners| Aabb::from_points(corners))
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        let &[a, b, c] = self.corners.get(id.index())?;
        Some(ConvexPolygon::triangle(a, b, c))
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        self.opaque.as_ref().is_none_or(|opaque| opaque.get(id.index()).is_some_and(|&opaque| opaque))
    }
}

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (triangles, faces=None, *, opaque=None))]
    fn new(
        py: Python<'_>,
        triangles: &Bound<'_, PyAny>,
        faces: Option<&Bound<'_, PyAny>>,
        opaque: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let corners = arrays::triangles(triangles, faces)?;
        let most = PolygonId::LIMIT as usize;
        if corners.len() > most {
            let message = format!("triangles: expected at most {most}; found {}", corners.len());
            return Err(PyValueError::new_err(message));
        }
        let opaque = opaque.map(|opaque| arrays::mask(opaque, corners.len(), "opaque")).transpose()?;
        py.detach(|| Self::of(Triangles { corners, opaque }))
    }

    /// Finds the triangles that a camera sees. Returns an array of truth values, one for each triangle.
    /// `numpy.flatnonzero` converts it to numbers.
    ///
    /// `view` is a `View`, or a matrix in the form of `View.from_matrix` with the depth from zero to one. Without
    /// `occlusion`, false means that the triangle lies outside the view's frustum. With `occlusion`, triangles that the
    /// method finds hidden behind others are false, too: `msvbsp` (a tree of the shadows of the largest occluders),
    /// `svbsp` and `frusta` (older forms of `msvbsp`) or `depth` (a depth buffer). A triangle with any visible point is
    /// never false. `occluders` is the largest number of occluders in a view (default 64). More occluders hide more and
    /// take longer.
    ///
    /// `ValueError`: an unknown method, or a number of occluders that is not from 1 to 4096.
    #[pyo3(signature = (view, occlusion=None, *, occluders=None))]
    fn visible<'py>(
        &self,
        py: Python<'py>,
        view: &Bound<'py, PyAny>,
        occlusion: Option<&str>,
        occluders: Option<usize>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let view = View::of(view, None)?;
        let method = occlusion.map(names::culler).transpose()?;
        let occluders = occluders.unwrap_or(OCCLUDERS);
        if !(1..=MOST_OCCLUDERS).contains(&occluders) {
            let message = format!("occluders: expected 1 to {MOST_OCCLUDERS}; found {occluders}");
            return Err(PyValueError::new_err(message));
        }
        let mask = py.detach(|| {
            let mut mask = vec![false; self.triangles.corners.len()];
            self.cull(&view, method, occluders).iter().for_each(|id| mask[id.index()] = true);
            mask
        });
        Ok(mask.into_pyarray(py))
    }

    /// The corners, float32, of the shape (n, 3, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        arrays::cube(py, self.triangles.corners.as_flattened(), 3)
    }

    fn __len__(&self) -> usize {
        self.triangles.corners.len()
    }

    fn __repr__(&self) -> String {
        format!("<osp.Mesh of {} triangles>", self.triangles.corners.len())
    }
}

impl Mesh {
    fn of(triangles: Triangles) -> PyResult<Self> {
        let all = triangles.corners.iter().map(|corners| Aabb::from_points(corners));
        let bounds = all.fold(Aabb::EMPTY, |bounds, more| bounds.union(&more));
        let size_m = bounds.extent().max_element() * 1.01;
        let root = match size_m > 0.0 && size_m.is_finite() {
            true => Aabb::cube(bounds.center(), size_m),
            false => IndexConfig::default().root,
        };
        let mut index = Box::new(Osp::new(&IndexConfig { root, capacity: triangles.corners.len() }));
        for id in ids(&triangles) {
            let inserted = index.insert(id, &triangles.bounds(id));
            inserted.map_err(|error| PyValueError::new_err(error.to_string()))?;
        }
        index.commit();
        Ok(Self { triangles, index, pool: OnceLock::new() })
    }

    /// Returns the triangles in view. With a method, omits the triangles that the method finds hidden. Keeps no state
    /// between views, so the result depends only on the view.
    fn cull(&self, view: &View, method: Option<Method>, occluders: usize) -> Vec<PolygonId> {
        let mut in_view = VisibleBlocks::new();
        self.index.frustum_cull_blocks(&view.frustum(), &mut in_view);
        let Some(method) = method else { return in_view.to_vec() };
        let select = SelectConfig { occluders, ..SelectConfig::default() };
        let config = OcclusionConfig { select, ..OcclusionConfig::default() };
        let (view, geometry) = (&view.view, &self.triangles);
        let input = ViewInput { index: &*self.index, geometry, view, in_view: &in_view, spaces: None };
        let mut drawn = VisibleBlocks::new();
        ViewOcclusion::with_culler(method.create(occluders), &config).cull(self.pool(), &input, &mut drawn);
        drawn.to_vec()
    }

    fn pool(&self) -> &OccluderPool {
        self.pool.get_or_init(|| {
            let mut pool = Box::new(OccluderPool::new(PoolConfig::default()));
            let changes = ids(&self.triangles).map(Change::Insert).collect::<Vec<_>>();
            pool.follow(&self.triangles, &changes);
            pool
        })
    }
}

fn ids(triangles: &Triangles) -> impl Iterator<Item = PolygonId> + use<> {
    (0..triangles.corners.len() as u32).map(PolygonId)
}
