use osp_session::{
    export::{KeptStrokes, PolygonTimes},
    recording::Event,
    replay::SessionState,
};

/// The events of a session, divided into frames.
#[derive(Debug)]
pub(super) struct Recorded {
    pub(super) events: Vec<Event>,
    /// For each frame, the index in `events` of its end.
    pub(super) frame_ends: Vec<usize>,
}

impl Recorded {
    /// The events of a frame.
    pub(super) fn of(&self, frame: u64) -> &[Event] {
        let at = frame as usize;
        let start = if at == 0 { 0 } else { self.frame_ends[at - 1] };
        &self.events[start..self.frame_ends[at]]
    }

    /// Plays `end` frames and returns the time at which each polygon was drawn. Stops early if `goes_on` returns
    /// `false`.
    pub(super) fn polygon_times(&self, end: u64, goes_on: &dyn Fn() -> bool) -> PolygonTimes {
        let (mut state, mut times) = (SessionState::keeping_groups_whole(), PolygonTimes::default());
        let mut changes = Vec::new();
        for frame in (0..end).take_while(|_| goes_on()) {
            changes.clear();
            state.scene.free_unreachable();
            state.play(self.of(frame), &mut changes);
            times.note(self.of(frame), &state.scene);
        }
        times
    }

    /// Returns the strokes after `end` frames. Calls `goes_on` with the number of events. Returns `None` once `goes_on`
    /// returns `false`.
    pub(super) fn strokes(&self, end: u64, goes_on: &dyn Fn(u64) -> bool) -> Option<KeptStrokes> {
        let (mut kept, mut events) = (KeptStrokes::default(), 0);
        for frame in 0..end {
            self.of(frame).iter().for_each(|event| kept.note(event));
            events += self.of(frame).len() as u64;
            if !goes_on(events) {
                return None;
            }
        }
        Some(kept)
    }
}
