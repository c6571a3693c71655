use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::{
    gltf_material::Material,
    gltf_part::{Part, VERTEX_BYTES},
};

const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A node of the exported file with its mesh.
pub(super) struct Object {
    pub(super) name: String,
    /// The parts of the object, by material.
    pub(super) parts: BTreeMap<usize, Part>,
}

/// Builds the JSON of a file. The file's binary chunk holds the parts of all objects one after the other, vertices
/// before indices. The JSON begins with the asset, which names the program.
pub(super) fn document(
    name: &str,
    objects: &[Object],
    materials: &[Material],
    has_times: bool,
    binary_bytes: usize,
) -> String {
    let asset = json!({ "version": "2.0", "generator": concat!("osp ", env!("CARGO_PKG_VERSION")) });
    let begin_with_asset = |rest: &Value| format!("{{\"asset\":{asset},{}", &rest.to_string()[1..]);
    if objects.is_empty() {
        // Empty lists are not allowed.
        return begin_with_asset(&json!({ "scene": 0, "scenes": [{ "name": name }] }));
    }
    let (mut views, mut accessors, mut offset) = (Vec::new(), Vec::new(), 0);
    let mut mesh = |object: &Object| {
        let primitives = object.parts.iter().map(|(material, part)| {
            let primitive = primitive(*material, part, has_times, offset, &mut views, &mut accessors);
            offset += part.bytes();
            primitive
        });
        json!({ "name": object.name, "primitives": primitives.collect::<Vec<_>>() })
    };
    let meshes: Vec<Value> = objects.iter().map(&mut mesh).collect();
    let node = |(i, object): (usize, &Object)| json!({ "name": object.name, "mesh": i });
    let mut extensions = Vec::new();
    if materials.iter().any(Material::is_unlit) {
        extensions.push("KHR_materials_unlit");
    }
    if materials.iter().any(Material::is_emissive) {
        extensions.push("KHR_materials_emissive_strength");
    }
    let mut json = json!({
        "scene": 0,
        "scenes": [{ "name": name, "nodes": (0..objects.len()).collect::<Vec<_>>() }],
        "nodes": objects.iter().enumerate().map(node).collect::<Vec<_>>(),
        "meshes": meshes,
        "materials": materials.iter().map(Material::json).collect::<Vec<_>>(),
        "buffers": [{ "byteLength": binary_bytes }],
        "bufferViews": views,
        "accessors": accessors,
    });
    if !extensions.is_empty() {
        json["extensionsUsed"] = json!(extensions);
    }
    begin_with_asset(&json)
}

fn primitive(
    material: usize,
    part: &Part,
    has_times: bool,
    offset: usize,
    views: &mut Vec<Value>,
    accessors: &mut Vec<Value>,
) -> Value {
    let (vertices, indices) = (part.vertices.len(), part.indices.len() * 4);
    let view = views.len();
    views.push(json!({
        "buffer": 0, "byteOffset": offset, "byteLength": vertices, "byteStride": VERTEX_BYTES,
        "target": ARRAY_BUFFER,
    }));
    views.push(json!({
        "buffer": 0, "byteOffset": offset + vertices, "byteLength": indices, "target": ELEMENT_ARRAY_BUFFER,
    }));
    let first = accessors.len();
    let count = part.count();
    accessors.push(json!({
        "bufferView": view, "byteOffset": 0, "componentType": FLOAT, "count": count, "type": "VEC3",
        "min": part.min.to_array(), "max": part.max.to_array(),
    }));
    accessors.push(json!({
        "bufferView": view, "byteOffset": 12, "componentType": FLOAT, "count": count, "type": "VEC3",
    }));
    accessors.push(json!({
        "bufferView": view, "byteOffset": 24, "componentType": UNSIGNED_SHORT, "normalized": true,
        "count": count, "type": "VEC4",
    }));
    accessors.push(json!({
        "bufferView": view, "byteOffset": 32, "componentType": FLOAT, "count": count, "type": "VEC2",
    }));
    accessors.push(json!({
        "bufferView": view + 1, "componentType": UNSIGNED_INT, "count": part.indices.len(), "type": "SCALAR",
    }));
    let mut attributes =
        json!({ "POSITION": first, "NORMAL": first + 1, "COLOR_0": first + 2, "TEXCOORD_0": first + 3 });
    let own = if has_times { &[("_TIMESTAMP", 40), ("_STROKE", 44)][..] } else { &[("_STROKE", 44)] };
    for &(name, offset) in own {
        attributes[name] = json!(accessors.len());
        accessors.push(json!({
            "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "count": count, "type": "SCALAR",
        }));
    }
    json!({ "attributes": attributes, "indices": first + 4, "material": material })
}
