//! `osp race` in a worker of the page, a frame at a time.

use std::path::Path;

use osp::{frame::StageClock, view::View};
use osp_lab::{
    Machine,
    bench::{self, Contender, RaceInput, RaceReport, RaceRun, Racer},
};
use osp_session::{
    recording::{Pace, Session, SynthKind, synthesize},
    replay::{ArtistSide, CameraChoice, CameraPath, main_bounds, root_cube, summarize, whole_view},
};
use serde_json::json;
use wasm_bindgen::prelude::*;

use super::files;

/// Names of all structures that can race, in the order of `osp replay --help`.
#[wasm_bindgen]
pub fn structures() -> Vec<String> {
    Contender::all().into_iter().map(|kind| kind.name().to_owned()).collect()
}

/// The longest time of a frame at 90 Hz, nanoseconds.
#[wasm_bindgen]
pub fn most_ns() -> f64 {
    Racer::MOST_NS as f64
}

/// The step in which this page's clock advances, nanoseconds: shorter times cannot be measured.
#[wasm_bindgen]
pub fn clock_step_ns() -> f64 {
    StageClock::default().step_ns() as f64
}

/// Size of the picture of the model, pixels, and the colour around the model (sRGB).
const PICTURE: (u32, u32) = (336, 180);
const GROUND: [u8; 3] = [27, 27, 27];

/// Width of the picture of the model, pixels.
#[wasm_bindgen]
pub fn picture_width() -> u32 {
    PICTURE.0
}

/// The session of a race.
#[derive(Debug)]
enum Source {
    /// The path of a file that was put here.
    File(String),
    /// Polygons of a synthetic session.
    Synthetic(u32),
}

impl Source {
    fn name(&self) -> String {
        match self {
            Self::File(path) => {
                Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned()
            }
            Self::Synthetic(polygons) => format!("synthetic {polygons}"),
        }
    }

    fn open(&self) -> Result<Session, JsError> {
        match self {
            Self::File(path) => files::open(path),
            Self::Synthetic(polygons) => Ok(synthesize(SynthKind::Scribble, *polygons, 1)),
        }
    }
}

/// A race with one run, or several runs one after the other.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Race {
    source: Source,
    input: RaceInput,
    /// The view of the pictures.
    view: View,
    runs: u32,
    run: RaceRun<Session>,
    /// Number of the run, from 1.
    number: u32,
    /// The least time of each frame in the runs that have ended.
    least: Option<bench::Race>,
}

#[wasm_bindgen]
impl Race {
    /// A race of these structures on a session that was [put](crate::put) here, with `samples` of the hand in a frame,
    /// and `runs` runs. The session is read once for its summary, and once for each run.
    ///
    /// # Errors
    /// The session cannot be read, or there is no structure with a name.
    pub fn on_file(path: String, samples: u32, runs: u32, structures: Vec<String>) -> Result<Self, JsError> {
        Self::new(Source::File(path), samples, runs, &structures)
    }

    /// A race on the session of `osp race --synth POLYGONS`.
    ///
    /// # Errors
    /// There is no structure with a name.
    pub fn on_synthetic(
        polygons: u32,
        samples: u32,
        runs: u32,
        structures: Vec<String>,
    ) -> Result<Self, JsError> {
        Self::new(Source::Synthetic(polygons), samples, runs, &structures)
    }

    fn new(source: Source, samples: u32, runs: u32, structures: &[String]) -> Result<Self, JsError> {
        let kind = |name: &String| {
            Contender::from_name(name).ok_or_else(|| JsError::new(&format!("{name}: expected a structure")))
        };
        let kinds = structures.iter().map(kind).collect::<Result<_, _>>()?;
        let pace = Pace::Samples(samples.max(1));
        let session = source.open()?;
        let header = session.header.clone();
        let mut artist = ArtistSide::default();
        let events = session.inspect(|event| event.iter().for_each(|event| artist.note(event)));
        let (summary, model, read) = summarize(events, pace);
        read?;
        let aspect = PICTURE.0 as f32 / PICTURE.1 as f32;
        let direction_to_artist = artist.direction_to_artist(header.camera);
        let view = whole_view(&main_bounds(&model, &summary.bounds), direction_to_artist, aspect);
        drop(model);
        let camera = CameraPath::new(CameraChoice::Auto, header.camera, &summary.bounds);
        let input = RaceInput {
            recording: source.name(),
            summary,
            pace,
            camera: (camera, CameraChoice::Auto.name()),
            root: root_cube(&header, &summary.bounds),
            kinds,
        };
        let run = pictured(&input, view, source.open()?);
        Ok(Self { source, input, view, runs: runs.max(1), run, number: 1, least: None })
    }

    /// The model after the latest frame: red, green, blue and opacity bytes, rows of [`picture_width`] pixels from the
    /// top.
    pub fn picture(&mut self) -> Vec<u8> {
        self.run.picture().chunks_exact(3).flat_map(|pixel| [pixel[0], pixel[1], pixel[2], u8::MAX]).collect()
    }

    /// Fingerprint of the polygons in view in the frames of this run, as `osp replay` prints it.
    pub fn fingerprint(&self) -> String {
        format!("{:016x}", self.run.race.fingerprint())
    }

    /// Frames of the whole session.
    pub fn frames(&self) -> f64 {
        self.run.race.frames as f64
    }

    /// Plays a frame. Returns `false` once the last run has ended.
    ///
    /// # Errors
    /// The session is damaged here, or two structures do not see the same polygons.
    pub fn step(&mut self) -> Result<bool, JsError> {
        while !self.run.step()? {
            if self.number > self.runs {
                return Ok(false);
            }
            let race = self.run.race.clone();
            self.least = Some(match self.least.take() {
                Some(least) => least.least(&race),
                None => race,
            });
            self.number += 1;
            if self.number > self.runs {
                return Ok(false);
            }
            self.run = pictured(&self.input, self.view, self.source.open()?);
        }
        Ok(true)
    }

    /// The figures of the latest frame as JSON: the numbers of its run and of the frame, from 1, and the polygons in
    /// the model. Each structure has the time of the frame (`ns`, and `figure` in milliseconds) and the polygons in
    /// view. It also has the frames that missed 90 Hz, and the longest frame, milliseconds.
    pub fn latest(&self) -> String {
        let race = &self.run.race;
        let frame = race.racers.first().map_or(0, |racer| racer.times_ns.len());
        let racers: Vec<_> = race.racers.iter().map(figures).collect();
        json!({ "run": self.number, "frame": frame, "polygons": race.present(), "racers": racers })
            .to_string()
    }

    /// The figures of the least times of all frames as JSON: for each structure those of [`Race::latest`], and all its
    /// `times` in nanoseconds. Before the first run has ended there are no structures.
    pub fn least(&self) -> String {
        let of = |racer: &Racer| {
            let mut figures = figures(racer);
            figures["times"] = json!(racer.times_ns);
            figures
        };
        let racers: Vec<_> = self.least.iter().flat_map(|race| &race.racers).map(of).collect();
        json!({ "racers": racers }).to_string()
    }

    /// The outcome in one sentence, as `osp race --runs` prints it.
    pub fn verdict(&self) -> String {
        let machine = Machine::here(option_env!("OSP_COMMIT"));
        let race = self.least.as_ref().unwrap_or(&self.run.race);
        RaceReport::new(race, machine, "the page's race".to_owned()).verdict
    }
}

fn pictured(input: &RaceInput, view: View, session: Session) -> RaceRun<Session> {
    RaceRun::new(input, session).with_picture(view, PICTURE, GROUND)
}

fn figures(racer: &Racer) -> serde_json::Value {
    let ns = racer.times_ns.last().copied().unwrap_or(0);
    json!({
        "name": racer.name,
        "ns": ns,
        "figure": Racer::figure_ms(ns),
        "inView": racer.in_view,
        "missed": racer.missed,
        "longest": Racer::figure_ms(racer.longest_ns),
    })
}
