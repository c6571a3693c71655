//! Guarantee "nothing visible is ever culled", on every shipped session, as pixels: the picture of what is left is the
//! picture of everything.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::scenes::{all_ids, drawer, gpu, picture_of};
use osp::{
    frame::{PassConfig, Pipeline},
    index::IndexConfig,
    occlusion::Occlusion,
    polygon::PolygonId,
};
use osp_lab::Method;
use osp_render::{Gpu, Offscreen};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{self, OpenOptions, Pace, Pacer},
    replay::{CameraChoice, CameraPath, Moment, summarize},
    scene::Scene,
};

/// Odd, so that no pixel's centre lies on an axis of symmetry.
const SIZE: (u32, u32) = (481, 361);
/// Frames of each session that are looked at by each camera.
const FRAMES: u64 = 5;

pub(crate) fn shipped() -> Vec<PathBuf> {
    let folder = PathBuf::from(osp_testkit::ROOT).join("recordings");
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .expect("recordings/")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "ron"))
        .collect();
    paths.sort();
    assert!(paths.len() >= 4, "{paths:?}");
    paths
}

/// Draws the same frame twice: what culling leaves, and everything.
struct Eyes {
    culled: Offscreen,
    whole: Offscreen,
}

impl Eyes {
    fn new(gpu: &Arc<Gpu>) -> Self {
        // Two drawers, so that what one remembers cannot hide a fault of the other.
        Self { culled: drawer(gpu, SIZE), whole: drawer(gpu, SIZE) }
    }
}

/// Polygons that were not drawn, over all frames looked at.
#[derive(Clone, Copy, Debug, Default)]
struct LeftOut {
    /// Polygons of the session.
    polygons: u64,
    /// Pixels that were drawn.
    shown: usize,
    out_of_view: u64,
    hidden: u64,
}

/// Plays a session and compares at evenly spaced frames.
fn compare(gpu: &Arc<Gpu>, path: &Path, choice: CameraChoice) -> LeftOut {
    let open = || recording::open(path, &OpenOptions::default()).expect("a recording");
    let pace = Pace::Samples(16);
    let (summary, _, read) = summarize(&mut open(), pace);
    read.expect("a whole recording");
    let session = open();
    let camera = CameraPath::new(choice, session.header.camera, &summary.bounds);
    let capacity = summary.counts.polygons as usize;
    let pipeline = |kind: IndexKind| {
        let config = IndexConfig { capacity, ..IndexConfig::default() };
        Pipeline::new(kind.create(&config), capacity)
    };
    let mut by_view: Vec<Pipeline> = IndexKind::DEFAULT.iter().copied().map(pipeline).collect();
    let mut by_occlusion = Vec::new();
    for kind in Method::conservative_cullers() {
        let pass = PassConfig::for_strokes(Occlusion::Auto);
        by_occlusion.push((kind.name(), kind.add_to(pipeline(IndexKind::Osp), pass)));
    }
    let mut eyes = Eyes::new(gpu);
    let (mut scene, mut moment) = (Scene::new(), Moment::default());
    let mut left_out = LeftOut { polygons: summary.counts.polygons, ..LeftOut::default() };
    let (mut pacer, mut events, mut changes) = (Pacer::new(session, pace), Vec::new(), Vec::new());
    while pacer.next_frame(&mut events).expect("a whole recording") {
        changes.clear();
        for event in &events {
            moment.note(event);
            scene.apply(event, &mut changes);
        }
        eyes.culled.renderer.follow(&changes);
        eyes.whole.renderer.follow(&changes);
        let view = camera.view(&moment).with_aspect(eyes.whole.aspect());
        // Which polygons may hide others, they learn from frame to frame.
        for (_, pipeline) in &mut by_occlusion {
            pipeline.frame(&scene, &changes, &view);
        }
        let looked_at = |frame: u64| frame * FRAMES / summary.frames;
        let is_looked_at = looked_at(moment.frame + 1) > looked_at(moment.frame);
        moment.frame += 1;
        if !is_looked_at {
            by_view.iter_mut().for_each(|pipeline| pipeline.skip(&scene, &changes));
            continue;
        }
        let all = all_ids(&scene);
        let whole = picture_of(&mut eyes.whole, &scene, &view, &all);
        left_out.shown += whole.drawn_pixels();
        let mut check = |name: &str, ids: &[PolygonId]| {
            let differing = picture_of(&mut eyes.culled, &scene, &view, ids).differing_pixels(&whole);
            assert_eq!(differing, 0, "{}, {choice:?}, frame {}, {name}", path.display(), moment.frame);
        };
        for pipeline in &mut by_view {
            pipeline.frame(&scene, &changes, &view);
            let ids = pipeline.draw_list().to_vec();
            left_out.out_of_view += (all.len() - ids.len()) as u64;
            check(pipeline.index().name(), &ids);
        }
        for (name, pipeline) in &by_occlusion {
            let ids = pipeline.draw_list().to_vec();
            left_out.hidden += (pipeline.in_view().len() - ids.len()) as u64;
            check(name, &ids);
        }
    }
    left_out
}

#[test]
fn culling_changes_no_pixel_of_any_shipped_session() {
    let Some(gpu) = gpu() else { return };
    let mut hidden = 0;
    for path in shipped() {
        let cameras = [CameraChoice::Auto, CameraChoice::Inside].map(|choice| compare(&gpu, &path, choice));
        let out_of_view: u64 = cameras.iter().map(|left_out| left_out.out_of_view).sum();
        assert!(out_of_view > 1000, "{}: {out_of_view} polygons out of view", path.display());
        // A camera in the middle of a small model may look past all of it.
        let seeing = cameras.iter().filter(|left_out| left_out.shown > 1000).count();
        let least = if cameras[0].polygons < 1000 { 1 } else { cameras.len() };
        assert!(seeing >= least, "{}: {cameras:?}", path.display());
        eprintln!("{}: {cameras:?}", path.display());
        hidden += cameras.iter().map(|left_out| left_out.hidden).sum::<u64>();
    }
    assert!(hidden > 1000, "{hidden} polygons hidden behind others");
}
