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
    pub(super) heads: u64,
}

impl KeptStrokes {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Author, GroupId, SynthKind, Transform, synthesize, synthesize_class};

    /// Edits of every kind of the strokes of a session. Some edits are undone.
    fn edits(strokes: &[StrokeId]) -> Vec<Event> {
        let (author, t) = (Author::SOLE, 1.0e4);
        let turn = Quat::from_xyzw(0.0, 0.6, 0.0, 0.8);
        let place = |s| Transform { p: Vec3::new(0.1, 0.2, 0.3), q: turn, s };
        let group = |group, strokes: &[StrokeId], parent| Event::Group {
            author,
            t,
            group: GroupId(group),
            strokes: strokes.to_vec(),
            parent,
            name: None,
        };
        let parts: Vec<&[StrokeId]> = strokes.chunks(strokes.len().div_ceil(4)).collect();
        vec![
            Event::Erase { author, t, stroke: strokes[0] },
            Event::Move { author, t, strokes: parts[0].to_vec(), by: Vec3::X },
            Event::Undo { author, t },
            Event::Move { author, t, strokes: parts[1].to_vec(), by: Vec3::Y },
            group(1, parts[2], None),
            group(2, parts[1], Some(GroupId(1))),
            Event::Place { author, t, group: GroupId(1), to: place(2.0) },
            Event::Place { author, t, group: GroupId(2), to: place(0.5) },
            Event::Move { author, t, strokes: parts[1].to_vec(), by: Vec3::Z },
            Event::Assign { author, t, layer: 3, strokes: parts[2].to_vec() },
            Event::Layer { author, t, layer: 3, name: None, hidden: Some(true), locked: None, mine: None },
            Event::Erase { author, t, stroke: strokes[1] },
            Event::Erase { author, t, stroke: strokes[2] },
            Event::Undo { author, t },
        ]
    }

    #[test]
    fn strokes_without_polygons_have_the_state_that_the_scene_gives_them() {
        for session in [
            synthesize(SynthKind::Scribble, 3_000, 1),
            synthesize(SynthKind::Room, 3_000, 2),
            synthesize_class(3, 3_000, 3),
        ] {
            let mut events: Vec<Event> = session.map(|event| event.expect("a sound event")).collect();
            let begun = events.iter().filter_map(|event| match event {
                Event::Begin { stroke, .. } => Some(*stroke),
                _ => None,
            });
            events.extend(edits(&begun.collect::<Vec<_>>()));
            // A second beginning and a point after the end change nothing.
            let again: Vec<Event> = events.iter().take(40).cloned().collect();
            events.extend(again.into_iter().filter(|event| !matches!(event, Event::Join { .. })));
            let (mut kept, mut scene) = (KeptStrokes::default(), Scene::new());
            for event in &events {
                kept.note(event);
                scene.apply(event, &mut Vec::new());
            }
            assert!(kept.strokes.len() > 8);
            for stroke in &kept.strokes {
                // `None` if undo no longer reaches the stroke.
                let state = |scene: &Scene| {
                    let state = scene.stroke(stroke.id)?;
                    let seen = (state.is_taken_away(), state.is_hidden(), state.layer(), state.offset());
                    Some((seen, scene.groups_of(state), scene.world_from_stroke(stroke.id)))
                };
                assert_eq!(state(&kept.scene), state(&scene), "{:?}", stroke.id);
                if let Some(whole) = scene.stroke(stroke.id) {
                    assert_eq!(stroke.points.len() as u32, whole.point_count());
                }
            }
            let there = scene.strokes().iter().filter(|s| s.id().is_some() && !s.is_taken_away()).count();
            assert_eq!(kept.iter().count(), there);
        }
    }
}
