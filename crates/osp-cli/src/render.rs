//! `osp render`: draws pictures of a session, without a window.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail};

use super::{
    output::{Outcome, one_line, print_result, warn},
    played::FrameChoice,
    progress,
    read_session::{Keep, ReadSession},
    render_args::{Background, RenderArgs, RenderCamera},
    render_order::{OrderTrials, named_orders},
    render_painter::{PainterPictures, named_painter},
    render_pictures::{Picture, Pictures},
};
use osp::{
    frame::{PassConfig, Pipeline},
    occlusion::Occlusion,
    polygon::VisibleBlocks,
    view::View,
};
use osp_lab::report::thousands;
use osp_render::{
    Colors, DrawTimes, Gpu, Image, Layer, Offscreen, RendererConfig, background_for, ffmpeg_command,
};
use osp_session::{
    replay::{CameraChoice, CameraPath, Moment, Summary, main_bounds, whole_view},
    scene::Scene,
};

impl RenderArgs {
    fn colors(&self) -> Colors {
        if self.color_by == "authors" { Colors::Authors } else { Colors::Own }
    }
}

pub(super) fn run(args: &RenderArgs) -> anyhow::Result<Outcome> {
    let rig = args.rig.path()?;
    let pictures = Pictures::new(args.size, rig.as_ref());
    let mut outputs = args.shown.force.outputs().reads([&args.file]).reads(&args.rig.screens.file());
    if let Some(out) = &args.out {
        for picture in pictures.all() {
            outputs.add(&picture.path(out), &[".png"])?;
        }
    }
    if let Some(folder) = args.to.as_ref().filter(|folder| folder.exists() && !folder.is_dir()) {
        bail!("{}: expected a folder; found a file", folder.display());
    }
    let painter = args.painter.as_deref().and_then(named_painter);
    if let Some(painter) = painter
        && args.occlusion.is_while_drawing()
    {
        let (painter, occlusion) = (painter.name(), args.occlusion.name());
        bail!("--painter {painter} draws without a depth buffer: --occlusion {occlusion} needs one");
    }
    if !args.order.is_empty() && args.occlusion.is_while_drawing() {
        let name = args.occlusion.name();
        bail!("--order needs frames that the CPU culls: --occlusion {name} has its own order");
    }
    let gpu = Arc::new(Gpu::headless()?);
    // Occlusion culling and a rig's room need the frames before the picture.
    let is_still = args.every.is_none() && matches!(args.frame, FrameChoice::Last);
    let keep = match is_still && !args.occlusion.is_on_cpu() && rig.is_none() {
        true => Keep::Model,
        false => Keep::Events,
    };
    let session = ReadSession::at(&args.file, &args.shown.reading, args.shown.pace, keep)?;
    let (header, summary) = (session.header.clone(), session.summary);
    let (model, direction_to_artist) = (&session.end.scene, session.direction_to_artist);
    let environment = &header.environment;
    let config = RendererConfig { background: background_for(model), ..RendererConfig::default() };
    let own = header.camera.filter(|_| args.camera == RenderCamera::Own);
    let fixed = args.view.or(own);
    let bounds = match args.camera {
        RenderCamera::Own | RenderCamera::Whole if fixed.is_none() => main_bounds(model, &summary.bounds),
        _ => summary.bounds,
    };
    let mut drawer = pictures.drawer(Arc::clone(&gpu), &config)?;
    drawer.set_occlusion(args.occlusion.while_drawing())?;
    drawer.renderer.set_environment(environment.as_deref());
    drawer.renderer.set_time(args.shown.time);
    drawer.renderer.set_colors(args.colors());
    let background = args.shown.background;
    if let Some(background) = background {
        background.apply(&mut drawer.renderer);
    }
    // Uses a second drawer, so that the state of the first drawer cannot hide an error.
    let mut by_painter = match painter {
        Some(painter) => Some(PainterPictures::new(painter, &gpu, args.size, &config)?),
        None => None,
    };
    let mut trials = match args.order.is_empty() {
        true => None,
        false => {
            let light = (environment.as_deref(), args.shown.time);
            Some(OrderTrials::new(
                named_orders(&args.order),
                args.repeats.into(),
                &gpu,
                args.size,
                &config,
                light,
            )?)
        }
    };
    let mut uncut = match args.check && args.painter.is_none() {
        true => Some(pictures.drawer(gpu, &config)?),
        false => None,
    };
    if let Some(uncut) = &mut uncut {
        uncut.renderer.set_environment(environment.as_deref());
        uncut.renderer.set_time(args.shown.time);
        uncut.renderer.set_colors(args.colors());
        if let Some(background) = background {
            background.apply(&mut uncut.renderer);
        }
    }
    let mut rig = rig;
    let wanted = Wanted::new(args, &summary)?;
    if let Some(folder) = &args.to {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let numbers = (0..=wanted.last).filter(|&number| wanted.has(number));
        let paths = numbers.flat_map(|number| {
            let path = wanted.path(args, number);
            pictures.all().iter().map(move |picture| picture.path(&path))
        });
        outputs.add_pictures(paths)?;
    }
    warn(&format!("drawn by {}", drawer.renderer.gpu.name()));

    let camera: Box<dyn Fn(&Moment) -> View> = match args.camera {
        _ if fixed.is_some() => {
            let path = CameraPath::new(CameraChoice::Auto, fixed, &summary.bounds);
            // The default moment has no head pose, so the fixed camera determines the view.
            let view = path.view(&Moment::default()).with_aspect(drawer.aspect());
            Box::new(move |_| view)
        }
        RenderCamera::Own | RenderCamera::Whole => {
            let view = whole_view(&bounds, direction_to_artist, drawer.aspect());
            Box::new(move |_| view)
        }
        RenderCamera::Path(choice) => {
            let path = CameraPath::new(choice, header.camera, &summary.bounds);
            let aspect = drawer.aspect();
            Box::new(move |moment| path.view(moment).with_aspect(aspect))
        }
    };
    let pipeline = Pipeline::new(args.index.create(&session.index), session.index.capacity);
    let has_occlusion = args.occlusion.is_on_cpu();
    // `auto` chooses by counts of work, because pictures must not depend on the clock.
    let pass = PassConfig::for_strokes(Occlusion::Auto);
    let mut pipeline = args.occlusion.add_to(pipeline, pass);
    let mut outcome = Outcome::Done;
    let mut player = session.into_player();
    let progress = progress::bar(wanted.last + 1, "frames", &args.file.to_string_lossy());
    while player.frames() <= wanted.last && player.step()? {
        progress.inc(1);
        let (scene, changes, moment) = (player.scene(), player.changes(), player.moment());
        drawer.renderer.follow(changes);
        if let Some(uncut) = &mut uncut {
            uncut.renderer.follow(changes);
        }
        if let Some(pictures) = &mut by_painter {
            pictures.follow(changes);
        }
        if let Some(trials) = &mut trials {
            trials.follow(changes);
        }
        if wanted.has(moment.frame) {
            let seen = pictures.seen(rig.as_mut(), &camera(&moment));
            let views: Vec<View> = seen.iter().map(|(_, view)| *view).collect();
            pipeline.frame_of_views(scene, changes, &views);
            for blind in pictures.all().iter().filter(|picture| seen.iter().all(|(seen, _)| seen != *picture))
            {
                warn(&format!("frame {}: no picture: {}", moment.frame, blind.why_not()));
            }
            for ((shown, view), ids) in seen.iter().zip(pipeline.draw_lists()) {
                if let Some(trials) = &mut trials {
                    let (figures, image) = trials.draw(moment.frame, scene, view, ids)?;
                    outputs.write_picture(&shown.path(&wanted.path(args, moment.frame)), &image)?;
                    print_result(&if args.json { figures.json()? } else { figures.table() })?;
                    continue;
                }
                if let Some(pictures) = &mut by_painter {
                    let compared = pictures.draw(scene, view, ids)?;
                    let path = shown.path(&wanted.path(args, moment.frame));
                    outputs.write_picture(&path, &pictures.image()?)?;
                    print_result(&compared.line(moment.frame, &path))?;
                    if args.check && !compared.is_explained() {
                        outcome = Outcome::CheckFailed;
                    }
                    continue;
                }
                let whole = match &mut uncut {
                    Some(uncut) => {
                        let every: VisibleBlocks = scene.visible_ids().collect();
                        let draw = |uncut: &mut Offscreen| picture(uncut, shown, scene, view, &every);
                        Some(Background::image(background, uncut, draw)?.0)
                    }
                    None => None,
                };
                let of = shown.name();
                let mut compare = |image: &Image, when: &str| {
                    let Some(whole) = &whole else { return };
                    let (frame, differing) = (moment.frame, whole.differing_pixels(image));
                    if differing > 0 {
                        warn(&format!("frame {frame}{of}{when}: culling changes {differing} pixels"));
                        outcome = Outcome::CheckFailed;
                    }
                };
                if args.occlusion.is_while_drawing() {
                    // The visible polygons of the preceding frame are the first occluders of a frame. Here the
                    // preceding frame belongs to the preceding picture, so each picture is drawn twice.
                    let (first, _) = picture(&mut drawer, shown, scene, view, ids)?;
                    compare(&first, ", drawn first");
                }
                let draw = |drawer: &mut Offscreen| picture(drawer, shown, scene, view, ids);
                let (image, times) = Background::image(background, &mut drawer, draw)?;
                let path = shown.path(&wanted.path(args, moment.frame));
                outputs.write_picture(&path, &image)?;
                print_result(&line(moment.frame, scene, ids, &times, &path))?;
                compare(&image, "");
            }
        } else if has_occlusion {
            // Runs occlusion culling in every frame, like a replay, because it collects statistics about occluders.
            let seen = pictures.seen(rig.as_mut(), &camera(&moment));
            let views: Vec<View> = seen.iter().map(|(_, view)| *view).collect();
            pipeline.frame_of_views(scene, changes, &views);
        } else {
            // The eye of the first frame determines the position of a fixed room.
            pictures.seen(rig.as_mut(), &camera(&moment));
            pipeline.skip(scene, changes);
        }
    }
    progress.finish_and_clear();
    if let Some(folder) = &args.to {
        for picture in pictures.all() {
            let ending = picture.path(Path::new("")).to_string_lossy().into_owned();
            warn(&format!("as a video: {}", one_line(&ffmpeg_command(folder, &ending, VIDEO_RATE))));
        }
    }
    if args.check && args.painter.is_none() && outcome == Outcome::Done {
        warn("culling changes no pixel");
    }
    Ok(outcome)
}

/// Frame rate in the command that --every prints for a video.
const VIDEO_RATE: u32 = 30;

fn picture(
    drawer: &mut Offscreen,
    shown: &Picture,
    scene: &Scene,
    view: &View,
    polygons: &VisibleBlocks,
) -> anyhow::Result<(Image, DrawTimes)> {
    let times = drawer.draw_view(shown.number, scene, view, &[Layer::plain(polygons)])?;
    Ok((drawer.image()?, times))
}

fn line(frame: u64, scene: &Scene, polygons: &VisibleBlocks, times: &DrawTimes, path: &Path) -> String {
    let drawn = times.occlusion.map_or(polygons.len() as u64, |counts| counts.second_pass);
    let mut line = format!(
        "frame {frame}: {} of {} polygons drawn in {:.2} ms, {}",
        thousands(drawn),
        thousands(scene.counts().visible),
        times.draw.ns as f64 * 1.0e-6,
        one_line(&path.to_string_lossy())
    );
    if let Some(counts) = times.occlusion {
        line += &format!(
            "; hzb: {} in view, {} groups tested, {} drawn for depth, {} hidden",
            thousands(counts.in_view),
            thousands(counts.groups_tested),
            thousands(counts.first_pass),
            thousands(counts.hidden()),
        );
        if let Some(passes) = times.passes {
            let ms = |ns: u64| ns as f64 * 1.0e-6;
            let [depth, test, color] = [passes.depth_ns, passes.test_ns, passes.color_ns].map(ms);
            line += &format!("; GPU ms: depth {depth:.2}, test {test:.2}, colours {color:.2}");
        }
    }
    line
}

/// The frames to draw.
struct Wanted {
    every: Option<u64>,
    last: u64,
    /// Number of digits in the names of the files, so that they sort by frame.
    digits: usize,
}

impl Wanted {
    fn new(args: &RenderArgs, summary: &Summary) -> anyhow::Result<Self> {
        let last = args.frame.number(&args.file, summary, args.shown.pace)?;
        Ok(Self { every: args.every, last, digits: summary.frames.saturating_sub(1).to_string().len() })
    }

    fn has(&self, frame: u64) -> bool {
        frame == self.last || self.every.is_some_and(|n| frame.is_multiple_of(n))
    }

    fn path(&self, args: &RenderArgs, frame: u64) -> PathBuf {
        match (&args.to, &args.out) {
            (Some(folder), _) => folder.join(format!("{frame:0width$}.png", width = self.digits)),
            (None, Some(out)) => out.clone(),
            // clap requires one of these options.
            (None, None) => PathBuf::from("osp.png"),
        }
    }
}
