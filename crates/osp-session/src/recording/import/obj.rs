//! Wavefront `.obj` and `.obj.gz`: each face becomes a [`Polygon`](Event::Polygon) event at time 0.
//!
//! The reader parses `v`, `f` (corners as `v`, `v/vt`, `v//vn`, `v/vt/vn`; negative numbers count from the last vertex)
//! and, for colours, `usemtl`, `g` and `o`. It ignores all other lines. The format specifies neither units nor axes, so
//! neither is converted. By convention y is up, though scenes with z up are common.

use glam::Vec3;
use xxhash_rust::xxh3::xxh3_64;

use super::{
    lines::{LineReader, shown},
    session_name,
};
use crate::recording::{
    Author, Event, EventSource, Header, Notes, OpenOptions, Place, Session,
    error::{Mismatch, Result, beyond},
    input::Input,
};
use osp::math::COORDINATE_LIMIT_M;

/// Colour of faces without a group or material, sRGB.
const PLAIN: [f32; 3] = [0.72, 0.72, 0.70];
/// Colours of named faces, sRGB, chosen by the name's hash. They are light and similar in brightness, so that shading
/// stays visible.
const PALETTE: [[f32; 3]; 12] = [
    [0.78, 0.58, 0.52],
    [0.80, 0.68, 0.50],
    [0.76, 0.75, 0.52],
    [0.60, 0.74, 0.55],
    [0.50, 0.73, 0.66],
    [0.52, 0.70, 0.78],
    [0.56, 0.62, 0.80],
    [0.67, 0.60, 0.80],
    [0.78, 0.60, 0.74],
    [0.66, 0.66, 0.66],
    [0.72, 0.66, 0.58],
    [0.56, 0.64, 0.62],
];

pub(crate) fn open_obj(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let obj = Obj {
        lines: LineReader::open(input, options)?,
        vertices: Vec::new(),
        group: None,
        material: None,
        most_vertices: options.limits.polygons,
    };
    let header = Header::new(session_name(input.path), "Wavefront OBJ");
    Ok(Session::new(header, "obj", Box::new(obj), input.path, options))
}

/// Whether a line that is no comment is one of the statements with which files begin.
pub(crate) fn is_statement(line: &str) -> bool {
    let mut fields = line.split_ascii_whitespace();
    match fields.next() {
        Some("v" | "vt" | "vn") => fields.next().is_some_and(|field| field.parse::<f32>().is_ok()),
        Some("g" | "o" | "s" | "usemtl" | "mtllib") => true,
        _ => false,
    }
}

struct Obj {
    lines: LineReader,
    vertices: Vec<Vec3>,
    group: Option<[f32; 3]>,
    material: Option<[f32; 3]>,
    most_vertices: u64,
}

impl Obj {
    /// Reads the next line. A `\` at the end of a line continues it with the following line. `None` at the end of the
    /// file.
    fn next_line(&mut self) -> Result<Option<String>> {
        let Some(mut line) = self.lines.next_line()? else { return Ok(None) };
        // A comment is never continued, even if it ends in `\`.
        while let Some(begun) = line.strip_suffix('\\').filter(|begun| !begun.contains('#')) {
            line = begun.to_owned();
            let Some(more) = self.lines.next_line()? else { break };
            line.push(' ');
            line.push_str(&more);
            if line.len() > LineReader::MOST_LINE_BYTES {
                self.lines.damaged("a shorter line, with all that `\\` appends to it", shown(&line))?;
                line.clear();
            }
        }
        Ok(Some(line))
    }

    fn read_line(&mut self, line: &str) -> Result<Option<Event>, Mismatch> {
        let text = line.split_once('#').map_or(line, |(text, _comment)| text);
        let mut fields = text.split_ascii_whitespace();
        match fields.next() {
            Some("v") => self.read_vertex(line, fields)?,
            Some("f") => return self.read_face(line, fields).map(Some),
            Some("g" | "o") => self.group = color_of(text),
            Some("usemtl") => self.material = color_of(text),
            _ => {}
        }
        Ok(None)
    }

    /// Reads the coordinates of a vertex; a weight or colour after them is ignored. A damaged vertex keeps its number,
    /// and a face that refers to it is damaged.
    fn read_vertex<'a>(
        &mut self,
        line: &str,
        mut fields: impl Iterator<Item = &'a str>,
    ) -> Result<(), Mismatch> {
        let mut coordinate = || fields.next().and_then(|field| field.parse::<f32>().ok()).unwrap_or(f32::NAN);
        let vertex = Vec3::new(coordinate(), coordinate(), coordinate());
        let usable = vertex.is_finite() && vertex.abs().max_element() <= COORDINATE_LIMIT_M;
        self.vertices.push(if usable { vertex } else { Vec3::NAN });
        if usable { Ok(()) } else { Err(Mismatch::new("`v x y z`, finite and below 1e15", shown(line))) }
    }

    fn read_face<'a>(
        &mut self,
        line: &str,
        fields: impl Iterator<Item = &'a str>,
    ) -> Result<Event, Mismatch> {
        let mut vertices = Vec::new();
        for field in fields {
            let number = field.split('/').next().and_then(|number| number.parse::<i64>().ok());
            let number = number.ok_or_else(|| {
                Mismatch::new("`f` and corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`", shown(line))
            })?;
            vertices.push(self.vertex(number).ok_or_else(|| {
                let count = self.vertices.len();
                let found = format!("corner {number} in {}", shown(line));
                Mismatch { expected: format!("corners from 1 to {count} or from -{count} to -1"), found }
            })?);
            if vertices.len() > Event::MAX_VERTICES {
                break;
            }
        }
        let [r, g, b] = self.material.or(self.group).unwrap_or(PLAIN);
        let face =
            Event::Polygon { author: Author::SOLE, t: 0.0, stroke: None, vertices, color: (r, g, b, 1.0) };
        face.check().map_err(|expected| Mismatch::new(expected, shown(line)))?;
        Ok(face)
    }

    /// The vertex with this number. Positive numbers start at 1; negative numbers count back from the last vertex.
    fn vertex(&self, number: i64) -> Option<Vec3> {
        let number = usize::try_from(number).ok().or_else(|| {
            let back = usize::try_from(number.unsigned_abs()).ok()?;
            (self.vertices.len() + 1).checked_sub(back)
        })?;
        self.vertices.get(number.checked_sub(1)?).copied()
    }
}

/// The colour for the name of a group or material.
fn color_of(line: &str) -> Option<[f32; 3]> {
    let (_keyword, name) = line.trim_ascii().split_once(|c: char| c.is_ascii_whitespace())?;
    Some(PALETTE[(xxh3_64(name.trim_ascii().as_bytes()) % PALETTE.len() as u64) as usize])
}

impl EventSource for Obj {
    fn next_event(&mut self) -> Result<Option<Event>> {
        while let Some(line) = self.next_line()? {
            if self.vertices.len() as u64 > self.most_vertices {
                let (path, place) = (&self.lines.path, self.lines.place());
                return Err(beyond(path, place, self.most_vertices, "vertices"));
            }
            match self.read_line(&line) {
                Ok(Some(event)) => return Ok(Some(event)),
                Ok(None) => {}
                Err(Mismatch { expected, found }) => self.lines.damaged(expected, found)?,
            }
        }
        Ok(None)
    }

    fn notes(&self) -> Notes {
        self.lines.notes.clone()
    }

    fn place(&self) -> Place {
        self.lines.place()
    }
}
