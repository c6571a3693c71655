use std::{path::PathBuf, sync::Arc};

use numpy::{PyArray1, PyArray3, PyArrayMethods};
use osp::{
    frame::{PassConfig, Pipeline},
    glam::Vec3,
    index::IndexConfig,
    math::Aabb,
    occlusion::Occlusion,
    view::{self, Projection},
};
use osp_lab::Method;
use osp_render::{Gpu, Image, Layer, Offscreen, RendererConfig, background_for};
use osp_rivals::IndexKind;
use osp_session::{
    recording::{Header, OpenOptions, Pace, open},
    replay::{
        ArtistSide, CameraChoice, CameraPath, Moment, Player, Summary, main_bounds, summarize, whole_view,
    },
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyString};

use crate::{
    errors, names,
    recording::options,
    replay::{pace, root_cube},
    signals::Signals,
    view::View,
};

/// Longest side of a picture, pixels. Many adapters cannot draw larger pictures.
const MOST_PIXELS: i64 = 16_384;
/// Permitted times for animated brushes, seconds.
const TIMES_SECS: std::ops::RangeInclusive<f64> = 0.0..=1.0e4;

/// The position of the eye in a picture.
#[derive(Clone, Copy)]
enum Eye {
    /// A position from which the eye sees the whole model.
    Whole,
    /// The same as in a replay.
    Path(CameraChoice),
    Fixed(view::View),
}

/// The settings of a picture.
struct Settings {
    path: PathBuf,
    size: (u32, u32),
    /// The number of the frame; `None` for the last frame.
    frame: Option<i64>,
    eye: Eye,
    occlusion: Method,
    pace: Pace,
    time_s: f32,
    options: OpenOptions,
}

/// Draws a picture of a frame of a session: 8 bits for each of red, green, blue and opacity, rows from the top.
#[pyfunction]
#[pyo3(signature = (path, size, frame, view, occlusion, pace, time_secs, lenient, max_polygons))]
#[expect(clippy::too_many_arguments, reason = "the arguments of `osp.render`")]
pub(crate) fn render_frame<'py>(
    py: Python<'py>,
    path: PathBuf,
    size: Vec<i64>,
    frame: Option<i64>,
    view: &Bound<'py, PyAny>,
    occlusion: Option<&str>,
    pace: &str,
    time_secs: f64,
    lenient: bool,
    max_polygons: Option<u64>,
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    if !TIMES_SECS.contains(&time_secs) {
        let message = format!("time_secs: expected a number from 0 to 10000; found {time_secs}");
        return Err(PyValueError::new_err(message));
    }
    let settings = Settings {
        path,
        size: self::size(&size)?,
        frame,
        eye: eye(view)?,
        occlusion: occlusion.map_or(Ok(Method::NONE), names::drawn)?,
        pace: self::pace(pace)?,
        time_s: time_secs as f32,
        options: options(lenient, max_polygons)?,
    };
    let image = py.detach(|| draw(&settings))?;
    let shape = [image.height() as usize, image.width() as usize, 4];
    PyArray1::from_slice(py, image.rgba()).reshape(shape)
}

fn size(size: &[i64]) -> PyResult<(u32, u32)> {
    match *size {
        [width, height] if [width, height].iter().all(|side| (1..=MOST_PIXELS).contains(side)) => {
            Ok((width as u32, height as u32))
        }
        _ => Err(PyValueError::new_err(format!(
            "size: expected width and height, 1 to {MOST_PIXELS} pixels each; found {size:?}"
        ))),
    }
}

fn eye(view: &Bound<'_, PyAny>) -> PyResult<Eye> {
    match view.cast::<PyString>() {
        Ok(name) if name.to_cow()? == "whole" => Ok(Eye::Whole),
        Ok(name) => Ok(Eye::Path(names::picture_camera(&name.to_cow()?)?)),
        Err(_) => Ok(Eye::Fixed(View::of(view, None)?.view)),
    }
}

/// Plays the session up to the frame as `osp replay` does, culls by the index, and draws the remaining polygons.
fn draw(settings: &Settings) -> PyResult<Image> {
    let Settings { path, size, occlusion, pace, time_s, options, .. } = settings;
    let failed = |error| errors::of_recording(&error);
    let undrawn = |error| errors::of_drawing(&error);
    let session = open(path, options).map_err(failed)?;
    let header = session.header.clone();
    // A missing adapter is reported before a long session is read.
    let gpu = Arc::new(Gpu::headless().map_err(undrawn)?);
    let mut artist = ArtistSide::default();
    let events = session.inspect(|event| event.iter().for_each(|event| artist.note(event)));
    let (summary, model, read) = summarize(events, *pace);
    read.map_err(failed)?;
    let wanted = settings.wanted(&summary)?;

    let config = RendererConfig { background: background_for(&model), ..RendererConfig::default() };
    let whole = main_bounds(&model, &summary.bounds);
    drop(model);
    let mut drawer = Offscreen::on(gpu, size.0, size.1, &config).map_err(undrawn)?;
    drawer.set_occlusion(occlusion.while_drawing()).map_err(undrawn)?;
    drawer.renderer.set_environment(header.environment.as_deref());
    drawer.renderer.set_time(*time_s);
    let camera = settings.camera(
        &header,
        (&summary.bounds, &whole),
        artist.direction_to_artist(header.camera),
        drawer.aspect(),
    );
    let capacity = usize::try_from(summary.counts.polygons).unwrap_or(usize::MAX);
    let index = IndexConfig { root: root_cube(&header, &summary.bounds), capacity };
    let pipeline = Pipeline::new(IndexKind::Osp.create(&index), capacity);
    // Pictures must not depend on the clock.
    let pass = PassConfig::for_strokes(Occlusion::Auto);
    let mut pipeline = occlusion.add_to(pipeline, pass);
    let learns = occlusion.is_on_cpu();

    let mut player = Player::new(open(path, options).map_err(failed)?, *pace);
    let mut signals = Signals::new();
    while player.frames() <= wanted && player.step().map_err(failed)? {
        let (scene, changes, moment) = (player.scene(), player.changes(), player.moment());
        drawer.renderer.follow(changes);
        if moment.frame == wanted {
            let view = camera(&moment);
            pipeline.frame(scene, changes, &view);
            // A method that culls while drawing uses the visible polygons of the previous drawing as occluders.
            let times = if occlusion.is_while_drawing() { 2 } else { 1 };
            for _ in 0..times {
                let shown = [Layer::plain(pipeline.draw_list())];
                drawer.draw(scene, &view, &shown).map_err(undrawn)?;
            }
            return drawer.image().map_err(undrawn);
        }
        if learns {
            // As in a replay, each frame improves the choice of the occluders.
            pipeline.frame(scene, changes, &camera(&moment));
        } else {
            pipeline.skip(scene, changes);
        }
        signals.check()?;
    }
    Err(PyValueError::new_err(format!("{}: it became shorter while it was read", path.display())))
}

impl Settings {
    /// Returns the number of the frame to draw.
    fn wanted(&self, summary: &Summary) -> PyResult<u64> {
        let path = self.path.display();
        let Some(last) = summary.frames.checked_sub(1) else {
            return Err(PyValueError::new_err(format!("{path}: nothing was drawn in this session")));
        };
        let Some(frame) = self.frame else { return Ok(last) };
        u64::try_from(frame).ok().filter(|&frame| frame <= last).ok_or_else(|| {
            let pace = self.pace;
            let message = format!(
                "frame: expected 0 to {last}, as {path} has {} frames at the pace {pace}; found {frame}",
                summary.frames
            );
            PyValueError::new_err(message)
        })
    }

    /// Returns a function from a moment to its view, with the aspect ratio of the picture.
    fn camera(
        &self,
        header: &Header,
        (bounds, whole): (&Aabb, &Aabb),
        direction_to_artist: Option<Vec3>,
        aspect: f32,
    ) -> Box<dyn Fn(&Moment) -> view::View> {
        match self.eye {
            Eye::Whole => {
                let view = whole_view(whole, direction_to_artist, aspect);
                Box::new(move |_| view)
            }
            Eye::Path(choice) => {
                let path = CameraPath::new(choice, header.camera, bounds);
                Box::new(move |moment| path.view(moment).with_aspect(aspect))
            }
            Eye::Fixed(view) => {
                let view = with_an_end(&view, bounds).with_aspect(aspect);
                Box::new(move |_| view)
            }
        }
    }
}

/// Returns the view with a finite far distance that lies behind the whole model. The renderer cannot draw an infinite
/// view.
fn with_an_end(view: &view::View, bounds: &Aabb) -> view::View {
    let Projection { near_m, far_m, .. } = view.projection;
    if far_m.is_finite() {
        return *view;
    }
    let reach_m = match bounds.is_empty() {
        true => 0.0,
        false => view.eye_in_world.distance(bounds.center()) + bounds.extent().length(),
    };
    view::View { projection: Projection { far_m: reach_m.max(near_m * 100.0), ..view.projection }, ..*view }
}
