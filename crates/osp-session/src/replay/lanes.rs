use super::{CameraPath, Player, RigPath, RigView};
use crate::{
    platform::time::Load,
    recording::{Event, RecordingError},
    replay::fingerprint_of_views,
    scene::Scene,
};
use osp::{
    frame::{FrameRecord, Pipeline, Stage},
    polygon::{Change, VisibleBlocks},
    view::View,
};

/// Number of equal parts of a session. A lane may spend this fraction of its budget in each part.
pub const PARTS_OF_SESSION: u64 = 40;

/// The index, from 0, of the part that contains the frame `frame`. The session has `frames` frames.
pub fn part_of_frame(frame: u64, frames: u64) -> u64 {
    (frame.saturating_mul(PARTS_OF_SESSION) / frames.max(1)).min(PARTS_OF_SESSION - 1)
}

/// Limit of the time that a lane spends on measured frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Total time for measured frames, nanoseconds: applying events to the model, the lane's work, and its
    /// fingerprints. Once the budget of a part is spent, the lane skips its frames: it only applies the changes. The
    /// time of skipped frames, and of the first measured frame after them, is not part of the budget.
    pub ns: u64,
    /// Number of frames of the session, which determines the length of the parts.
    pub frames: u64,
}

/// An index in a replay, with its own pipeline and budget.
#[derive(Debug)]
pub struct Lane {
    pipeline: Pipeline,
    budget: Budget,
    part: u64,
    spent_ns: u64,
    /// Whether changes have been applied without a commit. The next measured frame's time then includes them.
    has_skipped: bool,
    /// If set, the lane queries a single view in each frame. It switches to the next view after this number of frames.
    frames_a_view: Option<u64>,
}

impl Lane {
    /// A lane with a pipeline, which must have no polygons.
    pub fn new(pipeline: Pipeline, budget: Budget) -> Self {
        Self { pipeline, budget, part: 0, spent_ns: 0, has_skipped: false, frames_a_view: None }
    }

    /// Limits the lane to a single view in each frame. It switches to the next view after `frames_a_view` frames. Such
    /// a lane is the baseline for the cost of several views.
    #[must_use]
    pub fn of_one_view(self, frames_a_view: u64) -> Self {
        Self { frames_a_view: Some(frames_a_view.max(1)), ..self }
    }

    pub fn pipeline(&self) -> &Pipeline {
        &self.pipeline
    }

    fn step(
        &mut self,
        frame: u64,
        scene: &Scene,
        changes: &[Change],
        applying: Stage,
        views: &[View],
    ) -> Option<LaneFrame> {
        let part = part_of_frame(frame, self.budget.frames);
        if part != self.part {
            (self.part, self.spent_ns) = (part, 0);
        }
        if self.spent_ns > self.budget.ns / PARTS_OF_SESSION {
            self.pipeline.skip(scene, changes);
            self.has_skipped = true;
            return None;
        }
        let views = match self.frames_a_view {
            Some(frames) if !views.is_empty() => {
                std::slice::from_ref(&views[(frame / frames) as usize % views.len()])
            }
            _ => views,
        };
        let record = self.pipeline.frame_of_views(scene, changes, views);
        let catches_up = std::mem::take(&mut self.has_skipped);
        let start = self.pipeline.clock().start();
        let in_view = fingerprint_of_views(self.pipeline.in_view_lists().iter().map(VisibleBlocks::ids));
        let drawn = match self.pipeline.is_occluded() {
            true => fingerprint_of_views(self.pipeline.draw_lists().iter().map(VisibleBlocks::ids)),
            false => in_view,
        };
        // Fingerprints are not a stage of the frame, because the window does not compute them.
        let fingerprinting = self.pipeline.clock().since(start);
        // The first frame after skipped frames costs no budget, so every part has at least one measured frame.
        if !catches_up {
            self.spent_ns += applying.ns + record.total_ns() + fingerprinting.ns;
        }
        Some(LaneFrame { applying, record, in_view, drawn, catches_up })
    }
}

#[derive(Clone, Copy, Debug)]
pub struct LaneFrame {
    /// Cost of applying the frame's events to the model, which all lanes share.
    pub applying: Stage,
    pub record: FrameRecord,
    /// Fingerprint of the polygons in the frustum; see [`crate::replay::fingerprint_of_frame`].
    pub in_view: u64,
    pub drawn: u64,
    /// Whether the lane skipped the frames before this frame. The times then include the changes of the skipped frames.
    pub catches_up: bool,
}

/// A replay of a session with several indexes simultaneously, frame by frame. All lanes get the same scene, changes and
/// view, one after the other, so that a disturbance of the machine affects all of them.
#[derive(Debug)]
pub struct Replay<I> {
    player: Player<I>,
    camera: CameraPath,
    rig: Option<RigPath>,
    lanes: Vec<Lane>,
    views: Vec<View>,
    rig_views: Vec<RigView>,
    outcomes: Vec<Option<LaneFrame>>,
    load: Load,
}

impl<I: Iterator<Item = Result<Event, RecordingError>>> Replay<I> {
    pub fn new(player: Player<I>, camera: CameraPath, lanes: Vec<Lane>) -> Self {
        let outcomes = vec![None; lanes.len()];
        let (views, rig_views) = (Vec::new(), Vec::new());
        Self { player, camera, rig: None, lanes, views, rig_views, outcomes, load: Load::default() }
    }

    /// Puts the screens of a rig around the camera's eye. Each frame then has a view for each screen and eye.
    #[must_use]
    pub fn on_rig(self, rig: RigPath) -> Self {
        Self { rig: Some(rig), ..self }
    }

    /// Plays one frame. Returns the result of each lane, in the order of the lanes; `None` for a lane whose budget for
    /// this part is spent. `Ok(None)` after the last frame.
    ///
    /// # Errors
    /// The recording is damaged. The frames before the damage have been played in every lane.
    pub fn step(&mut self) -> Result<Option<&[Option<LaneFrame>]>, RecordingError> {
        if !self.player.step()? {
            return Ok(None);
        }
        let moment = self.player.moment();
        let view = self.camera.view(&moment);
        self.views.clear();
        match &mut self.rig {
            Some(rig) => {
                rig.views_into(&view, &mut self.rig_views);
                self.views.extend(self.rig_views.iter().filter_map(|seen| seen.view));
            }
            None => self.views.push(view),
        }
        let (count, begun) = (self.lanes.len(), Load::begin());
        for turn in 0..count {
            // Each frame begins with a different lane, because the first lane finds the CPU caches in another state
            // than the others.
            let at = (turn + moment.frame as usize) % count;
            let (scene, changes) = (self.player.scene(), self.player.changes());
            let applying = self.player.applying();
            self.outcomes[at] = self.lanes[at].step(moment.frame, scene, changes, applying, &self.views);
        }
        self.load.add(begun);
        Ok(Some(&self.outcomes))
    }

    pub fn scene(&self) -> &Scene {
        self.player.scene()
    }

    pub fn changes(&self) -> &[Change] {
        self.player.changes()
    }

    /// The views of the last frame. Without a rig it is a single view; with a rig, a view for each screen and each eye
    /// in front of it.
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// View of each eye on each screen of the rig in the last frame; empty without a rig.
    pub fn rig_views(&self) -> &[RigView] {
        &self.rig_views
    }

    pub fn lanes(&self) -> &[Lane] {
        &self.lanes
    }

    /// How undisturbed the lanes were.
    pub fn load(&self) -> Load {
        self.load
    }

    pub fn frames(&self) -> u64 {
        self.player.frames()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp::index::{BruteForce, SpatialIndex};

    #[test]
    fn what_it_takes_to_apply_the_events_is_spent_too() {
        let looked_at = |applying_ns: u64| {
            let index: Box<dyn SpatialIndex> = Box::new(BruteForce::default());
            let pipeline = Pipeline::new(index, 1);
            let budget = Budget { ns: u64::MAX / 2, frames: 2 * PARTS_OF_SESSION };
            let mut lane = Lane::new(pipeline, budget);
            let applying = Stage { ns: applying_ns, allocations: 0 };
            [0, 1, 2].map(|frame| lane.step(frame, &Scene::new(), &[], applying, &[]).is_some())
        };
        // A part has two frames here.
        assert_eq!(looked_at(0), [true, true, true]);
        assert_eq!(looked_at(u64::MAX / 2 / PARTS_OF_SESSION + 1), [true, false, true]);
    }
}
