//! Boxes and rays: the slab test misses no box that the ray passes through, and every index answers as the plainest
//! code does.

use super::input::{self, Input, below, chance};
use osp::{
    glam::Vec3,
    index::IndexConfig,
    math::{Aabb, Ray},
    polygon::PolygonId,
};
use osp_rivals::IndexKind;

pub fn run(data: &[u8]) {
    let mut u = Input::new(data);
    let boxes: Vec<Aabb> = (0..1 + below(&mut u, 120)).map(|_| input::bounds(&mut u)).collect();
    let mut rays = Vec::new();
    while rays.len() < 16 {
        rays.push(ray(&mut u, &boxes));
        if u.is_empty() {
            break;
        }
    }
    for ray in &rays {
        for bounds in &boxes {
            if passes(ray, bounds) {
                assert!(ray.enter_box(bounds, f32::INFINITY).is_some(), "{ray:?} misses {bounds:?}");
            }
        }
    }
    for kind in IndexKind::ALL {
        let mut index = kind.create(&IndexConfig { capacity: 0, ..IndexConfig::default() });
        for (id, bounds) in (0..).map(PolygonId).zip(&boxes) {
            index.insert(id, bounds).expect("a sound box");
        }
        index.commit();
        for ray in &rays {
            for t_max in [f32::INFINITY, 1.0] {
                // The box itself is what is hit.
                let hit = |id: PolygonId| ray.enter_box(&boxes[id.index()], t_max);
                let mut expected: Option<(PolygonId, f32)> = None;
                for id in (0..boxes.len() as u32).map(PolygonId) {
                    if let Some(t) = hit(id)
                        && expected.is_none_or(|(_, best)| t < best)
                    {
                        expected = Some((id, t));
                    }
                }
                let place = format!("{}, {ray:?} up to {t_max}", kind.name());
                assert_eq!(index.ray_nearest(ray, t_max, &mut |id| hit(id)), expected, "{place}");
                let any = index.ray_any(ray, t_max, &mut |id| hit(id));
                assert_eq!(any.is_some(), expected.is_some(), "{place}, any");
            }
        }
    }
}

/// From anywhere, or from a corner, an edge or a face of a box, to anywhere or along an axis.
fn ray(u: &mut Input<'_>, boxes: &[Aabb]) -> Ray {
    let bounds = boxes[below(u, boxes.len())];
    let on_box = Vec3::from_array(std::array::from_fn(|axis| {
        [bounds.min[axis], bounds.center()[axis], bounds.max[axis]][below(u, 3)]
    }));
    let origin = if chance(u, 2) { on_box } else { input::near_point(u) };
    let target = if chance(u, 2) { on_box } else { boxes[below(u, boxes.len())].center() };
    let mut direction = if chance(u, 2) { target - origin } else { input::direction(u) };
    if chance(u, 2) {
        direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(1.0, 1.0, 0.0)][below(u, 4)];
    }
    let is_long = direction.is_finite() && direction.abs().max_element() > 1.0e-20;
    Ray::new(origin, if is_long { direction } else { Vec3::new(0.5, -0.25, 1.0) })
}

/// Whether the ray goes through the box, exactly but for the rounding of doubles; borders that it only touches by that
/// much are left out.
fn passes(ray: &Ray, bounds: &Aabb) -> bool {
    let (mut near, mut far) = (0.0f64, f64::INFINITY);
    for axis in 0..3 {
        let [low, high, from, along] =
            [bounds.min[axis], bounds.max[axis], ray.origin[axis], ray.direction[axis]].map(f64::from);
        if along == 0.0 {
            if from < low || from > high {
                return false;
            }
            continue;
        }
        let (a, b) = ((low - from) / along, (high - from) / along);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near.is_finite() && near < 1.0e30 && near <= far
}
