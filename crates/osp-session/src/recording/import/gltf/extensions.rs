//! The extensions of a file: which of them change its meshes.

use gltf_json::{Root, extensions::mesh::Primitive};
use serde_json::{Map, Value};

pub(super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";
pub(super) const INSTANCES: &str = "EXT_mesh_gpu_instancing";
/// Materials of Tilt Brush and Open Brush.
pub(super) const BRUSH: &str = "GOOGLE_tilt_brush_material";
pub(super) const VISIBLE: &str = "KHR_node_visibility";

/// Extensions that are applied, or change nothing that is seen.
const SHOWN: [&str; 20] = [
    BRUSH,
    MESHOPT[0],
    MESHOPT[1],
    DRACO,
    INSTANCES,
    VISIBLE,
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_structural_metadata",
    "EXT_texture_webp",
    "FB_ngon_encoding",
    "MAXAR_mesh_variants",
];
/// Extensions of primitives without which their triangles are the same.
const HARMLESS: [&str; 2] = ["KHR_materials_variants", "CESIUM_primitive_outline"];

/// Whether an extension that is not read says what some mesh consists of. Others change materials, lights, animations or
/// what a program does with the model.
pub(super) fn changes_meshes(root: &Root, name: &str) -> bool {
    if SHOWN.contains(&name) || HARMLESS.contains(&name) {
        return false;
    }
    let has = |others: Option<&Map<String, Value>>| others.is_some_and(|others| others.contains_key(name));
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let of_primitive = |of: &Primitive| has(Some(&of.others));
    root.accessors.iter().any(|of| has(of.extensions.as_ref().map(|of| &of.others)))
        || root.buffers.iter().any(|of| has(of.extensions.as_ref().map(|of| &of.others)))
        || root.buffer_views.iter().any(|of| has(of.extensions.as_ref().map(|of| &of.others)))
        || root.meshes.iter().any(|of| has(of.extensions.as_ref().map(|of| &of.others)))
        || primitives.filter_map(|of| of.extensions.as_ref()).any(of_primitive)
}

/// The extensions that would change what is seen, for the list of what is not shown.
pub(super) fn not_shown(root: &Root) -> Option<String> {
    let names: Vec<&str> =
        root.extensions_used.iter().map(String::as_str).filter(|of| !SHOWN.contains(of)).collect();
    let shown: Vec<String> = names.iter().take(16).map(|name| name.chars().take(60).collect()).collect();
    (!names.is_empty()).then(|| format!("the extensions {}", shown.join(", ")))
}
