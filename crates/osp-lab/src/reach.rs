//! The reference for frustum culling: the polygons that intersect a view. The computation is in `f64` and relative to
//! the eye, as in drawing. It uses another method than [`View::frustum`], and no boxes.

use glam::{DMat3, DVec3};

use osp::{
    math::rotate_exactly,
    polygon::{ConvexPolygon, PolygonId},
    view::View,
};
use osp_session::scene::Scene;

/// A view as six inequalities, which hold for every point in the view.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    eye_in_world: DVec3,
    view_from_world: DMat3,
    /// In view space: a point `p` in the view has `normal . p > distance` for each side.
    sides: [(DVec3, f64); 6],
}

impl Reach {
    pub fn new(view: &View) -> Self {
        let p = &view.projection;
        let [left, right, bottom, top, near_m, far_m] =
            [p.left, p.right, p.bottom, p.top, p.near_m, p.far_m].map(f64::from);
        let axis = |axis| rotate_exactly(view.world_from_view, axis);
        Self {
            eye_in_world: view.eye_in_world.as_dvec3(),
            view_from_world: DMat3::from_cols(axis(DVec3::X), axis(DVec3::Y), axis(DVec3::Z)).inverse(),
            sides: [
                (DVec3::new(0.0, 0.0, -1.0), near_m),
                (DVec3::new(0.0, 0.0, 1.0), -far_m),
                (DVec3::new(1.0, 0.0, left), 0.0),
                (DVec3::new(-1.0, 0.0, -right), 0.0),
                (DVec3::new(0.0, 1.0, bottom), 0.0),
                (DVec3::new(0.0, -1.0, -top), 0.0),
            ],
        }
    }

    /// Whether a polygon has a point inside the view. A point on the border of the view does not count. More than
    /// three corners are a fan around the first corner.
    pub fn holds_part_of(&self, polygon: &ConvexPolygon) -> bool {
        let corners = polygon.vertices();
        corners[1..].windows(2).any(|pair| {
            self.holds_part_of_triangle(
                [corners[0], pair[0], pair[1]]
                    .map(|p| self.view_from_world * (p.as_dvec3() - self.eye_in_world)),
            )
        })
    }

    /// The function has its own clipping instead of the crate's routine, because a reference must also find errors of
    /// that routine.
    fn holds_part_of_triangle(&self, triangle: [DVec3; 3]) -> bool {
        let mut left = Corners { at: [DVec3::ZERO; MOST_CORNERS], count: 0 };
        triangle.into_iter().for_each(|p| left.push(p));
        for (normal, distance) in self.sides {
            let from = std::mem::replace(&mut left, Corners { at: [DVec3::ZERO; MOST_CORNERS], count: 0 });
            for i in 0..from.count {
                let (a, b) = (from.at[i], from.at[(i + 1) % from.count]);
                let (inside, next) = (normal.dot(a) - distance, normal.dot(b) - distance);
                if inside > 0.0 {
                    left.push(a);
                }
                if (inside > 0.0) != (next > 0.0) {
                    left.push(a + (b - a) * (inside / (inside - next)));
                }
            }
        }
        left.count > 0
    }
}

/// The part of a triangle inside the view.
struct Corners {
    at: [DVec3; MOST_CORNERS],
    count: usize,
}

/// Largest number of corners: each of six sides adds one; rounding adds a few to a triangle that is nearly a line.
const MOST_CORNERS: usize = 12;

impl Corners {
    fn push(&mut self, p: DVec3) {
        if let Some(place) = self.at.get_mut(self.count) {
            *place = p;
            self.count += 1;
        }
    }
}

/// The polygons that intersect a view but are not in `in_view`, the result of frustum culling. The list is empty,
/// unless the frustum or the index has an error. O(polygons of the scene).
pub fn lost_polygons(scene: &Scene, view: &View, in_view: &[PolygonId]) -> Vec<PolygonId> {
    let mut is_in_view = vec![false; scene.polygon_count()];
    in_view.iter().for_each(|id| is_in_view[id.index()] = true);
    let reach = Reach::new(view);
    // A polygon with an infinite box cannot be drawn.
    let is_lost = |&id: &PolygonId| {
        !is_in_view[id.index()] && scene.bounds(id).is_valid() && reach.holds_part_of(&scene.polygon(id))
    };
    scene.visible_ids().filter(is_lost).collect()
}
