//! Plays a recorded session event by event, and culls every frame: `cargo run -p osp-session --example replay_events`.

#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::{error::Error, path::Path};

use osp::{
    frame::Pipeline,
    index::{IndexConfig, Osp},
    math::Aabb,
};
use osp_session::{
    recording::{OpenOptions, Pace, open},
    replay::{CameraChoice, CameraPath, Player},
};

fn main() -> Result<(), Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../recordings/scribble.ron");
    let session = open(&path, &OpenOptions::default())?;
    let index = Osp::new(&IndexConfig::default());
    let mut pipeline = Pipeline::new(Box::new(index), 100_000);
    let camera = CameraPath::new(CameraChoice::Auto, None, &Aabb::EMPTY);
    let mut player = Player::new(session, Pace::Samples(16));
    let mut slowest_ns = 0;
    while player.step()? {
        let view = camera.view(&player.moment());
        let record = pipeline.frame(player.scene(), player.changes(), &view);
        slowest_ns = slowest_ns.max(record.total_ns());
    }
    println!("{} frames, {} polygons", player.frames(), player.scene().counts().visible);
    println!(
        "{} in view in the last frame, slowest frame {:.1} µs",
        pipeline.draw_list().len(),
        slowest_ns as f64 / 1e3
    );
    Ok(())
}
