use glam::Vec3;

use super::{
    paint_layers::on_layer,
    studio::Studio,
    subject::Subject,
    tracker::{Message, Tracker},
};
use crate::recording::{Author, Event};

/// Messages of a tracker that a frame takes; the others wait for the next one. At 60 frames a second that is more than a
/// hundred trackers send.
const MESSAGES_A_FRAME: u32 = 4096;
/// Erasures, undos and redos among them: a few bytes may concern the whole model.
const EDITS_A_FRAME: u32 = 64;
/// Once so many polygons have come, gone or moved, the frame takes no more messages.
const CHANGES_A_FRAME: usize = 1 << 16;

impl Studio {
    /// The tracker's messages since the last frame.
    pub(super) fn listen(&mut self) {
        if self.is_reading() {
            return;
        }
        let Some(tracker) = self.tracker.take() else { return };
        let t = self.now_secs();
        for brush in tracker.unknown_brushes() {
            self.say(format!(
                "tracker: the brush `{}` is unknown: its strokes are plain ribbons",
                brush.escape_debug()
            ));
        }
        self.tracker_waits = !self.take_messages(t, &tracker);
        let first = self.events.len();
        self.hands.rest(t, &mut self.events);
        self.mirror_events(first);
        self.apply_events();
        self.tracker = Some(tracker);
    }

    /// Takes messages up to the limit of a frame; returns whether none was left.
    fn take_messages(&mut self, t: f64, tracker: &Tracker) -> bool {
        let (mut messages, mut edits) = (0, 0);
        while messages < MESSAGES_A_FRAME && edits < EDITS_A_FRAME && self.changes_waiting() < CHANGES_A_FRAME
        {
            let Some((at, sent)) = tracker.take_heard() else { return true };
            let mut in_room = self.room.message_to_room(sent);
            self.watch.note(at, &sent, &in_room);
            if let (Message::Hand { pressure, .. }, true) = (&mut in_room, self.is_calibrating) {
                // It touches the corners of a screen.
                *pressure = 0.0;
            }
            messages += 1;
            if !matches!(in_room, Message::Head { .. } | Message::Brush { .. }) {
                self.part_eraser_step();
            }
            let message = self.room.message_to_world(&self.navigator, in_room);
            let Subject::Sketch(document) = &mut self.subject else { continue };
            if document.is_read_only() {
                self.hands.look(&message);
                continue;
            }
            let first = self.events.len();
            let erased = self.hands.take(t, &message, || document.new_stroke(), &mut self.events);
            let mut begins = false;
            for event in &mut self.events[first..] {
                if let Event::Begin { paint, .. } = event {
                    *paint = on_layer(paint.take(), self.brush.layer);
                    begins = true;
                }
            }
            // Who wears a helmet does not see the window: what the hand draws is kept all the same.
            if begins && let Some(why) = self.why_layer_is_closed() {
                self.say_once(&format!("{why}: a tracker draws on it all the same"));
            }
            self.mirror_events(first);
            // The screens show what the head sees from its place in the room; the session has it in the world, like the hands.
            if let (Message::Head { .. }, Some(Event::Head { p, q, .. })) = (&message, self.events.last_mut())
            {
                (*p, *q) = self.room.pose_to_world(&self.navigator, (*p, *q));
            }
            if matches!(message, Message::Erase { .. } | Message::Undo | Message::Redo) {
                edits += 1;
                // The stroke to erase may be among those that have just been drawn.
                self.apply_events();
            }
            if let Message::Undo | Message::Redo = message {
                self.follow_selection(matches!(message, Message::Undo));
            }
            if let Some(p) = erased {
                self.erase_near(t, p);
            }
        }
        false
    }

    fn changes_waiting(&self) -> usize {
        match &self.subject {
            Subject::Sketch(document) => document.changes().len(),
            Subject::Replay(_) => 0,
        }
    }

    /// Erases the stroke nearest to a point, if one is within reach.
    fn erase_near(&mut self, t: f64, p: Vec3) {
        /// How far from the point a stroke may be, metres: about a finger's width.
        const REACH_M: f32 = 0.01;
        let Subject::Sketch(document) = &self.subject else { return };
        let nearest = self.culling.nearest_box(document.scene(), document.changes(), p, REACH_M);
        let scene = document.scene();
        let stroke =
            nearest.map(|id| scene.stroke_of(id)).filter(|stroke| !self.is_layer_held(stroke.layer()));
        if let Some(stroke) = stroke.and_then(|stroke| stroke.id()) {
            self.events.push(Event::Erase { author: Author::SOLE, t, stroke });
            self.apply_events();
        }
    }
}
