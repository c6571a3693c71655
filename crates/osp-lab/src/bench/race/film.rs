use std::{io, ops::Range};

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};
use thiserror::Error;

use super::{Race, Racer, plot::ModelPlot};
use crate::{
    Machine,
    report::{Area, Backend, Drawn, Picture, one_line, pixels, thousands},
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

#[derive(Debug, Error)]
pub enum FilmError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Io(#[from] io::Error),
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
        let mut player = Player::new(events, self.race.pace);
        let mut plot = ModelPlot::new(view, MODEL, [CARD.0, CARD.1, CARD.2]);
        for frame in 0..self.frames() {
            for _ in self.slice(frame) {
                player.step()?;
                plot.follow(player.scene(), player.changes());
            }
            let model = plot.picture(player.scene());
            let shown = Shown { film: self, frame, model: &model };
            let rgb = pixels(&shown, self.size()).map_err(|error| FilmError::Draw(error.to_string()))?;
            take(&rgb)?;
        }
        Ok(())
    }

    /// Draws the parts of the picture that are the same in all frames.
    fn draw_still<B: Backend>(&self, area: &Area<B>) -> Drawn {
        area.fill(&GROUND)?;
        let (played, columns) = (self.race.present.len(), self.frames().max(1));
        let (fewest, most) = (played / columns, played.div_ceil(columns));
        let (of, column) = match most {
            1 => ("this frame", "one frame".to_owned()),
            _ if fewest == most => ("longest in this column", format!("the longest of {most} frames")),
            _ => ("longest in this column", format!("the longest of {fewest} or {most} frames")),
        };
        for (number, racer) in self.race.racers.iter().enumerate() {
            let at = pane(number);
            text(area, racer.name, at(EDGE, 32), 27, INK, HPos::Left)?;
            text(area, "ms", at(RIGHT - 24, 94), 22, FAINT, HPos::Left)?;
            text(area, of, at(RIGHT, 120), 17, FAINT, HPos::Right)?;
            text(area, "polygons", at(RIGHT, 214), 17, FAINT, HPos::Right)?;
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
            text(area, line, (EDGE, top + y), 17, FAINT, HPos::Left)?;
        }
        Ok(())
    }

    fn draw_strip<B: Backend>(
        &self,
        area: &Area<B>,
        racer: &Racer,
        frame: usize,
        at: impl Fn(i32, i32) -> (i32, i32),
    ) -> Drawn {
        let (left, top) = STRIP_AT;
        let (right, bottom) = (left + STRIP.0 as i32, top + STRIP.1 as i32);
        fill(area, at(left, top), at(right, bottom), CARD)?;
        let height = |ns: u64| {
            // At least one pixel, so that every time is visible.
            (ns as f64 / self.height_ns * f64::from(STRIP.1)).clamp(1.0, f64::from(STRIP.1)) as i32
        };
        let x = |column: usize| left + (column * STRIP.0 as usize / self.frames()) as i32;
        for column in 0..=frame {
            let ns = longest(racer, self.slice(column));
            let color = if ns > Racer::MOST_NS { LATE } else { IN_TIME };
            fill(area, at(x(column), bottom - height(ns)), at(x(column + 1), bottom), color)?;
        }
        let limit = bottom - height(Racer::MOST_NS);
        fill(area, at(left, limit), at(right, limit + 1), INK)?;
        text(area, "11.1 ms (90 Hz)", at(left + 6, limit - 6), 17, INK, HPos::Left)
    }
}

/// A frame of the film, with its picture of the model.
struct Shown<'a> {
    film: &'a RaceFilm<'a>,
    frame: usize,
    model: &'a [u8],
}

impl Picture for Shown<'_> {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn {
        let Self { film, frame, model } = *self;
        film.draw_still(area)?;
        for (number, racer) in film.race.racers.iter().enumerate() {
            let (at, slice) = (pane(number), film.slice(frame));
            let played = &racer.times_ns[..slice.end];
            let missed = played.iter().filter(|&&ns| ns > Racer::MOST_NS).count() as u64;
            let (frames, color) = (thousands(played.len() as u64), if missed > 0 { LATE } else { FAINT });
            let said = format!("{} of {frames} frames missed 90 Hz", thousands(missed));
            text(area, &said, at(RIGHT, 32), 19, color, HPos::Right)?;
            let (left, top) = at(EDGE, 46);
            for (place, pixel) in (0..).zip(model.chunks_exact(3)) {
                let (x, y) = (place % MODEL.0 as i32, place / MODEL.0 as i32);
                area.draw_pixel((left + x, top + y), &RGBColor(pixel[0], pixel[1], pixel[2]))?;
            }
            let ns = longest(racer, slice.clone());
            let color = if ns > Racer::MOST_NS { LATE } else { INK };
            text(area, &Racer::figure_ms(ns), at(RIGHT - 32, 94), 50, color, HPos::Right)?;
            let polygons = thousands(film.race.present[slice.end - 1]);
            text(area, &polygons, at(RIGHT, 190), 34, INK, HPos::Right)?;
            film.draw_strip(area, racer, frame, at)?;
        }
        area.present()?;
        Ok(())
    }
}

/// Fills a rectangle; in pixels, its lower right corner is excluded.
fn fill<B: Backend>(area: &Area<B>, from: (i32, i32), to: (i32, i32), color: RGBColor) -> Drawn {
    area.draw(&Rectangle::new([from, to], color.filled()))?;
    Ok(())
}

/// Writes a line of text that begins or ends at a point of its baseline.
fn text<B: Backend>(
    area: &Area<B>,
    text: &str,
    (x, baseline): (i32, i32),
    size: i32,
    color: RGBColor,
    side: HPos,
) -> Drawn {
    let style = TextStyle::from(("sans-serif", size).into_font()).color(&color);
    // The middle of the letters lies about a third of their size above the baseline.
    let at = (x, baseline - size / 3);
    area.draw(&Text::new(text.to_owned(), at, style.pos(Pos::new(side, VPos::Center))))?;
    Ok(())
}

fn pane(number: usize) -> impl Fn(i32, i32) -> (i32, i32) + Copy {
    let (column, row) = ((number % 2) as i32, (number / 2) as i32);
    move |x, y| (x + column * PANE.0 as i32, y + row * PANE.1 as i32)
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
        let strips = |frame: usize, color: RGBColor| {
            let shown = Shown { film: &film, frame, model: &[] };
            let rgb = pixels(&shown, film.size()).expect("drawn");
            [(0, 0), (480, 0), (0, 360)].map(|pane| of_strip(&rgb, pane, color))
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
}
