//! Changed copies of strokes: moved, rotated, scaled, mirrored, or with another colour or width.

use glam::{Quat, Vec3};

use super::{Author, Event, Paint, StrokeId, Transform};
use osp::math::{rotate, unit};

/// A similarity transform with an optional reflection. It negates x first, then scales, rotates and translates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    pub is_mirrored: bool,
    /// The transform after the reflection.
    pub to: Transform,
}

impl Motion {
    pub const STAY: Self =
        Self { is_mirrored: false, to: Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0 } };

    /// A translation, metres.
    pub fn by(way: Vec3) -> Self {
        Self { to: Transform { p: way, ..Self::STAY.to }, ..Self::STAY }
    }

    /// A rotation and scale about a fixed point.
    pub fn about(middle: Vec3, turn: Quat, scale: f32) -> Self {
        let p = middle - rotate(turn, middle * scale);
        Self { to: Transform { p, q: turn, s: scale }, ..Self::STAY }
    }

    /// A reflection in the plane perpendicular to the x axis at `x`.
    pub fn mirror_x(x: f32) -> Self {
        Self { is_mirrored: true, ..Self::by(Vec3::new(2.0 * x, 0.0, 0.0)) }
    }

    pub fn point(&self, p: Vec3) -> Vec3 {
        let p = if self.is_mirrored { Vec3::new(-p.x, p.y, p.z) } else { p };
        rotate(self.to.q, p * self.to.s) + self.to.p
    }

    /// Transforms the direction of a normal.
    fn direction(&self, normal: Vec3) -> Vec3 {
        rotate(self.to.q, if self.is_mirrored { Vec3::new(-normal.x, normal.y, normal.z) } else { normal })
    }

    /// Transforms the orientation of a hand. The mirror image of a pose is left-handed, so a reflection also reverses
    /// the pose's x axis.
    pub fn orientation(&self, q: Quat) -> Quat {
        let q = if self.is_mirrored { mirrored(q) } else { q };
        unit(self.to.q * q)
    }

    /// The composition: this motion, then `next`.
    pub fn then(&self, next: &Self) -> Self {
        let q = if next.is_mirrored { mirrored(self.to.q) } else { self.to.q };
        let to = Transform { p: next.point(self.to.p), q: unit(next.to.q * q), s: self.to.s * next.to.s };
        Self { is_mirrored: self.is_mirrored != next.is_mirrored, to }
    }

    /// The inverse; `None` if this motion scales everything to a point.
    pub fn inverse(&self) -> Option<Self> {
        let s = 1.0 / self.to.s;
        let back = self.to.q.conjugate();
        let q = if self.is_mirrored { mirrored(back) } else { back };
        let turned = Self { is_mirrored: self.is_mirrored, to: Transform { p: Vec3::ZERO, q, s } };
        let p = -turned.point(self.to.p);
        let is_finite = p.is_finite() && s.is_finite();
        is_finite.then_some(Self { to: Transform { p, ..turned.to }, ..turned })
    }
}

/// The rotation `q` in mirrored space: conjugated by the reflection of x.
fn mirrored(q: Quat) -> Quat {
    Quat::from_xyzw(q.x, -q.y, -q.z, q.w)
}

/// The changes of a copy of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alteration {
    /// The motion, in the space of the stroke's points. The width changes with the scale.
    pub motion: Motion,
    /// The colour, sRGB with opacity; `None` keeps the stroke's colour.
    pub color: Option<(f32, f32, f32, f32)>,
    /// The width, metres; `None` scales the stroke's width with the motion.
    pub width_m: Option<f32>,
}

impl Alteration {
    /// A copy that differs only in its number.
    pub const NONE: Self = Self { motion: Motion::STAY, color: None, width_m: None };

    /// Returns the events of a copy of a stroke, in order. `events` contain the stroke's events; events of other
    /// strokes are skipped. Every copied event gets the time `t`. The copy ends even if the stroke is unfinished.
    pub fn copy<'e>(
        &self,
        events: impl IntoIterator<Item = &'e Event>,
        of: StrokeId,
        copy: StrokeId,
        t: f64,
    ) -> Vec<Event> {
        #[derive(PartialEq)]
        enum State {
            Before,
            Drawing,
            After,
        }
        let moves = self.motion != Motion::STAY;
        let (mut out, mut state) = (Vec::new(), State::Before);
        for event in events {
            match event {
                Event::Begin { stroke, .. } if *stroke == of && state == State::Before && out.is_empty() => {
                    state = State::Drawing;
                    out.push(self.begin(event, copy, t));
                }
                Event::Point { stroke, p, q, pressure, .. } if *stroke == of && state == State::Drawing => {
                    let (p, q) =
                        if moves { (self.motion.point(*p), self.motion.orientation(*q)) } else { (*p, *q) };
                    out.push(Event::Point { t, stroke: copy, p, q, pressure: *pressure });
                }
                Event::End { stroke, .. } if *stroke == of && state == State::Drawing => {
                    state = State::After;
                    out.push(Event::End { t, stroke: copy });
                }
                Event::Polygon { stroke: Some(stroke), vertices, shading, color, .. } if *stroke == of => {
                    let (mut vertices, mut shading) = (vertices.clone(), shading.clone());
                    if moves {
                        vertices.iter_mut().for_each(|p| *p = self.motion.point(*p));
                        for normal in shading.iter_mut().flat_map(|shading| &mut shading.normals) {
                            *normal = self.motion.direction(*normal);
                        }
                    }
                    let color = self.color.unwrap_or(*color);
                    out.push(Event::Polygon {
                        author: Author::SOLE,
                        t,
                        stroke: Some(copy),
                        vertices,
                        shading,
                        color,
                    });
                }
                _ => {}
            }
        }
        if state == State::Drawing {
            out.push(Event::End { t, stroke: copy });
        }
        out
    }

    fn begin(&self, event: &Event, copy: StrokeId, t: f64) -> Event {
        let mut begin = event.clone();
        if let Event::Begin { author, t: time, stroke, width, color, paint, .. } = &mut begin {
            // The author who makes the copy owns it, not the author of the stroke.
            (*author, *time, *stroke) = (Author::SOLE, t, copy);
            *width = self.width_m.unwrap_or(*width * self.motion.to.s);
            *color = self.color.unwrap_or(*color);
            if let Some(paint) = paint {
                let scale = paint.scale * self.motion.to.s;
                **paint = Paint { scale, ..(**paint).clone() };
            }
        }
        begin
    }
}
