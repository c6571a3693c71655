//! A-Painter (Mozilla, 2016) `.apa`. The format is little-endian: a magic word, the brushes' names, then strokes of
//! 36-byte points. A drawing as JSON has the same numbers, and is read as the bytes of an `.apa`.
//!
//! A-Painter's line brush (`src/brushes/line.js` in aframevr/a-painter) spans the ribbon along the controller's local x
//! axis. The ribbon extends half of `size * pressure` to either side, so its width is 0 at pressure 0. The reader
//! therefore uses [`NormalRule::SideX`]. Positions are in metres, right-handed with y up (WebVR). Rotations are in the
//! axes of three.js, which are those of osp. The recorded position is that of the controller. A-Painter adds the offset
//! of the brush's tip only for display, and only for known controllers. The reader omits the offset.
//!
//! A-Painter's plain brushes (flat, smooth) become the plain ribbon. Brushes with textures, or with stamps of leaves or
//! blots, become the most similar brushes of Tilt Brush (`apa_brushes.ron`). These brushes keep a part of their width
//! at pressure 0. Pressures are therefore converted to give A-Painter's width, down to the brush's smallest width. A
//! brush without a counterpart becomes a plain ribbon, and the header lists it.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use super::bytes::ByteReader;
use super::cassie_json::{PaintedPoint, PaintedStroke, Painting};
use super::session_name;
use super::strokes::{Sample, StrokeFormat, StrokeHead, StrokeStream};
use crate::{
    brush::{self, Brush},
    recording::{Header, MemoryFiles, NormalRule, OpenOptions, Paint, Session, error::Result, input::Input},
};

/// The first bytes of a file: the length of a string, and the string.
pub(super) const MAGIC: &[u8] = b"\x08apainter";
/// The only version that exists.
const VERSION: u16 = 1;
/// Full pressure of early recordings. A file with a pressure above 1 is an early recording.
const GREATEST_PRESSURE: f32 = 2.0;
const PLAIN: [&str; 2] = ["flat", "smooth"];
/// Largest number of characters of a brush's name in a header. `MOST_NAMES` is the largest number of names.
const MOST_NAME_CHARS: usize = 40;
const MOST_NAMES: usize = 8;

/// The most similar brush of the crate's table, by A-Painter's name.
static NEAREST: LazyLock<BTreeMap<String, String>> = LazyLock::new(|| {
    ron::from_str(include_str!("apa_brushes.ron")).expect("the crate's own table, which a test reads")
});

pub(crate) fn open_apa(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    open_with(input, options, Vec::new())
}

/// Opens a drawing that was read from JSON.
pub(super) fn open_painting(
    input: Input<'_>,
    painting: &Painting,
    options: &OpenOptions,
    warnings: Vec<String>,
) -> Result<Session> {
    let names = &painting.brushes[..painting.brushes.len().min(u8::MAX.into())];
    let mut bytes = [MAGIC, &VERSION.to_le_bytes(), &[names.len() as u8]].concat();
    for name in names {
        let name = &name.as_bytes()[..name.len().min(u8::MAX.into())];
        bytes.push(name.len() as u8);
        bytes.extend(name);
    }
    bytes.extend((painting.strokes.len() as u32).to_le_bytes());
    for PaintedStroke { brush, points } in &painting.strokes {
        bytes.push(u8::try_from(brush.index).unwrap_or(u8::MAX));
        bytes.extend(brush.color.iter().chain([&brush.size]).flat_map(|number| number.to_le_bytes()));
        bytes.extend((points.len() as u32).to_le_bytes());
        for PaintedPoint { position, orientation, pressure, timestamp } in points {
            let place = position.0.to_array().into_iter().chain(orientation.0.to_array());
            bytes.extend(place.chain([*pressure]).flat_map(f32::to_le_bytes));
            bytes.extend((*timestamp as u32).to_le_bytes());
        }
    }
    let mut files = MemoryFiles::new();
    files.insert(input.path, bytes);
    open_with(Input::in_memory(input.path, &files), options, warnings)
}

fn open_with(input: Input<'_>, options: &OpenOptions, warnings: Vec<String>) -> Result<Session> {
    let path = input.path;
    let mut bytes = ByteReader::open(input)?;
    let (names, strokes) = read_head(&mut bytes)?;
    let (full_pressure, used) = first_pass(input);
    let mut header = Header::new(session_name(path), "A-Painter");
    header.left_out.extend(without_counterpart(&names, &used));
    let brushes = names.iter().map(|name| NEAREST.get(name).and_then(|name| brush::find(name))).collect();
    let format = Apa { full_pressure, brushes, ..Apa::default() };
    let stream = StrokeStream::new(format, bytes, strokes, options.lenient, warnings);
    Ok(Session::new(header, "apa", Box::new(stream), path, options))
}

/// Lists, as text, the used brushes that have no counterpart and are drawn as plain ribbons.
fn without_counterpart(names: &[String], used: &[bool; 256]) -> Option<String> {
    let is_missing = |name: &str| !PLAIN.contains(&name) && !NEAREST.contains_key(name);
    let missing = names.iter().zip(used).filter(|&(name, &used)| used && is_missing(name));
    let mut names: Vec<String> =
        missing.map(|(name, _)| name.chars().take(MOST_NAME_CHARS).collect()).collect();
    names.sort_unstable();
    names.dedup();
    if names.len() > MOST_NAMES {
        names.truncate(MOST_NAMES);
        names.push("…".to_owned());
    }
    (!names.is_empty())
        .then(|| format!("the look of the brushes {}: they are plain ribbons", names.join(", ")))
}

/// Reads everything before the strokes: the brushes' names, and the number of strokes.
fn read_head(bytes: &mut ByteReader) -> Result<(Vec<String>, u32)> {
    let mut magic = [0; MAGIC.len()];
    bytes.fill(&mut magic, "the word `apainter`")?;
    if magic != MAGIC {
        return Err(bytes.expected_at(0, "the word `apainter`, its length first", magic.escape_ascii()));
    }
    let at = bytes.offset;
    let version = bytes.u16("the version")?;
    if version != VERSION {
        let expected = format_args!("version {VERSION}");
        return Err(bytes.expected_at(at, expected, format_args!("version {version}")));
    }
    let mut names = Vec::new();
    for _ in 0..bytes.u8("the number of brushes")? {
        let mut name = vec![0; bytes.u8("the length of a brush's name")?.into()];
        bytes.fill(&mut name, "a brush's name")?;
        names.push(String::from_utf8_lossy(&name).into_owned());
    }
    Ok((names, bytes.u32("the number of strokes")?))
}

/// Returns the file's full pressure, from 1 to 2, and the brushes that strokes use. Older drawings have a full pressure
/// of 2, others of 1, so the file is read twice. This first pass stops at any damage, and the second pass reports it.
fn first_pass(input: Input<'_>) -> (f32, [bool; 256]) {
    let (mut full, mut used) = (1.0_f32, [false; 256]);
    let mut scan = || -> Result<()> {
        let mut bytes = ByteReader::open(input)?;
        let mut format = Apa::default();
        for _ in 0..read_head(&mut bytes)?.1 {
            let head = format.read_stroke(&mut bytes)?;
            used[usize::from(format.brush)] = true;
            for _ in 0..head.points {
                full = full.max(format.read_point(&mut bytes)?.pressure);
            }
        }
        Ok(())
    };
    let _the_second_pass_reports_it = scan();
    (full.min(GREATEST_PRESSURE), used)
}

struct Apa {
    full_pressure: f32,
    /// The most similar brush of the crate's table, by the brush's number in the file.
    brushes: Vec<Option<&'static Brush>>,
    brush: u8,
    strokes: u32,
}

impl Default for Apa {
    fn default() -> Self {
        Self { full_pressure: 1.0, brushes: Vec::new(), brush: 0, strokes: 0 }
    }
}

impl Apa {
    fn nearest(&self) -> Option<&'static Brush> {
        self.brushes.get(usize::from(self.brush)).copied().flatten()
    }
}

/// The pressure at which the brush has A-Painter's width; in A-Painter the width is proportional to the pressure.
fn pressure_for(brush: &Brush, part_of_width: f32) -> f32 {
    let least = brush.pressure_size_min;
    if least < 1.0 { ((part_of_width - least) / (1.0 - least)).max(0.0) } else { part_of_width }
}

impl StrokeFormat for Apa {
    const NORMAL: NormalRule = NormalRule::SideX;
    const THINNEST: f32 = 0.0;

    fn read_stroke(&mut self, bytes: &mut ByteReader) -> Result<StrokeHead> {
        self.brush = bytes.u8("a stroke's brush")?;
        let color = [bytes.f32("red")?, bytes.f32("green")?, bytes.f32("blue")?, 1.0];
        let width_m = bytes.f32("the brush's size")? * self.full_pressure;
        let points = bytes.u32("the number of points")?;
        let paint = self.nearest().map(|brush| Box::new(Paint::new(brush.name.clone(), self.strokes)));
        self.strokes = self.strokes.wrapping_add(1);
        Ok(StrokeHead { paint, width_m, color, points })
    }

    fn read_point(&mut self, bytes: &mut ByteReader) -> Result<Sample> {
        let (p, q) = bytes.pose("a point's position and orientation")?;
        let pressure = bytes.f32("a point's pressure")? / self.full_pressure;
        let pressure = self.nearest().map_or(pressure, |brush| pressure_for(brush, pressure));
        let time_secs = f64::from(bytes.u32("a point's time stamp")?) / 1000.0;
        Ok(Sample { time_secs, p, q, pressure })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_brush_of_the_table_is_known_and_keeps_the_width() {
        assert!(NEAREST.len() > 20);
        for name in NEAREST.values() {
            let brush = brush::find(name).expect("a brush of our table");
            assert!(brush.pressure_size_min <= 0.5, "{name} does not answer to pressure");
            for part in [brush.pressure_size_min, 0.75, 1.0] {
                let width = brush.size(pressure_for(brush, part));
                assert!((width - part).abs() < 1e-6, "{name}: {width} of the width in place of {part}");
            }
            assert_eq!(pressure_for(brush, 0.0), 0.0, "{name}");
        }
    }
}
