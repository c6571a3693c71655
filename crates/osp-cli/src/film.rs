//! `osp film`: writes a session as a video (MP4) or an animated GIF.

#[cfg(feature = "window")]
use std::path::Path;
use std::{f64::consts::TAU, sync::Arc};

use anyhow::{Context, bail};
use glam::{Quat, Vec3};
use indicatif::HumanBytes;

use super::{
    film_file::{FilmFile, FilmFormat, Times},
    output::{Outcome, one_line, print_result, warn},
    parsers::Size,
    progress,
    read_session::{Keep, ReadSession},
    render_args::{Background, FilmArgs},
};
use osp::{
    math::{Aabb, rotate},
    polygon::VisibleBlocks,
    view::{Projection, View},
};
use osp_lab::report::thousands;
use osp_render::{Gpu, Layer, Offscreen, RendererConfig, background_for};
use osp_session::replay::{CameraChoice, CameraPath, Moment, main_bounds, whole_view};

/// Number of directions sampled to choose the turntable's radius.
const TURNTABLE_VIEWS: usize = 72;

pub(super) fn run(args: &FilmArgs) -> anyhow::Result<Outcome> {
    let progress = progress::bar(frame_count(args)?, "frames", &args.file.to_string_lossy());
    let film = write(args, &|frames| {
        progress.set_position(frames);
        true
    });
    progress.finish_and_clear();
    print_result(&film?)?;
    Ok(Outcome::Done)
}

/// The maker of the window's films: once around the model.
#[cfg(feature = "window")]
pub(super) fn maker() -> osp_app::FilmMaker {
    let make: osp_app::MakeFilm = |session, out, goes_on| {
        let args = FilmArgs::of_files(session, out).map_err(|error| error.to_string())?;
        write(&args, goes_on).map_err(|error| format!("{error:#}"))
    };
    let pictures: fn(&Path) -> u64 =
        |out| FilmArgs::of_files(out, out).ok().and_then(|args| frame_count(&args).ok()).unwrap_or(0);
    osp_app::FilmMaker { pictures, make }
}

fn frame_count(args: &FilmArgs) -> anyhow::Result<u64> {
    let fps = FilmFormat::of(&args.out)?.pictures_a_second(args.fps)?;
    Ok(((args.seconds * f64::from(fps)).round() as u64).max(1))
}

/// Writes the film, and returns a line about it. Calls `goes_on` with the number of finished pictures; no film is
/// written once it returns `false`.
fn write(args: &FilmArgs, goes_on: &dyn Fn(u64) -> bool) -> anyhow::Result<String> {
    let mut outputs = args.shown.force.outputs().reads([&args.file]);
    let format = FilmFormat::of(&args.out)?;
    let output = outputs.add(&args.out, &[])?;
    let (width, height) = format.size(args.size)?;
    let fps = format.pictures_a_second(args.fps)?;
    let gpu = Arc::new(Gpu::headless()?);
    let keep = if args.path == "turntable" { Keep::Model } else { Keep::Events };
    let session = ReadSession::at(&args.file, &args.shown.reading, args.shown.pace, keep)?;
    let (header, summary) = (session.header.clone(), session.summary);
    let (model, direction_to_artist) = (&session.end.scene, session.direction_to_artist);
    let file = || args.file.display().to_string();
    let Some(last) = summary.frames.checked_sub(1) else {
        bail!("{}: nothing was drawn in this session", file());
    };
    if args.path == "recorded" && summary.heads == 0 {
        bail!("{}: --path recorded: no head was recorded; `grow` and `turntable` need none", file());
    }
    let config = RendererConfig { background: background_for(model), ..RendererConfig::default() };
    let bounds = main_bounds(model, &summary.bounds);
    let mut drawer = Offscreen::on(gpu, width, height, &config)?;
    drawer.renderer.set_environment(header.environment.as_deref());
    match args.shown.background {
        Some(Background::Transparent) => {
            bail!("--background transparent: films have no transparent background")
        }
        Some(background) => background.apply(&mut drawer.renderer),
        None => {}
    }
    warn(&format!("drawn by {}", drawer.renderer.gpu.name()));
    if let Some(asked) = args.size.filter(|asked| (asked.width, asked.height) != (width, height)) {
        let Size { width: asked_width, height: asked_height } = asked;
        warn(&format!("{asked_width}x{asked_height} pixels become {width}x{height}: a video has even sides"));
    }

    let aspect = drawer.aspect();
    let whole = whole_view(&bounds, direction_to_artist, aspect);
    let path = CameraPath::new(CameraChoice::Auto, header.camera, &summary.bounds);
    let turn = Turn::new(&bounds, &whole);
    let times = Times { frames: frame_count(args)?, fps, end_stays: args.path != "turntable" };
    let view = |frame: u64, moment: &Moment| match args.path.as_str() {
        "turntable" => turn.view(frame as f64 / times.frames as f64),
        "recorded" => path.view(moment).with_aspect(aspect),
        // The default moment has no head pose, so the session's own camera determines the view.
        _ if header.camera.is_some() => path.view(&Moment::default()).with_aspect(aspect),
        _ => whole,
    };

    let name = || output.path().display().to_string();
    let mut film = FilmFile::begin(format, output.create()?, (width, height), times).with_context(name)?;
    let mut player = session.into_player();
    for frame in 0..times.frames {
        let shown = match args.path.as_str() {
            "turntable" => last,
            _ => last * (frame + 1) / times.frames,
        };
        while player.frames() <= shown && player.step()? {
            drawer.renderer.follow(player.changes());
        }
        drawer.renderer.set_time(args.shown.time + (frame as f64 / f64::from(fps)) as f32);
        let polygons: VisibleBlocks = player.scene().visible_ids().collect();
        let view = view(frame, &player.moment());
        drawer.draw_view(0, player.scene(), &view, &[Layer::plain(&polygons)])?;
        film.add(&drawer.image()?, frame).with_context(name)?;
        if !goes_on(frame + 1) {
            bail!("cancelled");
        }
    }
    let bytes = output.commit(film.finish().with_context(name)?)?;
    let size = bytes.map(|bytes| format!(", {}", HumanBytes(bytes))).unwrap_or_default();
    let name = name();
    let path = one_line(&name);
    Ok(format!("{path}: {} frames, {:.1} s{size}", thousands(times.frames), args.seconds))
}

/// A circular path of the eye around the model.
struct Turn {
    center: Vec3,
    /// Vector from the model to the eye at the start of the turn.
    away: Vec3,
    projection: Projection,
    distance_m: f32,
}

impl Turn {
    /// Creates a turn that starts in the direction of the view `whole`. All its views contain `bounds`.
    fn new(bounds: &Aabb, whole: &View) -> Self {
        let center = if bounds.is_empty() { Vec3::ZERO } else { bounds.center() };
        let away = rotate(whole.world_from_view, Vec3::Z);
        let Projection { right, top, .. } = whole.projection;
        let views = (0..TURNTABLE_VIEWS).map(|number| {
            let away = turned(away, number as f64 / TURNTABLE_VIEWS as f64);
            whole_view(bounds, Some(away), right / top)
        });
        let (mut distance_m, mut projection) = (0.0f32, whole.projection);
        for view in views {
            distance_m = distance_m.max(view.eye_in_world.distance(center));
            projection.far_m = projection.far_m.max(view.projection.far_m);
        }
        Self { center, away, projection, distance_m }
    }

    /// Returns the view after a part of the turn, from 0 to 1.
    fn view(&self, part: f64) -> View {
        let eye = self.center + turned(self.away, part) * self.distance_m;
        View::look_at(eye, self.center, self.projection)
    }
}

/// Rotates a direction about the vertical axis by a part of a full turn, from 0 to 1.
fn turned(direction: Vec3, part: f64) -> Vec3 {
    rotate(Quat::from_rotation_y((part * TAU) as f32), direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_sees_the_whole_model_and_ends_where_it_begins() {
        let bounds = Aabb { min: Vec3::new(-3.0, 0.0, -0.5), max: Vec3::new(5.0, 1.0, 0.5) };
        let whole = whole_view(&bounds, None, 16.0 / 9.0);
        let turn = Turn::new(&bounds, &whole);
        for step in 0..360 {
            let to_clip = turn.view(f64::from(step) / 360.0).clip_from_world();
            for corner in 0..8 {
                let side = |bit: u32| if corner >> bit & 1 == 1 { bounds.max } else { bounds.min };
                let p = to_clip * Vec3::new(side(0).x, side(1).y, side(2).z).extend(1.0);
                assert!(p.w > 0.0 && p.x.abs() <= p.w && p.y.abs() <= p.w && p.z >= 0.0, "{step}: {p}");
            }
        }
        let (begin, end) = (turn.view(0.0).eye_in_world, turn.view(1.0).eye_in_world);
        assert!(begin.distance(end) < 1.0e-4 * begin.length(), "{begin} {end}");
        assert!(turn.view(0.5).eye_in_world.distance(begin) > 1.0);
    }
}
