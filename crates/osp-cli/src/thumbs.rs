//! `osp thumbs`: draws a picture of each session.

use std::sync::Arc;

use anyhow::ensure;

use super::{
    batch::{Batch, Job},
    output::{Outcome, warn},
    outputs::Outputs,
    read_session::{Keep, ReadSession},
    render_args::{Background, MOMENT_S, ThumbsArgs},
    session::OpenSession,
};
use osp::polygon::{Change, VisibleBlocks};
use osp_render::{Gpu, Layer, Offscreen, RendererConfig, background_for};
use osp_session::{recording::Pace, replay::still_view};

pub(super) fn run(args: &ThumbsArgs) -> anyhow::Result<Outcome> {
    // Without --out, `NAME.png` in the folder of a session may be the artist's own picture.
    let ending = if args.out.is_some() { ".png" } else { ".thumb.png" };
    let batch = Batch::plan(&args.files, args.out.as_deref(), ending, args.force.force)?;
    batch.run(1, ["drawn", ending], || {
        let gpu = Arc::new(Gpu::headless()?);
        warn(&format!("drawn by {}", gpu.name()));
        Ok(move |job: &Job| draw(args, job, &gpu))
    })
}

/// Draws one session. Returns the reader's remarks.
fn draw(args: &ThumbsArgs, job: &Job, gpu: &Arc<Gpu>) -> anyhow::Result<Vec<String>> {
    let mut outputs = Outputs::new(job.replaces).reads([&job.source]);
    let output = outputs.add(&job.target, &[])?;
    let mut session = OpenSession::open(&job.source, &args.reading)?.counted();
    let (header, pace) = (session.header.clone(), Pace::Samples(16));
    let (read_session, read) = ReadSession::of(header, session.by_ref(), pace, Keep::Model, |_, _| {});
    read?;
    let ReadSession { header, summary, end, direction_to_artist, .. } = read_session;
    let scene = end.scene;
    ensure!(scene.visible_ids().next().is_some(), "nothing was drawn in this session");
    let config = RendererConfig { background: background_for(&scene), ..RendererConfig::default() };
    let mut drawer = Offscreen::on(Arc::clone(gpu), args.size.width, args.size.height, &config)?;
    drawer.renderer.set_environment(header.environment.as_deref());
    drawer.renderer.set_time(MOMENT_S);
    let changes: Vec<Change> = scene.visible_ids().map(Change::Insert).collect();
    drawer.renderer.follow(&changes);
    let polygons: VisibleBlocks = scene.visible_ids().collect();
    let view = still_view(&scene, &summary.bounds, header.camera, direction_to_artist, drawer.aspect());
    if let Some(background) = args.background {
        background.apply(&mut drawer.renderer);
    }
    let (image, ()) = Background::image(args.background, &mut drawer, |drawer| {
        drawer.draw_view(0, &scene, &view, &[Layer::plain(&polygons)])?;
        Ok((drawer.image()?, ()))
    })?;
    output.write_by(|file| image.write_png_to(file))?;
    Ok(session.not_shown().into_iter().chain(session.notes().warnings.iter().cloned()).collect())
}
