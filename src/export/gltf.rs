//! Binary glTF 2.0: "glTF 2.0 Specification", Khronos Group, 2021.

use std::io::{self, Write};

use glam::Vec3;
use serde_json::{Value, json};
use thiserror::Error;

use crate::{polygon::PolygonId, scene::Scene};

/// Bytes of a vertex: position and normal as floats, colour as four 16-bit numbers.
const VERTEX_BYTES: usize = 12 + 12 + 8;
const GLB_MAGIC: u32 = 0x4654_6c67;
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BIN_CHUNK: u32 = 0x004e_4942;
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Why a model was not exported.
#[derive(Debug, Error)]
pub enum ExportError {
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format counts bytes in 32 bits.
    #[error("the model is too large for one .glb file: {0} bytes of at most 4294967295")]
    TooLarge(u64),
}

/// What was exported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GltfCounts {
    /// Polygons.
    pub polygons: u64,
    /// Triangles.
    pub triangles: u64,
    /// Polygons left out: a corner is not a finite number, which the format does not have.
    pub not_finite: u64,
}

/// Vertices and triangles of one material.
#[derive(Default)]
struct Part {
    vertices: Vec<u8>,
    indices: Vec<u32>,
    min: Vec3,
    max: Vec3,
}

impl Part {
    fn count(&self) -> usize {
        self.vertices.len() / VERTEX_BYTES
    }

    fn add(&mut self, corners: &[Vec3], normal: Vec3, color: [u16; 4]) {
        let first = self.count() as u32;
        if first == 0 {
            (self.min, self.max) = (corners[0], corners[0]);
        }
        for &corner in corners {
            (self.min, self.max) = (self.min.min(corner), self.max.max(corner));
            for number in corner.to_array().into_iter().chain(normal.to_array()) {
                self.vertices.extend(number.to_le_bytes());
            }
            self.vertices.extend(color.iter().flat_map(|c| c.to_le_bytes()));
        }
        for i in 2..corners.len() as u32 {
            self.indices.extend([first, first + i - 1, first + i]);
        }
    }
}

/// Writes the visible polygons of a scene as one binary glTF file: flat-shaded, two-sided, with the strokes' colours at
/// the vertices; opaque and transparent polygons have a material each. World space, metres, as glTF has it.
///
/// # Errors
/// The output fails, or the model does not fit the format.
pub fn write_glb(scene: &Scene, name: &str, mut out: impl Write) -> Result<GltfCounts, ExportError> {
    let mut counts = GltfCounts::default();
    let (mut opaque, mut transparent) = (Part::default(), Part::default());
    for id in scene.visible_ids() {
        let polygon = scene.polygon(id);
        // A group can be placed so far away that `f32` has no number for it.
        if !polygon.vertices().iter().all(|corner| corner.is_finite()) {
            counts.not_finite += 1;
            continue;
        }
        let color = linear_color(scene, id);
        let part = if color[3] < u16::MAX { &mut transparent } else { &mut opaque };
        part.add(polygon.vertices(), unit_normal(polygon.area_vector()), color);
        counts.polygons += 1;
        counts.triangles += polygon.vertices().len() as u64 - 2;
    }
    let parts: Vec<(usize, Part)> =
        [opaque, transparent].into_iter().enumerate().filter(|(_, part)| part.count() > 0).collect();
    let binary_bytes: usize =
        parts.iter().map(|(_, part)| part.vertices.len() + part.indices.len() * 4).sum();
    let mut json = document(name, &parts, binary_bytes).to_string().into_bytes();
    // Chunks are multiples of four bytes; JSON is filled up with spaces.
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary_chunk = if binary_bytes > 0 { 8 + binary_bytes as u64 } else { 0 };
    let total = 12 + 8 + json.len() as u64 + binary_chunk;
    let total_u32 = u32::try_from(total).map_err(|_| ExportError::TooLarge(total))?;
    let mut words = |words: &[u32]| words.iter().try_for_each(|word| out.write_all(&word.to_le_bytes()));
    words(&[GLB_MAGIC, 2, total_u32, json.len() as u32, JSON_CHUNK])?;
    out.write_all(&json)?;
    if binary_bytes > 0 {
        out.write_all(&(binary_bytes as u32).to_le_bytes())?;
        out.write_all(&BIN_CHUNK.to_le_bytes())?;
        for (_, part) in &parts {
            out.write_all(&part.vertices)?;
            for index in &part.indices {
                out.write_all(&index.to_le_bytes())?;
            }
        }
    }
    out.flush()?;
    Ok(counts)
}

/// The normal of a polygon; that of a huge one overflows, and any will do.
fn unit_normal(area_vector: Vec3) -> Vec3 {
    area_vector.try_normalize().filter(|normal| normal.is_finite()).unwrap_or(Vec3::Y)
}

fn document(name: &str, parts: &[(usize, Part)], binary_bytes: usize) -> Value {
    let (mut views, mut accessors, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
    let mut offset = 0;
    for (material, part) in parts {
        let (vertices, indices) = (part.vertices.len(), part.indices.len() * 4);
        let vertex_view = views.len();
        views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": vertices, "byteStride": VERTEX_BYTES,
            "target": ARRAY_BUFFER,
        }));
        views.push(json!({
            "buffer": 0, "byteOffset": offset + vertices, "byteLength": indices, "target": ELEMENT_ARRAY_BUFFER,
        }));
        offset += vertices + indices;
        let first = accessors.len();
        let count = part.count();
        accessors.push(json!({
            "bufferView": vertex_view, "byteOffset": 0, "componentType": FLOAT, "count": count, "type": "VEC3",
            "min": part.min.to_array(), "max": part.max.to_array(),
        }));
        accessors.push(json!({
            "bufferView": vertex_view, "byteOffset": 12, "componentType": FLOAT, "count": count, "type": "VEC3",
        }));
        accessors.push(json!({
            "bufferView": vertex_view, "byteOffset": 24, "componentType": UNSIGNED_SHORT, "normalized": true,
            "count": count, "type": "VEC4",
        }));
        accessors.push(json!({
            "bufferView": vertex_view + 1, "componentType": UNSIGNED_INT, "count": part.indices.len(),
            "type": "SCALAR",
        }));
        primitives.push(json!({
            "attributes": { "POSITION": first, "NORMAL": first + 1, "COLOR_0": first + 2 },
            "indices": first + 3,
            "material": material,
        }));
    }
    let material = |name: &str, mode: &str| {
        json!({
            "name": name, "doubleSided": true, "alphaMode": mode,
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.8 },
        })
    };
    let asset = json!({ "version": "2.0", "generator": concat!("osp ", env!("CARGO_PKG_VERSION")) });
    if primitives.is_empty() {
        // Empty lists are not allowed.
        return json!({ "asset": asset, "scene": 0, "scenes": [{ "name": name }] });
    }
    json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "name": name, "nodes": [0] }],
        "nodes": [{ "name": name, "mesh": 0 }],
        "meshes": [{ "name": name, "primitives": primitives }],
        "materials": [material("opaque", "OPAQUE"), material("transparent", "BLEND")],
        "buffers": [{ "byteLength": binary_bytes }],
        "bufferViews": views,
        "accessors": accessors,
    })
}

/// Vertex colours are linear in glTF.
fn linear_color(scene: &Scene, id: PolygonId) -> [u16; 4] {
    let (r, g, b, a) = scene.stroke_of(id).color();
    let linear = |c: f32| {
        let c = c.clamp(0.0, 1.0);
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    [linear(r), linear(g), linear(b), a.clamp(0.0, 1.0)].map(|c| (c * 65535.0).round() as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{Event, GroupId, StrokeId, Transform};
    use glam::Quat;

    fn word(bytes: &[u8], at: usize) -> u32 {
        u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
    }

    fn export(events: &[Event]) -> (GltfCounts, Value, Vec<u8>) {
        let mut scene = Scene::new();
        events.iter().for_each(|event| scene.apply(event, &mut Vec::new()));
        let mut bytes = Vec::new();
        let counts = write_glb(&scene, "test", &mut bytes).expect("memory");
        assert_eq!((word(&bytes, 0), word(&bytes, 4), word(&bytes, 8)), (GLB_MAGIC, 2, bytes.len() as u32));
        let json_bytes = word(&bytes, 12) as usize;
        assert_eq!((word(&bytes, 16), json_bytes % 4), (JSON_CHUNK, 0));
        let json = serde_json::from_slice(&bytes[20..20 + json_bytes]).expect("JSON");
        let rest = bytes.split_off(20 + json_bytes);
        (counts, json, rest)
    }

    fn polygon(vertices: &[[f32; 3]], alpha: f32) -> Event {
        let vertices = vertices.iter().map(|&v| Vec3::from(v)).collect();
        Event::Polygon { t: 0.0, stroke: None, vertices, color: (1.0, 0.5, 0.0, alpha) }
    }

    #[test]
    fn polygons_come_back_from_the_bytes() {
        let quad = polygon(&[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 1.0, 0.0]], 1.0);
        let glass = polygon(&[[0.0, 0.0, 5.0], [1.0, 0.0, 5.0], [0.0, 1.0, 5.0]], 0.5);
        let (counts, json, chunk) = export(&[quad, glass]);
        assert_eq!(counts, GltfCounts { polygons: 2, triangles: 3, not_finite: 0 });
        assert_eq!(word(&chunk, 4), BIN_CHUNK);
        let binary = &chunk[8..];
        assert_eq!(binary.len() as u64, json["buffers"][0]["byteLength"].as_u64().expect("a number"));
        let primitives = json["meshes"][0]["primitives"].as_array().expect("a list");
        assert_eq!(primitives.len(), 2);
        assert_eq!(json["materials"][1]["alphaMode"], "BLEND");
        let accessor = |i: u64| &json["accessors"][i as usize];
        let positions = accessor(primitives[0]["attributes"]["POSITION"].as_u64().expect("a number"));
        assert_eq!(positions["max"], json!([2.0, 1.0, 0.0]));
        assert_eq!(positions["count"], 4);
        let indices = accessor(primitives[0]["indices"].as_u64().expect("a number"));
        let view = &json["bufferViews"][indices["bufferView"].as_u64().expect("a number") as usize];
        let at = view["byteOffset"].as_u64().expect("a number") as usize;
        let found: Vec<u32> = (0..6).map(|i| word(binary, at + 4 * i)).collect();
        assert_eq!(found, [0, 1, 2, 0, 2, 3]);
        let float = |at| f32::from_bits(word(binary, at));
        assert_eq!([float(VERTEX_BYTES), float(VERTEX_BYTES + 4)], [2.0, 0.0], "the second corner");
        assert_eq!([float(12), float(16), float(20)], [0.0, 0.0, 1.0], "its normal");
    }

    #[test]
    fn nothing_is_a_valid_file_too() {
        let (counts, json, rest) = export(&[]);
        assert_eq!(counts, GltfCounts::default());
        assert!(rest.is_empty() && json.get("buffers").is_none());
    }

    #[test]
    fn a_polygon_at_infinity_is_left_out_and_counted() {
        let corners = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]];
        let Event::Polygon { vertices, color, .. } = polygon(&corners, 1.0) else {
            unreachable!("made above")
        };
        let far = Event::Polygon { t: 0.0, stroke: Some(StrokeId(1)), vertices, color };
        let group = |id: u32, strokes: Vec<StrokeId>, parent: Option<u32>| Event::Group {
            t: 0.0,
            group: GroupId(id),
            strokes,
            parent: parent.map(GroupId),
        };
        let to = Transform { p: Vec3::ZERO, q: Quat::IDENTITY, s: 1.0e30 };
        let place = |id: u32| Event::Place { t: 0.0, group: GroupId(id), to };
        let near = polygon(&corners, 1.0);
        let grouped = [group(2, vec![], None), group(1, vec![StrokeId(1)], Some(2)), place(1), place(2)];
        let (counts, json, _) = export(&[&[near, far], &grouped[..]].concat());
        assert_eq!(counts, GltfCounts { polygons: 1, triangles: 1, not_finite: 1 });
        assert!(json["accessors"][0]["max"].as_array().is_some_and(|max| max.iter().all(Value::is_number)));
    }
}
