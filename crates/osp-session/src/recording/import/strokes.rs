use glam::{Quat, Vec3};

use super::bytes::ByteReader;
use crate::recording::{
    Author, Event, EventSource, NormalRule, Notes, Paint, Place, RecordingError, StrokeId, Tool,
    error::Result,
};

/// A binary format that is a list of strokes. Each stroke is a header and a list of points.
pub(super) trait StrokeFormat: Send {
    const NORMAL: NormalRule;
    const THINNEST: f32;

    fn read_stroke(&mut self, bytes: &mut ByteReader) -> Result<StrokeHead>;

    fn read_point(&mut self, bytes: &mut ByteReader) -> Result<Sample>;

    /// A warning about the strokes so far.
    fn warning(&self) -> Option<String> {
        None
    }
}

pub(super) struct StrokeHead {
    pub(super) width_m: f32,
    pub(super) color: [f32; 4],
    pub(super) paint: Option<Box<Paint>>,
    pub(super) points: u32,
}

/// A control point in the axes of osp, metres.
pub(super) struct Sample {
    pub(super) time_secs: f64,
    pub(super) p: Vec3,
    pub(super) q: Quat,
    pub(super) pressure: f32,
}

/// The events of a list of strokes, in the order of the file. A stroke's number is its index in the file, from 0.
pub(super) struct StrokeStream<F> {
    format: F,
    bytes: ByteReader,
    is_lenient: bool,
    notes: Notes,
    /// The first damage that a lenient reader skipped, and the number of damaged strokes.
    skipped_damage: Option<(RecordingError, u64)>,
    strokes: u32,
    next_stroke: u32,
    time_secs: f64,
    state: State,
}

enum State {
    Between,
    /// Inside a stroke: the next point if it was read in advance, and the number of points after it.
    Stroke {
        stroke: StrokeId,
        ahead: Option<Event>,
        left: u32,
    },
    Done,
}

impl<F: StrokeFormat> StrokeStream<F> {
    /// A stream of `strokes` strokes. The position of `bytes` is the start of the first stroke.
    pub(super) fn new(
        format: F,
        bytes: ByteReader,
        strokes: u32,
        is_lenient: bool,
        warnings: Vec<String>,
    ) -> Self {
        Self {
            format,
            bytes,
            is_lenient,
            notes: Notes { warnings, skipped: 0 },
            skipped_damage: None,
            strokes,
            next_stroke: 0,
            time_secs: 0.0,
            state: State::Between,
        }
    }

    fn step(&mut self) -> Result<Option<Event>> {
        loop {
            match &mut self.state {
                State::Done => return Ok(None),
                State::Between if self.next_stroke < self.strokes => {
                    if let Some(begin) = self.begin()? {
                        return Ok(Some(begin));
                    }
                }
                State::Between => {
                    self.bytes.expect_end(format_args!("{} strokes", self.strokes))?;
                    self.state = State::Done;
                }
                State::Stroke { stroke, ahead, left } => {
                    let stroke = *stroke;
                    if let Some(event) = ahead.take() {
                        return Ok(Some(event));
                    }
                    if *left > 0 {
                        *left -= 1;
                        let left = *left;
                        match self.point(stroke)? {
                            Ok(event) => return Ok(Some(event)),
                            Err(damage) => self.skip_damaged(damage, left)?,
                        }
                    }
                    self.state = State::Between;
                    return Ok(Some(Event::End { t: self.time_secs, stroke }));
                }
            }
        }
    }

    /// Reads the header of the next stroke; `None` if the stroke is skipped. The first point is read in advance,
    /// because it has the time of the stroke's beginning.
    fn begin(&mut self) -> Result<Option<Event>> {
        let at = self.bytes.offset;
        let stroke = StrokeId(self.next_stroke);
        let head = self.format.read_stroke(&mut self.bytes)?;
        let scale = head.paint.as_ref().map_or(1.0, |paint| paint.scale);
        let [r, g, b, a] = head.color.map(unit_interval);
        let mut begin = Event::Begin {
            author: Author::SOLE,
            t: self.time_secs,
            stroke,
            tool: Tool::Ribbon,
            width: head.width_m,
            color: (r, g, b, a),
            normal: F::NORMAL,
            thinnest: F::THINNEST,
            paint: head.paint,
        };
        if let Err(expected) = begin.check() {
            let found = format!("a width of {} m at scale {scale} in stroke {}", head.width_m, stroke.0);
            self.skip_damaged(self.bytes.expected_at(at, expected, found), head.points)?;
            self.next_stroke += 1;
            return Ok(None);
        }
        let mut ahead = None;
        let left = head.points.saturating_sub(1);
        if head.points > 0 {
            match self.point(stroke)? {
                Ok(event) => ahead = Some(event),
                Err(damage) => {
                    self.skip_damaged(damage, left)?;
                    self.next_stroke += 1;
                    return Ok(None);
                }
            }
        }
        if let Event::Begin { t, .. } = &mut begin {
            *t = self.time_secs;
        }
        self.next_stroke += 1;
        self.state = State::Stroke { stroke, ahead, left };
        Ok(Some(begin))
    }

    /// Reads the next point. The inner error is a fault in the point's numbers; the following point can still be read.
    fn point(&mut self, stroke: StrokeId) -> Result<Result<Event>> {
        let at = self.bytes.offset;
        let Sample { time_secs: t, p, q, pressure } = self.format.read_point(&mut self.bytes)?;
        let mut event = Event::Point { t, stroke, p, q, pressure };
        if let Err(expected) = event.check() {
            let found = format!("position {p}, orientation {q}, pressure {pressure} in stroke {}", stroke.0);
            return Ok(Err(self.bytes.expected_at(at, expected, found)));
        }
        if let Event::Point { pressure, .. } = &mut event {
            *pressure = unit_interval(*pressure);
        }
        self.time_secs = t;
        Ok(Ok(event))
    }

    /// Skips the rest of a stroke with a damaged number. Returns the damage as an error if the reader is not lenient.
    fn skip_damaged(&mut self, damage: RecordingError, points_left: u32) -> Result<()> {
        if !self.is_lenient {
            return Err(damage);
        }
        self.notes.skipped += 1;
        self.skipped_damage.get_or_insert((damage, 0)).1 += 1;
        for _ in 0..points_left {
            self.format.read_point(&mut self.bytes)?;
        }
        Ok(())
    }
}

impl<F: StrokeFormat> EventSource for StrokeStream<F> {
    fn next_event(&mut self) -> Result<Option<Event>> {
        let error = match self.step() {
            Ok(event) => return Ok(event),
            Err(error) => error,
        };
        let state = std::mem::replace(&mut self.state, State::Done);
        // A system error is not damage, because a second read may succeed. A limit is not damage either:
        // [`Limited`](super::super::limited::Limited) reports it.
        if !self.is_lenient || matches!(error, RecordingError::Io { .. } | RecordingError::Limit { .. }) {
            return Err(error);
        }
        self.notes.skipped += 1;
        self.notes.warnings.push(format!("{error}; reading ended there, after {} strokes", self.next_stroke));
        // The points read so far are kept, so the stroke must end here.
        Ok(match state {
            State::Stroke { stroke, .. } => Some(Event::End { t: self.time_secs, stroke }),
            State::Between | State::Done => None,
        })
    }

    fn notes(&self) -> Notes {
        let mut notes = self.notes.clone();
        let path = self.bytes.path.display();
        notes.warnings.extend(self.format.warning().map(|warning| format!("{path}: {warning}")));
        if let Some((first, strokes)) = &self.skipped_damage {
            notes.warnings.push(match strokes {
                1 => format!("{first}; the stroke is skipped from there on"),
                _ => format!("{first}; {strokes} damaged strokes are skipped, each from its damage on"),
            });
        }
        notes
    }

    fn place(&self) -> Place {
        Place::Byte(self.bytes.offset)
    }
}

/// A colour channel or pressure clamped to 0 to 1; NaN becomes 0.
fn unit_interval(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) }
}
