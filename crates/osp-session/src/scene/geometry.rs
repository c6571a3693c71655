use glam::Vec3;

use super::{Scene, solid::solid_part};
use crate::brush::Draw;
use osp::{
    math::Aabb,
    polygon::{ConvexPolygon, Geometry, PolygonId, SpaceId, SpacePlace},
};

impl Geometry for Scene {
    fn id_end(&self) -> usize {
        self.polygon_count()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.polygon_count() && self.is_visible(id)
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        Self::bounds(self, id)
    }

    fn space(&self, id: PolygonId) -> Option<SpaceId> {
        Self::space(self, id)
    }

    fn bounds_in_space(&self, id: PolygonId) -> Aabb {
        self.bounds.get(id.index()).copied().unwrap_or(Aabb::EMPTY)
    }

    fn place(&self, space: SpaceId) -> SpacePlace {
        Self::place_of(self, space)
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        // A polygon that faces the eye or is animated has no fixed corners.
        let is_fixed = !self.surface(id).is_facing() && self.stroke_of(id).padding_m == 0.0;
        is_fixed.then(|| Self::polygon(self, id))
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        let stroke = self.stroke_of(id);
        match stroke.brush().map(|brush| brush.draw) {
            Some(Draw::Opaque) => !self.surface(id).is_facing() && stroke.padding_m == 0.0,
            Some(Draw::Cutout) => self.occluder(id).is_some(),
            Some(Draw::Additive | Draw::Blended) => false,
            None => stroke.color().3 >= 1.0,
        }
    }

    fn occluder(&self, id: PolygonId) -> Option<ConvexPolygon> {
        match self.stroke_of(id).brush().filter(|brush| brush.draw == Draw::Cutout) {
            Some(brush) => solid_part(&Geometry::polygon(self, id)?, &self.surface(id), brush),
            None if self.may_occlude(id) => Geometry::polygon(self, id),
            None => None,
        }
    }
}

impl Scene {
    /// A polygon as it is drawn for an eye, world space. A polygon that [faces the eye](crate::brush::Surface::facing)
    /// is a square perpendicular to the line of sight. Its rotation about that line is relative to `up`, the upward
    /// direction of the picture. Other polygons do not depend on the eye.
    pub fn polygon_from(&self, id: PolygonId, eye: Vec3, up: Vec3) -> ConvexPolygon {
        let stored = Self::polygon(self, id);
        let surface = self.surface(id);
        if !surface.is_facing() {
            return stored;
        }
        let middle = stored.bounds().center();
        let half_edge = stored.vertices()[0].distance(middle) * std::f32::consts::FRAC_1_SQRT_2;
        let away = (middle - eye).normalize_or(Vec3::NEG_Z);
        let right = away.cross(up).try_normalize().unwrap_or_else(|| away.any_orthonormal_vector());
        let upward = right.cross(away);
        let (sin, cos) = libm::sincosf(surface.roll_radians());
        let (right, upward) = (right * cos + upward * sin, upward * cos - right * sin);
        let corner = |x: f32, y: f32| middle + (right * x + upward * y) * half_edge;
        ConvexPolygon::quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)])
    }
}
