//! From bytes to numbers, places, views and events. Bytes that have run out give zeros: every input has an end.

use arbitrary::Unstructured;
use osp::{
    glam::{Quat, Vec3},
    math::COORDINATE_LIMIT_M,
    view::{Projection, View},
};
use osp_session::recording::{Author, Event, GroupId, NormalRule, Paint, StrokeId, Tool, Transform};

pub type Input<'a> = Unstructured<'a>;

/// A number from 0 to below `n`.
pub fn below(u: &mut Input<'_>, n: usize) -> usize {
    u.int_in_range(0..=n - 1).unwrap_or(0)
}

pub fn chance(u: &mut Input<'_>, one_in: usize) -> bool {
    below(u, one_in) == one_in - 1
}

/// From -1 to 1, in steps that meet 0, halves and quarters exactly.
pub fn signed(u: &mut Input<'_>) -> f32 {
    f32::from(u.arbitrary::<i16>().unwrap_or(0) >> 2) / 8192.0
}

/// From 0 to 1.
pub fn unit(u: &mut Input<'_>) -> f32 {
    f32::from(u.arbitrary::<u16>().unwrap_or(0) >> 2) / 16384.0
}

/// In the room, often on a plane that halves it; seldom anything that a session may hold.
pub fn coordinate(u: &mut Input<'_>) -> f32 {
    match below(u, 16) {
        0..=8 => signed(u) * 2.0,
        9..=13 => (below(u, 33) as f32 - 16.0) * 0.125,
        14 => [0.0, -0.0, 1.0e-40, 1.0e6, -3.0e10, COORDINATE_LIMIT_M][below(u, 6)],
        _ => {
            let any = f32::from_bits(u.arbitrary().unwrap_or(0));
            if any.is_finite() { any.clamp(-COORDINATE_LIMIT_M, COORDINATE_LIMIT_M) } else { 0.5 }
        }
    }
}

pub fn point(u: &mut Input<'_>) -> Vec3 {
    Vec3::new(coordinate(u), coordinate(u), coordinate(u))
}

/// In the room, nowhere else.
pub fn near_point(u: &mut Input<'_>) -> Vec3 {
    Vec3::new(signed(u), signed(u), signed(u)) * 2.0
}

pub fn rotation(u: &mut Input<'_>) -> Quat {
    let q = Quat::from_xyzw(signed(u), signed(u), signed(u), signed(u));
    if q.length_squared() < 1.0e-4 { Quat::IDENTITY } else { q.normalize() }
}

pub fn view(u: &mut Input<'_>) -> View {
    let mut eye = near_point(u) * 2.0;
    if chance(u, 8) {
        eye = eye.round();
    }
    if chance(u, 8) {
        eye += Vec3::new(signed(u), signed(u), signed(u)) * 10_000.0;
    }
    let near_m = [0.01, 0.05, 0.25][below(u, 3)];
    // Beyond everything: what lies behind the far plane is not drawn.
    let far_m = 1.0e5;
    let projection = match below(u, 4) {
        0 => {
            let (left, bottom) = (signed(u), signed(u));
            let (right, top) = (left + 0.1 + unit(u), bottom + 0.1 + unit(u));
            Projection { left, right, bottom, top, near_m, far_m }
        }
        _ => Projection::symmetric(30.0 + 90.0 * unit(u), 0.5 + 1.5 * unit(u), near_m, far_m),
    };
    if chance(u, 4) {
        return View { eye_in_world: eye, world_from_view: rotation(u), projection };
    }
    View::look_at(eye, near_point(u), projection)
}

/// Strokes and groups are few, so that events meet the same ones again.
fn stroke(u: &mut Input<'_>) -> StrokeId {
    StrokeId(if chance(u, 40) { u32::MAX } else { below(u, 8) as u32 })
}

fn group(u: &mut Input<'_>) -> GroupId {
    GroupId(below(u, 5) as u32)
}

fn strokes(u: &mut Input<'_>) -> Vec<StrokeId> {
    (0..below(u, 4)).map(|_| stroke(u)).collect()
}

fn color(u: &mut Input<'_>) -> (f32, f32, f32, f32) {
    (unit(u), unit(u), unit(u), if chance(u, 4) { unit(u) } else { 1.0 })
}

pub fn time(u: &mut Input<'_>) -> f64 {
    if chance(u, 16) {
        let any = f64::from_bits(u.arbitrary().unwrap_or(0));
        return if any.is_finite() { any } else { 0.0 };
    }
    f64::from(unit(u)) * 100.0
}

/// A brush, now and then one that nobody knows, now and then on a hidden layer.
fn paint(u: &mut Input<'_>) -> Paint {
    let known = osp_session::brush::all();
    let brush = match below(u, 6) {
        0 => "Nobody's".to_owned(),
        1 => String::new(),
        _ => known[below(u, known.len())].name.clone(),
    };
    let scale = [1.0, 0.1, 4.0, 1.0e4][below(u, 4)];
    let seed: u32 = u.arbitrary().unwrap_or(0);
    let (layer, hidden) = (below(u, 4) as u32, chance(u, 6));
    let (sketch_group, sketch_flags) = (seed % 3, seed % 5);
    Paint { scale, layer, hidden, sketch_group, sketch_flags, ..Paint::new(brush, seed) }
}

/// Any event that a session may hold.
pub fn event(u: &mut Input<'_>) -> Event {
    let t = time(u);
    match below(u, 27) {
        0 => Event::Head { author: Author::SOLE, t, p: point(u), q: rotation(u) },
        1..=4 => {
            let tool = [Tool::Ribbon, Tool::Wall, Tool::Tube][below(u, 3)];
            let rules = [NormalRule::LocalX, NormalRule::SideX, NormalRule::Travel, NormalRule::Transport];
            let normal = rules[below(u, 4)];
            let width = if chance(u, 12) { 0.0 } else { unit(u) * 0.2 };
            Event::Begin {
                author: Author::SOLE,
                t,
                stroke: stroke(u),
                tool,
                width,
                color: color(u),
                normal,
                thinnest: unit(u),
                paint: chance(u, 3).then(|| Box::new(paint(u))),
            }
        }
        5..=12 => {
            let pressure = [0.0, 0.5, 1.0, unit(u)][below(u, 4)];
            Event::Point { t, stroke: stroke(u), p: point(u), q: rotation(u), pressure }
        }
        13 => Event::End { t, stroke: stroke(u) },
        14 => Event::Erase { author: Author::SOLE, t, stroke: stroke(u) },
        15 => Event::Undo { author: Author::SOLE, t },
        16 => Event::Redo { author: Author::SOLE, t },
        17 => Event::Move { author: Author::SOLE, t, strokes: strokes(u), by: point(u) },
        18 => {
            let parent = chance(u, 2).then(|| group(u));
            Event::Group { author: Author::SOLE, t, group: group(u), strokes: strokes(u), parent, name: None }
        }
        19 => {
            let s = if chance(u, 8) { 1.0e15 } else { 0.01 + unit(u) * 3.0 };
            Event::Place {
                author: Author::SOLE,
                t,
                group: group(u),
                to: Transform { p: point(u), q: rotation(u), s },
            }
        }
        20 => Event::Step { author: Author::SOLE, t, edits: below(u, 5) as u32 },
        21 => {
            let said = |u: &mut Input<'_>| [None, Some(true), Some(false)][below(u, 3)];
            Event::Layer {
                author: Author::SOLE,
                t,
                layer: below(u, 4) as u32,
                name: None,
                hidden: said(u),
                locked: said(u),
                mine: None,
            }
        }
        22 => Event::Assign { author: Author::SOLE, t, layer: below(u, 4) as u32, strokes: strokes(u) },
        _ => {
            let vertices = (0..3 + below(u, 6)).map(|_| point(u)).collect();
            Event::Polygon {
                author: Author::SOLE,
                t,
                stroke: chance(u, 2).then(|| stroke(u)),
                vertices,
                shading: None,
                color: color(u),
            }
        }
    }
}
