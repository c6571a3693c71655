//! Two picked points: the distance between them, and the strokes in their box or sphere.

use glam::Vec3;

use super::tool::Span;
use osp::{
    math::{Aabb, Sphere},
    polygon::ConvexPolygon,
};
use osp_render::{Depth, LineBatch, LineColor};

/// A region of space in which strokes are selected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    /// A box.
    Box(Aabb),
    /// A sphere.
    Sphere(Sphere),
}

impl Part {
    /// The box or sphere of two points; `None` for a distance.
    pub(super) fn of(span: Span, from: Vec3, to: Vec3) -> Option<Self> {
        match span {
            Span::Distance => None,
            Span::Box => {
                // The margin compensates rounding errors: without it, a flat box could miss points of a surface.
                let more = Vec3::splat(from.distance(to) * 1.0e-3);
                Some(Self::Box(Aabb::new(from.min(to) - more, from.max(to) + more)))
            }
            Span::Sphere => Some(Self::Sphere(Sphere { center: from, radius_m: from.distance(to) })),
        }
    }

    /// Whether a polygon intersects the region.
    pub(super) fn touches(&self, polygon: &ConvexPolygon) -> bool {
        match self {
            Self::Box(bounds) => polygon.touches(bounds),
            Self::Sphere(sphere) => polygon.distance_m(sphere.center) <= sphere.radius_m,
        }
    }
}

/// Draws two points, and the line, box or sphere between them.
pub(super) fn draw_span(span: Span, from: Vec3, to: Vec3, out: &mut LineBatch) {
    const COLOR: LineColor = [120, 255, 200, 255];
    const CORNERS: usize = 32;
    match Part::of(span, from, to) {
        None => {}
        Some(Part::Box(bounds)) => out.aabb(&bounds, COLOR, Depth::Through),
        Some(Part::Sphere(Sphere { center, radius_m })) => {
            for (right, up) in [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)] {
                let corners: [Vec3; CORNERS] = std::array::from_fn(|i| {
                    let angle = i as f32 / CORNERS as f32 * std::f32::consts::TAU;
                    center + (right * angle.cos() + up * angle.sin()) * radius_m
                });
                out.outline(&corners, COLOR, Depth::Through);
            }
        }
    }
    out.line(from, to, COLOR, Depth::Through);
}
