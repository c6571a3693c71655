use std::collections::HashMap;
use std::fmt;
use std::path::{Path, PathBuf};

use glam::Vec3;

use super::{
    Event, EventSource, Notes, OpenOptions, RecordingError, StrokeId, Tool, unknown_brushes::UnknownBrushes,
};
use crate::brush::{self, Brush, Family};

/// How much a session may hold: a small packed file can claim to be more than fits into memory.
///
/// All that memory grows with is counted as it is read, before it is kept anywhere. A reader that reaches a limit gives
/// what comes before, and then [`RecordingError::Limit`]; a lenient one notes it and ends there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most polygons, counted before they are made: a sample of a ribbon or wall is one, of a tube eight, a face as many
    /// as it has corners less two. (A bent quad becomes two, so there may be up to twice as many.)
    pub polygons: u64,
    /// Most bytes that each byte of a packed file may become, beyond [`Limits::FREE_BYTES`]. What is drawn by hand packs
    /// to a third or a fifth; what packs to a hundredth is a repetition.
    pub unpacking: u64,
}

impl Limits {
    /// The limits of [`OpenOptions::default`].
    pub const DEFAULT: Self = Self { polygons: 4_000_000, unpacking: 32 };
    /// Bytes that any packed file may become.
    pub const FREE_BYTES: u64 = 1 << 20;

    /// Most strokes, and most groupings: a quarter of [`Limits::polygons`].
    pub fn strokes(&self) -> u64 {
        self.polygons / 4
    }

    /// Most events, each stroke that an edit names being one more: four times [`Limits::polygons`].
    pub fn events(&self) -> u64 {
        self.polygons.saturating_mul(4)
    }

    /// Most frames at the recorded pace, of each of which a replay keeps what it cost: half of [`Limits::polygons`], six
    /// hours at 90 frames a second.
    pub fn frames(&self) -> u64 {
        self.polygons / 2
    }

    /// Most bytes of a file that has to be held whole: four times [`Limits::polygons`].
    pub fn whole_bytes(&self) -> u64 {
        self.polygons.saturating_mul(4)
    }

    /// Most bytes that so many packed ones may become.
    pub fn unpacked_bytes(&self, packed: u64) -> u64 {
        packed.saturating_mul(self.unpacking).saturating_add(Self::FREE_BYTES)
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// How far a reader has come in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// Unknown, or the file as a whole.
    #[default]
    File,
    /// The line read last, from 1.
    Line(u64),
    /// The byte to be read next, from 0.
    Byte(u64),
}

/// The text that follows a file's name in a message.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// Polygons of a tube's sample: its sides.
const TUBE_POLYGONS: u64 = 8;

/// A session that exceeds one of the [`Limits`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excess {
    /// The file.
    pub path: PathBuf,
    /// Where in it.
    pub place: Place,
    /// The limit.
    pub most: u64,
    /// Of what.
    pub what: String,
    /// The option of `osp` that raises it.
    pub option: &'static str,
    /// How much was read up to there, if that is known.
    pub read: Option<String>,
}

impl fmt::Display for Excess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { path, place, most, what, option, read } = self;
        write!(
            f,
            "{}{place}: expected at most {most} {what} ({option} allows more); found more",
            path.display()
        )?;
        read.iter().try_for_each(|read| write!(f, "; read before: {read}"))
    }
}

/// Names the option that raises [`Limits::polygons`], and with it the limits that follow from it.
const MAX_POLYGONS: &str = "--max-polygons N";

/// The error for more than `most` of something; [`Limited`] adds what was read.
pub(super) fn beyond(path: &Path, place: Place, most: u64, what: &str) -> RecordingError {
    RecordingError::Limit(Box::new(Excess {
        path: path.to_owned(),
        place,
        most,
        what: what.to_owned(),
        option: MAX_POLYGONS,
        read: None,
    }))
}

/// Counts of everything read so far that takes memory.
#[derive(Clone, Copy, Debug, Default)]
struct Amount {
    strokes: u64,
    points: u64,
    faces: u64,
    groupings: u64,
    events: u64,
    polygons: u64,
}

impl Amount {
    /// The first limit that is passed, and its name.
    fn excess(&self, limits: &Limits) -> Option<(u64, &'static str)> {
        [
            (self.polygons, limits.polygons, "polygons"),
            (self.strokes, limits.strokes(), "strokes"),
            (self.groupings, limits.strokes(), "groupings"),
            (self.events, limits.events(), "events and strokes that edits name"),
        ]
        .into_iter()
        .find_map(|(read, most, what)| (read > most).then_some((most, what)))
    }
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { strokes, points, faces, groupings, events, .. } = self;
        write!(
            f,
            "{strokes} strokes, {points} points, {faces} faces, {groupings} groupings, {events} events in all"
        )
    }
}

/// How many polygons a sample counts as.
enum Weight {
    /// Each as many.
    Each(u64),
    /// Particles and sprays: by the way from the last sample.
    ByWay { brush: &'static Brush, width_m: f32, scale: f32, last: Option<Vec3> },
}

impl Weight {
    fn of(&mut self, p: Vec3, pressure: f32) -> u64 {
        match self {
            Self::Each(polygons) => *polygons,
            Self::ByWay { brush, width_m, scale, last } => {
                let way_m = last.replace(p).map_or(0.0, |last| last.distance(p));
                let step_m = match brush.family {
                    Family::Particles => brush::PARTICLE_STEP_M * *scale / brush.particle_rate,
                    _ => *width_m * brush.size(pressure) / brush.spray_rate,
                };
                let count = (way_m / step_m) as u64;
                1 + if step_m > 0.0 { count.min(brush::MAX_SCATTERED) } else { 0 }
            }
        }
    }
}

/// A source that ends where a session becomes too large, and notes unknown brushes.
pub(super) struct Limited {
    source: Box<dyn EventSource>,
    path: PathBuf,
    options: OpenOptions,
    read: Amount,
    /// For each stroke that is being drawn: as how many polygons a sample counts.
    open: HashMap<StrokeId, Weight>,
    /// The stroke that the last sample was of, if each counts the same: most often that of the next one, too.
    last: Option<(StrokeId, u64)>,
    /// The stroke of the last face: most often that of the next one, too.
    last_face: Option<StrokeId>,
    /// Why the source was ended, for a lenient reader.
    warning: Option<String>,
    unknown_brushes: UnknownBrushes,
    is_over: bool,
}

impl Limited {
    pub(super) fn new(source: Box<dyn EventSource>, path: &Path, options: &OpenOptions) -> Self {
        Self {
            source,
            path: path.to_owned(),
            options: *options,
            read: Amount::default(),
            open: HashMap::new(),
            last: None,
            last_face: None,
            warning: None,
            unknown_brushes: UnknownBrushes::default(),
            is_over: false,
        }
    }

    /// The counts with this event.
    fn with(&mut self, event: &Event) -> Amount {
        let mut read = self.read;
        read.events += 1;
        match event {
            Event::Begin { stroke, tool, width, paint, .. } => {
                read.strokes += 1;
                let brush = paint.as_ref().and_then(|paint| brush::find(&paint.brush));
                let scale = paint.as_ref().map_or(1.0, |paint| paint.scale);
                let weight = match brush.map(|brush| (brush, brush.family)) {
                    Some((_, Family::Tube { .. } | Family::BoxSection)) => Weight::Each(TUBE_POLYGONS),
                    Some((brush, Family::Particles | Family::Spray { .. })) => {
                        Weight::ByWay { brush, width_m: *width, scale, last: None }
                    }
                    None if *tool == Tool::Tube => Weight::Each(TUBE_POLYGONS),
                    _ => Weight::Each(1),
                };
                self.open.entry(*stroke).or_insert(weight);
            }
            Event::Point { stroke, p, pressure, .. } => {
                read.points += 1;
                if let Some((last, polygons)) = self.last
                    && last == *stroke
                {
                    read.polygons += polygons;
                } else if let Some(weight) = self.open.get_mut(stroke) {
                    read.polygons += weight.of(*p, *pressure);
                    self.last = match weight {
                        Weight::Each(polygons) => Some((*stroke, *polygons)),
                        Weight::ByWay { .. } => None,
                    };
                } else {
                    self.last = None;
                }
            }
            Event::End { stroke, .. } => {
                self.open.remove(stroke);
                self.last = None;
            }
            Event::Polygon { vertices, stroke, .. } => {
                read.faces += 1;
                read.strokes += u64::from(stroke.is_some() && *stroke != self.last_face);
                self.last_face = *stroke;
                read.polygons += vertices.len().saturating_sub(2) as u64;
            }
            Event::Move { strokes, .. } | Event::Assign { strokes, .. } => {
                read.events += strokes.len() as u64
            }
            Event::Group { strokes, .. } => {
                read.groupings += 1;
                read.events += strokes.len() as u64;
            }
            Event::Head { .. }
            | Event::Erase { .. }
            | Event::Undo { .. }
            | Event::Redo { .. }
            | Event::Step { .. }
            | Event::Layer { .. }
            | Event::View { .. }
            | Event::Place { .. } => {}
        }
        read
    }

    fn stop(&mut self, mut error: RecordingError) -> Result<Option<Event>, RecordingError> {
        self.is_over = true;
        // Nobody draws on: what was kept for the strokes can go.
        (self.open, self.last) = (HashMap::new(), None);
        if let RecordingError::Limit(excess) = &mut error {
            excess.read = Some(self.read.to_string());
        }
        if !self.options.lenient {
            return Err(error);
        }
        self.warning = Some(format!("{error}; reading ended there"));
        Ok(None)
    }
}

impl EventSource for Limited {
    fn next_event(&mut self) -> Result<Option<Event>, RecordingError> {
        if self.is_over {
            return Ok(None);
        }
        let event = match self.source.next_event() {
            Ok(Some(event)) => event,
            Err(error @ RecordingError::Limit { .. }) => return self.stop(error),
            other => return other,
        };
        let read = self.with(&event);
        if let Some((most, what)) = read.excess(&self.options.limits) {
            return self.stop(beyond(&self.path, self.source.place(), most, what));
        }
        self.read = read;
        self.unknown_brushes.note(&event);
        Ok(Some(event))
    }

    fn notes(&self) -> Notes {
        let mut notes = self.source.notes();
        notes.skipped += u64::from(self.warning.is_some());
        notes.warnings.extend(self.warning.clone());
        notes.warnings.extend(self.unknown_brushes.warning(&self.path));
        notes
    }

    fn place(&self) -> Place {
        self.source.place()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaps_of_particles_and_sprays_count_as_what_they_become() {
        for (name, step_m) in [("Snow", None), ("Splatter", Some(0.1))] {
            let brush = brush::find(name).expect("a brush of the table");
            let step_m = match step_m {
                Some(width_m) => width_m * brush.size(1.0) / brush.spray_rate,
                None => brush::PARTICLE_STEP_M / brush.particle_rate,
            };
            let mut weight = Weight::ByWay { brush, width_m: 0.1, scale: 1.0, last: None };
            assert_eq!(weight.of(Vec3::ZERO, 1.0), 1);
            assert_eq!(weight.of(Vec3::X * step_m * 10.5, 1.0), 11, "{name}");
            assert_eq!(weight.of(Vec3::X * 1.0e9, 1.0), 1 + brush::MAX_SCATTERED, "{name}");
        }
    }
}
