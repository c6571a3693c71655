//! Measures a distance, or selects strokes in a box or sphere, between two points of the model.

use glam::{Vec2, Vec3};

use crate::{
    navigator::on_plane_through,
    spans::Part,
    studio::Studio,
    tool::{Span, ToolChoice},
};

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
