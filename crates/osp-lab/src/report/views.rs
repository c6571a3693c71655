use serde::Serialize;

use super::one_line;
use osp::frame::Pipeline;
use osp_session::{
    replay::{LaneFrame, RigPath, RigView},
    rig::Eye,
};

/// The rig for whose screens the frames of a replay are culled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RigReport {
    pub name: String,
    /// Arrangement of the pictures for the two eyes.
    pub stereo: &'static str,
    /// Motion of the rig's room while the head moves.
    pub room: &'static str,
    pub views: Vec<RigViewReport>,
}

/// A screen and an eye of a rig.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RigViewReport {
    pub screen: String,
    /// The eye: `eye`, `left eye` or `right eye`.
    pub eye: &'static str,
    /// Number of frames in which the eye was not in front of the screen.
    pub frames_without_view: u64,
}

impl RigViewReport {
    /// A name such as `left, right eye`; if the rig has one eye, only the screen, such as `left`.
    pub fn name(&self) -> String {
        if self.eye == Eye::Middle.name() {
            self.screen.clone()
        } else {
            format!("{}, {}", self.screen, self.eye)
        }
    }
}

impl RigReport {
    pub fn new(path: &RigPath) -> Self {
        let views = path.slots().map(|(screen, eye)| RigViewReport {
            screen: path.rig().screens[screen].name.clone(),
            eye: eye.name(),
            frames_without_view: 0,
        });
        Self {
            name: path.rig().name.clone(),
            stereo: path.stereo().name(),
            room: path.motion().name(),
            views: views.collect(),
        }
    }

    pub fn add(&mut self, views: &[RigView]) {
        for (report, seen) in self.views.iter_mut().zip(views) {
            report.frames_without_view += u64::from(seen.view.is_none());
        }
    }

    /// The camera's name in the report, including the rig, because a replay with a rig has other views.
    pub fn camera(&self, camera: &str) -> String {
        format!("{camera} on {}, {}, room {}", self.name, self.stereo, self.room)
    }

    /// A line for each screen and eye that had no view in some frames.
    pub fn blind(&self, frames: u64) -> Vec<String> {
        let blind = self.views.iter().filter(|view| view.frames_without_view > 0);
        let line = |view: &RigViewReport| {
            format!(
                "{}: no view in {} of {frames} frames: the {} was not in front of the screen.",
                one_line(&view.name()),
                view.frames_without_view,
                view.eye
            )
        };
        blind.map(line).collect()
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ViewCounts {
    pub(super) in_view: u32,
    pub(super) drawn: u32,
}

/// The results of one index in each view of its measured frames.
#[derive(Clone, Debug, Default)]
pub struct ViewsReport {
    /// Counts of each screen and eye that had a view, for each measured frame.
    pub(super) frames: Vec<Box<[Option<ViewCounts>]>>,
    /// Two times of each measured frame, nanoseconds: with all views, and with one view times the number of views.
    /// `None` if one of the times was not measured.
    pub(super) against_one: Vec<Option<(u64, u64)>>,
    last: Vec<Option<ViewCounts>>,
    /// The time of the last frame with only one of its views, nanoseconds, if it was measured.
    pub one_view_ns: Option<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewMeans {
    /// Mean number of polygons in the frustum, over the frames with this view.
    pub in_view: f64,
    /// Mean number of drawn polygons, over the frames with this view.
    pub drawn: f64,
}

impl ViewsReport {
    pub fn add(
        &mut self,
        views: &[RigView],
        pipeline: &Pipeline,
        frame: &LaneFrame,
        one: Option<&LaneFrame>,
    ) {
        let count = |len: usize| u32::try_from(len).unwrap_or(u32::MAX);
        let mut lists = pipeline.in_view_lists().iter().zip(pipeline.draw_lists());
        self.last.clear();
        self.last.extend(views.iter().map(|seen| {
            let (in_view, drawn) = seen.view.and_then(|_| lists.next())?;
            Some(ViewCounts { in_view: count(in_view.len()), drawn: count(drawn.len()) })
        }));
        let one = one.filter(|one| !one.catches_up && one.record.views > 0);
        self.one_view_ns = one.map(|one| one.record.total_ns());
        if !frame.catches_up {
            self.frames.push(self.last.as_slice().into());
            let views = frame.record.views;
            let both = self.one_view_ns.map(|one_ns| (frame.record.total_ns(), one_ns * views));
            self.against_one.push(both);
        }
    }

    /// The counts of the last frame: polygons in the frustum and polygons drawn, for each screen and eye that had a
    /// view.
    pub fn last(&self) -> impl Iterator<Item = Option<(u32, u32)>> + '_ {
        self.last.iter().map(|view| view.map(|counts| (counts.in_view, counts.drawn)))
    }
}

/// Frames with all views of a rig, compared with the same frames with one view, each view in turn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AgainstOneView {
    /// Mean time of a frame with all views, microseconds.
    pub all_views_us: f64,
    /// Mean time of a frame with one view, times the number of views, microseconds.
    pub views_times_one_us: f64,
    /// `all_views_us` divided by `views_times_one_us`.
    pub ratio: f64,
}

impl AgainstOneView {
    /// Compares the two times of each frame, nanoseconds. Only means are compared, because views differ. Skips the
    /// slowest hundredth of either time, as disturbances of the machine.
    pub fn of(mut pairs: Vec<(u64, u64)>) -> Option<Self> {
        let slowest = |values: &mut dyn Iterator<Item = u64>| {
            let mut values: Vec<u64> = values.collect();
            values.sort_unstable();
            values.get(values.len().saturating_sub(1 + values.len() / 100)).copied()
        };
        let all_ns = slowest(&mut pairs.iter().map(|pair| pair.0))?;
        let times_one_ns = slowest(&mut pairs.iter().map(|pair| pair.1))?;
        pairs.retain(|&(all, times_one)| all <= all_ns && times_one <= times_one_ns);
        let us = |sum: u64| sum as f64 / 1000.0 / pairs.len().max(1) as f64;
        let all_views_us = us(pairs.iter().map(|pair| pair.0).sum());
        let views_times_one_us = us(pairs.iter().map(|pair| pair.1).sum());
        let ratio = all_views_us.max(1.0e-3) / views_times_one_us.max(1.0e-3);
        Some(Self { all_views_us, views_times_one_us, ratio })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_that_differ_are_compared_by_their_means() {
        // Two views of 10 and 30 us in turns: both together take as long as their sum.
        let mut pairs: Vec<(u64, u64)> =
            (0..400).map(|i| (40_000, if i % 2 == 0 { 20_000 } else { 60_000 })).collect();
        let of = AgainstOneView::of(pairs.clone()).expect("frames");
        assert_eq!((of.all_views_us, of.views_times_one_us, of.ratio), (40.0, 40.0, 1.0));
        // A pause of the machine does not count.
        pairs[7].0 = 90_000_000;
        pairs[9].1 = 90_000_000;
        assert!((AgainstOneView::of(pairs).expect("frames").ratio - 1.0).abs() < 0.01);
        assert_eq!(AgainstOneView::of(Vec::new()), None);
        assert!(AgainstOneView::of(vec![(5, 7)]).is_some());
    }
}
