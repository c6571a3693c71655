use super::Scene;
use crate::{
    math::Aabb,
    polygon::{ConvexPolygon, Geometry, PolygonId},
};

impl Geometry for Scene {
    fn id_end(&self) -> usize {
        self.polygon_count()
    }

    fn is_present(&self, id: PolygonId) -> bool {
        id.index() < self.polygon_count() && self.is_visible(id)
    }

    fn bounds(&self, id: PolygonId) -> Aabb {
        *Self::bounds(self, id)
    }

    fn polygon(&self, id: PolygonId) -> Option<ConvexPolygon> {
        Some(Self::polygon(self, id))
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        let (.., opacity) = self.stroke_of(id).color();
        opacity >= 1.0
    }
}
