//! Tilt Brush (Google, 2016) and Open Brush `.tilt`: a 16-byte head and a zip. See [`recording::import`] for its reader.
//!
//! [`recording::import`]: crate::recording::import

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{Cursor, Write},
};

use zip::{CompressionMethod, ZipWriter, write::SimpleFileOptions};

use super::{
    error::ExportError,
    kept_strokes::KeptStrokes,
    tilt_metadata::{Brushes, Layers, metadata},
    tilt_stroke::{Place, TiltStroke},
};
use crate::recording::{
    GroupId, Header,
    import::tilt_layout::{MAGIC, SKETCH_MAGIC},
};

/// Number of bytes of the header before the zip.
const HEAD_BYTES: u16 = 16;
/// Version of the header, and version of `data.sketch`, as Tilt Brush writes them.
const HEAD_VERSION: u16 = 1;
const SKETCH_VERSION: u32 = 5;
/// Version of a `data.sketch` with long stroke extensions.
const LONG_SKETCH_VERSION: u32 = 6;
/// Upper bound of the total size of the zip's headers, its directory and the metadata, bytes.
const ZIP_ROOM_BYTES: u64 = 1 << 25;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TiltCounts {
    pub strokes: u64,
    pub points: u64,
    /// One line for each kind of data that the file lacks or stores in another form.
    pub notes: Vec<String>,
}

/// Writes the strokes at the end of a session as a `.tilt`, with layers, groups, camera and light.
///
/// Erased and undone strokes are skipped. Moved and grouped strokes are written at their final positions. For a session
/// that was read from a `.tilt`, its metadata are written back, and an unchanged stroke is equal bit for bit.
/// `thumbnail` is a PNG.
///
/// Numbers of a session from another source are rounded: positions in decimetres to 24 bits, times to milliseconds. The
/// whole file is in memory, 36 bytes for each control point.
///
/// # Errors
/// The output fails, the sketch does not fit the format, or a session of polygons has no stroke with control points.
pub fn write_tilt(
    kept: &mut KeptStrokes,
    header: &Header,
    thumbnail: Option<&[u8]>,
    out: &mut dyn Write,
) -> Result<TiltCounts, ExportError> {
    kept.settle();
    let kept = &*kept;
    let mut counts = TiltCounts::default();
    let mut stand_ins = BTreeMap::<&str, u64>::new();
    let (mut lost, mut opaque, mut out_of_time, mut unextended) = (0, 0, 0, 0);
    let mut strokes = Vec::new();
    for (stroke, motion) in kept.iter() {
        // The brush of a model's polygons; `finished_polygons` counts these.
        let has_polygons = kept.scene.stroke(stroke.id).is_some_and(|state| state.polygon_count() > 0);
        if stroke.points.is_empty() && has_polygons {
            continue;
        }
        let Some(ready) = TiltStroke::new(stroke, motion) else {
            lost += 1;
            continue;
        };
        if let Some(brush) = ready.plain {
            *stand_ins.entry(&brush.name).or_default() += 1;
            opaque += u64::from(stroke.color.3 < 1.0);
        }
        out_of_time += ready.points_out_of_time();
        unextended += u64::from(ready.loses_extensions());
        strokes.push((stroke.id, ready));
    }
    if strokes.is_empty() && kept.finished_polygons() > 0 {
        return Err(ExportError::NoStrokes(kept.finished_polygons()));
    }
    let used: BTreeSet<u32> =
        strokes.iter().filter_map(|(id, _)| Some(kept.scene.stroke(*id)?.layer())).collect();
    let layers = Layers::new(header, &kept.scene, &used);
    let mut brushes = Brushes::of(header);
    let taken = strokes.iter().filter_map(|(_, stroke)| Some(stroke.paint()?.sketch_group)).collect();
    let mut groups = SketchGroups { taken, given: BTreeMap::new(), last: 0 };
    let mut sketch: Vec<u8> = Vec::new();
    let (mut inner, mut named, mut authors) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    let has_long = strokes.iter().any(|(_, stroke)| stroke.has_long_extension());
    let version = if has_long { LONG_SKETCH_VERSION } else { SKETCH_VERSION };
    let head = [SKETCH_MAGIC, version, 0, 0, strokes.len() as u32];
    sketch.extend(head.iter().flat_map(|word| word.to_le_bytes()));
    for (id, stroke) in &strokes {
        let Some(state) = kept.scene.stroke(*id) else { continue };
        // Groups of the format are flat: strokes that move together are selected together.
        let mut within = kept.scene.groups_of(state);
        named.extend(within.iter().copied().filter(|&id| kept.scene.group_name(id).is_some()));
        authors.insert(state.author());
        let outermost = within.pop();
        inner.extend(within);
        let group = match outermost {
            Some(outermost) => groups.number(outermost),
            None => stroke.paint().map_or(0, |paint| paint.sketch_group),
        };
        let place = Place { brush: brushes.place(stroke.guid), layer: layers.place(state.layer()), group };
        stroke.write(&place, &mut sketch);
        counts.strokes += 1;
        counts.points += stroke.point_count() as u64;
        let bytes = sketch.len() as u64 + ZIP_ROOM_BYTES;
        if u32::try_from(bytes).is_err() {
            return Err(ExportError::TooLarge(bytes));
        }
    }
    let (metadata, rewritten) = metadata(header, &kept.scene, brushes, &layers);
    let grouped = [inner.len() as u64, named.len() as u64];
    counts.notes = notes(kept, [opaque, lost, unextended], grouped, &stand_ins);
    if authors.len() > 1 {
        counts.notes.push("which author drew a stroke is not written: .tilt has no place for it".to_owned());
    }
    counts.notes.extend(rewritten);
    if out_of_time > 0 {
        counts.notes.push(format!(
            "control points before the start or later than 49 days, with the nearest time that .tilt can store: {out_of_time}"
        ));
    }
    let mut zip = ZipWriter::new(Cursor::new(Vec::with_capacity(sketch.len() + 4096)));
    let thumbnail = thumbnail.map(|png| ("thumbnail.png", png));
    let files = [("data.sketch", sketch.as_slice()), ("metadata.json", metadata.as_bytes())];
    for (name, bytes) in thumbnail.into_iter().chain(files) {
        // Tilt Brush and Open Brush write uncompressed files, and some of their tools read no others.
        let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        zip.start_file(name, stored).map_err(std::io::Error::from)?;
        zip.write_all(bytes)?;
    }
    let zip = zip.finish().map_err(std::io::Error::from)?.into_inner();
    out.write_all(MAGIC)?;
    out.write_all(&HEAD_BYTES.to_le_bytes())?;
    out.write_all(&HEAD_VERSION.to_le_bytes())?;
    out.write_all(&[0; 8])?;
    out.write_all(&zip)?;
    out.flush()?;
    Ok(counts)
}

/// Numbers of the file's groups. Groups that came from a sketch keep their numbers. The session's other groups get
/// unused numbers.
struct SketchGroups {
    taken: BTreeSet<u32>,
    given: BTreeMap<GroupId, u32>,
    last: u32,
}

impl SketchGroups {
    fn number(&mut self, group: GroupId) -> u32 {
        *self.given.entry(group).or_insert_with(|| {
            // The loop ends, because a file has fewer strokes than there are numbers.
            while self.last == 0 || self.taken.contains(&self.last) {
                self.last = self.last.wrapping_add(1);
            }
            self.taken.insert(self.last);
            self.last
        })
    }
}

/// Returns one line for each kind of data that the file lacks or stores in another form.
fn notes(
    kept: &KeptStrokes,
    [opaque, lost, unextended]: [u64; 3],
    [inner, named]: [u64; 2],
    stand_ins: &BTreeMap<&str, u64>,
) -> Vec<String> {
    let many = |count: u64, one: &str, many: &str| match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {many}"),
    };
    let mut notes = Vec::new();
    for (name, &count) in stand_ins {
        let strokes = many(
            count,
            "stroke without a brush of Tilt Brush is",
            "strokes without a brush of Tilt Brush are",
        );
        notes.push(format!("{strokes} written with the brush {name}"));
    }
    if opaque > 0 {
        let strokes = many(opaque, "transparent stroke", "transparent strokes");
        notes.push(format!(
            "{strokes} without a brush will be opaque: the brushes above have no transparency"
        ));
    }
    if unextended > 0 {
        let of = many(unextended, "stroke with other control points", "strokes with other control points");
        notes.push(format!("the control points' extensions are not written for {of} than the sketch had"));
    }
    let polygons = kept.finished_polygons();
    let left_out = [
        (polygons, "polygon that no stroke drew", "polygons that no stroke drew"),
        (lost, "stroke at infinity or shrunk to a point", "strokes at infinity or shrunk to a point"),
        (kept.heads, "recorded pose of a head", "recorded poses of a head"),
        (kept.scene.views().len() as u64, "saved view", "saved views"),
        (inner, "group in another group", "groups in other groups"),
        (named, "name of a group", "names of groups"),
    ];
    for (count, one, several) in left_out {
        if count > 0 {
            let is = if count == 1 { "is" } else { "are" };
            notes.push(format!("{} {is} not written: .tilt has no place for it", many(count, one, several)));
        }
    }
    notes
}
