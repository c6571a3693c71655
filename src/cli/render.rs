//! `osp render`: pictures of a session, without a window.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, bail};
use clap::{
    Args,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
};
use glam::Vec3;

use super::{
    Outcome,
    frame_choice::FrameChoice,
    numbers,
    output::{complain, one_line, say},
    outputs::Outputs,
    parsers::{Size, index_parser, occlusion_parser},
    progress,
    reading::ReadArgs,
    render_order::{self, OrderTrials, order_parser},
    render_painter::{PainterPictures, painter_parser},
    render_pictures::{Picture, Pictures},
    rig_args::RigPathArgs,
    session::OpenSession,
};
use crate::{
    frame::{AutoBasis, PassConfig, Pipeline, StageClock},
    index::IndexConfig,
    lab::report::thousands,
    math::{rotate, unit},
    occlusion::Occlusion,
    output_file::OutputKind,
    polygon::VisibleBlocks,
    recording::{Camera, Pace},
    render::{
        Colors, DrawTimes, Gpu, Image, Layer, Offscreen, Painter, RendererConfig, background_for,
        ffmpeg_command,
    },
    replay::{
        ArtistSide, CameraChoice, CameraPath, Moment, Player, Summary, root_cube, summarize, whole_view,
    },
    rivals::IndexKind,
    scene::Scene,
    view::View,
};

/// Draw frames of a session to PNG files, without a window.
///
/// The command plays the session up to the frame as `osp replay` does, culls by the index, and draws what is left on the
/// graphics adapter (one in software will do).
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp render recordings/portrait.ron portrait.png
  osp render sketch.tilt --frame 120 --camera orbit --size 1920x1080 sketch.png
  osp render sketch.tilt sketch.png --view '(p:(0,1.6,3),q:(0,0,0,1),fov_degrees:60)'
  osp render painting.apa --every 30 --to frames/
  osp render recordings/portrait.ron --every 50 --to frames/ --occlusion msvbsp --check
  osp render sketch.tilt sketch.png --occlusion hzb --check
  osp render recordings/room.ron room.png --painter bsp --check
  osp render sketch.tilt sketch.png --order all
  osp render recordings/class.ron class.png --color-by authors
  osp render recordings/room.ron room.png --rig dual-wall --stereo mono --camera recorded

With --rig there is a picture for each screen and eye, with their names: room-left-right-eye.png is
what the right eye sees on the screen `left`. --size gives the height; the width follows the screen.
The camera's eye is the head before the screens.

With --occlusion hzb each picture is drawn twice, as two frames of a camera at rest; the figures
are those of the second. --check compares both with the picture without culling: the first draws
with what was visible in the picture before, which has another view and an earlier model.
--painter draws every polygon solid in its plain colour, whatever brush has painted it, and so
does the picture that it is compared with. A pixel counts as explained by an edge if its colour lies
between those of the nine pixels around it in the other picture.
`osp replay --help` describes the indexes and the methods of occlusion culling.")]
pub(super) struct RenderArgs {
    /// The session: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
    file: PathBuf,
    /// The picture to write.
    #[arg(value_name = "OUT.png", required_unless_present_any = ["to", "every"])]
    out: Option<PathBuf>,
    /// The frame to draw: its number from 0, or `last`.
    #[arg(long, default_value = "last", conflicts_with = "every")]
    frame: FrameChoice,
    /// Draw every Nth frame and the last one, into the folder --to.
    #[arg(long, value_name = "N", requires = "to", conflicts_with = "out", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<u64>,
    /// The folder for the pictures of --every; osp makes it if it does not exist.
    #[arg(long, value_name = "DIR", requires = "every")]
    to: Option<PathBuf>,
    /// Width and height in pixels.
    #[arg(long, default_value = "1280x720")]
    size: Size,
    /// The index that finds what is in view.
    #[arg(long, default_value = "osp", value_parser = index_parser())]
    index: IndexKind,
    /// Also cull hidden polygons by this method.
    #[arg(long, default_value = "none", value_parser = occlusion_parser())]
    occlusion: Occlusion,
    /// Draw every polygon of the model, without culling.
    #[arg(long, conflicts_with = "check")]
    no_cull: bool,
    /// Draw each frame a second time without culling; a pixel that differs gives exit code 1.
    #[arg(long)]
    check: bool,
    /// Draw by the painter's algorithm: what is in view back to front, one over the other, without a test of depth. `bsp`
    /// finds the order by a BSP tree, which cuts polygons where there is none; `centre` sorts by the distance of their
    /// middles. The picture is compared with that of the depth buffer; with --check, more than one pixel in 10,000 that no
    /// edge explains gives exit code 1.
    #[arg(long, value_name = "ORDER", conflicts_with_all = ["no_cull", "rig"], value_parser = painter_parser())]
    painter: Option<Painter>,
    /// Also draw each frame with its opaque polygons in other orders, separated by commas, and print a table of what each
    /// costs: the time of drawing, overdraw, draw calls, changes of material. The picture is that of the first. `none` is
    /// the renderer's own, by number.
    #[arg(long, value_delimiter = ',', value_parser = order_parser())]
    #[arg(conflicts_with_all = ["painter", "check", "no_cull", "rig"])]
    order: Vec<render_order::Wanted>,
    /// Rounds of --order, after one that does not count; each draws every order.
    #[arg(long, value_name = "N", requires = "order", default_value_t = 9, value_parser = clap::value_parser!(u16).range(1..))]
    repeats: u16,
    /// Print the figures of --order as JSON, an object a frame.
    #[arg(long, requires = "order")]
    json: bool,
    /// How much of the session a frame takes: `recorded` (by its time stamps) or `samples:N` (N samples of
    /// the hand).
    #[arg(long, default_value = "samples:16")]
    pace: Pace,
    /// Where the eye is: `whole` shows the whole model, from the side of the session's own camera, or from which the
    /// artist began it; `recorded` is the recorded head path, else the session's own camera, else `orbit`; `orbit`
    /// circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "whole", value_parser = camera_parser())]
    camera: RenderCamera,
    /// Where the eye is, in place of --camera, as the header of a recording says it: `(p: (x, y, z), q: (x, y, z, w),
    /// fov_degrees: 60)` is the eye in metres, the turn from view to world, and the vertical field of view.
    #[arg(long, conflicts_with = "camera")]
    view: Option<Camera>,
    /// Colour strokes as they were painted (`own`), or by who drew them (`authors`, which `osp info` lists).
    #[arg(long, value_name = "WHOSE", default_value = "own", value_parser = ["own", "authors"], conflicts_with_all = ["painter", "order"])]
    color_by: String,
    /// The moment that brushes which move by themselves are seen at, seconds after the beginning.
    #[arg(long, default_value_t = 10.0, value_parser = numbers::moment_s)]
    time: f32,
    #[command(flatten)]
    reading: ReadArgs,
    /// Let a picture replace a file of another kind, but never the session.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    rig: RigPathArgs,
}

impl RenderArgs {
    fn colors(&self) -> Colors {
        if self.color_by == "authors" { Colors::Authors } else { Colors::Own }
    }
}

/// The position of a picture's eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RenderCamera {
    /// So that it sees the whole model.
    Whole,
    /// As in a replay.
    Path(CameraChoice),
}

fn camera_parser() -> impl TypedValueParser<Value = RenderCamera> {
    // `auto`, as in a replay, is accepted for `recorded`.
    let names = ["whole", "recorded", "orbit", "follow", "inside"].map(PossibleValue::new);
    let names = names.into_iter().chain([PossibleValue::new("auto").hide(true)]);
    PossibleValuesParser::new(names).try_map(|name| match name.as_str() {
        "whole" => Ok(RenderCamera::Whole),
        "recorded" => Ok(RenderCamera::Path(CameraChoice::Auto)),
        name => {
            let found = CameraChoice::ALL.iter().find(|choice| choice.name() == name);
            found
                .map(|choice| RenderCamera::Path(*choice))
                .ok_or_else(|| format!("no camera is called {name}"))
        }
    })
}

pub(super) fn run(args: &RenderArgs) -> anyhow::Result<Outcome> {
    let rig = args.rig.path()?;
    let pictures = Pictures::new(args.size, rig.as_ref());
    let mut outputs = Outputs::new(args.force).reads([&args.file]).reads(&args.rig.screens.file());
    if let Some(out) = &args.out {
        for picture in pictures.all() {
            outputs.add("OUT.png", &picture.path(out), OutputKind::Png)?;
        }
    }
    if let Some(folder) = args.to.as_ref().filter(|folder| folder.exists() && !folder.is_dir()) {
        bail!("{}: expected a folder; found a file", folder.display());
    }
    if let Some(painter) = args.painter
        && args.occlusion.is_while_drawing()
    {
        let (painter, occlusion) = (painter.name(), args.occlusion.name());
        bail!("--painter {painter} draws without a depth buffer: --occlusion {occlusion} needs one");
    }
    if !args.order.is_empty() && args.occlusion.is_while_drawing() {
        let name = args.occlusion.name();
        bail!("--order is of frames that the CPU culls: --occlusion {name} has an order of its own");
    }
    let gpu = Arc::new(Gpu::headless()?);
    let mut session = OpenSession::open(&args.file, &args.reading)?.counted();
    let environment = session.header.environment.clone();
    let mut artist = ArtistSide::default();
    let events = session.by_ref().inspect(|event| event.iter().for_each(|event| artist.note(event)));
    let (summary, model, read) = summarize(events, args.pace);
    for warning in &session.notes().warnings {
        complain(&format!("warning: {warning}"));
    }
    read?;
    let config = RendererConfig { background: background_for(&model), ..RendererConfig::default() };
    drop(model);
    let mut drawer = pictures.drawer(Arc::clone(&gpu), &config)?;
    drawer.set_occlusion(args.occlusion)?;
    drawer.set_environment(environment.as_deref());
    drawer.set_time(args.time);
    drawer.set_colors(args.colors());
    // A second drawer, so that what one remembers cannot hide a fault of the other.
    let mut by_painter = match args.painter {
        Some(painter) => Some(PainterPictures::new(painter, &gpu, args.size, &config)?),
        None => None,
    };
    let mut trials = match args.order.is_empty() {
        true => None,
        false => {
            let light = (environment.as_deref(), args.time);
            Some(OrderTrials::new(&args.order, args.repeats.into(), &gpu, args.size, &config, light)?)
        }
    };
    let mut uncut = match args.check && args.painter.is_none() {
        true => Some(pictures.drawer(gpu, &config)?),
        false => None,
    };
    if let Some(uncut) = &mut uncut {
        uncut.set_environment(environment.as_deref());
        uncut.set_time(args.time);
        uncut.set_colors(args.colors());
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
        outputs.add_pictures("--to", paths)?;
    }
    complain(&format!("drawn by {}", drawer.gpu().name()));

    let session = OpenSession::open(&args.file, &args.reading)?;
    let camera: Box<dyn Fn(&Moment) -> View> = match args.camera {
        _ if args.view.is_some() => {
            let path = CameraPath::new(CameraChoice::Auto, args.view, &summary.bounds);
            // Without a head: nothing comes before the fixed camera.
            let view = path.view(&Moment::default()).with_aspect(drawer.aspect());
            Box::new(move |_| view)
        }
        RenderCamera::Whole => {
            let of_camera = session.header.camera.map(|camera| rotate(unit(camera.q), Vec3::Z));
            let backwards = of_camera.or_else(|| artist.backwards());
            let view = whole_view(&summary.bounds, backwards, drawer.aspect());
            Box::new(move |_| view)
        }
        RenderCamera::Path(choice) => {
            let path = CameraPath::new(choice, session.header.camera, &summary.bounds);
            let aspect = drawer.aspect();
            Box::new(move |moment| path.view(moment).with_aspect(aspect))
        }
    };
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let config = IndexConfig { root: root_cube(&session.header, &summary.bounds), capacity };
    let pipeline = Pipeline::new(args.index.create(&config), capacity, StageClock::default());
    let has_occlusion = args.occlusion.has_culler() || args.occlusion == Occlusion::DepthLast;
    // Pictures must not depend on the clock.
    let pass = PassConfig { basis: AutoBasis::Work, ..PassConfig::new(args.occlusion) };
    let mut pipeline = pipeline.with_occlusion(pass);
    let mut outcome = Outcome::Done;
    let mut player = Player::new(session, args.pace);
    let progress = progress::bar(wanted.last + 1, "frames", &args.file.to_string_lossy());
    while player.frames() <= wanted.last && player.step()? {
        progress.inc(1);
        let (scene, changes, moment) = (player.scene(), player.changes(), player.moment());
        drawer.follow(changes);
        if let Some(uncut) = &mut uncut {
            uncut.follow(changes);
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
                complain(&format!("frame {}: no picture: {}", moment.frame, blind.why_not()));
            }
            for ((shown, view), in_list) in seen.iter().zip(pipeline.draw_lists()) {
                let every: VisibleBlocks;
                let ids = if args.no_cull {
                    every = scene.visible_ids().collect();
                    &every
                } else {
                    in_list
                };
                if let Some(trials) = &mut trials {
                    let (figures, image) = trials.draw(moment.frame, scene, view, ids)?;
                    image.write_png(&shown.path(&wanted.path(args, moment.frame)))?;
                    say(&if args.json { figures.json()? } else { figures.table() })?;
                    continue;
                }
                if let Some(pictures) = &mut by_painter {
                    let compared = pictures.draw(scene, view, ids)?;
                    let path = shown.path(&wanted.path(args, moment.frame));
                    pictures.image()?.write_png(&path)?;
                    say(&compared.line(moment.frame, &path))?;
                    if args.check && !compared.is_explained() {
                        outcome = Outcome::CheckFailed;
                    }
                    continue;
                }
                let whole = match &mut uncut {
                    Some(uncut) => {
                        let every: VisibleBlocks = scene.visible_ids().collect();
                        Some(picture(uncut, shown, scene, view, &every)?.0)
                    }
                    None => None,
                };
                let of = shown.name();
                let mut compare = |image: &Image, when: &str| {
                    let differing = whole.as_ref().map_or(0, |whole| whole.differing_pixels(image));
                    if differing > 0 {
                        let frame = moment.frame;
                        complain(&format!("frame {frame}{of}{when}: culling changes {differing} pixels"));
                        outcome = Outcome::CheckFailed;
                    }
                };
                if args.occlusion.is_while_drawing() {
                    // The polygons of the last frame occlude in the next; here the last frame is the last picture.
                    let (first, _) = picture(&mut drawer, shown, scene, view, ids)?;
                    compare(&first, ", drawn first");
                }
                let (image, times) = picture(&mut drawer, shown, scene, view, ids)?;
                let path = shown.path(&wanted.path(args, moment.frame));
                image.write_png(&path)?;
                say(&line(moment.frame, scene, ids, &times, &path))?;
                compare(&image, "");
            }
        } else if has_occlusion {
            // As a replay does: which polygons may hide others, it learns from frame to frame.
            let seen = pictures.seen(rig.as_mut(), &camera(&moment));
            let views: Vec<View> = seen.iter().map(|(_, view)| *view).collect();
            pipeline.frame_of_views(scene, changes, &views);
        } else {
            // A room that stands stands where the first eye is.
            pictures.seen(rig.as_mut(), &camera(&moment));
            pipeline.skip(scene, changes);
        }
    }
    progress.finish_and_clear();
    if let Some(folder) = &args.to {
        for picture in pictures.all() {
            let ending = picture.path(Path::new("")).to_string_lossy().into_owned();
            complain(&format!("as a video: {}", one_line(&ffmpeg_command(folder, &ending, VIDEO_RATE))));
        }
    }
    if args.check && args.painter.is_none() && outcome == Outcome::Done {
        complain("culling changes no pixel");
    }
    Ok(outcome)
}

/// Pictures a second in the video of --every.
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
    /// Digits of the largest number, so that the files sort.
    digits: usize,
}

impl Wanted {
    fn new(args: &RenderArgs, summary: &Summary) -> anyhow::Result<Self> {
        let last = args.frame.number(&args.file, summary, args.pace)?;
        Ok(Self { every: args.every, last, digits: summary.frames.saturating_sub(1).to_string().len() })
    }

    fn has(&self, frame: u64) -> bool {
        frame == self.last || self.every.is_some_and(|n| frame.is_multiple_of(n))
    }

    fn path(&self, args: &RenderArgs, frame: u64) -> PathBuf {
        match (&args.to, &args.out) {
            (Some(folder), _) => folder.join(format!("{frame:0width$}.png", width = self.digits)),
            (None, Some(out)) => out.clone(),
            // clap asks for one of them.
            (None, None) => PathBuf::from("osp.png"),
        }
    }
}
