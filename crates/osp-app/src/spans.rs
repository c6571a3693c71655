//! Two picked points: the distance between them, and the strokes in their box or sphere.

use glam::{Vec2, Vec3};

use crate::{
    layers::circle,
    navigator::on_plane_through,
    studio::Studio,
    tool::{Span, ToolChoice},
};
use osp::{
    math::{Aabb, Sphere},
    polygon::ConvexPolygon,
};
use osp_render::{Depth, LineBatch, LineColor};

/// A region of space in which strokes are selected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    Box(Aabb),
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

    pub(super) fn touches(&self, polygon: &ConvexPolygon) -> bool {
        match self {
            Self::Box(bounds) => polygon.touches(bounds),
            Self::Sphere(sphere) => polygon.distance_m(sphere.center) <= sphere.radius_m,
        }
    }
}

pub(super) fn draw_span(span: Span, from: Vec3, to: Vec3, out: &mut LineBatch) {
    const COLOR: LineColor = [120, 255, 200, 255];
    match Part::of(span, from, to) {
        None => {}
        Some(Part::Box(bounds)) => out.aabb(&bounds, COLOR, Depth::Through),
        Some(Part::Sphere(Sphere { center, radius_m })) => {
            for (right, up) in [(Vec3::X, Vec3::Y), (Vec3::Y, Vec3::Z), (Vec3::Z, Vec3::X)] {
                let corners = circle::<32>(center, right * radius_m, up * radius_m);
                out.outline(&corners, COLOR, Depth::Through);
            }
        }
    }
    out.line(from, to, COLOR, Depth::Through);
}

impl Studio {
    /// The two points of the last measured distance.
    pub fn measured(&self) -> Option<(Vec3, Vec3)> {
        self.input.measured
    }

    /// The point of the model under the pointer; if there is none, the point at the depth of `from`.
    pub(crate) fn span_point(&mut self, at: Vec2, size_px: Vec2, from: Option<Vec3>) -> Option<Vec3> {
        if let Some((_, point)) = self.stroke_under(at, size_px) {
            return Some(point);
        }
        let (view, on_screen) = self.view_at(at, size_px.x / size_px.y.max(1.0))?;
        from.map(|from| on_plane_through(&view, on_screen, from))
    }

    /// Ends the choice of two points: measures their distance or selects strokes.
    pub(crate) fn end_span(&mut self, span: Span, from: Vec3, to: Vec3, adds: bool) {
        let Some(part) = Part::of(span, from, to) else {
            self.input.measured = Some((from, to));
            return;
        };
        let mut strokes = self.strokes_in(&part);
        if adds {
            strokes.extend_from_slice(self.input.selection.strokes());
        }
        self.input.selection.set(strokes);
        self.deselect_locked();
    }

    /// The two points to show: the points being chosen, or else the ends of the last measured distance.
    pub(crate) fn shown_span(&self) -> Option<(Span, Vec3, Vec3)> {
        let is_measuring = self.input.tool == ToolChoice::Span(Span::Distance);
        let measured = self.input.measured.filter(|_| is_measuring);
        self.input.gestures.span().or(measured.map(|(from, to)| (Span::Distance, from, to)))
    }
}
