use std::collections::BTreeMap;

use osp::polygon::{Change, VisibleBlocks};
use osp_session::{
    recording::{Author, Event, StrokeId},
    scene::Scene,
};

/// The user's strokes that the server has not returned completely. They are drawn immediately, without waiting for the
/// network.
///
/// The strokes have their own scene, which is drawn over the session's scene. A stroke stays in the overlay until all
/// of its events have returned. Only polygons that the session's scene lacks are shown.
#[derive(Debug, Default)]
pub struct Overlay {
    /// The scene of the user's strokes.
    pub scene: Scene,
    changes: Vec<Change>,
    /// The polygons of this scene that are shown.
    pub shown: VisibleBlocks,
    strokes: BTreeMap<StrokeId, Stroke>,
    /// Whether the scene was replaced since its changes were last taken.
    is_other: bool,
}

#[derive(Clone, Copy, Debug, Default)]
struct Stroke {
    /// Number of events that have not returned.
    waiting: usize,
    has_ended: bool,
}

fn drawn_by(event: &Event) -> Option<StrokeId> {
    match event {
        Event::Begin { stroke, .. }
        | Event::Point { stroke, .. }
        | Event::End { stroke, .. }
        | Event::Polygon { stroke: Some(stroke), .. } => Some(*stroke),
        _ => None,
    }
}

impl Overlay {
    /// Adds an event of the user that was sent to the server.
    pub(super) fn add(&mut self, event: &Event) {
        let Some(id) = drawn_by(event) else { return };
        if matches!(event, Event::Begin { .. } | Event::Polygon { .. }) {
            self.strokes.entry(id).or_default();
        }
        // The overlay does not draw a stroke without its beginning.
        let Some(stroke) = self.strokes.get_mut(&id) else { return };
        stroke.waiting += 1;
        stroke.has_ended |= matches!(event, Event::End { .. } | Event::Polygon { .. });
        self.scene.apply_all([event], &mut self.changes);
    }

    /// Records that the server has returned or refused an event of the user.
    pub(super) fn settle(&mut self, event: &Event) {
        let Some(id) = drawn_by(event) else { return };
        let Some(stroke) = self.strokes.get_mut(&id) else { return };
        stroke.waiting = stroke.waiting.saturating_sub(1);
        if stroke.waiting > 0 || !stroke.has_ended {
            return;
        }
        self.strokes.remove(&id);
        if self.strokes.is_empty() {
            // A new scene replaces the old one, which would grow without limit.
            (self.scene, self.is_other) = (Scene::default(), true);
            self.changes.clear();
        } else {
            let erase = Event::Erase { author: Author::SOLE, t: event.time_secs(), stroke: id };
            self.scene.apply_all([&erase], &mut self.changes);
        }
    }

    /// Determines the polygons to show. `in_session` returns the number of polygons of a user's stroke in the session's
    /// scene.
    pub(super) fn show(&mut self, in_session: impl Fn(StrokeId) -> usize) {
        self.shown.clear();
        for &id in self.strokes.keys() {
            let Some(stroke) = self.scene.stroke(id) else { continue };
            for polygon in stroke.polygon_ids().skip(in_session(id)).filter(|&id| self.scene.is_visible(id)) {
                self.shown.insert(polygon);
            }
        }
    }

    /// Appends the changes since the last call. Returns `true` if the whole scene was replaced.
    pub(crate) fn take_changes(&mut self, out: &mut Vec<Change>) -> bool {
        out.append(&mut self.changes);
        std::mem::take(&mut self.is_other)
    }
}

#[cfg(test)]
mod tests {
    use glam::{Quat, Vec3};

    use super::*;
    use osp_session::recording::{NormalRule, Tool};

    fn stroke(id: u32, points: u32) -> Vec<Event> {
        let stroke = StrokeId(id);
        let begin = Event::Begin {
            author: Author::SOLE,
            t: 0.0,
            stroke,
            tool: Tool::Ribbon,
            width: 0.01,
            color: (1.0, 1.0, 1.0, 1.0),
            paint: None,
            thinnest: 1.0,
            normal: NormalRule::default(),
        };
        let point = |n: u32| Event::Point {
            t: 0.0,
            stroke,
            p: Vec3::new(n as f32 * 0.1, id as f32, 0.0),
            q: Quat::IDENTITY,
            pressure: 1.0,
        };
        let end = Event::End { t: 0.0, stroke };
        std::iter::once(begin).chain((0..points).map(point)).chain([end]).collect()
    }

    #[test]
    fn a_stroke_is_shown_until_all_of_it_has_come_back_and_only_what_has_not() {
        let mut overlay = Overlay::default();
        let (first, second) = (stroke(1, 20), stroke(2, 10));
        first.iter().chain(&second).for_each(|event| overlay.add(event));
        overlay.show(|_| 0);
        let all = overlay.shown.len();
        assert!(all > 20, "{all}");
        let of_first = overlay.scene.stroke(StrokeId(1)).expect("a stroke").polygon_ids().count();
        overlay.show(|id| if id == StrokeId(1) { of_first - 3 } else { 0 });
        assert_eq!(overlay.shown.len(), all - of_first + 3);
        first.iter().for_each(|event| overlay.settle(event));
        overlay.show(|_| 0);
        assert_eq!(overlay.shown.len(), all - of_first);
        assert!(!overlay.take_changes(&mut Vec::new()));
        // The hand is still drawing the stroke, so it has not ended.
        let mut open = Overlay::default();
        second[..11].iter().for_each(|event| open.add(event));
        second[..11].iter().for_each(|event| open.settle(event));
        open.show(|_| 0);
        assert!(!open.shown.is_empty());
        second.iter().for_each(|event| overlay.settle(event));
        overlay.show(|_| 0);
        assert!(overlay.shown.is_empty() && overlay.scene.polygon_count() == 0);
        assert!(overlay.take_changes(&mut Vec::new()));
        // Edits of the session's strokes are not shown before they return.
        overlay.add(&Event::Undo { author: Author::SOLE, t: 0.0 });
        assert_eq!(overlay.scene.counts().ignored_events, 0);
    }
}
