//! glTF 2.0, `.glb` and `.gltf` ("glTF 2.0 Specification", Khronos Group, 2021): each triangle becomes a
//! [`Polygon`](Event::Polygon) at time 0. Each node with a mesh in its subtree becomes a group with the node's name and
//! transform. A mesh that two nodes share becomes two copies of its polygons.
//!
//! Two consecutive coplanar triangles that share an edge become one quad, which looks the same. Axes and units need no
//! conversion (+y up, metres, a camera looks along its -z). A [`Transform`](crate::recording::Transform) has a uniform
//! scale. The rest of a node's transform (non-uniform scale, mirror, shear) is applied to the vertices of the node and
//! its descendants. Colours are the base colour times the vertices' mean colour. A stroke has the polygons of one
//! colour in one primitive. The first camera becomes the session's view. Directional lights become the session's
//! [`Environment`](crate::recording::Environment). Textures, skins, animations, points and lines are skipped, and the
//! header lists them.
//!
//! The JSON types are those of the crate `gltf`. Every number is checked where it is used, because the crate's own
//! check can panic on damaged files.

mod accessor;
mod container;
mod faces;
mod look;
mod nodes;
pub(super) mod uri;

use std::{
    collections::{HashMap, VecDeque},
    path::Path,
};

pub(super) use self::container::{MAGIC, files_beside, is_json};
use self::{
    container::File,
    faces::{Faces, Polygon},
    nodes::Planned,
};
use super::session_name;
use crate::recording::{
    Author, Event, EventSource, Header, Notes, OpenOptions, Session, StrokeId,
    error::{Mismatch, Result},
    input::Input,
};

const CHUNK: usize = 1 << 14;
/// Largest number of colours of a primitive that are stored exactly. With more colours, each channel is rounded to 16
/// steps, so that a painted mesh does not become a stroke for each of its triangles.
const MOST_COLORS: usize = 1024;

/// Opens a glTF file and its external buffers.
pub(crate) fn open_gltf(input: Input<'_>, options: &OpenOptions) -> Result<Session> {
    let path = input.path;
    let mut damage = Damage { is_lenient: options.lenient, notes: Notes::default() };
    let file = File::read(input, &options.limits, &mut damage)?;
    let nodes = nodes::plan(&file, &mut damage)?;
    let mut header = Header::new(session_name(path), look::source(&file));
    look::fill(&file, &nodes.seen, &mut header);
    let format = if file.is_binary { "glb" } else { "gltf" };
    let source = Gltf {
        file,
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
    strokes: HashMap<u32, StrokeId>,
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
        let outcome = faces.decode(&self.file, primitive, &part.node.residual, CHUNK, &mut polygons);
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

    fn push_polygons(&mut self, part: &mut Part, mut polygons: Vec<Polygon>) {
        let mut colors: Vec<u32> = polygons.iter().map(|polygon| polygon.color).collect();
        colors.sort_unstable();
        colors.dedup();
        let new = colors.iter().filter(|color| !part.strokes.contains_key(color)).count();
        if part.strokes.len() + new > MOST_COLORS {
            polygons.iter_mut().for_each(|polygon| polygon.color = faces::rounded(polygon.color));
        }
        // Polygons are sorted by colour, because each colour becomes a stroke. The sort is stable, so a stroke's
        // polygons keep their order.
        polygons.sort_by_key(|polygon| polygon.color);
        for polygon in polygons {
            let color = faces::channels(polygon.color);
            let known = part.strokes.get(&polygon.color).copied();
            let stroke = known.unwrap_or(StrokeId(self.next_stroke));
            self.queue.push_back(Event::Polygon {
                author: Author::SOLE,
                t: 0.0,
                stroke: Some(stroke),
                vertices: polygon.corners,
                color,
            });
            if known.is_none() {
                self.next_stroke += 1;
                part.strokes.insert(polygon.color, stroke);
                self.queue.push_back(part.node.group_event(vec![stroke]));
            }
        }
    }
}

impl EventSource for Gltf {
    fn next_event(&mut self) -> Result<Option<Event>> {
        while !self.is_over {
            if let Some(event) = self.queue.pop_front() {
                return Ok(Some(event));
            }
            match self.fill() {
                Ok(true) => {}
                Ok(false) => self.is_over = true,
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
