//! The strokes that exist at the end of a session, with their control points, for formats that store strokes.

use std::collections::HashMap;

use glam::{Quat, Vec3};

use crate::{
    recording::{Event, Motion, NormalRule, Paint, StrokeId, Tool},
    scene::Scene,
};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KeptPoint {
    pub(super) t: f64,
    pub(super) p: Vec3,
    pub(super) q: Quat,
    pub(super) pressure: f32,
}

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

/// Collects the strokes of a session from its events, including strokes that are erased later. It stores about 40 bytes
/// for each control point, and makes no polygons.
#[derive(Debug, Default)]
pub struct KeptStrokes {
    /// A scene without control points. It determines each stroke's layer, and whether the stroke is erased, undone,
    /// moved or grouped.
    pub(super) scene: Scene,
    strokes: Vec<KeptStroke>,
    places: HashMap<StrokeId, usize>,
    /// Edits that the scene does not have yet. Applied together they cost one visit of each stroke.
    edits: Vec<Event>,
    /// Whether one of them may end a stroke.
    may_end_strokes: bool,
    pub(super) heads: u64,
}

/// Largest number of [`KeptStrokes::edits`].
const MOST_EDITS: usize = 1 << 16;

impl KeptStrokes {
    pub fn note(&mut self, event: &Event) {
        match event {
            Event::Point { t, stroke, p, q, pressure } => {
                if self.may_end_strokes {
                    self.settle();
                }
                let is_open = self.scene.stroke(*stroke).is_some_and(|stroke| stroke.is_open());
                if let Some(&at) = self.places.get(stroke).filter(|_| is_open) {
                    self.strokes[at].points.push(KeptPoint { t: *t, p: *p, q: *q, pressure: *pressure });
                }
                return;
            }
            Event::Head { .. } => {
                self.heads += 1;
                return;
            }
            Event::Begin { .. } => self.settle(),
            _ => {
                self.edits.push(event.clone());
                self.may_end_strokes |= !matches!(event, Event::Place { .. } | Event::Move { .. });
                if self.edits.len() == MOST_EDITS {
                    self.settle();
                }
                return;
            }
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

    /// Applies the last edits.
    pub(super) fn settle(&mut self) {
        self.scene.apply_all(&self.edits, &mut Vec::new());
        self.edits.clear();
        self.may_end_strokes = false;
    }

    /// The strokes that are neither erased nor undone, in the order of their beginnings. Hidden strokes are included.
    /// Each stroke comes with the transform from its points to world space.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&KeptStroke, Motion)> {
        self.strokes.iter().filter_map(|stroke| {
            let is_there = self.scene.stroke(stroke.id).is_some_and(|state| !state.is_taken_away());
            Some((stroke, self.scene.world_from_stroke(stroke.id).filter(|_| is_there)?))
        })
    }

    /// Number of polygons that events contain directly, without control points, and that are neither erased
    /// nor undone.
    pub(super) fn finished_polygons(&self) -> u64 {
        let there = self.scene.strokes().iter().filter(|stroke| !stroke.is_taken_away());
        there.map(|stroke| u64::from(stroke.polygon_count())).sum()
    }
}
