//! The answers by the plainest loop, in `f64` and from the numbers of a line alone: nothing here is the library's. A
//! question is `None` where `f32` might decide it otherwise.

use std::collections::BTreeMap;

use osp::{
    glam::{DMat4, DVec3, Mat4, Vec3},
    math::{Aabb, Ray, Sphere},
};

pub(crate) type Boxes = BTreeMap<u32, Aabb>;

/// How far from a border a box has to be for `f32` to decide it, metres, and as a part of the coordinates.
const MARGIN_M: f64 = 1.0e-3;
const MARGIN_PER_M: f64 = 1.0e-5;

/// The ids that a test says yes to; `None` if it cannot decide one of them.
fn filtered(boxes: &Boxes, mut test: impl FnMut(&Aabb) -> Option<bool>) -> Option<Vec<u32>> {
    let mut found = Vec::new();
    for (&id, bounds) in boxes {
        if test(bounds)? {
            found.push(id);
        }
    }
    Some(found)
}

/// A border through a point of the box is not beyond it, and exact where the numbers are.
fn decide(distance_m: f64, reach_m: f64) -> Option<bool> {
    let is_clear = distance_m == 0.0 || distance_m.abs() > MARGIN_M + MARGIN_PER_M * reach_m;
    is_clear.then_some(distance_m >= 0.0)
}

fn reach_m(bounds: &Aabb) -> f64 {
    f64::from(bounds.min.abs().max(bounds.max.abs()).max_element())
}

/// The boxes that lie behind none of the six planes of a matrix, depth from 0 to 1 in either direction.
pub(crate) fn visible(boxes: &Boxes, clip_from_world: &Mat4) -> Option<Vec<u32>> {
    let rows: DMat4 = clip_from_world.as_dmat4().transpose();
    let [x, y, z, w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
    let planes = [w + x, w - x, w + y, w - y, z, w - z];
    filtered(boxes, |bounds| {
        let (low, high) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
        let sides = planes.map(|plane| {
            let normal = plane.truncate();
            let length =
                if normal.length() > 1.0e-9 { normal.length() } else { return Some(plane.w >= 0.0) };
            let farthest = DVec3::select(normal.cmpge(DVec3::ZERO), high, low);
            decide((normal.dot(farthest) + plane.w) / length, reach_m(bounds))
        });
        if sides.contains(&Some(false)) {
            Some(false)
        } else {
            sides.iter().all(Option::is_some).then_some(true)
        }
    })
}

/// The boxes that share a point with a box.
pub(crate) fn box_query(boxes: &Boxes, asked: &Aabb) -> Option<Vec<u32>> {
    filtered(boxes, |bounds| {
        // Comparisons are exact.
        Some(asked.min.cmple(bounds.max).all() && bounds.min.cmple(asked.max).all())
    })
}

/// The boxes that share a point with a ball.
pub(crate) fn sphere(boxes: &Boxes, asked: &Sphere) -> Option<Vec<u32>> {
    let center = asked.center.as_dvec3();
    filtered(boxes, |bounds| {
        let distance_m = center.clamp(bounds.min.as_dvec3(), bounds.max.as_dvec3()).distance(center);
        decide(f64::from(asked.radius_m) - distance_m, reach_m(bounds))
    })
}

/// The first box that a ray enters, and where; `None` if it grazes one or enters two at once.
#[expect(clippy::option_option, reason = "undecided, or no box, or a box")]
pub(crate) fn ray(boxes: &Boxes, asked: &Ray, t_max: f32) -> Option<Option<(u32, f32)>> {
    let mut entered = Vec::new();
    for (&id, bounds) in boxes {
        let margin = Vec3::splat((MARGIN_M + MARGIN_PER_M * reach_m(bounds)) as f32);
        let grown = enter(asked, &Aabb::new(bounds.min - margin, bounds.max + margin), t_max);
        let t = enter(asked, bounds, t_max);
        let shrunk = enter(asked, &Aabb::new(bounds.min + margin, bounds.max - margin), t_max);
        if grown.is_some() != t.is_some() || (t.is_some() && shrunk.is_none()) {
            return None;
        }
        entered.extend(t.map(|t| (t, id)));
    }
    entered.sort_by(|a, b| a.0.total_cmp(&b.0));
    match *entered {
        [(first, _), (second, _), ..] if second - first <= 1.0e-3 * (1.0 + first) => None,
        [(t, id), ..] => Some(Some((id, t as f32))),
        [] => Some(None),
    }
}

fn enter(ray: &Ray, bounds: &Aabb, t_max: f32) -> Option<f64> {
    let (mut near, mut far) = (0.0f64, f64::from(t_max));
    for axis in 0..3 {
        let along = |at: f32| f64::from(at) - f64::from(ray.origin[axis]);
        let (low, high, step) =
            (along(bounds.min[axis]), along(bounds.max[axis]), f64::from(ray.direction[axis]));
        if low > high {
            return None;
        }
        if step == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        near = near.max((low / step).min(high / step));
        far = far.min((low / step).max(high / step));
    }
    (near <= far).then_some(near)
}
