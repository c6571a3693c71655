use std::collections::BTreeMap;

use glam::Vec3;
use serde_json::{Value, json};

use super::{
    gltf_material::Materials,
    gltf_options::ExportOptions,
    gltf_part::{Attribute, Part, aligned},
    gltf_texture::Textures,
    gltf_view::{background, camera, lights},
};

/// The extension of compressed buffers.
const MESHOPT: &str = "EXT_meshopt_compression";
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

pub(super) struct Object {
    pub(super) name: String,
    pub(super) parts: BTreeMap<usize, Part>,
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
        let (mut views, mut accessors, mut place) = (Vec::new(), Vec::new(), Place::default());
        let has_times = options.times.is_some();
        let mut mesh = |object: &Object| {
            let primitives = object.parts.iter().map(|(material, part)| {
                primitive(*material, part, has_times, &mut place, &mut views, &mut accessors)
            });
            json!({ "name": object.name, "primitives": primitives.collect::<Vec<_>>() })
        };
        let meshes: Vec<Value> = objects.iter().map(&mut mesh).collect();
        let node = |(i, object): (usize, &Object)| {
            let mut node = json!({ "name": object.name, "mesh": i });
            if let Some(grid) = object.parts.values().find_map(|part| part.layout.grid) {
                node["translation"] = json!(grid.origin.to_array());
                node["scale"] = json!(Vec3::splat(grid.step_m).to_array());
            }
            node
        };
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
        let textures = &materials.textures;
        let mut images = Vec::new();
        for image in &textures.images {
            images.push(json!({ "bufferView": views.len(), "mimeType": "image/png" }));
            views.push(json!({ "buffer": 0, "byteOffset": place.stored, "byteLength": image.len() }));
            place.stored += aligned(image.len());
        }
        scene["nodes"] = json!((0..nodes.len()).collect::<Vec<_>>());
        let samplers = if images.is_empty() { Vec::new() } else { Textures::samplers() };
        let mut buffers =
            if binary_bytes > 0 { vec![json!({ "byteLength": binary_bytes })] } else { Vec::new() };
        let parts = || objects.iter().flat_map(|object| object.parts.values());
        let mut required: Vec<&str> = Vec::new();
        if parts().any(|part| part.packed.is_some()) {
            // The buffer that a reader fills with the decompressed bytes.
            buffers.push(json!({ "byteLength": place.raw, "extensions": { MESHOPT: { "fallback": true } } }));
            required.push(MESHOPT);
        }
        if parts().any(|part| part.layout.has_byte_normals) {
            required.push("KHR_mesh_quantization");
        }
        extensions.extend(&required);
        let names = |names: Vec<&str>| names.into_iter().map(Value::from).collect();
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
            ("extensionsUsed", names(extensions)),
            ("extensionsRequired", names(required)),
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
    place: &mut Place,
    views: &mut Vec<Value>,
    accessors: &mut Vec<Value>,
) -> Value {
    let view = views.len();
    views.push(place.view(part, 0, part.layout.stride(), part.count()));
    views.push(place.view(part, 1, 4, part.indices.len()));
    let mut attributes = json!({});
    for Attribute { name, offset, component, is_normalized, shape } in part.layout.attributes() {
        if name == "_TIMESTAMP" && !has_times {
            continue;
        }
        let mut accessor = json!({
            "bufferView": view, "byteOffset": offset, "componentType": component, "count": part.count(), "type": shape,
        });
        if is_normalized {
            accessor["normalized"] = json!(true);
        }
        if name == "POSITION" {
            accessor["min"] = json!(part.min.to_array());
            accessor["max"] = json!(part.max.to_array());
        }
        attributes[name] = json!(accessors.len());
        accessors.push(accessor);
    }
    let indices = accessors.len();
    accessors.push(json!({
        "bufferView": view + 1, "componentType": UNSIGNED_INT, "count": part.indices.len(), "type": "SCALAR",
    }));
    json!({ "attributes": attributes, "indices": indices, "material": material })
}

/// Number of bytes that the existing buffer views cover.
#[derive(Default)]
struct Place {
    /// Number of bytes in the binary chunk.
    stored: usize,
    /// Number of bytes in the buffer of the decompressed bytes.
    raw: usize,
}

impl Place {
    /// Returns the buffer view of the vertices (`which` 0) or the indices (1) of a part: `count` elements of `stride`
    /// bytes.
    fn view(&mut self, part: &Part, which: usize, stride: usize, count: usize) -> Value {
        let (target, mode) = [(ARRAY_BUFFER, "ATTRIBUTES"), (ELEMENT_ARRAY_BUFFER, "TRIANGLES")][which];
        let (raw, stored) = (part.raw_bytes()[which], part.stored_bytes()[which]);
        let mut view = json!({ "buffer": 0, "byteOffset": self.stored, "byteLength": raw, "target": target });
        if which == 0 {
            view["byteStride"] = json!(stride);
        }
        if part.packed.is_some() {
            let packed = json!({
                "buffer": 0, "byteOffset": self.stored, "byteLength": stored, "byteStride": stride, "count": count,
                "mode": mode,
            });
            view["buffer"] = json!(1);
            view["byteOffset"] = json!(self.raw);
            view["extensions"] = json!({ MESHOPT: packed });
        }
        self.raw += aligned(raw);
        self.stored += aligned(stored);
        view
    }
}
