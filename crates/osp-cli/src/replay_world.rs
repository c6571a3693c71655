//! `osp replay --world`: plays a flight through a world, and prints a table.

use std::{
    collections::VecDeque,
    io::Write,
    path::Path,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail, ensure};

use super::{
    outcome::Outcome,
    output::{file_name, print_result},
    outputs::Output,
    replay_args::ReplayArgs,
    session::OpenSession,
    world_args::{WorldArgs, world_name},
    world_report::WorldReport,
};
use osp::view::{Projection, View};
use osp_net::world::{Flight, Missing, Place, ResidentConfig, Walk, World};
use osp_session::{
    recording::Pacer,
    replay::{CameraChoice, CameraPath, Moment},
};

/// Number of frames of a synthetic flight.
const FRAMES: u64 = 900;
/// Frame rate to which `--speed` refers.
const FRAMES_A_SECOND: f32 = 90.0;

pub(super) fn run(args: &ReplayArgs, address: &str, csv: Option<&Output>) -> anyhow::Result<Outcome> {
    if let Some(file) = args.files.first() {
        bail!("--world takes the place of sessions: expected none; found {}", file.display());
    }
    let options = &args.world;
    let world = Arc::new(World::open(Place::to_read(address)?)?);
    let (camera, mut views) = views(args, &world)?;
    let config = ResidentConfig { memory: options.memory, loaders: usize::from(options.loaders) };
    let mut walk = Walk::new(Arc::clone(&world), config).context("--memory")?;
    let missing = if options.wait { Missing::Wait } else { Missing::Count };
    let mut report = WorldReport::new(address, &world, options, camera);
    let mut table = match csv {
        Some(output) => {
            let mut file = output.create()?;
            writeln!(file, "{}", WorldReport::COLUMNS)
                .with_context(|| output.path().display().to_string())?;
            Some((output, file))
        }
        None => None,
    };
    let rate = if options.wait { 0 } else { options.rate };
    let mut due = Instant::now();
    // Holds only the views that `--prefetch` needs. All views would need memory in proportion to `--frames`.
    let prefetch = usize::from(options.prefetch);
    let mut coming = VecDeque::with_capacity(prefetch + 1);
    loop {
        coming.extend(views.by_ref().take(prefetch + 1 - coming.len()));
        let Some(view) = coming.pop_front() else { break };
        if rate > 0 {
            let now = Instant::now();
            thread::sleep(due.saturating_duration_since(now));
            // A late frame does not shorten the frames after it.
            due = due.max(now) + Duration::from_secs(1) / u32::from(rate);
        }
        let ahead = prefetch.checked_sub(1).and_then(|last| coming.get(last));
        let frame = walk.frame(&view, ahead, missing)?;
        report.add(&frame);
        if let Some((output, file)) = &mut table {
            let line = WorldReport::line(&world_name(address), &frame);
            writeln!(file, "{line}").with_context(|| output.path().display().to_string())?;
        }
    }
    report.counts = walk.counts();
    if let Some((output, file)) = table {
        output.commit(file)?;
    }
    print_result(&if args.json { report.to_json() } else { report.text() })?;
    Ok(Outcome::Done)
}

/// Views, one for each frame.
type Views = Box<dyn Iterator<Item = View>>;

/// Returns the name of the camera, and its views.
fn views(args: &ReplayArgs, world: &World) -> anyhow::Result<(String, Views)> {
    let WorldArgs { path, frames, seed, speed, far, .. } = &args.world;
    let camera = args.play.camera;
    let far_m = far.unwrap_or(f32::INFINITY);
    let not_beyond = move |view: View| {
        let Projection { near_m, far_m: whole_m, .. } = view.projection;
        let far_m = whole_m.min(far_m);
        let projection = Projection { near_m: near_m.min(far_m * 1.0e-3), far_m, ..view.projection };
        View { projection, ..view }
    };
    if let Some(path) = path {
        let views = recorded(args, path, world, frames.unwrap_or(u64::MAX))?;
        let name = file_name(path);
        return Ok((format!("{} of {name}", camera.name()), Box::new(views.into_iter().map(not_beyond))));
    }
    let frames = frames.unwrap_or(FRAMES);
    if camera == CameraChoice::Auto {
        let flight = Flight::new(&world.bounds, *seed, speed.map(|speed| speed / FRAMES_A_SECOND), *far);
        return Ok((format!("flight with seed {seed}"), Box::new(flight.take(frames as usize))));
    }
    ensure!(camera != CameraChoice::Follow, "--camera follow needs --path: a world has no hand");
    ensure!(speed.is_none(), "--speed: expected --camera auto, the synthetic flight");
    let path = CameraPath::new(camera, None, &world.bounds);
    let view = move |frame| not_beyond(path.view(&Moment { frame, ..Moment::default() }));
    Ok((camera.name().to_owned(), Box::new((0..frames).map(view))))
}

/// Returns the views of a session's recorded head. Ignores its strokes.
fn recorded(args: &ReplayArgs, file: &Path, world: &World, most: u64) -> anyhow::Result<Vec<View>> {
    let session = OpenSession::open(file, &args.play.reading)?;
    let camera = CameraPath::new(args.play.camera, session.header.camera, &world.bounds);
    let mut pacer = Pacer::new(session, args.play.pace);
    let (mut events, mut moment, mut views) = (Vec::new(), Moment::default(), Vec::new());
    let mut has_head = false;
    while (views.len() as u64) < most && pacer.next_frame(&mut events)? {
        events.iter().for_each(|event| moment.note(event));
        has_head |= moment.head.is_some();
        // Before the first head pose there is no path to follow.
        if moment.head.is_some() || args.play.camera != CameraChoice::Auto {
            views.push(camera.view(&moment));
        }
        moment.frame += 1;
        let most_frames = args.play.reading.options().limits.frames();
        ensure!(
            views.len() as u64 <= most_frames,
            "{}: expected at most {most_frames} frames",
            file.display()
        );
    }
    if !has_head && args.play.camera == CameraChoice::Auto {
        bail!("{}: expected a session with a recorded head path; found none", file.display());
    }
    Ok(views)
}
