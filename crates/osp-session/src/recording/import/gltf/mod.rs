//! glTF 2.0, `.glb` and `.gltf` ("glTF 2.0 Specification", Khronos Group, 2021): each triangle becomes a
//! [`Polygon`](Event::Polygon) at time 0. Each node with a mesh in its subtree becomes a group with the node's name and
//! transform. A mesh that two nodes share becomes two copies of its polygons.
//!
//! Two consecutive coplanar triangles that share an edge become one quad, which looks the same. Axes and units need no
//! conversion (+y up, metres, a camera looks along its -z). A [`Transform`](crate::recording::Transform) has a uniform
//! scale. The rest of a node's transform (non-uniform scale, mirror, shear) is applied to the vertices of the node and
//! its descendants. The colour of a polygon is that of its material, texture and vertices
//! ([`paint`](super::paint)). A stroke has the polygons of one opacity in one primitive. The first camera becomes the session's view. Directional lights become the session's
//! [`Environment`](crate::recording::Environment). Skins, animations, points and lines are skipped, and the
//! header lists them.
//!
//! The JSON types are those of the crate `gltf`. Every number is checked where it is used, because the crate's own
//! check can panic on damaged files.

mod accessor;
mod container;
mod extensions;
mod faces;
mod look;
mod nodes;
mod packed;
mod surfaces;
pub(super) mod uri;

use std::{
    collections::{HashMap, VecDeque},
    path::Path,
};

pub(super) use self::container::{MAGIC, files_beside, is_json};
use self::{container::File, faces::Faces, nodes::Planned, surfaces::Surfaces};
use super::{
    far_from_origin,
    paint::{Painted, Splitter},
    session_name,
};
use crate::brush::Brush;
use crate::recording::{
    Author, Event, EventSource, Header, NormalRule, Notes, OpenOptions, Paint, Session, StrokeId, Tool,
    error::{Mismatch, Result},
    input::Input,
};

const CHUNK: usize = 1 << 14;

/// Opens a glTF file and its external buffers.
pub(crate) fn open_gltf(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let path = input.path;
    let mut damage = Damage { is_lenient: options.lenient, notes: Notes::default() };
    let file = File::read(input, &options.limits, &mut damage)?;
    let nodes = nodes::plan(&file, &options.limits, &mut damage)?;
    let surfaces = Surfaces::read(input, &file, &options.limits);
    let mut header = Header::new(session_name(path), look::source(&file));
    look::fill(&file, &nodes.seen, &surfaces.lost, &mut header);
    header.left_out.extend(far_from_origin(nodes.origin));
    let triangles =
        nodes.planned.iter().filter_map(|node| node.mesh).map(|mesh| nodes::triangles(&file, mesh)).sum();
    let format = if file.is_binary { "glb" } else { "gltf" };
    let source = Gltf {
        file,
        surfaces,
        splitter: Splitter::new(triangles, &options.limits),
        polygons: 0,
        damage,
        nodes: nodes.planned.into_iter(),
        at: None,
        queue: VecDeque::new(),
        next_stroke: 0,
        is_over: false,
    };
    Ok(Session::new(header, format, Box::new(source), path, options))
}

struct Damage {
    is_lenient: bool,
    notes: Notes,
}

impl Damage {
    fn note(&mut self, path: &Path, fault: Mismatch) -> Result<()> {
        self.notes.skip(self.is_lenient, fault.in_file(path), "it")
    }
}

struct Gltf {
    file: File,
    surfaces: Surfaces,
    splitter: Splitter,
    /// Number of polygons so far.
    polygons: u64,
    damage: Damage,
    nodes: std::vec::IntoIter<Planned>,
    at: Option<Part>,
    queue: VecDeque<Event>,
    next_stroke: u32,
    is_over: bool,
}

struct Part {
    node: Planned,
    primitive: usize,
    faces: Option<Faces>,
    /// The stroke of each opacity.
    strokes: HashMap<u8, StrokeId>,
}

impl Gltf {
    /// Appends events to the queue; `false` at the end.
    fn fill(&mut self) -> Result<bool> {
        let Some(mut part) = self.at.take() else {
            let Some(node) = self.nodes.next() else { return Ok(false) };
            self.queue.push_back(node.group_event(Vec::new()));
            if let Some(to) = node.to {
                self.queue.push_back(Event::Place { author: Author::SOLE, t: 0.0, group: node.group, to });
            }
            self.at = Some(Part { node, primitive: 0, faces: None, strokes: HashMap::new() });
            return Ok(true);
        };
        let Some(mesh) = part.node.mesh else { return Ok(true) };
        let meshes = &self.file.root.meshes;
        let Some(described) = meshes.get(mesh) else {
            let fault = Mismatch::new(format!("mesh {mesh}"), format!("{} of them", meshes.len()));
            self.damage.note(&self.file.path, fault)?;
            return Ok(true);
        };
        let number = part.primitive;
        let Some(primitive) = described.primitives.get(number) else { return Ok(true) };
        let mut faces = part.faces.take().unwrap_or_default();
        let mut polygons = Vec::new();
        let outcome = {
            let look = (&self.surfaces, &mut self.splitter);
            faces.decode(&self.file, look, primitive, &part.node.residual, CHUNK, &mut polygons)
        };
        let is_done = outcome.as_ref().is_ok_and(|more| !more) || outcome.is_err();
        self.push_polygons(&mut part, polygons);
        if let Some(fault) = outcome.err().or_else(|| faces.fault.take()) {
            let found = format!("{} in mesh {mesh}, primitive {number}", fault.found);
            let fault = Mismatch { found, ..fault };
            self.damage.note(&self.file.path, fault)?;
        }
        if is_done {
            part.primitive += 1;
            part.strokes.clear();
        } else {
            part.faces = Some(faces);
        }
        self.at = Some(part);
        Ok(true)
    }

    fn push_polygons(&mut self, part: &mut Part, polygons: Vec<Painted>) {
        self.polygons += polygons.len() as u64;
        let mesh = part.node.mesh.and_then(|mesh| self.file.root.meshes.get(mesh));
        let brush = mesh.and_then(|mesh| mesh.primitives.get(part.primitive)).and_then(|primitive| {
            let material = primitive.material.map(|material| material.value());
            self.surfaces.of(material).brush_of(primitive)
        });
        for polygon in polygons {
            let opacity = polygon.color[3];
            let known = part.strokes.get(&opacity).copied();
            let stroke = known.unwrap_or(StrokeId(self.next_stroke));
            if let Some(brush) = brush.filter(|_| known.is_none()) {
                self.queue.extend(brush_stroke(stroke, brush));
            }
            self.queue.push_back(polygon.event(stroke));
            if known.is_none() {
                self.next_stroke += 1;
                part.strokes.insert(opacity, stroke);
                self.queue.push_back(part.node.group_event(vec![stroke]));
            }
        }
    }

    /// Ends the reading. A model without polygons is an error, because nothing could be shown.
    fn finish(&mut self) -> Result<()> {
        self.is_over = true;
        let path = &self.file.path;
        if self.polygons == 0 {
            let (meshes, dropped) = (self.file.root.meshes.len(), self.splitter.dropped);
            let found = format!("none in {meshes} meshes, {dropped} behind masks");
            let error = Mismatch::new("triangles in the nodes of the scene", found).in_file(path);
            if !self.damage.is_lenient {
                return Err(error);
            }
            self.damage.notes.warnings.push(error.to_string());
        }
        let lost = self.splitter.lost();
        if !lost.is_empty() {
            self.damage.notes.warnings.push(format!("{}: not shown: {}", path.display(), lost.join("; ")));
        }
        Ok(())
    }
}

/// The events of a stroke whose polygons are those of a model.
fn brush_stroke(stroke: StrokeId, brush: &Brush) -> [Event; 2] {
    let begin = Event::Begin {
        author: Author::SOLE,
        t: 0.0,
        stroke,
        tool: Tool::Ribbon,
        width: 0.01,
        color: (1.0, 1.0, 1.0, 1.0),
        normal: NormalRule::LocalX,
        thinnest: 1.0,
        paint: Some(Box::new(Paint::new(&*brush.name, 0))),
    };
    [begin, Event::End { t: 0.0, stroke }]
}

impl EventSource for Gltf {
    fn next_event(&mut self) -> Result<Option<Event>> {
        while !self.is_over {
            if let Some(event) = self.queue.pop_front() {
                return Ok(Some(event));
            }
            match self.fill() {
                Ok(true) => {}
                Ok(false) => self.finish()?,
                Err(error) => {
                    self.is_over = true;
                    return Err(error);
                }
            }
        }
        Ok(None)
    }

    fn notes(&self) -> Notes {
        self.damage.notes.clone()
    }
}
