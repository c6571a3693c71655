//! Drawing aids: straight lines, a mirror, and a brush of constant width on the screen.

use std::collections::BTreeMap;

use glam::Vec3;

use crate::{navigator::pixel_m, pen::Brush, studio::Studio};
use osp::view::View;
use osp_render::{Depth, LineBatch, LineColor};
use osp_session::recording::{Author, Event, Motion, StrokeId};

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aids {
    /// Whether strokes are straight, as with Shift.
    pub straight: bool,
    /// The x coordinate of the mirror plane, metres. The plane is perpendicular to the x axis. Each stroke is also
    /// drawn mirrored. `None` without a mirror.
    pub mirror_x: Option<f32>,
    /// Width of the brush on the screen, pixels; its width in the model then depends on the distance.
    pub width_px: Option<f32>,
}

/// For each unfinished stroke, its mirror image and the reflection.
#[derive(Clone, Debug, Default)]
pub(super) struct MirrorStrokes(pub(super) BTreeMap<StrokeId, (StrokeId, Motion)>);

impl Studio {
    pub fn aids(&self) -> Aids {
        self.input.aids
    }

    pub(crate) fn set_aids(&mut self, aids: Aids) {
        self.finish_gestures();
        self.input.aids = aids;
        self.follow_width();
    }

    /// Size of a pixel in the centre of the view, metres.
    pub(crate) fn middle_pixel_m(&self) -> f32 {
        let view = self.navigator.view(self.last_aspect, &self.session.bounds());
        pixel_m(&view, self.navigator.distance_m(), self.last_height_px)
    }

    /// Width of the brush in the centre of the view, pixels.
    pub fn width_px(&self) -> f32 {
        self.input.brush.width_m / self.middle_pixel_m()
    }

    /// Adapts the brush width to the camera, so that the width in pixels stays the same.
    pub(crate) fn follow_width(&mut self) {
        if let Some(width_px) = self.input.aids.width_px {
            let (narrowest, widest) = Brush::WIDTHS_M;
            self.input.brush.width_m = (width_px * self.middle_pixel_m()).clamp(narrowest, widest);
        }
    }

    /// Stores the brush width in pixels after the user has changed it.
    pub(crate) fn take_width(&mut self) {
        if self.input.aids.width_px.is_some() {
            self.input.aids.width_px = Some(self.width_px());
        }
    }

    /// The brush with its width at a point of the model.
    pub(crate) fn brush_at(&self, view: &View, p: Vec3, height_px: f32) -> Brush {
        let Some(width_px) = self.input.aids.width_px else { return self.input.brush };
        let distance_m = (p - view.eye_in_world).dot(view.forward_in_world());
        let width_m = width_px * pixel_m(view, distance_m.max(view.projection.near_m), height_px);
        Brush { width_m: width_m.clamp(Brush::WIDTHS_M.0, Brush::WIDTHS_M.1), ..self.input.brush }
    }

    /// Adds the mirror images of the strokes that the pending events draw, from the event with index `first` on.
    pub(crate) fn mirror_events(&mut self, first: usize) {
        if self.input.aids.mirror_x.is_none() && self.input.twins.0.is_empty() {
            return;
        }
        let drawn = self.events.split_off(first.min(self.events.len()));
        for event in drawn {
            match &event {
                Event::Begin { t, stroke, .. } => {
                    let Some((x, twin)) = self.input.aids.mirror_x.zip(self.new_stroke()) else {
                        self.events.push(event);
                        continue;
                    };
                    self.input.twins.0.insert(*stroke, (twin, Motion::mirror_x(x)));
                    let mut image = event.clone();
                    if let Event::Begin { stroke, .. } = &mut image {
                        *stroke = twin;
                    }
                    self.events.extend([Event::Step { author: Author::SOLE, t: *t, edits: 2 }, event, image]);
                }
                Event::Point { t, stroke, p, q, pressure } => {
                    let image = self.input.twins.0.get(stroke).map(|(twin, motion)| Event::Point {
                        t: *t,
                        stroke: *twin,
                        p: motion.point(*p),
                        q: motion.orientation(*q),
                        pressure: *pressure,
                    });
                    self.events.push(event);
                    self.events.extend(image);
                }
                Event::End { t, stroke } => {
                    let image = self.input.twins.0.remove(stroke);
                    let image = image.map(|(twin, _)| Event::End { t: *t, stroke: twin });
                    self.events.push(event);
                    self.events.extend(image);
                }
                _ => self.events.push(event),
            }
        }
    }

    pub(crate) fn twin_of(&self, stroke: Option<StrokeId>) -> Option<StrokeId> {
        self.input.twins.0.get(&stroke?).map(|(twin, _)| *twin)
    }

    /// Draws the mirror around the centre of the view, and the unfinished straight line.
    pub(crate) fn draw_aids(&mut self) {
        if let Some(x) = self.input.aids.mirror_x {
            let middle = Vec3::new(x, self.navigator.target().y, self.navigator.target().z);
            draw_mirror(middle, self.navigator.distance_m() * 0.5, &mut self.shown.lines);
        }
        if let Some((from, to)) = self.input.pen.line() {
            let [r, g, b, _] = self.input.brush.color.map(|c| (c.clamp(0.0, 1.0) * 255.0) as u8);
            self.shown.lines.line(from, to, [r, g, b, 255], Depth::Through);
            if let Some(x) = self.input.aids.mirror_x {
                let mirror = Motion::mirror_x(x);
                self.shown.lines.line(mirror.point(from), mirror.point(to), [r, g, b, 150], Depth::Through);
            }
        }
    }
}

fn draw_mirror(middle: Vec3, half_m: f32, out: &mut LineBatch) {
    const COLOR: LineColor = [120, 200, 255, 110];
    let (y, z) = (Vec3::Y * half_m, Vec3::Z * half_m);
    out.outline(&[middle - y - z, middle + y - z, middle + y + z, middle - y + z], COLOR, Depth::Hidden);
    out.line(middle - y, middle + y, COLOR, Depth::Hidden);
    out.line(middle - z, middle + z, COLOR, Depth::Hidden);
}
