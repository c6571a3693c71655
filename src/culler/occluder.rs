use std::sync::Arc;

use glam::Vec3;
use thiserror::Error;

use crate::{
    math::{Aabb, is_flat_and_convex},
    occlusion::{BOX_SIDES, OccluderMesh},
    polygon::ConvexPolygon,
};

/// The reason why a shape cannot be an occluder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum OccluderError {
    /// A coordinate is infinite or NaN.
    #[error("corner {0}: expected finite coordinates")]
    NotFinite(usize),
    /// A quad is bent, concave, crosses itself or has no area.
    #[error(
        "corners: expected a flat, convex quad, its corners in order around it; `Occluder::mesh` takes other shapes"
    )]
    NotFlatAndConvex,
    /// The number of indices is not a multiple of three.
    #[error("indices: expected three for each triangle, found {0}")]
    NotTriangles(usize),
    /// An index is out of range.
    #[error("indices[{at}]: expected less than {vertices}, found {found}")]
    NoVertex {
        /// Position in the list of indices.
        at: usize,
        /// The vertex index at this position.
        found: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// No triangle or side of the box has an area.
    #[error("expected a surface with an area")]
    NoArea,
    /// The box's minimum is larger than its maximum on an axis.
    #[error("bounds: expected min <= max")]
    EmptyBox,
}

/// Largest number of triangles of a mesh that the shadow-volume tree considers. With more, each new mesh takes longer.
const MOST_SINGLE: usize = 48;

/// A surface that hides objects behind it, metres, in the space of its object: opaque, and seen from both sides.
///
/// The engine draws the surface itself, or an opaque object around it. A copy shares the prepared mesh, so objects of one
/// shape should have copies of one occluder.
#[derive(Clone, Debug, PartialEq)]
pub struct Occluder {
    mesh: Arc<OccluderMesh>,
    /// The polygons of a small mesh.
    polygons: Arc<[ConvexPolygon]>,
}

impl Occluder {
    /// A flat, convex quad, with its corners in clockwise or counter-clockwise order.
    ///
    /// # Errors
    /// [`OccluderError::NotFinite`], [`OccluderError::NotFlatAndConvex`].
    pub fn quad<P: Into<[f32; 3]>>(corners: [P; 4]) -> Result<Self, OccluderError> {
        let corners = corners.map(point);
        check_finite(&corners)?;
        if !is_flat_and_convex(corners) {
            return Err(OccluderError::NotFlatAndConvex);
        }
        Self::of(&corners, &[[0, 1, 2], [0, 2, 3]], || [ConvexPolygon::quad(corners)].into())
    }

    /// A mesh of triangles, with three indices for each triangle. The mesh may be open or closed, with triangles of any
    /// orientation. Vertices at the same position count as one; gaps stay open. Takes 0.2 to 2 µs a
    /// triangle; less if neighbouring triangles follow each other.
    ///
    /// # Errors
    /// [`OccluderError::NotTriangles`], [`OccluderError::NotFinite`], [`OccluderError::NoVertex`],
    /// [`OccluderError::NoArea`].
    pub fn mesh<P: Into<[f32; 3]> + Copy>(vertices: &[P], indices: &[u32]) -> Result<Self, OccluderError> {
        let (triangles, rest) = indices.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(OccluderError::NotTriangles(indices.len()));
        }
        let vertices: Vec<Vec3> = vertices.iter().map(|&vertex| point(vertex)).collect();
        check_finite(&vertices)?;
        let is_beyond = |index: &u32| *index as usize >= vertices.len();
        if let Some(at) = indices.iter().position(is_beyond) {
            return Err(OccluderError::NoVertex { at, found: indices[at], vertices: vertices.len() });
        }
        Self::of(&vertices, triangles, || {
            let corners = triangles.iter().map(|triangle| triangle.map(|index| vertices[index as usize]));
            corners.map(|[a, b, c]| ConvexPolygon::triangle(a, b, c)).collect()
        })
    }

    /// The six sides of a box, `[min, max]`, such as a box inside a house.
    ///
    /// # Errors
    /// [`OccluderError::NotFinite`], [`OccluderError::EmptyBox`], [`OccluderError::NoArea`].
    pub fn cuboid<P: Into<[f32; 3]>>(bounds: [P; 2]) -> Result<Self, OccluderError> {
        let corners = bounds.map(point);
        check_finite(&corners)?;
        let bounds = Aabb::new(corners[0], corners[1]);
        if bounds.is_empty() {
            return Err(OccluderError::EmptyBox);
        }
        let corners = bounds.corners();
        let triangles: Vec<_> = BOX_SIDES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self::of(&corners, &triangles, || {
            let corners = BOX_SIDES.iter().map(|side| side.map(|corner| corners[corner as usize]));
            corners.map(ConvexPolygon::quad).collect()
        })
    }

    fn of(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        polygons: impl FnOnce() -> Vec<ConvexPolygon>,
    ) -> Result<Self, OccluderError> {
        let mesh = OccluderMesh::new(vertices, triangles).ok_or(OccluderError::NoArea)?;
        let mut polygons = if triangles.len() > MOST_SINGLE { Vec::new() } else { polygons() };
        polygons.retain(|polygon| polygon.area_m2() > 0.0);
        Ok(Self { mesh: Arc::new(mesh), polygons: polygons.into() })
    }

    pub(super) fn polygons(&self) -> &[ConvexPolygon] {
        &self.polygons
    }

    pub(super) fn prepared(&self) -> &Arc<OccluderMesh> {
        &self.mesh
    }
}

fn point(corner: impl Into<[f32; 3]>) -> Vec3 {
    Vec3::from(corner.into())
}

fn check_finite(corners: &[Vec3]) -> Result<(), OccluderError> {
    match corners.iter().position(|corner| !corner.is_finite()) {
        Some(at) => Err(OccluderError::NotFinite(at)),
        None => Ok(()),
    }
}
