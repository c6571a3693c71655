use glam::Vec3;

use crate::{
    paint_layers::on_layer,
    studio::Studio,
    tracker::{Message, ReceivedMessage, Tracker},
};
use osp_session::recording::{Author, Event};

/// Largest number of tracker messages that a frame handles; further messages wait for the next frame. At 60 frames a
/// second a hundred trackers send fewer.
const MESSAGES_A_FRAME: u32 = 4096;
/// Largest number of erasures, undos and redos that a frame handles, because a single edit may change the whole model.
const EDITS_A_FRAME: u32 = 64;
/// Number of changed polygons after which the frame handles no more messages.
const CHANGES_A_FRAME: usize = 1 << 16;

impl Studio {
    pub(crate) fn listen(&mut self) {
        if self.is_reading() {
            return;
        }
        let Some(tracker) = self.input.tracker.take() else { return };
        let t = self.now_secs();
        for brush in tracker.unknown_brushes() {
            self.show_message(format!(
                "tracker: the brush `{}` is unknown: its strokes are plain ribbons",
                brush.escape_debug()
            ));
        }
        self.input.tracker_waits = !self.take_messages(t, &tracker);
        let first = self.events.len();
        self.input.hands.rest(t, &mut self.events);
        self.mirror_events(first);
        self.apply_events();
        self.input.tracker = Some(tracker);
    }

    /// Handles messages up to the limits of a frame. Returns whether no message is left.
    fn take_messages(&mut self, t: f64, tracker: &Tracker) -> bool {
        let (mut messages, mut edits) = (0, 0);
        while messages < MESSAGES_A_FRAME
            && edits < EDITS_A_FRAME
            && self.session.changes().len() < CHANGES_A_FRAME
        {
            let Some(ReceivedMessage { at, message: sent }) = tracker.take_received() else {
                return true;
            };
            let mut in_room = self.room.message_to_room(sent);
            self.input.watch.note(at, &sent, &in_room);
            if let (Message::Hand { pressure, .. }, true) = (&mut in_room, self.input.is_calibrating) {
                // During calibration the hand touches the corners of a screen and draws nothing.
                *pressure = 0.0;
            }
            messages += 1;
            if !matches!(in_room, Message::Head { .. } | Message::Brush { .. }) {
                self.part_eraser_step();
            }
            let message = self.room.message_to_world(&self.navigator, in_room);
            if self.session.is_replay() {
                continue;
            }
            if self.session.is_read_only() {
                self.input.hands.look(&message);
                continue;
            }
            let first = self.events.len();
            let session = &mut self.session;
            let next_stroke = || session.new_stroke();
            let erased = self.input.hands.take(t, &message, next_stroke, &mut self.events);
            let mut begins = false;
            let layer = self.input.brush.layer;
            let may_touch = self.scene().may_touch(self.author(), layer);
            for event in &mut self.events[first..] {
                if let Event::Begin { paint, .. } = event {
                    *paint = on_layer(paint.take(), if may_touch { layer } else { 0 });
                    begins = true;
                }
            }
            // A user with a headset does not see the window, so the strokes are kept in any case.
            if begins && !may_touch {
                let name = self.session_layer(layer).name;
                self.show_once(&format!(
                    "{name} belongs to another author, so the tracker draws on the first layer"
                ));
            } else if begins && let Some(why) = self.why_layer_is_closed() {
                self.show_once(&format!("{why}; the tracker can still draw in this layer"));
            }
            self.mirror_events(first);
            // The screens need the head's pose in the room; the session stores it in the world, like the hands.
            if let (Message::Head { .. }, Some(Event::Head { p, q, .. })) = (&message, self.events.last_mut())
            {
                (*p, *q) = self.room.pose_to_world(&self.navigator, (*p, *q));
            }
            if matches!(message, Message::Erase { .. } | Message::Undo | Message::Redo) {
                edits += 1;
                // The stroke to erase may be in the waiting events.
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

    /// Ends the unfinished strokes of the tracker.
    pub(crate) fn end_hands_strokes(&mut self) {
        let t = self.now_secs();
        self.input.hands.stop(t, &mut self.events);
        self.apply_events();
    }

    /// Erases the stroke nearest to a point, if the stroke is within reach.
    fn erase_near(&mut self, t: f64, p: Vec3) {
        /// Largest distance from the point to a stroke, metres: about a finger's width.
        const REACH_M: f32 = 0.01;
        let scene = self.session.scene();
        let nearest = self.culling.nearest_box(scene, self.session.changes(), p, REACH_M);
        let stroke =
            nearest.map(|id| scene.stroke_of(id)).filter(|stroke| !self.is_layer_held(stroke.layer()));
        if let Some(stroke) = stroke.and_then(|stroke| stroke.id()) {
            self.events.push(Event::Erase { author: Author::SOLE, t, stroke });
            self.apply_events();
        }
    }
}
