//! The answers by the plainest loop, in `f64` and from the numbers of a line alone: nothing here is the library's. A
//! question is `None` where `f32` might decide it otherwise.

use std::collections::BTreeMap;

use osp::{
    glam::{DMat3, DMat4, DVec3, Mat4, Vec3},
    math::{Aabb, Ray, Sphere},
};

use super::file::Quad;

pub(crate) type Boxes = BTreeMap<u32, Aabb>;

/// The occluders, by the id of the object that has them.
pub(crate) type Quads = BTreeMap<u32, Quad>;

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

/// Of the boxes in view those that do not lie wholly in the shadow of one occluder. `None` also where a box is partly out of view: what
/// is left of it may be hidden.
pub(crate) fn unhidden(boxes: &Boxes, quads: &Quads, clip_from_world: &Mat4) -> Option<Vec<u32>> {
    let in_view = visible(boxes, clip_from_world)?;
    let clip_from_world = clip_from_world.as_dmat4();
    let rows = clip_from_world.transpose();
    // The eye is where x, y and w of clip space are zero.
    let [x, y, w] = [rows.x_axis, rows.y_axis, rows.w_axis];
    let at = DMat3::from_cols(x.truncate(), y.truncate(), w.truncate()).transpose();
    let eye = -(at.inverse() * DVec3::new(x.w, y.w, w.w));
    let is_on_screen = |corner: DVec3| {
        let clip = clip_from_world * corner.extend(1.0);
        clip.w > 0.0 && clip.truncate().abs().max_element() <= clip.w
    };
    let mut found = Vec::new();
    for id in in_view {
        let corners = boxes[&id].corners().map(Vec3::as_dvec3);
        if !corners.iter().all(|&corner| is_on_screen(corner)) {
            return None;
        }
        let mut is_hidden = false;
        for quad in quads.values() {
            is_hidden |= is_in_shadow(&quad.map(Vec3::as_dvec3), eye, &corners)?;
        }
        if !is_hidden {
            found.push(id);
        }
    }
    Some(found)
}

/// Whether all points lie behind a quad, as an eye sees it.
fn is_in_shadow(quad: &[DVec3; 4], eye: DVec3, points: &[DVec3]) -> Option<bool> {
    let towards = |normal: DVec3, from: DVec3, inside: DVec3| {
        let normal = normal.normalize();
        (if normal.dot(inside - from) < 0.0 { -normal } else { normal }, from)
    };
    let middle = (quad[0] + quad[1] + quad[2] + quad[3]) / 4.0;
    let (front, from) = towards((quad[1] - quad[0]).cross(quad[2] - quad[0]), quad[0], eye);
    let mut planes = vec![(-front, from)];
    planes.extend((0..4).map(|i| {
        let (a, b) = (quad[i] - eye, quad[(i + 1) % 4] - eye);
        towards(a.cross(b), eye, middle)
    }));
    let sides = points.iter().flat_map(|point| {
        planes.iter().map(move |(inwards, from)| {
            let distance_m = inwards.dot(*point - *from);
            // On the plane of the quad is not behind it.
            if distance_m == 0.0 { Some(false) } else { decide(distance_m, point.abs().max_element()) }
        })
    });
    let sides: Vec<_> = sides.collect();
    if sides.contains(&Some(false)) { Some(false) } else { sides.iter().all(Option::is_some).then_some(true) }
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
