use glam::{Quat, Vec2, Vec3};

use super::{
    navigator::{on_plane_through, pixel_m},
    paint_layers::on_layer,
};
use osp::{math::rotate, view::View};
use osp_session::{
    brush,
    recording::{Author, Event, NormalRule, Paint, StrokeId, Tool},
};

/// Smallest distance between the samples of a ribbon or tube, pixels. A mouse reports whole pixels, so the direction
/// between neighbouring pixels is noise.
const SAMPLE_PX: f32 = 2.5;
/// Smallest distance between a wall's corners, pixels. A wall is split into convex pieces, and each corner adds a
/// piece.
const CORNER_PX: f32 = 14.0;
/// Smallest distance between samples, as a fraction of the width, at which a stroke does not fold over itself.
const SAMPLE_WIDTH: f32 = 0.15;
/// Distance between the samples of a straight line, in widths. A long line has [`MOST_LINE_PARTS`] evenly spaced
/// samples.
const LINE_WIDTHS: f32 = 1.0;
/// Largest number of samples of a straight line.
const MOST_LINE_PARTS: f32 = 256.0;
/// Width at pressure 0 divided by the full width.
const THINNEST: f32 = 0.1;

/// The settings of the pen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brush {
    pub tool: Tool,
    /// The brush of ribbons; `None` for plain ribbons.
    pub paint: Option<&'static brush::Brush>,
    /// Full width, metres.
    pub width_m: f32,
    /// Red, green, blue, opacity, sRGB.
    pub color: [f32; 4],
    /// The layer of new strokes.
    pub layer: u32,
}

impl Brush {
    /// Limits of the width, metres.
    pub const WIDTHS_M: (f32, f32) = (1.0e-4, 100.0);

    /// The brush for the current tool. Only ribbons have a brush.
    pub fn paint(&self) -> Option<&'static brush::Brush> {
        self.paint.filter(|_| self.tool == Tool::Ribbon)
    }

    /// Makes the pen wider or narrower by steps.
    pub fn widen(&mut self, steps: f32) {
        self.width_m = (self.width_m * 1.15f32.powf(steps)).clamp(Self::WIDTHS_M.0, Self::WIDTHS_M.1);
    }
}

impl Default for Brush {
    fn default() -> Self {
        Self { tool: Tool::Ribbon, paint: None, width_m: 0.04, color: [0.95, 0.62, 0.2, 1.0], layer: 0 }
    }
}

/// Rule for the depth of a stroke.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Snap {
    /// The plane parallel to the window through the stroke's first point. A stroke begins on the surface under the
    /// cursor, or else at the depth of the view's centre.
    #[default]
    Start,
    /// The surface under the cursor along the whole stroke; without a surface, the plane of [`Snap::Start`].
    Surface,
    /// The plane parallel to the window through the centre of the view.
    Off,
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    p: Vec3,
    q: Quat,
    pressure: f32,
}

/// An unfinished stroke.
#[derive(Clone, Debug)]
struct Drawing {
    stroke: StrokeId,
    brush: Brush,
    /// A point of the drawing plane.
    anchor: Vec3,
    last: Sample,
    /// The pointer's latest position, if it is too near to the last sample to become a sample.
    pending: Option<Sample>,
    /// Whether the stroke's first event is in the session; a press without a movement gives no stroke.
    has_begun: bool,
    /// The end of an unfinished straight line, which has no event yet.
    line_to: Option<Sample>,
    /// The corners of an unfinished wall, which appears only when it is finished.
    outline: Vec<Vec3>,
}

/// A pen that draws with the pointer on a plane that faces the viewer.
#[derive(Clone, Debug, Default)]
pub struct Pen {
    drawing: Option<Drawing>,
}

/// The pointer's position, and the view and surface under it.
#[derive(Clone, Copy, Debug)]
pub struct PenPoint<'a> {
    /// The view under the pointer.
    pub view: &'a View,
    /// Position, -1 to 1 from left to right and from the lower to the upper border.
    pub at: Vec2,
    /// Height of the window, pixels.
    pub height_px: f32,
    /// The point of the model under the pointer, if any.
    pub surface: Option<Vec3>,
    /// The centre of the view: the point around which the camera orbits.
    pub target: Vec3,
    /// Pressure, 0 to 1; 1 without a pressure-sensitive pen.
    pub pressure: f32,
}

impl PenPoint<'_> {
    /// The point under the pointer on the plane through `anchor` parallel to the window.
    fn on_plane(&self, anchor: Vec3) -> Vec3 {
        on_plane_through(self.view, self.at, anchor)
    }

    /// Orientation of a stroke that lies parallel to the window. The x axis of the pose is a plain ribbon's normal and
    /// points to the viewer. For a brush, the pose is the orientation of the view.
    fn orientation(&self, brush: &Brush) -> Quat {
        let q = self.view.world_from_view;
        if brush.paint().is_some() {
            return q;
        }
        let (right, up, back) = (rotate(q, Vec3::X), rotate(q, Vec3::Y), rotate(q, Vec3::Z));
        Quat::from_rotation_axes(back, up, -right).normalize()
    }

    fn sample(&self, p: Vec3, brush: &Brush) -> Sample {
        Sample { p, q: self.orientation(brush), pressure: self.pressure }
    }

    fn distance_m(&self, p: Vec3) -> f32 {
        (p - self.view.eye_in_world).dot(self.view.forward_in_world())
    }
}

impl Pen {
    /// Whether a stroke is being drawn.
    pub fn is_drawing(&self) -> bool {
        self.drawing.is_some()
    }

    /// The unfinished stroke.
    pub fn stroke(&self) -> Option<StrokeId> {
        self.drawing.as_ref().map(|drawing| drawing.stroke)
    }

    /// A point of the plane of the unfinished stroke.
    pub fn anchor(&self) -> Option<Vec3> {
        self.drawing.as_ref().map(|drawing| drawing.anchor)
    }

    /// The ends of an unfinished straight line.
    pub fn line(&self) -> Option<(Vec3, Vec3)> {
        let drawing = self.drawing.as_ref()?;
        Some((drawing.last.p, drawing.line_to?.p))
    }

    /// The corners of an unfinished wall.
    pub fn outline(&self) -> &[Vec3] {
        self.drawing.as_ref().map_or(&[], |drawing| &drawing.outline)
    }

    /// The start of a stroke that would begin at this position.
    pub fn aim(point: &PenPoint<'_>, snap: Snap) -> Vec3 {
        match (snap, point.surface) {
            (Snap::Start | Snap::Surface, Some(surface)) => surface,
            _ => point.on_plane(point.target),
        }
    }

    /// Begins a stroke.
    pub fn press(
        &mut self,
        t: f64,
        stroke: StrokeId,
        brush: Brush,
        snap: Snap,
        point: &PenPoint<'_>,
        out: &mut Vec<Event>,
    ) {
        self.release(t, out);
        let anchor = Self::aim(point, snap);
        let outline = if brush.tool == Tool::Wall { vec![anchor] } else { Vec::new() };
        let last = point.sample(anchor, &brush);
        self.drawing = Some(Drawing {
            stroke,
            brush,
            anchor,
            last,
            pending: None,
            has_begun: false,
            line_to: None,
            outline,
        });
    }

    /// Continues the stroke. A straight stroke is a line to the point of release, unless the stroke has begun freehand.
    /// Walls have no straight edges.
    pub fn drag(
        &mut self,
        t: f64,
        snap: Snap,
        is_straight: bool,
        point: &PenPoint<'_>,
        out: &mut Vec<Event>,
    ) {
        let Some(drawing) = &mut self.drawing else { return };
        let p = match (snap, point.surface) {
            (Snap::Surface, Some(surface)) => surface,
            _ => point.on_plane(drawing.anchor),
        };
        let is_wall = drawing.brush.tool == Tool::Wall;
        let pixels = if is_wall { CORNER_PX } else { SAMPLE_PX };
        let by_pixels = pixels * pixel_m(point.view, point.distance_m(p), point.height_px);
        let apart_m = if is_wall { by_pixels } else { by_pixels.max(SAMPLE_WIDTH * drawing.brush.width_m) };
        let sample = point.sample(p, &drawing.brush);
        let is_line = is_straight && !is_wall && !drawing.has_begun;
        drawing.line_to = is_line.then_some(sample).filter(|_| p.distance(drawing.last.p) >= apart_m);
        if is_line {
            return;
        }
        if p.distance(drawing.last.p) < apart_m {
            drawing.pending = Some(sample);
            return;
        }
        drawing.begin(t, out);
        drawing.pending = None;
        drawing.last = sample;
        if is_wall {
            drawing.outline.push(p);
        }
        out.push(sample.event(t, drawing.stroke));
    }

    /// Drops a stroke without events, such as an unfinished straight line. Returns whether a stroke with events is left.
    pub(super) fn drop_line(&mut self) -> bool {
        self.drawing = self.drawing.take().filter(|drawing| drawing.has_begun);
        self.drawing.is_some()
    }

    /// Ends the stroke, if there is one, at the pointer.
    pub fn release(&mut self, t: f64, out: &mut Vec<Event>) {
        let Some(mut drawing) = self.drawing.take() else { return };
        drawing.draw_line(t, out);
        if !drawing.has_begun {
            return;
        }
        let stroke = drawing.stroke;
        if let Some(sample) = drawing.pending.filter(|_| drawing.brush.tool != Tool::Wall) {
            out.push(sample.event(t, stroke));
        }
        out.push(Event::End { t, stroke });
    }
}

impl Drawing {
    /// Adds the events of the straight line, with evenly spaced samples.
    fn draw_line(&mut self, t: f64, out: &mut Vec<Event>) {
        let Some(end) = self.line_to.take() else { return };
        let start = self.last;
        self.begin(t, out);
        let apart_m = (self.brush.width_m * LINE_WIDTHS).max(f32::MIN_POSITIVE);
        let parts = (start.p.distance(end.p) / apart_m).ceil().clamp(1.0, MOST_LINE_PARTS);
        for part in 1..=parts as u32 {
            let along = part as f32 / parts;
            let pressure = start.pressure + (end.pressure - start.pressure) * along;
            let sample = Sample { p: start.p.lerp(end.p, along), q: start.q, pressure };
            out.push(sample.event(t, self.stroke));
        }
    }

    /// Adds the events of the stroke's beginning and its first sample.
    fn begin(&mut self, t: f64, out: &mut Vec<Event>) {
        if std::mem::replace(&mut self.has_begun, true) {
            return;
        }
        let [r, g, b, a] = self.brush.color;
        out.push(Event::Begin {
            author: Author::SOLE,
            t,
            stroke: self.stroke,
            tool: self.brush.tool,
            width: self.brush.width_m,
            color: (r, g, b, a),
            normal: if self.brush.paint().is_some() { NormalRule::Travel } else { NormalRule::LocalX },
            thinnest: THINNEST,
            paint: on_layer(
                self.brush.paint().map(|brush| Box::new(Paint::new(&*brush.name, self.stroke.0))),
                self.brush.layer,
            ),
        });
        out.push(self.last.event(t, self.stroke));
    }
}

impl Sample {
    fn event(self, t: f64, stroke: StrokeId) -> Event {
        let Self { p, q, pressure } = self;
        Event::Point { t, stroke, p, q, pressure }
    }
}
