//! The strokes of a session at its end, with their control points: what a format of strokes can keep.

use std::collections::HashMap;

use glam::{Quat, Vec3};

use crate::{
    recording::{Event, Motion, NormalRule, Paint, StrokeId, Tool},
    scene::Scene,
};

/// A control point of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KeptPoint {
    /// Time, seconds.
    pub(super) t: f64,
    /// Position, metres.
    pub(super) p: Vec3,
    /// World from tracker.
    pub(super) q: Quat,
    /// 0 to 1.
    pub(super) pressure: f32,
}

/// A stroke as it was drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct KeptStroke {
    pub(super) id: StrokeId,
    pub(super) tool: Tool,
    pub(super) width_m: f32,
    pub(super) color: (f32, f32, f32, f32),
    pub(super) normal: NormalRule,
    pub(super) thinnest: f32,
    pub(super) paint: Option<Box<Paint>>,
    pub(super) points: Vec<KeptPoint>,
}

/// Collects the strokes of a session from its events: about 40 bytes a control point, also of strokes that are erased
/// later. No polygon of a stroke is made.
#[derive(Debug, Default)]
pub struct KeptStrokes {
    /// Decides what is erased, undone, moved, grouped and layered. It gets no control points.
    scene: Scene,
    strokes: Vec<KeptStroke>,
    places: HashMap<StrokeId, usize>,
    heads: u64,
}

impl KeptStrokes {
    /// Takes the next event of the session.
    pub fn note(&mut self, event: &Event) {
        match event {
            Event::Point { t, stroke, p, q, pressure } => {
                let is_open = self.scene.stroke(*stroke).is_some_and(|stroke| stroke.is_open());
                if let Some(&at) = self.places.get(stroke).filter(|_| is_open) {
                    self.strokes[at].points.push(KeptPoint { t: *t, p: *p, q: *q, pressure: *pressure });
                }
                return;
            }
            Event::Head { .. } => self.heads += 1,
            _ => {}
        }
        let ignored = self.scene.counts().ignored_events;
        self.scene.apply(event, &mut Vec::new());
        if let Event::Begin { stroke, tool, width, color, normal, thinnest, paint, .. } = event
            && self.scene.counts().ignored_events == ignored
        {
            self.places.insert(*stroke, self.strokes.len());
            self.strokes.push(KeptStroke {
                id: *stroke,
                tool: *tool,
                width_m: *width,
                color: *color,
                normal: *normal,
                thinnest: *thinnest,
                paint: paint.clone(),
                points: Vec::new(),
            });
        }
    }

    /// The session's edits, without control points.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Recorded poses of heads.
    pub(super) fn heads(&self) -> u64 {
        self.heads
    }

    /// The strokes that are neither erased nor undone, in the order of their beginnings, hidden ones too. Each comes with
    /// the motion from its points to the world.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&KeptStroke, Motion)> {
        self.strokes.iter().filter_map(|stroke| {
            let is_there = self.scene.stroke(stroke.id).is_some_and(|state| !state.is_taken_away());
            Some((stroke, self.scene.world_from_stroke(stroke.id).filter(|_| is_there)?))
        })
    }

    /// Polygons that came finished, without control points, and are neither erased nor undone.
    pub(super) fn finished_polygons(&self) -> u64 {
        let strokes = self.scene.strokes();
        let there = (0..strokes.len()).filter_map(|at| strokes.get(at)).filter(|s| !s.is_taken_away());
        there.map(|stroke| u64::from(stroke.polygon_count())).sum()
    }
}
