//! `osp replay --draw`: also draws every frame and measures the time for it.

use std::{slice, sync::Arc};

use super::{output::warn, parsers::Size};
use osp::view::View;
use osp_lab::{
    Method,
    report::{DrawnWhileCulling, RunReport},
};
use osp_render::{DrawTimes, Gpu, GpuOcclusion, Layer, Offscreen, RendererConfig};
use osp_session::{
    recording::{Event, RecordingError},
    replay::{LaneFrame, Replay, RigPath},
};

/// Draws the polygons of each frame that culling leaves.
#[derive(Debug)]
pub(super) struct Drawing {
    /// One drawer for each method of culling while drawing, because a drawer keeps the state of only one method.
    drawers: Vec<(GpuOcclusion, Offscreen)>,
    of_lane: Vec<usize>,
    frame: usize,
}

impl Drawing {
    /// Creates the drawers for lanes with these methods.
    pub(super) fn new(
        Size { width, height }: Size,
        choices: impl IntoIterator<Item = Option<Method>>,
        rig: Option<&RigPath>,
    ) -> anyhow::Result<Self> {
        let gpu = Arc::new(Gpu::headless()?);
        let size = Size { width, height };
        let sizes: Vec<Size> = match rig {
            Some(rig) => rig.slots().map(|(screen, _)| size.on(&rig.rig().screens[screen])).collect(),
            None => vec![size],
        };
        let named: Vec<String> =
            sizes.iter().map(|size| format!("{} x {}", size.width, size.height)).collect();
        warn(&format!("drawn by {}, {} pixels", gpu.name(), named.join(" and ")));
        let mut drawing = Self { drawers: Vec::new(), of_lane: Vec::new(), frame: 0 };
        for choice in choices {
            let occlusion = choice.map_or(GpuOcclusion::None, Method::while_drawing);
            let found = drawing.drawers.iter().position(|(other, _)| *other == occlusion);
            if found.is_none() {
                let Size { width, height } = sizes[0];
                let mut drawer = Offscreen::on(Arc::clone(&gpu), width, height, &RendererConfig::default())?;
                for size in &sizes[1..] {
                    drawer.add_view(size.width, size.height)?;
                }
                drawer.set_occlusion(occlusion)?;
                drawing.drawers.push((occlusion, drawer));
            }
            drawing.of_lane.push(found.unwrap_or(drawing.drawers.len() - 1));
        }
        Ok(drawing)
    }

    /// Draws the frame of each lane that replayed it. Draws lanes with the same remaining polygons only once: a second
    /// time would be shorter, because the GPU's caches already hold the data.
    pub(super) fn frame<I>(
        &mut self,
        replay: &Replay<I>,
        lane_frames: &[Option<LaneFrame>],
        runs: &mut [RunReport],
    ) -> anyhow::Result<()>
    where
        I: Iterator<Item = Result<Event, RecordingError>>,
    {
        for (_, drawer) in &mut self.drawers {
            drawer.renderer.follow(replay.changes());
        }
        // The views of the frame, each with its number among the views of all screens and eyes.
        let views: Vec<(usize, &View)> = match replay.rig_views() {
            [] => replay.views().iter().enumerate().collect(),
            of_rig => {
                of_rig.iter().enumerate().filter_map(|(i, seen)| Some((i, seen.view.as_ref()?))).collect()
            }
        };
        if views.is_empty() {
            return Ok(());
        }
        self.frame += 1;
        let mut drawn: Vec<(usize, u64, DrawTimes)> = Vec::new();
        // Rotates the order of the lanes from frame to frame, so that the order favours no lane.
        for i in 0..lane_frames.len() {
            let i = (i + self.frame) % lane_frames.len();
            let Some(LaneFrame { drawn: fingerprint, .. }) = lane_frames[i] else { continue };
            let number = self.of_lane[i];
            let same = drawn.iter().find(|other| (other.0, other.1) == (number, fingerprint));
            let times = match same {
                Some((.., times)) => *times,
                None => {
                    let lists = replay.lanes()[i].pipeline().draw_lists();
                    let drawer = &mut self.drawers[number].1;
                    let layers: Vec<Layer<'_>> = lists.iter().map(Layer::plain).collect();
                    let layers = views.iter().zip(&layers);
                    let layers: Vec<_> =
                        layers.map(|(&(sight, view), layer)| (sight, view, slice::from_ref(layer))).collect();
                    let times = drawer.draw_views(replay.scene(), &layers)?;
                    drawn.push((number, fingerprint, times));
                    times
                }
            };
            let report = runs[i].draw.get_or_insert_default();
            report.add(times.draw.ns, times.prepare.ns);
            if let Some(counts) = times.occlusion {
                report.add_culling(DrawnWhileCulling {
                    groups_tested: counts.groups_tested,
                    first_pass: counts.first_pass,
                    second_pass: counts.second_pass,
                    hidden: counts.hidden(),
                    gpu_ns: times.passes.map(|passes| [passes.depth_ns, passes.test_ns, passes.color_ns]),
                });
            }
        }
        Ok(())
    }
}
