//! Guarantee "nothing visible is ever culled", on every shipped session, as pixels: the picture of what is left is the
//! picture of everything.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use osp::{
    index::{IndexConfig, IndexKind},
    metrics::{StageClock, summarize},
    recording::{self, OpenOptions, Pace, Pacer},
    render::{Gpu, Image, Layer, Offscreen, RendererConfig},
    scene::{PolygonId, Scene},
    visibility::{CameraChoice, CameraPath, Moment, Pipeline, View},
};

use super::scenes::{all_ids, gpu};

/// Odd, so that no pixel's centre lies on an axis of symmetry.
const SIZE: (u32, u32) = (481, 361);
/// Frames of each session that are looked at by each camera.
const FRAMES: u64 = 5;

fn shipped() -> Vec<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("recordings");
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
        let drawer =
            || Offscreen::on(Arc::clone(gpu), SIZE.0, SIZE.1, &RendererConfig::default()).expect("a drawer");
        Self { culled: drawer(), whole: drawer() }
    }
}

fn picture(drawer: &mut Offscreen, scene: &Scene, view: &View, ids: &[PolygonId]) -> Image {
    drawer.draw(scene, view, &[Layer::plain(ids)]).expect("a drawn frame");
    drawer.image().expect("a picture")
}

/// Plays a session and compares at evenly spaced frames; returns how many polygons culling left out in all.
fn compare(gpu: &Arc<Gpu>, path: &Path, choice: CameraChoice) -> u64 {
    let open = || recording::open(path, &OpenOptions::default()).expect("a recording");
    let pace = Pace::Samples(16);
    let (summary, _, read) = summarize(&mut open(), pace);
    read.expect("a whole recording");
    let session = open();
    let camera = CameraPath::new(choice, session.header.camera, &summary.bounds);
    let mut pipelines: Vec<Pipeline> = IndexKind::DEFAULT
        .iter()
        .map(|kind| {
            let config = IndexConfig { capacity: summary.counts.polygons as usize, ..IndexConfig::default() };
            Pipeline::new(kind.create(&config), config.capacity, StageClock::default())
        })
        .collect();
    let mut eyes = Eyes::new(gpu);
    let (mut scene, mut moment, mut left_out, mut shown) = (Scene::new(), Moment::default(), 0, 0);
    let (mut pacer, mut events, mut changes) = (Pacer::new(session, pace), Vec::new(), Vec::new());
    while pacer.next_frame(&mut events).expect("a whole recording") {
        changes.clear();
        for event in &events {
            moment.note(event);
            scene.apply(event, &mut changes);
        }
        eyes.culled.follow(&changes);
        eyes.whole.follow(&changes);
        let is_looked_at =
            (moment.frame + 1) * FRAMES / summary.frames > moment.frame * FRAMES / summary.frames;
        moment.frame += 1;
        if !is_looked_at {
            pipelines.iter_mut().for_each(|pipeline| pipeline.skip(&scene, &changes));
            continue;
        }
        let view = camera.view(&moment).with_aspect(eyes.whole.aspect());
        let all = all_ids(&scene);
        let whole = picture(&mut eyes.whole, &scene, &view, &all);
        shown += whole.drawn_pixels();
        for pipeline in &mut pipelines {
            pipeline.frame(&scene, &changes, &view);
            let ids = pipeline.draw_list().ids();
            left_out += (all.len() - ids.len()) as u64;
            let differing = picture(&mut eyes.culled, &scene, &view, ids).differing_pixels(&whole);
            let index = pipeline.index().name();
            assert_eq!(differing, 0, "{}, {choice:?}, frame {}, {index}", path.display(), moment.frame);
        }
    }
    assert!(shown > 1000, "{}: {shown} pixels drawn", path.display());
    left_out
}

#[test]
fn culling_changes_no_pixel_of_any_shipped_session() {
    let Some(gpu) = gpu() else { return };
    for path in shipped() {
        let left_out: u64 = [CameraChoice::Auto, CameraChoice::Inside]
            .into_iter()
            .map(|choice| compare(&gpu, &path, choice))
            .sum();
        assert!(left_out > 1000, "{}: {left_out} polygons left out", path.display());
    }
}
