use bevy_ecs::component::Component;
use bevy_math::Vec3 as BevyVec3;
use bevy_mesh::Mesh;
use osp::{
    glam::Vec3,
    polygon::{ConvexPolygon, FLATNESS},
};
use thiserror::Error;

/// Largest number of polygons of an occluder. Every view computes the sizes of all polygons of occluders, and only
/// large polygons hide much. For a finer mesh, use a coarse, undrawn occluder inside it.
const MOST_POLYGONS: usize = 1024;

/// The reason why a shape cannot be an occluder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum OccluderError {
    /// A corner is not finite.
    #[error("expected finite corners")]
    NotFinite,
    /// The four corners are not in one plane.
    #[error("expected four corners in a plane")]
    NotFlat,
    /// The four corners, in order, do not form a convex quad.
    #[error("expected the corners of a convex quad, in order")]
    NotConvex,
    /// The mesh has no triangles with positions of three floats.
    #[error("expected a mesh of triangles with positions of three 32-bit floats, kept in the main world")]
    NoTriangles,
    /// There are too many triangles.
    #[error("expected at most {MOST_POLYGONS} triangles, found {0}")]
    TooMany(usize),
}

/// The sides of an occluder's polygons that are drawn. Only drawn sides hide entities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OccluderSides {
    /// The front: corners run counter-clockwise as seen from the eye. Use this for materials that cull back faces,
    /// Bevy's default. With a mirrored transform the occluder hides nothing.
    #[default]
    Front,
    /// Both sides, for materials without `cull_mode`.
    Both,
}

/// Polygons that hide the entities behind them. Add this component to a wall, a floor, a hill, or another large, opaque
/// entity.
///
/// The polygons are in the entity's space. Every view that draws the entity must draw the whole area of the polygons
/// opaque: no holes, no transparency, and no shader that moves them. The conservative MSVBSP of [`osp::occlusion`] then
/// leaves entities behind them out of the `VisibleEntities` of that view. An entity stays visible if even one pixel of
/// it can be seen.
///
/// * In a view, an entity hides nothing if it is hidden, in no layer of the view, or has a `VisibilityRange` (it may be
///   dithered).
/// * An occluder without an `InheritedVisibility` is not drawn itself. It must lie inside a drawn, opaque entity.
/// * Only perspective cameras omit hidden entities. They never omit an entity without `Aabb`, or with
///   `NoFrustumCulling` or an `Occluder`.
/// * Hidden entities still cast shadows, because Bevy's light systems find the shadow casters independently.
#[derive(Component, Clone, Debug, PartialEq)]
pub struct Occluder {
    polygons: Vec<ConvexPolygon>,
    sides: OccluderSides,
}

impl Occluder {
    /// Creates a flat, convex quad. Seen from its front, the corners run counter-clockwise.
    ///
    /// # Errors
    /// [`OccluderError::NotFinite`], [`OccluderError::NotFlat`], [`OccluderError::NotConvex`].
    pub fn quad(corners: [BevyVec3; 4]) -> Result<Self, OccluderError> {
        let [a, b, c, d] = corners;
        if !corners.iter().all(|corner| corner.is_finite()) {
            return Err(OccluderError::NotFinite);
        }
        let normal = (c - a).cross(d - b).normalize_or_zero();
        let turns =
            [(a, b, c), (b, c, d), (c, d, a), (d, a, b)].map(|(p, q, r)| (q - p).cross(r - q).dot(normal));
        if turns.iter().any(|turn| turn.is_nan() || *turn <= 0.0) {
            return Err(OccluderError::NotConvex);
        }
        let longest = [b - a, c - b, d - c, a - d].map(BevyVec3::length).into_iter().fold(0.0, f32::max);
        let plane = (b - a).cross(c - a).normalize_or_zero();
        if (d - a).dot(plane).abs() > FLATNESS * longest {
            return Err(OccluderError::NotFlat);
        }
        Ok(Self { polygons: vec![ConvexPolygon::quad(corners.map(to_osp))], sides: OccluderSides::Front })
    }

    /// Creates an occluder of triangles. Seen from the front of each, its corners run counter-clockwise.
    ///
    /// # Errors
    /// [`OccluderError::NotFinite`], [`OccluderError::TooMany`].
    pub fn triangles(triangles: &[[BevyVec3; 3]]) -> Result<Self, OccluderError> {
        if triangles.len() > MOST_POLYGONS {
            return Err(OccluderError::TooMany(triangles.len()));
        }
        if !triangles.iter().flatten().all(|corner| corner.is_finite()) {
            return Err(OccluderError::NotFinite);
        }
        let of = |corners: &[BevyVec3; 3]| {
            let [a, b, c] = corners.map(to_osp);
            ConvexPolygon::triangle(a, b, c)
        };
        Ok(Self { polygons: triangles.iter().map(of).collect(), sides: OccluderSides::Front })
    }

    /// Creates an occluder of the triangles of a mesh.
    ///
    /// # Errors
    /// [`OccluderError::NoTriangles`], [`OccluderError::NotFinite`], [`OccluderError::TooMany`].
    pub fn from_mesh(mesh: &Mesh) -> Result<Self, OccluderError> {
        let triangles = mesh.triangles().map_err(|_| OccluderError::NoTriangles)?;
        // One triangle more than allowed is enough to detect that there are too many.
        let triangles =
            triangles.take(MOST_POLYGONS + 1).map(|triangle| triangle.vertices).collect::<Vec<_>>();
        Self::triangles(&triangles)
    }

    /// Returns the occluder with these drawn sides.
    #[must_use]
    pub fn with_sides(mut self, sides: OccluderSides) -> Self {
        self.sides = sides;
        self
    }

    pub(crate) fn polygons(&self) -> &[ConvexPolygon] {
        &self.polygons
    }

    pub(crate) fn sides(&self) -> OccluderSides {
        self.sides
    }
}

fn to_osp(point: BevyVec3) -> Vec3 {
    Vec3::from(point.to_array())
}

#[cfg(test)]
mod tests {
    use bevy_math::primitives::{Cuboid, Sphere};
    use bevy_mesh::Meshable;

    use super::*;

    #[test]
    fn bad_polygons_are_refused() {
        let corners =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| BevyVec3::new(x, y, 0.0));
        assert_eq!(Occluder::quad(corners).unwrap().polygons().len(), 1);
        let with = |at: usize, corner: BevyVec3| {
            let mut corners = corners;
            corners[at] = corner;
            Occluder::quad(corners)
        };
        assert_eq!(with(2, BevyVec3::new(f32::NAN, 1.0, 0.0)), Err(OccluderError::NotFinite));
        assert_eq!(with(2, BevyVec3::new(1.0, 1.0, 0.5)), Err(OccluderError::NotFlat));
        assert_eq!(with(2, BevyVec3::new(-0.9, -0.9, 0.0)), Err(OccluderError::NotConvex));
        assert_eq!(with(2, corners[1]), Err(OccluderError::NotConvex));
        let [a, b, c, d] = corners;
        assert_eq!(Occluder::quad([a, c, b, d]), Err(OccluderError::NotConvex));
        let infinite = [[a, b, BevyVec3::INFINITY]];
        assert_eq!(Occluder::triangles(&infinite), Err(OccluderError::NotFinite));
    }

    #[test]
    fn meshes_give_their_triangles() {
        let cube = Occluder::from_mesh(&Mesh::from(Cuboid::default())).unwrap();
        assert_eq!(cube.polygons().len(), 12);
        let fine = Sphere::new(1.0).mesh().uv(64, 64);
        assert_eq!(Occluder::from_mesh(&fine), Err(OccluderError::TooMany(MOST_POLYGONS + 1)));
        let points = Mesh::new(bevy_mesh::PrimitiveTopology::PointList, Default::default());
        assert_eq!(Occluder::from_mesh(&points), Err(OccluderError::NoTriangles));
    }
}
