use super::Scene;
use crate::{
    brush::Draw,
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
        // What turns to the eye has no corners of its own.
        (!self.surface(id).is_facing()).then(|| Self::polygon(self, id))
    }

    fn may_occlude(&self, id: PolygonId) -> bool {
        let stroke = self.stroke_of(id);
        match stroke.brush() {
            Some(brush) => brush.draw == Draw::Opaque && !self.surface(id).is_facing(),
            None => stroke.color().3 >= 1.0,
        }
    }
}
