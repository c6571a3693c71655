use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::{
    gltf_material::Materials,
    gltf_options::ExportOptions,
    gltf_part::Part,
    gltf_texture::Textures,
    gltf_view::{background, camera, lights},
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

/// Padded length of a part of the binary chunk with contents of this length, bytes.
pub(super) fn aligned(bytes: usize) -> usize {
    bytes.next_multiple_of(4)
}

/// Contents of a file. Its binary chunk holds the parts of all objects one after the other, vertices before indices, and
/// then the pictures of the textures.
pub(super) struct Document<'a> {
    pub(super) name: &'a str,
    pub(super) objects: &'a [Object],
    pub(super) materials: &'a Materials,
    pub(super) options: &'a ExportOptions,
}

impl Document<'_> {
    /// The JSON of the file. It begins with the asset, which names the program.
    pub(super) fn text(&self, binary_bytes: usize) -> String {
        let Self { name, objects, materials, options } = self;
        let asset = json!({ "version": "2.0", "generator": concat!("osp ", env!("CARGO_PKG_VERSION")) });
        let (mut views, mut accessors, mut offset) = (Vec::new(), Vec::new(), 0);
        let has_times = options.times.is_some();
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
        let mut nodes: Vec<Value> = objects.iter().enumerate().map(node).collect();
        let mut extensions: Vec<&str> = Vec::new();
        let mut json = json!({ "scene": 0 });
        if let Some(pose) = &options.camera {
            let (camera, node) = camera(pose);
            json["cameras"] = json!([camera]);
            nodes.push(node);
        }
        let mut scene = json!({ "name": name });
        if let Some(environment) = &options.environment {
            let (lights, light_nodes) = lights(environment);
            if !lights.is_empty() {
                extensions.push("KHR_lights_punctual");
                json["extensions"] = json!({ "KHR_lights_punctual": { "lights": lights } });
                nodes.extend(light_nodes);
            }
            scene["extras"] = json!({ "environment": background(environment) });
        }
        extensions.extend(materials.extensions());
        let textures = materials.textures();
        let mut images = Vec::new();
        for image in textures.images() {
            images.push(json!({ "bufferView": views.len(), "mimeType": "image/png" }));
            views.push(json!({ "buffer": 0, "byteOffset": offset, "byteLength": image.len() }));
            offset += aligned(image.len());
        }
        scene["nodes"] = json!((0..nodes.len()).collect::<Vec<_>>());
        let samplers = if images.is_empty() { Vec::new() } else { Textures::samplers() };
        let buffers = if binary_bytes > 0 { vec![json!({ "byteLength": binary_bytes })] } else { Vec::new() };
        let lists = [
            ("nodes", nodes),
            ("meshes", meshes),
            ("materials", materials.json()),
            ("buffers", buffers),
            ("bufferViews", views),
            ("accessors", accessors),
            ("images", images),
            ("samplers", samplers),
            ("textures", textures.json()),
            ("extensionsUsed", extensions.into_iter().map(Value::from).collect()),
        ];
        // Empty lists are not allowed.
        if lists[0].1.is_empty() {
            scene.as_object_mut().map(|scene| scene.remove("nodes"));
        }
        json["scenes"] = json!([scene]);
        for (name, list) in lists.into_iter().filter(|(_, list)| !list.is_empty()) {
            json[name] = Value::Array(list);
        }
        format!("{{\"asset\":{asset},{}", &json.to_string()[1..])
    }
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
        "buffer": 0, "byteOffset": offset, "byteLength": vertices, "byteStride": part.stride(),
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
    let own = match (part.has_tail(), has_times) {
        (false, _) => &[][..],
        (true, false) => &[("_STROKE", 44)],
        (true, true) => &[("_TIMESTAMP", 40), ("_STROKE", 44)],
    };
    for &(name, offset) in own {
        attributes[name] = json!(accessors.len());
        accessors.push(json!({
            "bufferView": view, "byteOffset": offset, "componentType": FLOAT, "count": count, "type": "SCALAR",
        }));
    }
    json!({ "attributes": attributes, "indices": first + 4, "material": material })
}
