use osp_session::{export::PolygonTimes, recording::Event, replay::SessionState};

/// The events of a session, cut into frames.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) events: Vec<Event>,
    /// Where in `events` each frame ends.
    pub(super) frame_ends: Vec<usize>,
}

impl Recorded {
    /// The events of a frame.
    pub(super) fn of(&self, frame: u64) -> &[Event] {
        let at = frame as usize;
        let start = if at == 0 { 0 } else { self.frame_ends[at - 1] };
        &self.events[start..self.frame_ends[at]]
    }

    /// When the polygons were drawn that there are after `end` frames, as far as it is told to go on: plays them.
    pub(super) fn polygon_times(&self, end: u64, goes_on: &dyn Fn() -> bool) -> PolygonTimes {
        let (mut state, mut times) = (SessionState::keeping_groups_whole(), PolygonTimes::default());
        let mut changes = Vec::new();
        for frame in (0..end).take_while(|_| goes_on()) {
            changes.clear();
            state.scene.let_go();
            state.play(self.of(frame), &mut changes);
            times.note(self.of(frame), &state.scene);
        }
        times
    }
}
