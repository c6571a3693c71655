use glam::Vec3;

use super::studio::{Studio, Subject};
use crate::{math::Aabb, recording::Event, scene::PolygonId};

impl Studio {
    /// What the tracker has said since the last frame.
    pub(super) fn listen(&mut self) {
        let Some(tracker) = &self.tracker else { return };
        let t = self.now_secs();
        let mut erased = Vec::new();
        while let Some(message) = tracker.take() {
            let message = self.room.message_to_world(&self.navigator, message);
            let Subject::Sketch(document) = &mut self.subject else { continue };
            if document.is_read_only() {
                continue;
            }
            let erase = self.hands.take(t, &message, || document.new_stroke(), &mut self.events);
            // The stroke to erase may be among those that have just been drawn.
            erased.extend(erase.map(|p| (self.events.len(), p)));
        }
        self.hands.rest(t, &mut self.events);
        if erased.is_empty() {
            self.apply_events();
            return;
        }
        let mut events = std::mem::take(&mut self.events);
        let mut taken = 0;
        for (until, p) in erased {
            self.events.extend(events.drain(..until - taken));
            taken = until;
            self.apply_events();
            self.erase_near(t, p);
        }
        self.events.append(&mut events);
        self.apply_events();
    }

    /// Erases the stroke nearest to a point, if one is within reach.
    fn erase_near(&mut self, t: f64, p: Vec3) {
        /// How far from the point a stroke may be, metres: about a finger's width.
        const REACH_M: f32 = 0.01;
        let scene = self.subject.scene();
        let reach = Aabb::cube(p, 2.0 * REACH_M);
        let near = scene.visible_ids().filter(|&id| scene.bounds(id).intersects(&reach));
        let distance = |id: &PolygonId| scene.bounds(*id).distance_squared(p);
        let nearest = near.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(stroke) = nearest.and_then(|id| scene.stroke_of(id).id()) {
            self.events.push(Event::Erase { t, stroke });
            self.apply_events();
        }
    }
}
