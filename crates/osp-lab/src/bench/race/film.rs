use std::{error::Error, io, ops::Range};

use plotters::prelude::RGBColor;
use thiserror::Error;

use super::{
    Race, Racer,
    canvas::{Canvas, Side},
    plot::ModelPlot,
};
use crate::{
    Machine,
    report::{one_line, thousands},
};
use osp::view::View;
use osp_session::{
    recording::{Event, RecordingError},
    replay::Player,
};

/// Colours, sRGB. Red marks late frames only.
const GROUND: RGBColor = RGBColor(22, 24, 29);
const CARD: RGBColor = RGBColor(36, 39, 47);
const INK: RGBColor = RGBColor(238, 238, 238);
const FAINT: RGBColor = RGBColor(160, 166, 176);
const IN_TIME: RGBColor = RGBColor(77, 148, 255);
const LATE: RGBColor = RGBColor(255, 82, 62);

/// Width and height of a structure's pane, pixels.
const PANE: (u32, u32) = (480, 360);
/// Width and height of the model in a pane, pixels.
const MODEL: (u32, u32) = (280, 176);
/// Height of the lines of text below all panes, pixels.
const FOOT_HEIGHT: u32 = 68;
/// Number of characters of a recording's name that are shown.
const MOST_LETTERS: usize = 60;
/// Margin of a pane, pixels.
const EDGE: i32 = 16;
const RIGHT: i32 = PANE.0 as i32 - EDGE;
/// Upper left corner of the strip chart in a pane, pixels.
const STRIP_AT: (i32, i32) = (EDGE, 234);
/// Width and height of the strip chart, pixels. A column of the chart is a frame of the film.
const STRIP: (u32, u32) = (448, 120);
/// Largest number of frames of a film: a column of the strip chart is two pixels wide.
const MOST_FRAMES: usize = STRIP.0 as usize / 2;
/// Smallest height of the strip charts, in frame times at 90 Hz.
const LEAST_HEIGHT: f64 = 1.5;

/// Reason for which a film is incomplete.
#[derive(Debug, Error)]
pub enum FilmError {
    /// The recording is damaged.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The output refused a frame.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A frame could not be drawn.
    #[error("{0}")]
    Draw(String),
}

/// A film of a finished race, with a pane for each structure. A pane has the growing model, the frame time in large
/// digits, and a strip chart. Frames that took longer than at 90 Hz stay red on the chart. A frame of the film
/// represents several consecutive frames of the session, a slice.
#[derive(Clone, Debug)]
pub struct RaceFilm<'a> {
    race: &'a Race,
    processor: String,
    /// Time at the upper end of the strip charts, nanoseconds.
    height_ns: f64,
}

impl<'a> RaceFilm<'a> {
    /// Aspect ratio, width divided by height, of the picture of the model.
    pub const MODEL_ASPECT: f32 = MODEL.0 as f32 / MODEL.1 as f32;

    /// The film of a race on this machine.
    pub fn new(race: &'a Race, machine: &Machine) -> Self {
        let mut film = Self { race, processor: machine.processor.clone(), height_ns: 0.0 };
        let slices = (0..film.frames()).map(|frame| film.slice(frame));
        let longest =
            |slice: Range<usize>| race.racers.iter().map(move |racer| longest(racer, slice.clone()));
        let mut longest: Vec<u64> = slices.flat_map(longest).collect();
        longest.sort_unstable();
        // Ignores the longest hundredth, so that a single disturbance does not make all other columns too small.
        let high = longest.get(longest.len().saturating_sub(1 + longest.len() / 100)).copied().unwrap_or(0);
        film.height_ns = (high as f64 * 1.1).max(Racer::MOST_NS as f64 * LEAST_HEIGHT);
        film
    }

    /// Width and height, pixels: two panes in a row.
    pub fn size(&self) -> (u32, u32) {
        let rows = self.race.racers.len().div_ceil(2) as u32;
        (2 * PANE.0, rows * PANE.1 + FOOT_HEIGHT)
    }

    /// Number of frames of the film; 0 if no frame was measured.
    pub fn frames(&self) -> usize {
        self.race.present.len().min(MOST_FRAMES)
    }

    /// The frames of the session that a frame of the film represents.
    fn slice(&self, frame: usize) -> Range<usize> {
        let at = |frame: usize| frame * self.race.present.len() / self.frames().max(1);
        at(frame)..at(frame + 1)
    }

    /// Draws the film: plays the session once more and passes each frame to `take`, as red, green and blue bytes, rows
    /// from the top. `view` must have the aspect ratio [`RaceFilm::MODEL_ASPECT`]. O(polygons + frames of the film *
    /// pixels) for a model from which no polygon is removed. Memory: the scene.
    ///
    /// # Errors
    /// The recording is damaged, or `take` fails.
    pub fn draw<I>(
        &self,
        view: View,
        events: I,
        mut take: impl FnMut(&[u8]) -> io::Result<()>,
    ) -> Result<(), FilmError>
    where
        I: Iterator<Item = Result<Event, RecordingError>>,
    {
        let still = self.still().map_err(undrawn)?;
        let mut player = Player::new(events, self.race.pace);
        let mut plot = ModelPlot::new(view, MODEL, [CARD.0, CARD.1, CARD.2]);
        for frame in 0..self.frames() {
            for _ in self.slice(frame) {
                player.step()?;
                plot.follow(player.scene(), player.changes());
            }
            let model = plot.picture(player.scene());
            take(&self.frame(&still, frame, &model).map_err(undrawn)?.rgb)?;
        }
        Ok(())
    }

    /// The parts of the picture that are the same in all frames.
    fn still(&self) -> Result<Canvas, Box<dyn Error>> {
        let mut canvas = Canvas::new(self.size(), GROUND);
        let (played, columns) = (self.race.present.len(), self.frames().max(1));
        let (fewest, most) = (played / columns, played.div_ceil(columns));
        let (of, column) = match most {
            1 => ("this frame", "one frame".to_owned()),
            _ if fewest == most => ("longest in this column", format!("the longest of {most} frames")),
            _ => ("longest in this column", format!("the longest of {fewest} or {most} frames")),
        };
        for (number, racer) in self.race.racers.iter().enumerate() {
            let at = pane(number);
            canvas.text(racer.name, at(EDGE, 32), 27, INK, Side::Left)?;
            canvas.text("ms", at(RIGHT - 24, 94), 22, FAINT, Side::Left)?;
            canvas.text(of, at(RIGHT, 120), 17, FAINT, Side::Right)?;
            canvas.text("polygons", at(RIGHT, 214), 17, FAINT, Side::Right)?;
        }
        let name: String = one_line(&self.race.recording).chars().take(MOST_LETTERS).collect();
        let (polygons, processor) = (thousands(self.race.polygons), one_line(&self.processor));
        let all = if self.race.racers.len() == 2 { "both" } else { "all" };
        let least = match self.race.runs {
            1 => String::new(),
            runs => format!(", and a frame's time is the shortest of {runs} races"),
        };
        let lines = [
            format!("{name}: {polygons} polygons. {processor}"),
            format!(
                "One core runs {all} in turns, frame by frame. A frame is insertion, commit and culling, without drawing."
            ),
            format!("A column is {column}{least}. Red: later than 90 Hz allows."),
        ];
        let top = (self.size().1 - FOOT_HEIGHT) as i32;
        for (line, y) in lines.iter().zip([16, 36, 56]) {
            canvas.text(line, (EDGE, top + y), 17, FAINT, Side::Left)?;
        }
        Ok(canvas)
    }

    /// A frame of the film with this picture of the model.
    fn frame(&self, still: &Canvas, frame: usize, model: &[u8]) -> Result<Canvas, Box<dyn Error>> {
        let mut canvas = still.clone();
        for (number, racer) in self.race.racers.iter().enumerate() {
            let (at, slice) = (pane(number), self.slice(frame));
            let played = &racer.times_ns[..slice.end];
            let missed = played.iter().filter(|&&ns| ns > Racer::MOST_NS).count() as u64;
            let (frames, color) = (thousands(played.len() as u64), if missed > 0 { LATE } else { FAINT });
            let said = format!("{} of {frames} frames missed 90 Hz", thousands(missed));
            canvas.text(&said, at(RIGHT, 32), 19, color, Side::Right)?;
            canvas.lay(at(EDGE, 46), MODEL.0, model);
            let ns = longest(racer, slice.clone());
            let color = if ns > Racer::MOST_NS { LATE } else { INK };
            canvas.text(&Racer::figure_ms(ns), at(RIGHT - 32, 94), 50, color, Side::Right)?;
            let polygons = thousands(self.race.present[slice.end - 1]);
            canvas.text(&polygons, at(RIGHT, 190), 34, INK, Side::Right)?;
            self.strip(&mut canvas, racer, frame, at)?;
        }
        Ok(canvas)
    }

    fn strip(
        &self,
        canvas: &mut Canvas,
        racer: &Racer,
        frame: usize,
        at: impl Fn(i32, i32) -> (i32, i32),
    ) -> Result<(), Box<dyn Error>> {
        let (left, top) = STRIP_AT;
        let (right, bottom) = (left + STRIP.0 as i32, top + STRIP.1 as i32);
        canvas.fill(at(left, top), at(right, bottom), CARD);
        let height = |ns: u64| {
            // At least one pixel, so that every time is visible.
            (ns as f64 / self.height_ns * f64::from(STRIP.1)).clamp(1.0, f64::from(STRIP.1)) as i32
        };
        let x = |column: usize| left + (column * STRIP.0 as usize / self.frames()) as i32;
        for column in 0..=frame {
            let ns = longest(racer, self.slice(column));
            let color = if ns > Racer::MOST_NS { LATE } else { IN_TIME };
            canvas.fill(at(x(column), bottom - height(ns)), at(x(column + 1), bottom), color);
        }
        let limit = bottom - height(Racer::MOST_NS);
        canvas.fill(at(left, limit), at(right, limit + 1), INK);
        canvas.text("11.1 ms (90 Hz)", at(left + 6, limit - 6), 17, INK, Side::Left)
    }
}

/// Converts a position in a pane to a position in the film.
fn pane(number: usize) -> impl Fn(i32, i32) -> (i32, i32) + Copy {
    let (column, row) = ((number % 2) as i32, (number / 2) as i32);
    move |x, y| (x + column * PANE.0 as i32, y + row * PANE.1 as i32)
}

fn undrawn(error: Box<dyn Error>) -> FilmError {
    FilmError::Draw(error.to_string())
}

/// The longest frame time of a slice, nanoseconds.
fn longest(racer: &Racer, slice: Range<usize>) -> u64 {
    racer.times_ns[slice].iter().copied().max().unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use osp_session::recording::Pace;

    /// A race of 300 frames with these times.
    fn race(racers: &[fn(u64) -> u64]) -> Race {
        let racer = |time: &fn(u64) -> u64| {
            let mut racer = Racer::new("osp");
            (0..300).for_each(|frame| racer.add(time(frame), frame + 1));
            racer
        };
        Race {
            recording: "a.ron".to_owned(),
            pace: Pace::Samples(1),
            camera: "auto",
            frames: 300,
            polygons: 300,
            present: (1..=300).collect(),
            fingerprint: osp_session::replay::SessionFingerprint::new(),
            runs: 1,
            load: Default::default(),
            racers: racers.iter().map(racer).collect(),
        }
    }

    /// Number of pixels of a colour in the strip chart of a pane.
    fn of_strip(rgb: &[u8], (left, top): (usize, usize), color: RGBColor) -> usize {
        let (x, y) = (left + STRIP_AT.0 as usize, top + STRIP_AT.1 as usize);
        let rows = y..y + STRIP.1 as usize;
        let pixels = rows.flat_map(|y| (x..x + STRIP.0 as usize).map(move |x| (y * 960 + x) * 3));
        pixels.filter(|&at| rgb[at..at + 3] == [color.0, color.1, color.2]).count()
    }

    #[test]
    fn frames_that_were_late_stay_red_and_others_do_not_become_it() {
        // One structure is late from the 150th frame on, one only at the 30th.
        let race = race(&[
            |_| 10_000,
            |frame| if frame < 150 { 5_000_000 } else { 20_000_000 },
            |frame| if frame == 30 { 12_000_000 } else { 11_000_000 },
        ]);
        let film = RaceFilm::new(&race, &Machine::here(None));
        assert_eq!((film.size(), film.frames()), ((960, 788), 224));
        let still = film.still().expect("drawn");
        let strips = |frame: usize, color: RGBColor| {
            let canvas = film.frame(&still, frame, &[]).expect("drawn");
            [(0, 0), (480, 0), (0, 360)].map(|pane| of_strip(&canvas.rgb, pane, color))
        };
        let (red, blue) = (|frame| strips(frame, LATE), |frame| strips(frame, IN_TIME));
        // A frame of the film is one or two frames of the session: number 23 is frames 30 and 31.
        assert_eq!(red(15), [0, 0, 0]);
        assert!(red(111)[1] == 0 && red(112)[1] > 0);
        let reds = [112, 113, 150, 200, 223].map(|frame| red(frame)[1]);
        assert!(reds.is_sorted() && reds[0] < reds[1] && reds[3] < reds[4], "{reds:?}");
        assert_eq!(red(223)[0], 0);
        let [before, at, end] = [22, 23, 223].map(|frame| red(frame)[2]);
        assert!(before == 0 && at > 0 && at == end, "{before} {at} {end}");
        // Even the lowest column has a height, and the axis is the same in all panes.
        assert_eq!(blue(223)[0], STRIP.0 as usize);
        assert!(blue(223)[1] > 10 * blue(223)[0]);
        assert!(red(223)[1] > 3 * blue(223)[1]);
    }

    #[test]
    fn a_disturbance_does_not_flatten_the_rest() {
        let race = race(&[|frame| if frame == 100 { 3_000_000_000 } else { 10_000_000 }, |_| 1_000_000]);
        let film = RaceFilm::new(&race, &Machine::here(None));
        assert!(film.height_ns < 20.0e6, "{}", film.height_ns);
        assert_eq!(film.size(), (960, 428));
        // Every frame of the session is in exactly one slice.
        let slices: Vec<usize> = (0..film.frames()).flat_map(|frame| film.slice(frame)).collect();
        assert_eq!(slices, (0..300).collect::<Vec<_>>());
    }
}
