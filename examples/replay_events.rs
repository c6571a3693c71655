//! A recorded session, played event by event through a scene and the index: `cargo run --example replay_events`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::{error::Error, path::Path};

use osp::{
    frame::{Pipeline, StageClock},
    index::{IndexConfig, Osp},
    math::Aabb,
    recording::{OpenOptions, Pace, Pacer, open},
    replay::{CameraChoice, CameraPath, Moment},
    scene::Scene,
};

fn main() -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings/scribble.ron");
    let session = open(&path, &OpenOptions::default())?;
    let index = Osp::new(&IndexConfig::default());
    let mut pipeline = Pipeline::new(Box::new(index), 100_000, StageClock::default());
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let mut pacer = Pacer::new(session, Pace::Samples(16));
    let (mut scene, mut moment) = (Scene::new(), Moment::default());
    let (mut events, mut changes, mut slowest_ns) = (Vec::new(), Vec::new(), 0);
    while pacer.next_frame(&mut events)? {
        events.iter().for_each(|event| moment.note(event));
        changes.clear();
        scene.apply_all(&events, &mut changes);
        let record = pipeline.frame(&scene, &changes, &camera.view(&moment));
        slowest_ns = slowest_ns.max(record.total_ns());
        moment.frame += 1;
    }
    println!("{} frames, {} polygons", moment.frame, scene.counts().visible);
    println!(
        "{} in view in the last frame, slowest frame {:.1} us",
        pipeline.draw_list().len(),
        slowest_ns as f64 / 1e3
    );
    Ok(())
}
