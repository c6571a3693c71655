//! The judge: recomputes from the corners of the polygons, in `f64`, whether a point can be seen.

use super::random::Polygon;
use glam::{DVec3, Vec3};
use osp::{
    math::{Aabb, Sphere},
    occlusion::{OcclusionCuller, Verdict},
    view::ViewWindow,
};

/// How close to a triangle's border a ray still counts as meeting it, as a sine: neighbours meet without a crack.
const BORDER_SINE: f64 = 1.0e-10;

/// Whether the test of a box or of its ball calls a box hidden.
pub(crate) fn hides(culler: &dyn OcclusionCuller, bounds: &Aabb) -> bool {
    let ball = Sphere { center: bounds.center(), radius_m: bounds.extent().length() * 0.5 };
    [culler.test_box(bounds), culler.test_sphere(&ball)]
        .iter()
        .any(|tested| tested.verdict == Verdict::Hidden)
}

/// Whether a point, seen from the eye, is in the window and not nearer than the near plane.
pub(crate) fn is_in_window(window: &ViewWindow, x: DVec3) -> bool {
    let corners = window.corners();
    let inside = |i: usize| corners[i].cross(corners[(i + 1) % 4]).normalize().dot(x) > 1.0e-9 * x.length();
    (0..4).all(inside) && window.forward().dot(x) > window.near_m()
}

/// Whether one of the polygons lies between the eye and a point given from the eye, and is drawn there.
pub(crate) fn is_blocked(window: &ViewWindow, polygons: &[Polygon], x: DVec3) -> bool {
    polygons.iter().any(|polygon| {
        polygon[1..].windows(2).any(|pair| {
            let [a, b, c] = [polygon[0], pair[0], pair[1]].map(|p| window.from_eye(p));
            let at = meets(window, [a, b, c], x);
            at.is_some_and(|t| t <= 1.0)
        })
    })
}

/// Where the ray towards `x` meets a triangle, as a part of the way to `x`, if that is drawn.
fn meets(window: &ViewWindow, [a, b, c]: [DVec3; 3], x: DVec3) -> Option<f64> {
    let normal = (b - a).cross(c - a);
    let t = normal.dot(a) / normal.dot(x);
    let hit = x * t;
    let direction = x.normalize();
    let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| p.cross(q - p).normalize_or_zero().dot(direction));
    let one_way = sides.iter().all(|s| *s >= -BORDER_SINE) || sides.iter().all(|s| *s <= BORDER_SINE);
    // Beyond the near plane (or so little before it that it is rounding).
    let drawn = window.forward().dot(hit) >= window.near_m() * (1.0 - 1.0e-9);
    (one_way && t > 0.0 && drawn).then_some(t * (1.0 - 1.0e-9))
}

/// Points of a box that are in the window: corners, middles of faces and edges, the centre; from the eye.
pub(crate) fn points_of_box(window: &ViewWindow, bounds: &Aabb) -> Vec<DVec3> {
    let mut points = Vec::with_capacity(27);
    for i in 0..27 {
        let pick = |k: usize, low: f32, high: f32| [low, 0.5 * (low + high), high][k];
        let p = Vec3::new(
            pick(i % 3, bounds.min.x, bounds.max.x),
            pick(i / 3 % 3, bounds.min.y, bounds.max.y),
            pick(i / 9, bounds.min.z, bounds.max.z),
        );
        points.push(window.from_eye(p));
    }
    points.retain(|x| is_in_window(window, *x));
    points
}

/// Points of a ball that are in the window, from the eye.
pub(crate) fn points_of_ball(window: &ViewWindow, ball: &Sphere) -> Vec<DVec3> {
    let center = window.from_eye(ball.center);
    let mut points = vec![center];
    for i in 0..27 {
        let step = |k: usize| k as f64 - 1.0;
        let direction = DVec3::new(step(i % 3), step(i / 3 % 3), step(i / 9)).normalize_or_zero();
        points.push(center + direction * f64::from(ball.radius_m));
    }
    points.retain(|x| is_in_window(window, *x));
    points
}
