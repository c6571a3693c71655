//! `osp race` in a worker of the page, a frame at a time.

use std::path::Path;

use osp::frame::StageClock;
use osp_lab::{
    Machine,
    bench::{Contender, RaceInput, RaceReport, RaceRun, Racer},
};
use osp_session::{
    recording::{Pace, Session, SynthKind, synthesize},
    replay::{CameraChoice, CameraPath, root_cube, summarize},
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

/// A race that is on.
#[wasm_bindgen]
#[derive(Debug)]
pub struct Race {
    run: RaceRun<Session>,
}

#[wasm_bindgen]
impl Race {
    /// A race of these structures on a session that was [put](crate::put) here, with so many samples of the hand in a
    /// frame. The session is read once for its summary.
    ///
    /// # Errors
    /// The session cannot be read, or there is no structure with a name.
    pub fn on_file(path: &str, samples: u32, structures: Vec<String>) -> Result<Self, JsError> {
        let name = Path::new(path).file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self::new(name, samples, &structures, || files::open(path))
    }

    /// A race on the session of `osp race --synth POLYGONS`.
    ///
    /// # Errors
    /// There is no structure with a name.
    pub fn on_synthetic(polygons: u32, samples: u32, structures: Vec<String>) -> Result<Self, JsError> {
        let open = || Ok(synthesize(SynthKind::Scribble, polygons, 1));
        Self::new(format!("synthetic {polygons}"), samples, &structures, open)
    }

    fn new(
        recording: String,
        samples: u32,
        structures: &[String],
        open: impl Fn() -> Result<Session, JsError>,
    ) -> Result<Self, JsError> {
        let kind = |name: &String| {
            Contender::from_name(name).ok_or_else(|| JsError::new(&format!("{name}: expected a structure")))
        };
        let kinds = structures.iter().map(kind).collect::<Result<_, _>>()?;
        let pace = Pace::Samples(samples.max(1));
        let session = open()?;
        let header = session.header.clone();
        let (summary, _, read) = summarize(session, pace);
        read?;
        let camera = CameraPath::new(CameraChoice::Auto, header.camera, &summary.bounds);
        let input = RaceInput {
            recording,
            summary,
            pace,
            camera: (camera, CameraChoice::Auto.name()),
            root: root_cube(&header, &summary.bounds),
            kinds,
        };
        Ok(Self { run: RaceRun::new(&input, open()?) })
    }

    /// Frames of the whole session.
    pub fn frames(&self) -> f64 {
        self.run.race().frames() as f64
    }

    /// Plays a frame. `false`: the race has ended.
    ///
    /// # Errors
    /// The session is damaged here, or two structures do not see the same polygons.
    pub fn step(&mut self) -> Result<bool, JsError> {
        Ok(self.run.step()?)
    }

    /// The figures of the latest frame as JSON: its number from 1, the polygons in the model, and for each structure the
    /// time of the frame (`ns`, and `figure` in milliseconds), the polygons in view, the frames that missed 90 Hz, and
    /// the longest frame, milliseconds.
    pub fn latest(&self) -> String {
        let race = self.run.race();
        let of = |racer: &Racer| {
            let ns = racer.times_ns().last().copied().unwrap_or(0);
            json!({
                "name": racer.name(),
                "ns": ns,
                "figure": Racer::figure_ms(ns),
                "inView": racer.in_view(),
                "missed": racer.missed(),
                "longest": Racer::figure_ms(racer.longest_ns()),
            })
        };
        let frame = race.racers().first().map_or(0, |racer| racer.times_ns().len());
        let racers: Vec<_> = race.racers().iter().map(of).collect();
        json!({ "frame": frame, "polygons": race.present(), "racers": racers }).to_string()
    }

    /// The outcome in one sentence, as `osp race` prints it.
    pub fn verdict(&self) -> String {
        let machine = Machine::here(option_env!("OSP_COMMIT"));
        RaceReport::new(self.run.race(), machine, "the page's race".to_owned()).verdict
    }
}
