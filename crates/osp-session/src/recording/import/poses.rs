//! `.poses`: the path of a tracker, one pose a line, `time x y z qw qx qy qz`, in seconds and metres; `#` starts a
//! comment. Times that cannot be seconds are milliseconds, microseconds or nanoseconds ([`unit_secs`]).
//!
//! The axes are libsurvive's: right-handed, z up, gravity along -z. In a recording of a controller pulled up and down,
//! z varies by 0.88 m. In osp y is up, so the world is rotated by -90° about x: (x, y, z) becomes (x, z, -y). The
//! comment line `# up: y` marks a file in which y is up, as in OpenXR and OpenVR.
//!
//! A tracker does not record when a stroke begins, so the whole path is one ribbon, split where tracking was lost.

use std::f32::consts::FRAC_1_SQRT_2;

use glam::{Quat, Vec3};

use super::{
    axes,
    lines::{LineReader, shown},
    session_name,
};
use crate::recording::{
    Author, Event, EventSource, Header, NormalRule, Notes, OpenOptions, Place, Session, StrokeId, Tool,
    error::Result, input::Input,
};

/// A longer time between two poses, forwards or backwards, starts a new stroke, because tracking was lost. Trackers
/// record at least 100 poses a second. A shorter gap is a few lost packets.
const LONGEST_GAP_SECS: f64 = 0.25;
/// A longer distance between two poses starts a new stroke, because tracking was lost and found again elsewhere. A hand
/// at 10 m/s moves 0.1 m between poses at 100 Hz.
const LONGEST_STEP_M: f32 = 0.25;
/// Width of the ribbon along a tracker's path, metres; the format has no brush.
const WIDTH_M: f32 = 0.02;
/// Colour of the ribbon, sRGB.
const COLOR: (f32, f32, f32, f32) = (0.25, 0.55, 0.85, 1.0);
const LINE: &str = "`time x y z qw qx qy qz`";

pub(crate) fn open_poses(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let poses = Poses {
        lines: LineReader::open(input, options)?,
        up: Up::Z,
        unit_secs: unit_secs(first_times(input, options)),
        first: None,
        last: None,
        next_stroke: 0,
        ahead: [None, None],
    };
    let header = Header::new(session_name(input.path), "tracker poses");
    Ok(Session::new(header, "poses", Box::new(poses), input.path, options))
}

/// The times of the first two poses.
fn first_times(input: Input<'_>, options: &OpenOptions) -> [f64; 2] {
    let mut times = [0.0; 2];
    let mut found = 0;
    let mut lines = LineReader::open(input, &OpenOptions { lenient: true, ..*options }).ok();
    while let (Some(Ok(Some(line))), 0..2) = (lines.as_mut().map(LineReader::next_line), found) {
        if let Ok((time, ..)) = pose(&line) {
            times[found] = time;
            found += 1;
        }
    }
    times
}

/// The unit of time, seconds, by the first two times: since 1970, or of a step between two poses.
fn unit_secs([first, second]: [f64; 2]) -> f64 {
    // 1e11 seconds are 3,000 years, 1e11 milliseconds 3 years. A tracker records a pose each 0.1 to 100 ms.
    const UNITS: [(f64, f64, f64); 3] =
        [(1.0e17, 1.0e5, 1.0e-9), (1.0e14, 1.0e3, 1.0e-6), (1.0e11, f64::INFINITY, 1.0e-3)];
    let step = second - first;
    let is_whole = first.fract() == 0.0 && second.fract() == 0.0;
    let is_in = |(since, steps, _): &(f64, f64, f64)| first >= *since || (is_whole && step >= *steps);
    UNITS.into_iter().find(is_in).map_or(1.0, |(.., secs)| secs)
}

/// Whether a line that is no comment is a pose.
pub(crate) fn is_pose(line: &str) -> bool {
    pose(line).is_ok_and(|(t, p, q)| Event::Head { author: Author::SOLE, t, p, q }.check().is_ok())
}

/// Time, position and orientation in a line, in the file's axes.
fn pose(line: &str) -> Result<(f64, Vec3, Quat), &'static str> {
    let mut values = [0.0; 8];
    let mut fields = line.split_ascii_whitespace();
    for value in &mut values {
        *value = fields.next().and_then(|field| field.parse::<f64>().ok()).ok_or(LINE)?;
    }
    if fields.next().is_some() {
        return Err(LINE);
    }
    let [t, x, y, z, qw, qx, qy, qz] = values;
    let p = Vec3::new(x as f32, y as f32, z as f32);
    Ok((t, p, Quat::from_xyzw(qx as f32, qy as f32, qz as f32, qw as f32)))
}

/// The axis of the file that points up.
enum Up {
    Y,
    Z,
}

impl Up {
    /// Converts a pose from the file's axes to those of osp.
    fn to_ours(&self, p: Vec3, q: Quat) -> (Vec3, Quat) {
        match self {
            Self::Y => (p, q),
            Self::Z => {
                let ours_from_file = Quat::from_xyzw(-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2);
                (Vec3::new(p.x, p.z, -p.y), axes::product(ours_from_file, q))
            }
        }
    }
}

struct Poses {
    lines: LineReader,
    up: Up,
    unit_secs: f64,
    /// The first time, in the file's unit.
    first: Option<f64>,
    /// Time and position of the previous pose, if a stroke is open.
    last: Option<(f64, Vec3)>,
    next_stroke: u32,
    ahead: [Option<Event>; 2],
}

impl Poses {
    /// The next undamaged pose as time, position and orientation; `None` at the end of the file.
    fn next_point(&mut self) -> Result<Option<(f64, Vec3, Quat)>> {
        while let Some(line) = self.lines.next_line()? {
            let text = line.trim_ascii();
            if let Some(comment) = text.strip_prefix('#') {
                if comment.split_whitespace().eq(["up:", "y"]) {
                    self.up = Up::Y;
                }
                continue;
            }
            if text.is_empty() {
                continue;
            }
            match self.parse(text) {
                Ok(pose) => return Ok(Some(pose)),
                Err(expected) => self.lines.damaged(expected, shown(text))?,
            }
        }
        Ok(None)
    }

    fn parse(&mut self, text: &str) -> Result<(f64, Vec3, Quat), &'static str> {
        let (time, p, q) = pose(text)?;
        let (p, q) = self.up.to_ours(p, q);
        let t = (time - self.first.unwrap_or(time)) * self.unit_secs;
        Event::Head { author: Author::SOLE, t, p, q }.check()?;
        self.first.get_or_insert(time);
        Ok((t, p, q))
    }

    /// Converts the next pose to events. Returns the first event, and stores the others in `ahead`.
    fn advance(&mut self) -> Result<Option<Event>> {
        let Some((t, p, q)) = self.next_point()? else {
            let open = self.last.take();
            return Ok(open.map(|(t, _)| Event::End { t, stroke: StrokeId(self.next_stroke - 1) }));
        };
        let before = self.last.replace((t, p));
        let goes_on = before.is_some_and(|(last_t, last_p)| {
            (t - last_t).abs() <= LONGEST_GAP_SECS && p.distance(last_p) <= LONGEST_STEP_M
        });
        if goes_on {
            return Ok(Some(Event::Point { t, stroke: StrokeId(self.next_stroke - 1), p, q, pressure: 1.0 }));
        }
        let stroke = StrokeId(self.next_stroke);
        let end = before.map(|(t, _)| Event::End { t, stroke: StrokeId(self.next_stroke - 1) });
        self.next_stroke += 1;
        let begin = Event::Begin {
            author: Author::SOLE,
            t,
            stroke,
            tool: Tool::Ribbon,
            width: WIDTH_M,
            color: COLOR,
            normal: NormalRule::LocalX,
            thinnest: 1.0,
            paint: None,
        };
        let point = Event::Point { t, stroke, p, q, pressure: 1.0 };
        Ok(Some(match end {
            Some(end) => {
                self.ahead = [Some(begin), Some(point)];
                end
            }
            None => {
                self.ahead = [Some(point), None];
                begin
            }
        }))
    }
}

impl EventSource for Poses {
    fn next_event(&mut self) -> Result<Option<Event>> {
        let [first, second] = &mut self.ahead;
        if let Some(event) = first.take() {
            *first = second.take();
            return Ok(Some(event));
        }
        self.advance().inspect_err(|_| self.last = None)
    }

    fn notes(&self) -> Notes {
        let mut notes = self.lines.notes.clone();
        if self.unit_secs != 1.0 {
            let path = self.lines.path.display();
            notes
                .warnings
                .push(format!("{path}: its times are read in units of {:e} seconds", self.unit_secs));
        }
        notes
    }

    fn place(&self) -> Place {
        self.lines.place()
    }
}
