use osp_session::platform::time::Instant;

use serde::Serialize;

use super::Estimate;
use osp::{
    index::IndexConfig,
    occlusion::{Occlusion, OcclusionConfig, OcclusionStage, ViewInput},
    polygon::{Change, VisibleBlocks},
};
use osp_rivals::IndexKind;
use osp_session::{
    replay::{CameraPath, Moment},
    scene::Scene,
};

/// A flight through a finished model.
#[derive(Clone, Debug, Serialize)]
pub struct Flight {
    /// Name of the recording.
    pub recording: String,
    /// Name of the camera.
    pub camera: String,
    /// Name of the index.
    pub index: String,
    /// Name of the occlusion culler.
    pub occlusion: String,
    /// Polygons of the model.
    pub polygons: u64,
    /// Culling by the frustum alone, microseconds.
    pub frustum_us: Estimate,
    /// Culling by both, choice of occluders and building included, microseconds.
    pub both_us: Estimate,
    /// Polygons to draw after culling by the frustum, mean.
    pub in_view: f64,
    /// Polygons to draw after both, mean.
    pub drawn: f64,
    /// The cost of drawing a polygon, nanoseconds, from which on occlusion culling pays: its time over the polygons that
    /// it saves, both summed over the flight; `None` where it saves none.
    pub break_even_ns_per_polygon: Option<f64>,
    /// The frames.
    pub frames: Vec<FlightFrame>,
}

/// One frame of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FlightFrame {
    /// Polygons in view.
    pub in_view: u64,
    /// Of these, not culled by occlusion.
    pub drawn: u64,
    /// Culling by the frustum alone, nanoseconds.
    pub frustum_ns: u64,
    /// Culling by both, nanoseconds.
    pub both_ns: u64,
}

/// Flies along a camera's path through the visible polygons of `scene`, without a change to it: frustum culling alone,
/// and with occlusion culling by `culler`, in turns.
pub fn fly(
    recording: &str,
    scene: &Scene,
    root: IndexConfig,
    (camera, camera_name): (CameraPath, &str),
    (culler, occlusion): (Occlusion, OcclusionConfig),
    frames: u64,
) -> Flight {
    let mut index = IndexKind::Osp.create(&root);
    let mut stage = OcclusionStage::new(culler, occlusion);
    let changes: Vec<Change> = scene.visible_ids().map(Change::Insert).collect();
    for &change in &changes {
        if let Change::Insert(id) = change {
            // A polygon without a finite box cannot be drawn and is left out.
            let _ = index.insert(id, &scene.bounds(id));
        }
    }
    index.commit();
    stage.follow(scene, &changes);
    let [mut in_view, mut drawn] = [0, 1].map(|_| VisibleBlocks::with_capacity(changes.len()));
    let nanoseconds = |start: Instant| u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX);
    let mut flown = Vec::new();
    for frame in 0..frames {
        let view = camera.view(&Moment { frame: frame * 720 / frames.max(1), ..Moment::default() });
        if view.window().is_none() {
            continue;
        }
        let frustum = view.frustum();
        let mut record = FlightFrame { in_view: 0, drawn: 0, frustum_ns: 0, both_ns: 0 };
        // Neither always finds the caches filled by the other.
        for both in [frame % 2 == 0, frame % 2 == 1] {
            in_view.clear();
            let start = Instant::now();
            if both {
                index.frustum_cull_blocks(&frustum, &mut in_view);
                let input = ViewInput {
                    index: &*index,
                    geometry: scene,
                    view: &view,
                    in_view: &in_view,
                    spaces: None,
                };
                stage.cull(&input, &mut drawn);
                record.both_ns = nanoseconds(start);
                record.drawn = drawn.len() as u64;
            } else {
                index.frustum_cull_blocks(&frustum, &mut in_view);
                record.frustum_ns = nanoseconds(start);
                record.in_view = in_view.len() as u64;
            }
        }
        flown.push(record);
    }
    let us = |time: fn(&FlightFrame) -> u64| {
        let mut times: Vec<f64> = flown.iter().map(|frame| time(frame) as f64 / 1000.0).collect();
        Estimate::of(&mut times).unwrap_or_default()
    };
    let sum = |count: fn(&FlightFrame) -> u64| flown.iter().map(|frame| count(frame) as f64).sum::<f64>();
    let (in_view, drawn) = (sum(|frame| frame.in_view), sum(|frame| frame.drawn));
    let cost_ns = sum(|frame| frame.both_ns) - sum(|frame| frame.frustum_ns);
    let count = flown.len().max(1) as f64;
    Flight {
        recording: recording.to_owned(),
        camera: camera_name.to_owned(),
        index: index.name().to_owned(),
        occlusion: culler.name().to_owned(),
        polygons: changes.len() as u64,
        frustum_us: us(|frame| frame.frustum_ns),
        both_us: us(|frame| frame.both_ns),
        in_view: in_view / count,
        drawn: drawn / count,
        break_even_ns_per_polygon: (in_view > drawn).then(|| cost_ns.max(0.0) / (in_view - drawn)),
        frames: flown,
    }
}
