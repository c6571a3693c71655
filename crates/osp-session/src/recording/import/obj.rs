//! Wavefront `.obj` and `.obj.gz` ("Object Files (.obj)", Alias/Wavefront): each face becomes
//! [`Polygon`](Event::Polygon)s at time 0.
//!
//! Objects (`o`) and groups (`g`) become groups, a group within its object. A stroke has the faces of one material in
//! one group. A face has the colour of its material ([`materials`](super::obj_material)), or that of its vertices if
//! they have colours (`v x y z r g b`, sRGB). A face may precede its vertices. Lines, points, curves and unknown
//! statements are counted and named at the end.
//!
//! The format specifies neither units nor axes. [`OpenOptions`] state them, or a comment at the beginning of the file
//! (`# File units = inches`, `# up: z`); else a unit is a metre, and y is up. Vertices far from the origin are read
//! relative to a point in their middle, because `f32` has too few digits for them.
//!
//! The parsing is our own: the crate `tobj` reads whole files, without numbers of lines.

use std::collections::{BTreeMap, HashMap, VecDeque};

use glam::{DVec3, Vec2, Vec3, Vec4};

use super::{
    far_from_origin, group_name,
    lines::{LineReader, shown},
    obj_material::{Materials, PLAIN},
    paint::{Corner, Painted, Splitter},
    session_name,
    texture::linear_of,
};
use crate::recording::{
    Author, Event, EventSource, GroupId, Header, Notes, OpenOptions, Place, Session, StrokeId, Up,
    error::{Mismatch, Result, beyond},
    input::Input,
};
use osp::math::COORDINATE_LIMIT_M;

/// Number of vertices at the beginning of a file that decide whether it lies far from the origin.
const SNIFFED_VERTICES: usize = 1 << 16;
/// Bytes of a face and its vertex in a typical file. The number of faces is only estimated, to divide pieces fairly.
const BYTES_A_FACE: u64 = 64;
/// Most unknown statements that are counted by name.
const MOST_NAMES: usize = 16;

pub(crate) fn open_obj(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let sniffed = Sniffed::of(input, options);
    let bytes = input.open().and_then(|file| file.len()).unwrap_or_default();
    let mut header = Header::new(session_name(input.path), "Wavefront OBJ");
    header.left_out.extend(far_from_origin(sniffed.origin));
    let obj = Obj {
        lines: LineReader::open(input, options)?,
        materials: Materials::new(input, options),
        frame: sniffed,
        positions: Vec::new(),
        colors: Vec::new(),
        uvs: Vec::new(),
        normals: Vec::new(),
        at: State::default(),
        groups: HashMap::new(),
        node: None,
        strokes: HashMap::new(),
        late: VecDeque::new(),
        queue: VecDeque::new(),
        painted: Vec::new(),
        splitter: Splitter::new(bytes / BYTES_A_FACE, &options.limits),
        skipped: BTreeMap::new(),
        faces: 0,
        is_lenient: options.lenient,
        most_vertices: options.limits.polygons,
        is_over: false,
        notes: Notes::default(),
    };
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

/// Axes, unit and place of a file's vertices.
struct Sniffed {
    up: Up,
    unit_m: f64,
    /// The point that becomes the origin, in metres and our axes.
    origin: DVec3,
    /// The brightest colour of a vertex: 1, or 255 in files of some programs.
    full_color: f32,
}

impl Sniffed {
    /// Reads the beginning of the file.
    fn of(input: Input<'_>, options: &OpenOptions) -> Self {
        let (mut up, mut unit_m) = (options.up, options.unit_m);
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (mut count, mut full_color) = (0, 1.0);
        let mut lines = LineReader::open(input, &OpenOptions { lenient: true, ..*options }).ok();
        while let Some(Ok(Some(line))) = lines.as_mut().map(LineReader::next_line) {
            if let Some(comment) = line.strip_prefix('#').filter(|_| count == 0) {
                up = up.or_else(|| said_up(comment));
                unit_m = unit_m.or_else(|| said_unit_m(comment));
            }
            let mut fields = line.split_ascii_whitespace();
            if fields.next() == Some("v")
                && let Some(p) = point(&mut fields)
            {
                (min, max) = (min.min(p), max.max(p));
                count += 1;
                let more: Vec<f32> = fields.filter_map(|field| field.parse().ok()).take(3).collect();
                if more.len() == 3 {
                    full_color = full_color_of(&more).max(full_color);
                }
                if count == SNIFFED_VERTICES {
                    break;
                }
            }
        }
        let mut of = Self {
            up: up.unwrap_or_default(),
            unit_m: unit_m.unwrap_or(1.0),
            origin: DVec3::ZERO,
            full_color,
        };
        if count > 0 {
            of.origin = super::origin_of(of.placed(min), of.placed(max));
        }
        of
    }

    /// A point of the file in metres and our axes, relative to the origin.
    fn placed(&self, p: DVec3) -> DVec3 {
        self.up.turned(p) * self.unit_m - self.origin
    }
}

/// The brightest colour in a file with this colour: some programs count to 255. A little more than 1 is 1, rounded.
fn full_color_of(color: &[f32]) -> f32 {
    if color.iter().any(|c| *c > 2.0) { 255.0 } else { 1.0 }
}

/// The unit that a comment such as `# File units = inches` states.
fn said_unit_m(comment: &str) -> Option<f64> {
    let comment = comment.to_ascii_lowercase();
    let mut words = comment.split(|c: char| !c.is_ascii_alphanumeric());
    words.find(|word| matches!(*word, "unit" | "units"))?;
    words.find_map(crate::recording::unit_m)
}

/// The axis that a comment such as `# up: z` or `# Z-up` states.
fn said_up(comment: &str) -> Option<Up> {
    let comment = comment.to_ascii_lowercase();
    let words = || comment.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    let has = |wanted: &str| words().any(|word| word == wanted);
    match (has("up") && words().count() <= 4, has("y"), has("z")) {
        (true, true, false) => Some(Up::Y),
        (true, false, true) => Some(Up::Z),
        _ => None,
    }
}

/// The next three fields as a point within the limits.
fn point<'a>(fields: &mut impl Iterator<Item = &'a str>) -> Option<DVec3> {
    let mut coordinate = || fields.next().and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
    let p = DVec3::new(coordinate(), coordinate(), coordinate());
    (p.is_finite() && p.abs().max_element() <= f64::from(COORDINATE_LIMIT_M)).then_some(p)
}

/// What applies to the next face.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
struct State {
    object: Option<String>,
    group: Option<String>,
    material: Option<usize>,
}

/// A group and its parent.
type Node = (GroupId, Option<GroupId>);

struct Obj {
    lines: LineReader,
    materials: Materials,
    frame: Sniffed,
    positions: Vec<Vec3>,
    /// Colours of the vertices, as far as they have some; else white.
    colors: Vec<Option<[u8; 3]>>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    at: State,
    /// The groups by the names of object and group.
    groups: HashMap<[Option<String>; 2], Node>,
    /// The group of the current names, if it is known.
    node: Option<Option<Node>>,
    /// The stroke of a group, a material and an opacity.
    strokes: HashMap<(Option<GroupId>, Option<usize>, u8), StrokeId>,
    /// Faces with vertices that do not exist yet, with their lines.
    late: VecDeque<(u64, String, State)>,
    queue: VecDeque<Event>,
    painted: Vec<Painted>,
    splitter: Splitter,
    /// Numbers of skipped statements.
    skipped: BTreeMap<String, u64>,
    faces: u64,
    is_lenient: bool,
    most_vertices: u64,
    is_over: bool,
    notes: Notes,
}

impl Obj {
    /// Reads the next line. A `\` at the end of a line continues it with the following line. `None` at the end of the
    /// file.
    fn next_line(&mut self) -> Result<Option<String>> {
        let Some(mut line) = self.lines.next_line()? else { return Ok(None) };
        let (mut from, mut is_whole) = (0, true);
        // A comment is never continued, even if it ends in `\`.
        while line.ends_with('\\') && !line[from..].contains('#') {
            line.pop();
            from = line.len();
            let Some(more) = self.lines.next_line()? else { break };
            line.push(' ');
            line.push_str(&more);
            if line.len() > LineReader::MOST_LINE_BYTES {
                if std::mem::take(&mut is_whole) {
                    self.lines.damaged("a shorter line, with all that `\\` appends to it", shown(&line))?;
                }
                // What follows is part of the line that is skipped.
                line.replace_range(..line.len() - usize::from(line.ends_with('\\')), "");
                from = 0;
            }
        }
        Ok(Some(if is_whole { line } else { String::new() }))
    }

    fn read_line(&mut self, line: &str) -> Result<(), Mismatch> {
        let text = line.split_once('#').map_or(line, |(text, _comment)| text).trim_ascii();
        let (word, rest) = text.split_once(|c: char| c.is_ascii_whitespace()).unwrap_or((text, ""));
        let rest = rest.trim_ascii();
        let name = || (!rest.is_empty()).then(|| rest.to_owned());
        match word {
            "" | "s" | "lod" | "bevel" | "c_interp" | "d_interp" | "shadow_obj" | "trace_obj" => {}
            "v" => self.read_vertex(line, rest)?,
            "vn" => {
                let normal = point(&mut rest.split_ascii_whitespace()).unwrap_or_default();
                self.normals.push(self.frame.up.turned(normal).as_vec3());
            }
            "vt" => {
                let mut fields = rest.split_ascii_whitespace().map(|field| field.parse::<f32>().ok());
                let mut next = || fields.next().flatten().unwrap_or_default();
                // In files, v is up; rows of pictures go down.
                let (u, v) = (next(), next());
                self.uvs.push(Vec2::new(u, 1.0 - v));
            }
            "f" | "fo" => self.read_face(line, rest)?,
            "o" => {
                (self.node, self.at) =
                    (None, State { object: name(), group: None, ..std::mem::take(&mut self.at) })
            }
            "g" => (self.node, self.at.group) = (None, name()),
            "usemtl" => self.at.material = self.materials.number_of(rest),
            "mtllib" => self.materials.read(rest),
            _ => {
                let is_known = self.skipped.len() < MOST_NAMES || self.skipped.contains_key(word);
                let key = if is_known { shown(word) } else { "others".to_owned() };
                *self.skipped.entry(key).or_default() += 1;
            }
        }
        Ok(())
    }

    /// Reads a vertex: coordinates, then a weight, a colour, or both. A damaged vertex keeps its number, and a face
    /// that refers to it is damaged.
    fn read_vertex(&mut self, line: &str, rest: &str) -> Result<(), Mismatch> {
        let mut fields = rest.split_ascii_whitespace();
        let found = point(&mut fields);
        let p = found.map_or(Vec3::NAN, |p| self.frame.placed(p).as_vec3());
        self.positions.push(p);
        let more: Vec<Option<f32>> = fields.take(5).map(|field| field.parse().ok()).collect();
        let color = match more[..] {
            [Some(r), Some(g), Some(b)] | [Some(r), Some(g), Some(b), Some(_)] => Some([r, g, b]),
            [] => None,
            // The weight of a vertex matters to curves only.
            [Some(_)] => None,
            _ => {
                *self.skipped.entry("fields of `v`".to_owned()).or_default() += 1;
                None
            }
        };
        if let Some(color) = color {
            let most = full_color_of(&color).max(self.frame.full_color);
            self.colors.resize(self.positions.len() - 1, None);
            self.colors.push(Some(color.map(|c| (c / most * 255.0).round() as u8)));
        }
        found.map(drop).ok_or_else(|| Mismatch::new("`v x y z`, finite and below 1e15", shown(line)))
    }

    fn read_face(&mut self, line: &str, rest: &str) -> Result<(), Mismatch> {
        let mut corners: Vec<Corner> = Vec::new();
        let mut colors = 0;
        for field in rest.split_ascii_whitespace() {
            let mut numbers = field.split('/');
            let number = numbers.next().and_then(|number| number.parse::<i64>().ok());
            let number = number.ok_or_else(|| {
                Mismatch::new("`f` and corners as `v`, `v/vt`, `v//vn` or `v/vt/vn`", shown(line))
            })?;
            let count = self.positions.len();
            let Some(at) = place(number, count) else {
                if number > 0 && !self.is_over {
                    self.late.push_back((self.lines.number(), line.to_owned(), self.at.clone()));
                    return Ok(());
                }
                let found = format!("corner {number} in {}", shown(line));
                let expected = match count {
                    0 => "a vertex (`v`) for each corner".to_owned(),
                    _ => format!("corners from 1 to {count} or from -{count} to -1"),
                };
                return Err(Mismatch { expected, found });
            };
            let mut further = || numbers.next().and_then(|number| number.parse::<i64>().ok());
            let (uv, normal) = (further(), further());
            let uv = uv.and_then(|number| self.uvs.get(place(number, self.uvs.len())?));
            let normal = normal.and_then(|number| self.normals.get(place(number, self.normals.len())?));
            let (uv, normal) = (uv.copied().unwrap_or_default(), normal.copied().unwrap_or_default());
            let color = self.colors.get(at).copied().flatten();
            colors += usize::from(color.is_some());
            let [r, g, b] = color.unwrap_or([255; 3]).map(linear_of);
            corners.push(Corner { p: self.positions[at], normal, uv, color: Vec4::new(r, g, b, 1.0) });
            if corners.len() > Event::MAX_VERTICES {
                break;
            }
        }
        Corner::check(&corners).map_err(|expected| Mismatch::new(expected, shown(line)))?;
        self.faces += 1;
        let mut look = self.materials.look(self.at.material);
        if colors > 0 {
            // The colours of vertices stand for the material's.
            look.base = Vec4::ONE.with_w(look.base.w);
        } else if self.at.material.is_none() {
            look.base = PLAIN;
        }
        self.splitter.paint(&corners, &look, &mut self.painted);
        let group = self.group();
        let material = self.at.material;
        for polygon in self.painted.drain(..) {
            let key = (group.map(|(group, _)| group), material, polygon.color[3]);
            let known = self.strokes.get(&key).copied();
            let stroke = known.unwrap_or(StrokeId(self.strokes.len() as u32));
            self.queue.push_back(polygon.event(stroke));
            if known.is_none() {
                self.strokes.insert(key, stroke);
                self.queue.extend(group.map(|(group, parent)| grouping(group, parent, vec![stroke], None)));
            }
        }
        Ok(())
    }

    /// The current group and its parent. A new group is announced.
    fn group(&mut self) -> Option<Node> {
        if let Some(known) = self.node {
            return known;
        }
        let State { object, group, .. } = &self.at;
        let mut parent = None;
        // Many programs write the name of an object again as that of its only group.
        let inner = group.as_ref().filter(|group| object.as_ref() != Some(*group));
        for (name, key) in
            [(object.as_ref(), [object.clone(), None]), (inner, [object.clone(), inner.cloned()])]
        {
            let Some(name) = name else { continue };
            let next = GroupId(self.groups.len() as u32);
            let (id, _) = *self.groups.entry(key).or_insert_with(|| {
                self.queue.push_back(grouping(
                    next,
                    parent.map(|(id, _)| id),
                    Vec::new(),
                    Some(group_name(name)),
                ));
                (next, parent.map(|(id, _)| id))
            });
            parent = Some((id, parent.map(|(id, _)| id)));
        }
        self.node = Some(parent);
        parent
    }

    /// Ends the reading: late faces, then what was skipped.
    fn finish(&mut self) -> Result<()> {
        self.is_over = true;
        while let Some((number, line, state)) = self.late.pop_front() {
            (self.node, self.at) = (None, state);
            let rest = line.split_once('#').map_or(&*line, |(text, _)| text).trim_ascii();
            let rest = rest.split_once(|c: char| c.is_ascii_whitespace()).map_or("", |(_, rest)| rest);
            if let Err(Mismatch { expected, found }) = self.read_face(&line, rest) {
                self.lines.damaged_in(number, expected, found)?;
            }
        }
        let path = self.lines.path.display();
        let kinds = self.skipped.iter().map(|(name, count)| format!("{count} {name}"));
        let skipped = kinds.collect::<Vec<_>>().join(", ");
        if self.faces == 0 {
            let with = if skipped.is_empty() { String::new() } else { format!(", statements {skipped}") };
            let found = format!("none; {} vertices{with}", self.positions.len());
            let error = Mismatch::new("faces (`f`)", found).in_file(&self.lines.path);
            if !self.is_lenient {
                return Err(error);
            }
            self.notes.warnings.push(error.to_string());
        }
        let mut lost = self.splitter.lost();
        if !skipped.is_empty() {
            lost.push(format!("statements that make no faces: {skipped}"));
        }
        lost.extend(self.materials.lost());
        if !lost.is_empty() {
            self.notes.warnings.push(format!("{path}: not shown: {}", lost.join("; ")));
        }
        self.notes.warnings.extend(self.materials.warnings());
        Ok(())
    }
}

fn grouping(group: GroupId, parent: Option<GroupId>, strokes: Vec<StrokeId>, name: Option<String>) -> Event {
    Event::Group { author: Author::SOLE, t: 0.0, group, strokes, parent, name }
}

/// The place in a list of `count` entries of a number. Positive numbers start at 1; negative numbers count back from
/// the last entry.
fn place(number: i64, count: usize) -> Option<usize> {
    let number = usize::try_from(number).ok().or_else(|| {
        let back = usize::try_from(number.unsigned_abs()).ok()?;
        (count + 1).checked_sub(back)
    })?;
    number.checked_sub(1).filter(|&at| at < count)
}

impl EventSource for Obj {
    fn next_event(&mut self) -> Result<Option<Event>> {
        self.advance().inspect_err(|_| self.is_over = true)
    }

    fn notes(&self) -> Notes {
        let mut notes = self.lines.notes.clone();
        notes.warnings.extend(self.notes.warnings.iter().cloned());
        notes
    }

    fn place(&self) -> Place {
        self.lines.place()
    }
}

impl Obj {
    fn advance(&mut self) -> Result<Option<Event>> {
        loop {
            if let Some(event) = self.queue.pop_front() {
                return Ok(Some(event));
            }
            if self.is_over {
                return Ok(None);
            }
            let Some(line) = self.next_line()? else {
                self.finish()?;
                continue;
            };
            if self.positions.len().max(self.uvs.len()).max(self.normals.len()) as u64 > self.most_vertices {
                let (path, place) = (&self.lines.path, self.lines.place());
                return Err(beyond(path, place, self.most_vertices, "vertices"));
            }
            if let Err(Mismatch { expected, found }) = self.read_line(&line) {
                self.lines.damaged(expected, found)?;
            }
        }
    }
}
