//! CASSIE (Yu, Arora, Stanko, Bærentzen, Singh and Bousseau, "CASSIE: Curve and Surface Sketching in Immersive
//! Environments", CHI 2021): two files of one name. `sketch_history/NAME.json` has the strokes with the times at which
//! they were drawn and erased; `raw_data/NAME.json` has the user's actions and head. One file is enough. If the other
//! file exists in the neighbouring folder, both are read. Strokes that the mirror added are only in the history.
//!
//! # Properties that the files do not state
//!
//! - `creation_time` is the **end** of a stroke, and the time of the action "add stroke". At that time the hand is
//!   within 4 mm of the stroke's last sample (median 1 mm). The median distance to the first sample is 5 to 17 cm.
//! - Samples have no time. They are 2 to 4 cm apart, so the reader puts [`SAMPLE_SECS`] between them, or less if the
//!   previous stroke would overlap. A stroke and its mirror image have the same times.
//! - Samples are in canvas space, head and hand in room space. The user grabs and scales the canvas; canvasPos,
//!   canvasRot and canvasScale are its transform: room = pos + rot * (scale * canvas). After the inverse transform the
//!   hand lies on the stroke. The stroke lies in front of the eyes, 0.24 to 0.6 m away in the room. In canvas space
//!   this distance is smaller if the canvas is scaled up.
//! - Until the headset is tracked, its position is exactly zero. The reader skips such states.
//! - No orientation was recorded, so ribbons have a rotation-minimising frame. Width and brush were not recorded
//!   either. CASSIE draws thin tubes, so strokes get the brush Wire.

use std::path::{Path, PathBuf};
use std::vec;

use glam::Vec3;

use super::{
    apa, axes,
    cassie_json::{self, Document, HistoryStroke, RawData, State},
    session_name,
};
use crate::recording::{
    Author, Event, EventSource, Header, NormalRule, Notes, OpenOptions, Paint, Session, StrokeId, Tool,
    error::Result, input::Input,
};
use osp::math::rotate;

/// Width of a stroke, metres; CASSIE draws thin tubes.
const WIDTH_M: f32 = 0.005;
/// The brush that is most similar to CASSIE's tubes.
const BRUSH: &str = "Wire";
/// Colour of a stroke, sRGB.
const COLOR: (f32, f32, f32, f32) = (0.20, 0.24, 0.36, 1.0);
/// Time between two samples, seconds: a careful hand at 0.3 m/s covers 3 cm.
const SAMPLE_SECS: f64 = 0.1;
/// `interactionType` of an added stroke.
const ADD_STROKE: i64 = 1;
/// `interactionType` of a deleted stroke.
const DELETE_STROKE: i64 = 2;

/// Opens a CASSIE sketch by either of its files, or an A-Painter drawing as JSON.
/// The whole sketch is held in memory, because its events must be sorted; larger files than `Limits::whole_bytes` are
/// refused.
pub(crate) fn open_json(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let path = input.path;
    let mut warnings = Vec::new();
    let first = match cassie_json::read(input, options, &mut warnings)? {
        Document::Painting(painting) => return apa::open_painting(input, &painting, options, warnings),
        document => document,
    };
    let folder = if matches!(first, Document::History(_)) { "raw_data" } else { "sketch_history" };
    let sibling = sibling(input, folder);
    let second = sibling
        .as_deref()
        .map(|path| cassie_json::read(input.beside(path), options, &mut warnings))
        .transpose()?;
    let (mut history, mut raw) = (None, None);
    let mut raw_path = path;
    for (document, path) in [(Some(first), path), (second, sibling.as_deref().unwrap_or(path))] {
        match document {
            Some(Document::History(strokes)) => history = history.or(Some(strokes)),
            Some(Document::Raw(data)) if raw.is_none() => (raw, raw_path) = (Some(data), path),
            Some(Document::Raw(_) | Document::Painting(_)) | None => {}
        }
    }
    let skipped = warnings.len() as u64;
    let raw = raw.unwrap_or_default();
    let heads = head_path(raw_path, &raw.states, &mut warnings);
    let strokes = history.map_or_else(|| strokes_of_raw(raw), strokes_of_history);
    let events = merge(heads, strokes).into_iter();
    let stream = Cassie { events, notes: Notes { warnings, skipped } };
    let header = Header::new(session_name(path), "CASSIE");
    Ok(Session::new(header, "cassie", Box::new(stream), path, options))
}

/// The other files that are part of the sketch at `path`.
pub(crate) fn files_beside(path: &Path) -> Vec<PathBuf> {
    ["raw_data", "sketch_history"]
        .into_iter()
        .filter_map(|folder| sibling(Input::on_disk(path), folder))
        .collect()
}

/// The file of the same name in the folder `folder` beside the folder of `path`, if it exists.
fn sibling(input: Input<'_>, folder: &str) -> Option<PathBuf> {
    let path = input.path;
    let beside = path.parent()?.join("..").join(folder).join(path.file_name()?);
    input.beside(&beside).is_file().then_some(beside)
}

/// A stroke from one of the files. Its samples are in the axes of osp; its times are those of the file.
struct Stroke {
    samples: Vec<Vec3>,
    created_secs: f64,
    deleted_secs: Option<f64>,
}

fn strokes_of_history(history: Vec<HistoryStroke>) -> Vec<Stroke> {
    let stroke = |stroke: HistoryStroke| Stroke {
        samples: stroke.input_samples.iter().map(|sample| axes::position_from_unity(sample.0)).collect(),
        created_secs: stroke.creation_time.0,
        deleted_secs: stroke.deletion_time.map(|time| time.0),
    };
    history.into_iter().map(stroke).collect()
}

/// The strokes of a `raw_data` file without its history. A stroke without an action gets the time of the previous
/// stroke.
fn strokes_of_raw(raw: RawData) -> Vec<Stroke> {
    let mut actions: Vec<_> =
        raw.states.iter().map(|s| (s.element_id, s.interaction_type, s.time.0)).collect();
    // Actions are sorted by element, then by kind. The sort is stable, so the first action of a kind stays first.
    actions.sort_by_key(|&(element, kind, _)| (element, kind));
    let time_of = |element: i64, kind: i64| {
        let at = actions.partition_point(|&(e, k, _)| (e, k) < (element, kind));
        actions.get(at).filter(|&&(e, k, _)| (e, k) == (element, kind)).map(|&(_, _, secs)| secs)
    };
    let mut last_secs = raw.states.first().map_or(0.0, |state| state.time.0);
    let mut strokes = Vec::with_capacity(raw.strokes.len());
    for stroke in raw.strokes {
        last_secs = time_of(stroke.id, ADD_STROKE).unwrap_or(last_secs);
        strokes.push(Stroke {
            samples: stroke.input_samples.iter().map(|sample| axes::position_from_unity(sample.0)).collect(),
            created_secs: last_secs,
            deleted_secs: time_of(stroke.id, DELETE_STROKE),
        });
    }
    strokes
}

/// The tracked head poses, in canvas space and the axes of osp.
fn head_path(path: &Path, states: &[State], warnings: &mut Vec<String>) -> Vec<Event> {
    let mut heads = Vec::with_capacity(states.len());
    for state in states {
        let canvas_from_room = axes::inverse(axes::unit(state.canvas_rot.0));
        let p = rotate(canvas_from_room, state.head_pos.0 - state.canvas_pos.0) / state.canvas_scale;
        let q = axes::product(canvas_from_room, state.head_rot.0);
        let head = Event::Head {
            author: Author::SOLE,
            t: state.time.0,
            p: axes::position_from_unity(p),
            q: axes::rotation_from_unity(q),
        };
        if state.head_pos.0 != Vec3::ZERO && head.check().is_ok() {
            heads.push(head);
        }
    }
    let left_out = states.len() - heads.len();
    if left_out > 0 {
        warnings.push(format!(
            "{}: {left_out} of {} states have no tracked head",
            path.display(),
            states.len()
        ));
    }
    heads
}

/// All events sorted by time; the first time is zero.
fn merge(heads: Vec<Event>, strokes: Vec<Stroke>) -> Vec<Event> {
    let mut ends: Vec<f64> = strokes.iter().map(|stroke| stroke.created_secs).collect();
    ends.sort_by(f64::total_cmp);
    let mut events = heads;
    let mut erased = Vec::new();
    for (stroke, number) in strokes.into_iter().zip(0..) {
        let earlier = ends.partition_point(|&end| end < stroke.created_secs);
        let free_from = earlier.checked_sub(1).map_or(f64::NEG_INFINITY, |i| ends[i]);
        let number = StrokeId(number);
        if let Some(t) = stroke.deleted_secs {
            erased.push(Event::Erase { author: Author::SOLE, t: t.max(stroke.created_secs), stroke: number });
        }
        push_stroke(&mut events, stroke, number, free_from);
    }
    // Erasures are appended last. The sort is stable, so an erasure never comes before the end of its stroke.
    events.append(&mut erased);
    events.sort_by(|a, b| a.time_secs().total_cmp(&b.time_secs()));
    let start_secs = events.first().map_or(0.0, Event::time_secs);
    events.iter_mut().for_each(|event| shift(event, start_secs));
    events
}

/// Appends the events of a stroke. The stroke ends at its creation time, and does not start before `free_from`, the
/// time at which the hand became free.
fn push_stroke(events: &mut Vec<Event>, stroke: Stroke, number: StrokeId, free_from: f64) {
    let end = stroke.created_secs;
    let steps = stroke.samples.len().saturating_sub(1) as f64;
    let start = (end - steps * SAMPLE_SECS).max(free_from);
    events.push(Event::Begin {
        author: Author::SOLE,
        t: start,
        stroke: number,
        tool: Tool::Ribbon,
        width: WIDTH_M,
        color: COLOR,
        normal: NormalRule::Transport,
        thinnest: 1.0,
        paint: Some(Box::new(Paint::new(BRUSH, number.0))),
    });
    for (&p, index) in stroke.samples.iter().zip(0_u32..) {
        let part = if steps > 0.0 { f64::from(index) / steps } else { 1.0 };
        // For the last sample, this formula gives exactly `end`. A rounded value might come after the stroke's `End`.
        let t = start * (1.0 - part) + end * part;
        events.push(Event::Point { t, stroke: number, p, q: glam::Quat::IDENTITY, pressure: 1.0 });
    }
    events.push(Event::End { t: end, stroke: number });
}

fn shift(event: &mut Event, start_secs: f64) {
    if let Event::Head { t, .. }
    | Event::Begin { t, .. }
    | Event::Point { t, .. }
    | Event::End { t, .. }
    | Event::Erase { t, .. } = event
    {
        // Times are rounded to microseconds, because further digits are rounding errors of the subtraction. Rounding
        // keeps the order.
        *t = ((*t - start_secs) * 1e6).round() / 1e6;
    }
}

struct Cassie {
    events: vec::IntoIter<Event>,
    notes: Notes,
}

impl EventSource for Cassie {
    fn next_event(&mut self) -> Result<Option<Event>> {
        Ok(self.events.next())
    }

    fn notes(&self) -> Notes {
        self.notes.clone()
    }
}
