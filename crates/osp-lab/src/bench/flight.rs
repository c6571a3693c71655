use osp_session::platform::time::Instant;

use super::curves::grouped;
use crate::rows::{Curves, Rows};
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

const PART: &str = "flight";

#[derive(Clone, Copy, Debug, Default)]
struct Flown {
    in_view: u64,
    /// Number of polygons after occlusion culling.
    drawn: u64,
    /// Time of frustum culling alone, microseconds.
    frustum_us: f64,
    /// Time of frustum culling and occlusion culling, microseconds.
    both_us: f64,
}

/// Flies a camera along its path through the visible polygons of `scene`, which does not change. Measures frustum
/// culling alone, and with occlusion culling by `culler`, in turns. The rows are the part `flight`.
pub fn fly(
    recording: &str,
    scene: &Scene,
    root: IndexConfig,
    (camera, camera_name): (CameraPath, &str),
    (culler, occlusion): (Occlusion, OcclusionConfig),
    frames: u64,
) -> Rows {
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
    let us = |start: Instant| start.elapsed().as_nanos() as f64 / 1000.0;
    let mut flown: Vec<Flown> = Vec::new();
    for frame in 0..frames {
        let view = camera.view(&Moment { frame: frame * 720 / frames.max(1), ..Moment::default() });
        if view.window().is_none() {
            continue;
        }
        let frustum = view.frustum();
        let mut record = Flown::default();
        // The two measurements alternate in running first, so that the caches favour neither.
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
                record.both_us = us(start);
                record.drawn = drawn.len() as u64;
            } else {
                index.frustum_cull_blocks(&frustum, &mut in_view);
                record.frustum_us = us(start);
                record.in_view = in_view.len() as u64;
            }
        }
        flown.push(record);
    }
    let sum = |of: fn(&Flown) -> f64| flown.iter().map(of).sum::<f64>();
    let (in_view, drawn) = (sum(|frame| frame.in_view as f64), sum(|frame| frame.drawn as f64));
    let cost_us = sum(|frame| frame.both_us) - sum(|frame| frame.frustum_us);
    let count = flown.len().max(1) as f64;
    let (name, both) =
        (format!("{recording} {camera_name}"), format!("{} + {}", index.name(), culler.name()));
    let mut rows = Rows::default();
    rows.part(PART, "Flights through finished models: the frustum alone, and with occlusion culling");
    rows.note(PART, "Break-even: the time to draw a polygon above which occlusion culling saves time.");
    rows.of(PART, &name, "").value("polygons", "polygons", changes.len() as f64);
    let alone: Vec<(f64, f64)> = flown.iter().map(|frame| (frame.frustum_us, frame.frustum_us)).collect();
    rows.of(PART, &name, index.name()).against(&alone).value("drawn", "polygons", in_view / count);
    let pairs: Vec<(f64, f64)> = flown.iter().map(|frame| (frame.both_us, frame.frustum_us)).collect();
    let break_even = (in_view > drawn).then(|| 1000.0 * cost_us.max(0.0) / (in_view - drawn));
    rows.of(PART, &name, &both).against(&pairs).value("drawn", "polygons", drawn / count).maybe(
        "break_even",
        "ns/polygon",
        break_even,
    );
    let line = |of: fn(&Flown) -> f64| {
        grouped(flown.iter().enumerate().map(|(at, frame)| (at as f64, of(frame))).collect())
    };
    let curves = [
        (
            "polygons to draw",
            "polygons",
            line(|frame| frame.in_view as f64),
            line(|frame| frame.drawn as f64),
        ),
        ("time of culling", "µs", line(|frame| frame.frustum_us), line(|frame| frame.both_us)),
    ];
    for (what, y, frustum, with_occlusion) in curves {
        let lines = vec![(index.name().to_owned(), frustum), (both.clone(), with_occlusion)];
        rows.curves.push(Curves {
            part: PART,
            title: format!("{name}, flight: {what}"),
            x: "frame",
            y,
            lines,
        });
    }
    rows
}
