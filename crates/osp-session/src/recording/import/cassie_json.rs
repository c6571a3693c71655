use std::io::{BufRead, BufReader, Read};
use std::marker::PhantomData;

use glam::{Quat, Vec3};
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, de};

use super::axes;
use crate::recording::{
    OpenOptions, Place, RecordingError,
    error::{Mismatch, Result, beyond},
    input::Input,
};
use osp::math::COORDINATE_LIMIT_M;

/// Largest absolute time that is read, seconds: 30,000 years.
const GREATEST_TIME_SECS: f64 = 1e12;

/// The contents of a file of either kind, up to the first damage if the reader is lenient.
pub(super) enum Document {
    History(Vec<HistoryStroke>),
    Raw(RawData),
    Painting(Painting),
}

/// A drawing of A-Painter as JSON (`brush.js` in aframevr/a-painter): the fields of its binary files.
#[derive(Default)]
pub(super) struct Painting {
    pub(super) brushes: Vec<String>,
    pub(super) strokes: Vec<PaintedStroke>,
}

#[derive(Deserialize)]
pub(super) struct PaintedStroke {
    pub(super) brush: PaintedBrush,
    pub(super) points: Vec<PaintedPoint>,
}

#[derive(Deserialize)]
pub(super) struct PaintedBrush {
    /// -1 for a brush that the drawing does not list.
    pub(super) index: i64,
    pub(super) color: [f32; 3],
    pub(super) size: f32,
}

#[derive(Deserialize)]
pub(super) struct PaintedPoint {
    pub(super) position: Point,
    pub(super) orientation: Turn,
    pub(super) pressure: f32,
    pub(super) timestamp: f64,
}

/// A rotation `[x, y, z, w]` of any length but 0, normalised.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "[f32; 4]")]
pub(super) struct Turn(pub(super) Quat);

impl TryFrom<[f32; 4]> for Turn {
    type Error = &'static str;

    fn try_from(xyzw: [f32; 4]) -> Result<Self, Self::Error> {
        let q = axes::unit(Quat::from_array(xyzw));
        if q.is_finite() { Ok(Self(q)) } else { Err("a quaternion other than 0 is expected") }
    }
}

#[derive(Deserialize)]
pub(super) struct HistoryStroke {
    pub(super) input_samples: Vec<Point>,
    pub(super) creation_time: Seconds,
    pub(super) deletion_time: Option<Seconds>,
}

#[derive(Default)]
pub(super) struct RawData {
    pub(super) states: Vec<State>,
    pub(super) strokes: Vec<RawStroke>,
}

/// A sample of the user's state, perhaps with an action.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct State {
    pub(super) interaction_type: i64,
    pub(super) time: Seconds,
    #[serde(rename = "elementID")]
    pub(super) element_id: i64,
    pub(super) head_pos: Point,
    pub(super) head_rot: Rotation,
    pub(super) canvas_pos: Point,
    pub(super) canvas_rot: Rotation,
    pub(super) canvas_scale: f32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct RawStroke {
    pub(super) id: i64,
    pub(super) input_samples: Vec<Point>,
}

/// A time of at most [`GREATEST_TIME_SECS`].
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "f64")]
pub(super) struct Seconds(pub(super) f64);

impl TryFrom<f64> for Seconds {
    type Error = &'static str;

    fn try_from(secs: f64) -> Result<Self, Self::Error> {
        if secs.abs() <= GREATEST_TIME_SECS { Ok(Self(secs)) } else { Err("a time below 1e12 s is expected") }
    }
}

/// A position in Unity's axes: `[x, y, z]` or `{"x": …, "y": …, "z": …}`, finite.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "PointForms")]
pub(super) struct Point(pub(super) Vec3);

#[derive(Deserialize)]
#[serde(untagged)]
enum PointForms {
    Array([f32; 3]),
    Object { x: f32, y: f32, z: f32 },
}

impl TryFrom<PointForms> for Point {
    type Error = &'static str;

    fn try_from(form: PointForms) -> Result<Self, Self::Error> {
        let p = match form {
            PointForms::Array(xyz) => Vec3::from_array(xyz),
            PointForms::Object { x, y, z } => Vec3::new(x, y, z),
        };
        let usable = p.is_finite() && p.abs().max_element() <= COORDINATE_LIMIT_M;
        if usable { Ok(Self(p)) } else { Err("coordinates below 1e15 m are expected") }
    }
}

/// A rotation in Unity's axes, not necessarily a unit quaternion.
#[derive(Clone, Copy, Deserialize)]
#[serde(from = "RotationForm")]
pub(super) struct Rotation(pub(super) Quat);

#[derive(Deserialize)]
struct RotationForm {
    x: f32,
    y: f32,
    z: f32,
    w: f32,
}

impl From<RotationForm> for Rotation {
    fn from(RotationForm { x, y, z, w }: RotationForm) -> Self {
        Self(Quat::from_xyzw(x, y, z, w))
    }
}

/// Reads a sketch history or raw data. A lenient reader skips damaged parts and adds a line for each to `warnings`.
pub(super) fn read(input: Input<'_>, options: &OpenOptions, warnings: &mut Vec<String>) -> Result<Document> {
    let path = input.path;
    let io = |error| RecordingError::io(path, error);
    let file = input.open().map_err(io)?;
    let bytes = file.len().map_err(io)?;
    // The whole file is in memory. Real files have less than a million bytes.
    let most = options.limits.whole_bytes();
    if bytes > most {
        return Err(beyond(path, Place::File, most, "bytes"));
    }
    let mut reader = BufReader::new(file.take(most));
    let is_list = reader.fill_buf().map_err(io)?.trim_ascii_start().starts_with(b"[");
    let mut json = serde_json::Deserializer::from_reader(reader);
    let (document, result) = if is_list {
        let mut strokes = Vec::new();
        let result = Collect(&mut strokes).deserialize(&mut json);
        (Document::History(strokes), result)
    } else {
        let (mut raw, mut painting) = (RawData::default(), None);
        let result = CollectObject(&mut raw, &mut painting).deserialize(&mut json);
        (painting.map_or(Document::Raw(raw), Document::Painting), result)
    };
    let Err(error) = result.and_then(|()| json.end()) else { return Ok(document) };
    if error.is_io() {
        return Err(io(error.into()));
    }
    let expected = "a CASSIE sketch (a list of strokes, or an object with systemStates and allSketchedStrokes) or an \
                    A-Painter drawing (an object with strokes and brushes)";
    let found = format!("text that does not fit ({error})");
    let error = Mismatch::new(expected, found).in_line(path, error.line() as u64);
    if !options.lenient {
        return Err(error);
    }
    warnings.push(format!("{error}; reading ended there"));
    Ok(document)
}

/// Decodes a list into a vector, which keeps the elements before any damage.
struct Collect<'a, T>(&'a mut Vec<T>);

impl<'de, T: Deserialize<'de>> DeserializeSeed<'de> for Collect<'_, T> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        struct Items<'a, T>(&'a mut Vec<T>, PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Items<'_, T> {
            type Value = ();

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a list")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
                while let Some(item) = list.next_element()? {
                    self.0.push(item);
                }
                Ok(())
            }
        }
        deserializer.deserialize_seq(Items(self.0, PhantomData))
    }
}

/// Decodes `raw_data` or a drawing; the elements before any damage are kept.
struct CollectObject<'a>(&'a mut RawData, &'a mut Option<Painting>);

impl<'de> DeserializeSeed<'de> for CollectObject<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for CollectObject<'_> {
    type Value = ();

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let mut known = false;
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "systemStates" => map.next_value_seed(Collect(&mut self.0.states))?,
                "allSketchedStrokes" => map.next_value_seed(Collect(&mut self.0.strokes))?,
                "brushes" => map.next_value_seed(Collect(&mut self.1.get_or_insert_default().brushes))?,
                "strokes" => map.next_value_seed(Collect(&mut self.1.get_or_insert_default().strokes))?,
                _ => {
                    map.next_value::<IgnoredAny>()?;
                    continue;
                }
            }
            known = true;
        }
        if known { Ok(()) } else { Err(de::Error::missing_field("systemStates")) }
    }
}
