//! `osp replay --draw`: every frame is drawn, too, and its time taken.

use std::sync::Arc;

use super::{output::complain, render::Size};
use crate::{
    recording::{Event, RecordingError},
    render::{DrawTimes, Gpu, Layer, Offscreen, RendererConfig},
    report::RunReport,
    visibility::{LaneFrame, Replay},
};

/// Draws what is left of each frame.
#[derive(Debug)]
pub(super) struct Drawing {
    drawer: Offscreen,
}

impl Drawing {
    pub(super) fn new(Size { width, height }: Size) -> anyhow::Result<Self> {
        let gpu = Arc::new(Gpu::headless()?);
        let name = gpu.name();
        let drawer = Offscreen::on(gpu, width, height, &RendererConfig::default())?;
        complain(&format!("drawn by {name}, {width} x {height} pixels"));
        Ok(Self { drawer })
    }

    /// Draws the frame for each lane that looked at it. Lanes that leave the same polygons share a drawing: the second
    /// one would find all of them in the caches.
    pub(super) fn frame<I>(
        &mut self,
        replay: &Replay<I>,
        looked: &[Option<LaneFrame>],
        runs: &mut [RunReport],
    ) -> anyhow::Result<()>
    where
        I: Iterator<Item = Result<Event, RecordingError>>,
    {
        self.drawer.follow(replay.changes());
        let Some(view) = replay.view() else { return Ok(()) };
        let mut drawn: Vec<(u64, DrawTimes)> = Vec::new();
        for ((lane, frame), run) in replay.lanes().iter().zip(looked).zip(runs) {
            let Some(LaneFrame { record, .. }) = frame else { continue };
            let fingerprint =
                if record.occlusion.used { record.occlusion.fingerprint } else { record.fingerprint };
            let same = drawn.iter().find(|(other, _)| *other == fingerprint).map(|(_, times)| *times);
            let times = match same {
                Some(times) => times,
                None => {
                    let ids = lane.pipeline().draw_list().ids();
                    let times = self.drawer.draw(replay.scene(), view, &[Layer::plain(ids)])?;
                    drawn.push((fingerprint, times));
                    times
                }
            };
            run.draw.get_or_insert_default().add(times.draw.ns, times.prepare.ns);
        }
        Ok(())
    }
}
