//! Tilt Brush (Google, 2016) and Open Brush `.tilt`: a 16-byte header and a zip archive, or a folder with the same
//! files.
//!
//! `data.sketch` holds the strokes: little-endian, controller poses in canvas space, decimetres, Unity's axes.
//! `metadata.json` holds brushes, layers, light and the view of the thumbnail. A program that lacks a stroke's brush
//! draws a ribbon of constant width. The effect of pressure is a property of the brush, and is not in the file. Strokes
//! keep the order of the file, whatever their times.

use std::{collections::VecDeque, path::Path};

use super::{
    archive::Archive,
    axes,
    bytes::ByteReader,
    lines::shown,
    session_name,
    strokes::{Sample, StrokeFormat, StrokeHead, StrokeStream},
    tilt_layout::{MAGIC, METERS_PER_UNIT, SKETCH_MAGIC, point_mask, stroke_mask},
    tilt_metadata::Metadata,
};
use crate::recording::{
    Header, Layer, Limits, NormalRule, OpenOptions, Paint, RecordingError, Session, SketchExtensions,
    error::{Mismatch, Result},
    input::Input,
};

/// Largest size of a thumbnail that is read, bytes. Real thumbnails have up to 200,000.
const MOST_THUMBNAIL_BYTES: u64 = 16 << 20;
const THUMBNAIL_NAME: &str = "thumbnail.png";
/// Versions of `data.sketch` that can be read. Version 6 may have long stroke extensions or header bytes.
const VERSIONS: std::ops::RangeInclusive<u32> = 5..=6;
/// Names of the sketch file, the most common first. Sketches inside a Unity project end in `.bytes`.
const SKETCH_NAMES: [&str; 2] = ["data.sketch", "data.sketch.bytes"];
/// Number of files that a warning names.
const MOST_NAMED: usize = 8;
const METADATA_NAMES: [&str; 3] = ["metadata.json", "metadata.json.bytes", "main.json"];

/// Opens a Tilt Brush or Open Brush sketch. The header's camera is the view of the sketch's thumbnail.
pub(crate) fn open_tilt(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let path = input.path;
    let is_lenient = options.lenient;
    let (mut sketch, metadata, mut warnings) =
        if input.is_folder() { open_folder(input)? } else { open_zip(input, is_lenient, &options.limits)? };
    let metadata = match metadata {
        Some(bytes) => Metadata::read(bytes, is_lenient, &mut warnings),
        None => {
            warnings.push(format!(
                "{}: there is no metadata.json, so no camera, brushes or light",
                path.display()
            ));
            Ok(Metadata::default())
        }
    };
    let metadata = match metadata {
        Err(error) if is_lenient && !matches!(error, RecordingError::Io { .. }) => {
            warnings.push(format!("{error}; read without it"));
            Metadata::default()
        }
        other => other?,
    };
    let mut header = Header::new(session_name(path), String::new());
    metadata.fill(&mut header, &mut warnings);
    let format = Sketch { brushes: metadata.brushes(), layers: header.layers.clone(), ..Sketch::default() };
    drop(metadata);
    let strokes = match read_head(&mut sketch) {
        Ok(strokes) => strokes,
        Err(error) if is_lenient && !matches!(error, RecordingError::Io { .. }) => {
            warnings.push(format!("{error}; no stroke can be read"));
            sketch = ByteReader::new(sketch.path.clone(), Box::new(std::io::empty()));
            0
        }
        Err(error) => return Err(error),
    };
    let stream = StrokeStream::new(format, sketch, strokes, is_lenient, warnings);
    Ok(Session::new(header, "tilt", Box::new(stream), path, options))
}

/// The thumbnail of the `.tilt` file or folder at a path, a PNG of at most 16 MiB. Other files have none.
pub fn tilt_thumbnail(path: &Path) -> Option<Vec<u8>> {
    let input = Input::on_disk(path);
    let mut png = if is_tilt_folder(input) {
        let path = path.join(THUMBNAIL_NAME);
        path.is_file().then(|| ByteReader::open(input.beside(&path)).ok()).flatten()?
    } else {
        let archive = input.path.is_file().then(|| archive_of(input, false))?.ok()?;
        archive.find(&[THUMBNAIL_NAME])?.read(input, &Limits::DEFAULT).ok()?
    };
    png.rest(MOST_THUMBNAIL_BYTES, "a picture of at most 16 MiB").ok()
}

/// The archive of a `.tilt` file.
fn archive_of(input: Input<'_>, is_lenient: bool) -> Result<Archive> {
    let mut bytes = ByteReader::open(input)?;
    let mut magic = [0; MAGIC.len()];
    bytes.fill(&mut magic, "the word `tilT`")?;
    if magic != MAGIC {
        return Err(bytes.expected_at(0, "the word `tilT`", magic.escape_ascii()));
    }
    let zip_start = bytes.u16("the length of the head")?;
    Archive::open(input, zip_start.into(), is_lenient)
}

/// Whether a folder is an unpacked `.tilt`.
pub(super) fn is_tilt_folder(input: Input<'_>) -> bool {
    SKETCH_NAMES.iter().any(|name| input.beside(&input.path.join(name)).is_file())
}

type Parts = (ByteReader, Option<ByteReader>, Vec<String>);

fn open_folder(input: Input<'_>) -> Result<Parts> {
    let path = input.path;
    let open = |names: &[&str]| {
        let mut paths = names.iter().map(|name| path.join(name));
        let found = paths.find(|path| input.beside(path).is_file());
        found.map(|path| ByteReader::open(input.beside(&path))).transpose()
    };
    let sketch = open(&SKETCH_NAMES)?.ok_or_else(|| no_sketch(path, "a folder without it"))?;
    Ok((sketch, open(&METADATA_NAMES)?, Vec::new()))
}

fn open_zip(input: Input<'_>, is_lenient: bool, limits: &Limits) -> Result<Parts> {
    let path = input.path;
    let archive = archive_of(input, is_lenient)?;
    let sketch = archive
        .find(&SKETCH_NAMES)
        .ok_or_else(|| no_sketch(path, "a zip without it"))?
        .read(input, limits)?;
    let metadata = archive.find(&METADATA_NAMES).map(|entry| entry.read(input, limits)).transpose()?;
    let others = not_read(&archive).map(|names| format!("{}: {names}", path.display()));
    Ok((sketch, metadata, archive.warning.into_iter().chain(others).collect()))
}

/// Names the files of an archive that are no part of a sketch.
fn not_read(archive: &Archive) -> Option<String> {
    let is_known = |name: &str| {
        SKETCH_NAMES.iter().chain(&METADATA_NAMES).chain([&THUMBNAIL_NAME]).any(|part| *part == name)
    };
    let mut others = archive.names().filter(|name| !is_known(name));
    let named: Vec<String> = others.by_ref().take(MOST_NAMED).map(shown).collect();
    let more = match others.count() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let names = named.join(", ");
    (!named.is_empty()).then(|| format!("no part of a sketch that osp knows, and not read: {names}{more}"))
}

fn no_sketch(path: &Path, found: &str) -> RecordingError {
    Mismatch::new("a sketch with the file `data.sketch`", found).in_file(path)
}

/// Reads everything in `data.sketch` before the strokes; returns the number of strokes.
fn read_head(bytes: &mut ByteReader) -> Result<u32> {
    let magic = bytes.u32("the sketch's first word")?;
    if magic != SKETCH_MAGIC {
        let expected = format_args!("{SKETCH_MAGIC:#010x}");
        return Err(bytes.expected_at(0, expected, format_args!("{magic:#010x}")));
    }
    let version = bytes.u32("the sketch's version")?;
    if !VERSIONS.contains(&version) {
        return Err(bytes.expected_at(4, "sketch version 5 or 6", format_args!("version {version}")));
    }
    bytes.u32("a reserved word")?;
    let extra = bytes.u32("the length of further header bytes")?;
    bytes.skip(extra.into(), "further header bytes")?;
    bytes.count("the number of strokes")
}

#[derive(Default)]
struct Sketch {
    /// Names of the brushes by their numbers in the file.
    brushes: Vec<String>,
    layers: Vec<Layer>,
    strokes: u32,
    point_mask: u32,
    /// Control points that were read before the stroke begins, because its paint holds their extensions.
    ahead: VecDeque<Result<Sample>>,
    /// Number of strokes with extensions that are too long to keep.
    shortened: u64,
}

impl StrokeFormat for Sketch {
    const NORMAL: NormalRule = NormalRule::Travel;
    const THINNEST: f32 = 1.0;

    fn read_stroke(&mut self, bytes: &mut ByteReader) -> Result<StrokeHead> {
        let brush = bytes.u32("a stroke's brush")?;
        let color = [bytes.f32("red")?, bytes.f32("green")?, bytes.f32("blue")?, bytes.f32("opacity")?];
        let brush_size = bytes.f32("the brush's size")?;
        let mask = bytes.u32("the stroke's extension mask")?;
        self.point_mask = bytes.u32("the control points' extension mask")?;
        // If the file has no seeds, a stroke's number is its seed.
        let (mut scale, mut seed, mut layer, mut sketch_group, mut sketch_flags) =
            (1.0, self.strokes, 0, 0, 0);
        self.strokes = self.strokes.wrapping_add(1);
        let (mut others, mut is_whole) = (SketchExtensions::default(), true);
        for bit in set_bits(mask) {
            match bit {
                stroke_mask::FLAGS => sketch_flags = bytes.u32("the stroke's flags")?,
                stroke_mask::SCALE => scale = bytes.f32("the stroke's scale")?,
                stroke_mask::GROUP => sketch_group = bytes.u32("the stroke's group")?,
                stroke_mask::SEED => seed = bytes.u32("the stroke's seed")?,
                stroke_mask::LAYER => layer = bytes.u32("the stroke's layer")?,
                _ => is_whole &= read_extension(bytes, bit, &mut others)?,
            }
        }
        let points = bytes.count("the number of control points")?;
        is_whole &= self.read_ahead(bytes, points, &mut others);
        self.shortened += u64::from(!is_whole);
        let brush = self.brushes.get(brush as usize).cloned();
        let hidden = self.layers.get(layer as usize).is_some_and(|layer| layer.hidden);
        let sketch_extensions = (others != SketchExtensions::default()).then(|| Box::new(others));
        let paint = brush.map(|brush| {
            Box::new(Paint {
                brush,
                seed,
                scale,
                layer,
                hidden,
                sketch_group,
                sketch_flags,
                sketch_extensions,
            })
        });
        Ok(StrokeHead { width_m: brush_size * scale * METERS_PER_UNIT, color, paint, points })
    }

    fn read_point(&mut self, bytes: &mut ByteReader) -> Result<Sample> {
        match self.ahead.pop_front() {
            Some(read) => read,
            None => self.read_sample(bytes, &mut Vec::new()),
        }
    }

    fn warning(&self) -> Option<String> {
        let (count, most) = (self.shortened, SketchExtensions::MOST_BYTES);
        (count > 0).then(|| format!("lost extensions of more than {most} bytes; strokes with them: {count}"))
    }
}

impl Sketch {
    /// Reads the control points of a stroke in advance, if they have extensions that osp does not know, and appends
    /// these extensions to `others`. Returns `false` if the extensions cannot be kept.
    fn read_ahead(&mut self, bytes: &mut ByteReader, points: u32, others: &mut SketchExtensions) -> bool {
        others.point_mask = self.point_mask & !point_mask::KNOWN;
        let fits = u64::from(points) * others.point_len() as u64 <= SketchExtensions::MOST_BYTES;
        let mut is_read = fits;
        while others.point_mask > 0 && is_read && self.ahead.len() < points as usize {
            let read = self.read_sample(bytes, &mut others.points);
            is_read = read.is_ok();
            self.ahead.push_back(read);
        }
        if !is_read {
            (others.point_mask, others.points) = (0, Vec::new());
        }
        fits
    }

    /// Reads a control point, and appends its extensions that osp does not know to `others`.
    fn read_sample(&self, bytes: &mut ByteReader, others: &mut Vec<u8>) -> Result<Sample> {
        let (p, q) = bytes.pose("a control point's position and orientation")?;
        let (mut pressure, mut milliseconds) = (1.0, 0);
        for bit in set_bits(self.point_mask) {
            match bit {
                point_mask::PRESSURE => pressure = bytes.f32("a control point's pressure")?,
                point_mask::TIME_STAMP => milliseconds = bytes.u32("a control point's time stamp")?,
                _ => others.extend(bytes.u32("a control point's extension")?.to_le_bytes()),
            }
        }
        Ok(Sample {
            time_secs: f64::from(milliseconds) / 1000.0,
            p: axes::position_from_unity(p * METERS_PER_UNIT),
            q: axes::rotation_from_unity(q),
            pressure,
        })
    }
}

/// Reads an extension of a stroke that osp does not know. Returns `false` if the extension is too long to keep.
fn read_extension(bytes: &mut ByteReader, bit: u32, others: &mut SketchExtensions) -> Result<bool> {
    let word = bytes.u32("a stroke extension")?;
    let length = if bit < stroke_mask::FIRST_LONG { 0 } else { word };
    if others.stroke.len() as u64 + u64::from(length) > SketchExtensions::MOST_BYTES {
        bytes.skip(length.into(), "a stroke extension")?;
        return Ok(false);
    }
    others.stroke_mask |= 1 << bit;
    others.stroke.extend(word.to_le_bytes());
    let data = others.stroke.len();
    others.stroke.resize(data + length as usize, 0);
    bytes.fill(&mut others.stroke[data..], "a stroke extension")?;
    Ok(true)
}

/// The indices of the set bits, ascending.
fn set_bits(mask: u32) -> impl Iterator<Item = u32> {
    (0..u32::BITS).filter(move |bit| mask >> bit & 1 == 1)
}
