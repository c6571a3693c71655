//! Splits polygons of any number of corners into convex pieces of three or four.
//!
//! Ear clipping after G. H. Meisters, "Polygons Have Ears", 1975; the normal is Newell's sum over the edges.

use glam::Vec3;

use super::Drops;
use super::polygon::{push_checked, push_quad};
use osp::polygon::ConvexPolygon;

/// Largest number of further searches for ears after none was found. It bounds the work for outlines without ears.
const LOOKS_AGAIN: u32 = 8;

/// The normal by Newell's sum. Its length is twice the area. It is robust for non-planar and concave outlines.
fn newell_normal(corners: &[Vec3]) -> Vec3 {
    let Some(&first) = corners.first() else { return Vec3::ZERO };
    (0..corners.len())
        .map(|i| (corners[i] - first).cross(corners[(i + 1) % corners.len()] - first))
        .fold(Vec3::ZERO, |sum, v| sum + v)
}

/// Projects the corners onto the plane through their mean, perpendicular to Newell's normal.
pub(super) fn flatten(corners: &mut [Vec3]) {
    let normal = newell_normal(corners).normalize_or_zero();
    let count = corners.len().max(1) as f32;
    let center = corners.iter().fold(Vec3::ZERO, |sum, &p| sum + p / count);
    for p in corners {
        *p -= normal * normal.dot(*p - center);
    }
}

/// Appends a polygon of three or more corners as convex pieces. O(n) for a convex outline, O(n^2) otherwise. Fewer than
/// three corners count as degenerate.
pub fn split_into_convex(corners: &[Vec3], out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
    match *corners {
        [] | [_] | [_, _] => drops.degenerate += 1,
        [a, b, c] => push_checked(ConvexPolygon::triangle(a, b, c), out, drops),
        [a, b, c, d] if is_convex(corners) => push_quad([a, b, c, d], out, drops),
        _ if is_convex(corners) => push_fan(corners, out, drops),
        _ => clip_ears(corners, out, drops),
    }
}

fn is_convex(corners: &[Vec3]) -> bool {
    let normal = newell_normal(corners);
    let n = corners.len();
    // The sum of turning angles is not checked: a star polygon passes, and its fan still covers it.
    (0..n).all(|i| {
        let (a, b, c) = (corners[i], corners[(i + 1) % n], corners[(i + 2) % n]);
        (b - a).cross(c - b).dot(normal) >= 0.0
    })
}

/// Appends quads (and a last triangle) around the first corner.
fn push_fan(corners: &[Vec3], out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
    let mut i = 1;
    while i + 1 < corners.len() {
        if i + 2 < corners.len() {
            push_quad([corners[0], corners[i], corners[i + 1], corners[i + 2]], out, drops);
            i += 2;
        } else {
            push_checked(ConvexPolygon::triangle(corners[0], corners[i], corners[i + 1]), out, drops);
            i += 1;
        }
    }
}

fn clip_ears(corners: &[Vec3], out: &mut Vec<ConvexPolygon>, drops: &mut Drops) {
    let normal = newell_normal(corners);
    let mut left: Vec<Vec3> = corners.to_vec();
    let ears_of = |left: &[Vec3]| (0..left.len()).map(|i| is_ear(left, i, normal)).collect::<Vec<bool>>();
    let mut ears = ears_of(&left);
    let mut looks_again = LOOKS_AGAIN;
    while left.len() > 3 {
        let mut found = ears.iter().position(|&ear| ear);
        // If the outline touches itself, the corner that lay inside an ear may have been removed since.
        if found.is_none() && looks_again > 0 {
            looks_again -= 1;
            ears = ears_of(&left);
            found = ears.iter().position(|&ear| ear);
        }
        // A self-crossing outline may have no ear. Then any corner is cut off. The pieces still cover the outline's
        // corners.
        let i = found.unwrap_or(0);
        let n = left.len();
        push_checked(ConvexPolygon::triangle(left[(i + n - 1) % n], left[i], left[(i + 1) % n]), out, drops);
        left.remove(i);
        ears.remove(i);
        // Only the two neighbours have new edges.
        let n = left.len();
        for neighbour in [(i + n - 1) % n, i % n] {
            ears[neighbour] = is_ear(&left, neighbour, normal);
        }
    }
    push_checked(ConvexPolygon::triangle(left[0], left[1], left[2]), out, drops);
}

/// Whether corner `i` is an ear: it turns left, and no other corner lies in the triangle with its neighbours.
fn is_ear(left: &[Vec3], i: usize, normal: Vec3) -> bool {
    let n = left.len();
    let (a, b, c) = (left[(i + n - 1) % n], left[i], left[(i + 1) % n]);
    let turns_left = (b - a).cross(c - b).dot(normal) > 0.0;
    turns_left && !left.iter().any(|&p| p != a && p != b && p != c && in_triangle(p, [a, b, c], normal))
}

fn in_triangle(p: Vec3, [a, b, c]: [Vec3; 3], normal: Vec3) -> bool {
    let inside = |s: Vec3, e: Vec3| (e - s).cross(p - s).dot(normal) >= 0.0;
    inside(a, b) && inside(b, c) && inside(c, a)
}
