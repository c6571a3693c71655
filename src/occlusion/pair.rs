//! Two neighbouring polygons as one occluder: what [`super::patch::Patch`] is for many, in a tenth of its time.

use glam::{DVec2, DVec3, Vec3};

use super::{
    ShadowVolume,
    hull::{Hull, area},
    patch::shadow_of_hull,
};
use crate::{polygon::ConvexPolygon, view::ViewWindow};

/// The outline of both is worth filling if the second polygon adds at least this part of what it covers alone.
const WORTH_JOINING: f64 = 0.7;

/// Two polygons of at most four corners that share an edge have at most this many.
const MAX_BORDER: usize = 6;

/// The line round two polygons that share an edge bit for bit, the way the first one turns, and twice their area vector.
struct Border {
    corners: [Vec3; MAX_BORDER],
    len: usize,
    area_vector: Vec3,
}

impl Border {
    fn new(first: &ConvexPolygon, second: &ConvexPolygon) -> Option<Self> {
        let (a, b) = (first.vertices(), second.vertices());
        let (i, k, turned) = shared_edge(a, b)?;
        let mut corners = [Vec3::ZERO; MAX_BORDER];
        // From the edge's end all the way to its beginning, then the other's corners.
        for n in 0..a.len() {
            corners[n] = a[(i + 1 + n) % a.len()];
        }
        for n in 0..b.len() - 2 {
            let at = if turned { k + b.len() - 1 - n } else { k + 2 + n };
            corners[a.len() + n] = b[at % b.len()];
        }
        let turn = if turned { -1.0 } else { 1.0 };
        let area_vector = first.area_vector() + second.area_vector() * turn;
        Some(Self { corners, len: a.len() + b.len() - 2, area_vector })
    }

    fn corners(&self) -> &[Vec3] {
        &self.corners[..self.len]
    }
}

/// An edge of each, by its first corner, that is the same, and whether both outlines pass it the same way.
fn shared_edge(a: &[Vec3], b: &[Vec3]) -> Option<(usize, usize, bool)> {
    for i in 0..a.len() {
        let (p, q) = (a[i], a[(i + 1) % a.len()]);
        for k in 0..b.len() {
            let (from, to) = (b[k], b[(k + 1) % b.len()]);
            if (from == q && to == p) || (from == p && to == q) {
                return Some((i, k, from == p));
            }
        }
    }
    None
}

/// The shadow of two polygons that share an edge, as one: a convex outline inside their picture, capped behind its farthest
/// corner. `None` where there is no such edge, or the outline is not worth it. See [`super::hull`] for why it is inside.
pub(super) fn shadow_of_pair(
    first: &ConvexPolygon,
    second: &ConvexPolygon,
    window: &ViewWindow,
) -> Option<ShadowVolume> {
    let border = Border::new(first, second)?;
    let mut seen = [DVec3::ZERO; MAX_BORDER];
    let seen = &mut seen[..border.len];
    let mut middle = DVec3::ZERO;
    for (v, p) in seen.iter_mut().zip(border.corners()) {
        *v = window.from_eye(*p);
        middle += *v;
        // What the near plane would cut is left out as a whole.
        if window.forward().dot(*v) <= window.near_m() {
            return None;
        }
    }
    let ahead = middle.try_normalize()?;
    let mut cap_normal = border.area_vector.as_dvec3().try_normalize()?;
    if cap_normal.dot(ahead) < 0.0 {
        cap_normal = -cap_normal;
    }
    let x = ahead.any_orthonormal_vector();
    let y = ahead.cross(x);
    let (mut picture, mut cap_distance_m) = ([DVec2::ZERO; MAX_BORDER], 0.0_f64);
    for (to, v) in picture.iter_mut().zip(&*seen) {
        let away = ahead.dot(*v);
        // The picture is taken around `ahead`; a corner beside or behind the eye has no place in it.
        if away * away <= 0.01 * v.length_squared() || away <= 0.0 {
            return None;
        }
        *to = DVec2::new(x.dot(*v), y.dot(*v)) / away;
        cap_distance_m = cap_distance_m.max(cap_normal.dot(*v));
    }
    let picture = &mut picture[..border.len];
    let a_len = first.vertices().len();
    let (whole, alone) = (area(picture), area(&picture[..a_len]));
    let x = if whole < 0.0 { -x } else { x };
    if whole < 0.0 {
        // Seen from behind the border turns the other way: mirror the picture.
        picture.iter_mut().for_each(|p| p.x = -p.x);
    }
    let hull = Hull::inside_small(picture);
    let added = (whole - alone).abs();
    if hull.area() < alone.abs() + WORTH_JOINING * added {
        return None;
    }
    shadow_of_hull(&hull, [ahead, x, y], cap_normal, cap_distance_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a ray from the eye meets a triangle, as a part of the way to `x`.
    fn meets(a: DVec3, b: DVec3, c: DVec3, x: DVec3) -> Option<f64> {
        let inside = [(a, b), (b, c), (c, a)].map(|(p, q)| p.cross(q - p).normalize().dot(x.normalize()));
        let is_inside = inside.iter().all(|s| *s >= -1.0e-10) || inside.iter().all(|s| *s <= 1.0e-10);
        let normal = (b - a).cross(c - a);
        is_inside.then(|| normal.dot(a) / normal.dot(x))
    }

    #[test]
    fn rays_through_the_outline_of_a_pair_meet_one_of_the_two_before_its_cap() {
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
        };
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| DVec3::new(x, y, 1.0));
        let window = ViewWindow::new(DVec3::ZERO, DVec3::Z, corners, 0.1).expect("a window");
        let (mut found, mut bent) = (0, 0);
        for _ in 0..20_000 {
            let wild = 0.02 + random().abs();
            let mut at = |x: f64, y: f64| {
                Vec3::new(
                    (x + random() * wild) as f32,
                    (y + random() * wild) as f32,
                    (3.0 + random() * wild) as f32,
                )
            };
            let rungs = [-1.0, 0.0, 1.0].map(|x| [at(x, -0.5), at(x, 0.5)]);
            let [[a, b], [c, d], [e, f]] = rungs;
            // What is drawn: triangles, so that nothing is bent.
            let pairs = [
                (ConvexPolygon::triangle(a, c, d), ConvexPolygon::triangle(c, f, d)),
                (ConvexPolygon::triangle(a, c, d), ConvexPolygon::triangle(c, d, e)),
                (ConvexPolygon::triangle(b, c, d), ConvexPolygon::triangle(d, c, f)),
            ];
            for (first, second) in pairs {
                let Some(shadow) = shadow_of_pair(&first, &second, &window) else { continue };
                found += 1;
                bent += u32::from(shadow.sides().len() != 4);
                for _ in 0..8 {
                    let mix = shadow.corners().iter().map(|v| *v * (random() + 0.5)).sum::<DVec3>();
                    let x = mix * (shadow.cap_distance_m() / shadow.cap_normal().dot(mix)) * (1.0 + 1.0e-9);
                    let blocked = [&first, &second].iter().any(|polygon| {
                        let [a, b, c] = [0, 1, 2].map(|i| window.from_eye(polygon.vertices()[i]));
                        meets(a, b, c, x).is_some_and(|t| t > 0.0 && t <= 1.0)
                    });
                    assert!(blocked, "{x} behind {first:?} and {second:?}");
                }
            }
        }
        assert!(found > 20_000 && bent > 500, "{found}, {bent}");
    }

    /// Pairs beside the eye that reach far to the side: some corners lie behind the central direction.
    #[test]
    fn the_outline_of_a_pair_that_reaches_far_to_the_side_is_covered_by_it() {
        let mut seed = 11_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 33) as f64 / (1_u64 << 31) as f64
        };
        let corners =
            [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|(x, y)| DVec3::new(x, y, 1.0));
        let window = ViewWindow::new(DVec3::ZERO, DVec3::Z, corners, 0.01).expect("a window");
        let (mut found, mut behind) = (0, 0);
        for _ in 0..60_000 {
            let mut at = || {
                let far_m = 10.0_f64.powf(3.0 * random() - 1.0);
                let [x, y] = [0, 1].map(|_| (2.0 * random() - 1.0) * far_m);
                DVec3::new(x, y, 0.02 + random() * far_m * 0.2).as_vec3()
            };
            let [a, b, c, d] = [(); 4].map(|()| at());
            let (first, second) = (ConvexPolygon::triangle(a, b, c), ConvexPolygon::triangle(b, c, d));
            let middle = [a, b, c, d].map(|p| window.from_eye(p)).into_iter().sum::<DVec3>();
            behind += u32::from([a, b, c, d].iter().any(|p| window.from_eye(*p).dot(middle) < 0.0));
            let Some(shadow) = shadow_of_pair(&first, &second, &window) else { continue };
            found += 1;
            for _ in 0..8 {
                let mix = shadow.corners().iter().map(|v| *v * (random() + 0.01)).sum::<DVec3>();
                let x = mix * (shadow.cap_distance_m() / shadow.cap_normal().dot(mix)) * (1.0 + 1.0e-9);
                let blocked = [&first, &second].iter().any(|polygon| {
                    let [a, b, c] = [0, 1, 2].map(|i| window.from_eye(polygon.vertices()[i]));
                    meets(a, b, c, x).is_some_and(|t| t > 0.0 && t <= 1.0)
                });
                assert!(blocked, "{x} behind {first:?} and {second:?}");
            }
        }
        assert!(found > 1_000 && behind > 1_000, "{found}, {behind}");
    }

    #[test]
    fn pairs_without_a_common_edge_and_folded_ones_have_no_outline() {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let window = corners.map(|(x, y)| DVec3::new(x, y, 1.0));
        let window = ViewWindow::new(DVec3::ZERO, DVec3::Z, window, 0.1).expect("a window");
        let square = |x: f32| {
            ConvexPolygon::quad(
                [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(a, b)| Vec3::new(x + a, b, 3.0)),
            )
        };
        assert!(shadow_of_pair(&square(0.0), &square(1.0), &window).is_some());
        assert!(shadow_of_pair(&square(0.0), &square(1.5), &window).is_none());
        assert!(shadow_of_pair(&square(0.0), &square(0.0), &window).is_none());
    }
}
