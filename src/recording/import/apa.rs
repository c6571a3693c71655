//! A-Painter (Mozilla, 2016) `.apa`: little-endian; a magic word, the brushes' names, then strokes of 36-byte points.
//!
//! A-Painter's line brush (`src/brushes/line.js` in aframevr/a-painter) spans the ribbon along the controller's local
//! x axis, half of `size * pressure` to either side: so [`NormalRule::SideX`], and no width is left at pressure 0.
//! Positions are metres, right-handed with y up (WebVR), and the rotation turns three.js' axes, which are ours. The
//! recorded position is the controller's, not that of the brush's tip before it: the tip's offset is added when a
//! drawing is shown, and only where a controller's model is known, so it is left out here.

use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use super::bytes::ByteReader;
use super::session_name;
use super::strokes::{OnDamage, Sample, StrokeFormat, StrokeHead, StrokeStream};
use crate::recording::{Header, NormalRule, OpenOptions, RecordingError, Session};

/// The first bytes of a file: a string, its length first.
pub(super) const MAGIC: &[u8] = b"\x08apainter";
/// The only version there is.
const VERSION: u16 = 1;
/// Early recordings hold pressures up to 2. A file that does is taken to mean 2 by "full pressure".
const GREATEST_PRESSURE: f32 = 2.0;

/// Opens an A-Painter drawing.
///
/// # Errors
/// The file cannot be read, or its head is damaged.
pub fn open_apa(path: &Path, options: &OpenOptions) -> Result<Session, RecordingError> {
    let mut bytes = open_bytes(path)?;
    let strokes = read_head(&mut bytes)?;
    let format = Apa { full_pressure: full_pressure(path) };
    let stream = StrokeStream::new(format, bytes, strokes, OnDamage::of(options.lenient), Vec::new());
    let header = Header::new(session_name(path), "A-Painter");
    Ok(Session::new(header, "apa", Box::new(stream), path, options))
}

fn open_bytes(path: &Path) -> Result<ByteReader, RecordingError> {
    let file = File::open(path).map_err(|error| RecordingError::io(path, error))?;
    let reader: Box<dyn Read + Send> = Box::new(BufReader::new(file));
    Ok(ByteReader::new(path.to_owned(), reader))
}

/// Everything before the strokes; gives their number.
fn read_head(bytes: &mut ByteReader) -> Result<u32, RecordingError> {
    let mut magic = [0; MAGIC.len()];
    bytes.fill(&mut magic, "the word `apainter`")?;
    if magic != MAGIC {
        return Err(bytes.expected_at(0, "the word `apainter`, its length first", magic.escape_ascii()));
    }
    let at = bytes.offset();
    let version = bytes.u16("the version")?;
    if version != VERSION {
        return Err(bytes.expected_at(
            at,
            format_args!("version {VERSION}"),
            format_args!("version {version}"),
        ));
    }
    for _ in 0..bytes.u8("the number of brushes")? {
        let length = bytes.u8("the length of a brush's name")?;
        bytes.skip(length.into(), "a brush's name")?;
    }
    bytes.u32("the number of strokes")
}

/// The greatest pressure in the file, at least 1: a first pass, which stops at any damage and leaves it to the second
/// pass to report. Without it either drawings of the older kind come out at half their width, or all others get
/// twice the width at half the pressure.
fn full_pressure(path: &Path) -> f32 {
    let mut full: f32 = 1.0;
    let mut scan = || -> Result<(), RecordingError> {
        let mut bytes = open_bytes(path)?;
        let mut format = Apa { full_pressure: 1.0 };
        for _ in 0..read_head(&mut bytes)? {
            for _ in 0..format.read_stroke(&mut bytes)?.points {
                full = full.max(format.read_point(&mut bytes)?.pressure);
            }
        }
        Ok(())
    };
    let _the_second_pass_reports_it = scan();
    full.min(GREATEST_PRESSURE)
}

struct Apa {
    full_pressure: f32,
}

impl StrokeFormat for Apa {
    const NORMAL: NormalRule = NormalRule::SideX;
    const THINNEST: f32 = 0.0;

    fn read_stroke(&mut self, bytes: &mut ByteReader) -> Result<StrokeHead, RecordingError> {
        bytes.u8("a stroke's brush")?;
        let color = [bytes.f32("red")?, bytes.f32("green")?, bytes.f32("blue")?, 1.0];
        let width_m = bytes.f32("the brush's size")? * self.full_pressure;
        let points = bytes.u32("the number of points")?;
        Ok(StrokeHead { paint: None, width_m, color, points })
    }

    fn read_point(&mut self, bytes: &mut ByteReader) -> Result<Sample, RecordingError> {
        let (p, q) = bytes.pose("a point's position and orientation")?;
        let pressure = bytes.f32("a point's pressure")? / self.full_pressure;
        let time_secs = f64::from(bytes.u32("a point's time stamp")?) / 1000.0;
        Ok(Sample { time_secs, p, q, pressure })
    }
}
