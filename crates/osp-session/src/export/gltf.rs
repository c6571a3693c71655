//! Binary glTF 2.0: "glTF 2.0 Specification", Khronos Group, 2021.

use std::{collections::BTreeMap, io::Write};

use glam::Vec3;

use super::{
    error::ExportError,
    gltf_json::{Document, Object},
    gltf_material::Materials,
    gltf_options::{ExportOptions, Objects},
    gltf_packed::{compress, quantize},
    gltf_part::{Grid, Part, aligned},
};
use crate::{
    brush::Seen,
    recording::Environment,
    scene::{Scene, Stroke},
};
use osp::polygon::{ConvexPolygon, PolygonId};

const GLB_MAGIC: u32 = 0x4654_6c67;
const JSON_CHUNK: u32 = 0x4e4f_534a;
const BIN_CHUNK: u32 = 0x004e_4942;
/// Mean of [`cosine_to_eye`] over all directions of the eye.
const MEAN_VIEW_COSINE: f32 = 0.5;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GltfCounts {
    pub objects: u64,
    pub polygons: u64,
    pub triangles: u64,
    /// Number of polygons that were skipped because a coordinate is not finite. The format cannot represent such a
    /// number.
    pub not_finite: u64,
    /// Number of strokes in hidden layers, which are not written.
    pub hidden: u64,
    /// Number of polygons that always face the eye in the session. In the file their orientation is fixed.
    pub turned: u64,
}

impl GltfCounts {
    /// The counts before the first polygon.
    pub(super) fn of(scene: &Scene) -> Self {
        let hidden = scene.strokes().iter().filter(|stroke| stroke.is_hidden() && !stroke.is_taken_away());
        Self { hidden: hidden.count() as u64, ..Self::default() }
    }
}

/// A polygon of a scene. A particle faces `eye_in_world`.
pub(super) fn polygon_seen_from(scene: &Scene, id: PolygonId, eye_in_world: Option<Vec3>) -> ConvexPolygon {
    match eye_in_world {
        Some(eye) => scene.polygon_from(id, eye, Vec3::Y),
        None => scene.polygon(id),
    }
}

/// Writes the visible polygons of a scene as one binary glTF file: a mesh for each layer or stroke, a material and a
/// texture for each brush, with the strokes' colours at the vertices. Positions are in world space, metres.
///
/// Two attributes are osp's own, floats at each vertex: `_TIMESTAMP`, seconds from the session's beginning until the
/// polygon was drawn (with [`ExportOptions::times`]), and `_STROKE`, the number of the stroke. Polygons without a
/// stroke have -1. A brush's vertices have a second colour (`COLOR_1`), the sRGB colour and the opacity by which osp
/// reads the brush again. [`Objects::Whole`] has none of these, and its vertices are smaller (`KHR_mesh_quantization`).
///
/// The file shows brushes at time 0 ([`BrushAtRest`](crate::brush::BrushAtRest)). glTF has no additive blending.
/// Additive strokes are therefore alpha-blended, and their alpha is the brightness of their light: dark light covers
/// nothing.
///
/// The file's lights give a matte surface the same colours as the session's lights and ambient light. The scene's
/// `extras` have the sky and the fog.
///
/// # Errors
/// The output fails, or the model does not fit the format.
pub fn write_glb(
    scene: &Scene,
    name: &str,
    options: &ExportOptions,
    out: &mut dyn Write,
) -> Result<GltfCounts, ExportError> {
    write_glb_watched(scene, name, options, out, &|_| true)
}

/// Does the same as [`write_glb`]. Every few milliseconds it calls `go_on` with the number of polygons written so far.
///
/// # Errors
/// The errors of [`write_glb`], or `go_on` returned `false`.
pub fn write_glb_watched(
    scene: &Scene,
    name: &str,
    options: &ExportOptions,
    out: &mut dyn Write,
    go_on: &dyn Fn(u64) -> bool,
) -> Result<GltfCounts, ExportError> {
    /// Number of polygons between two calls of `go_on`: a few milliseconds.
    const POLLED_AFTER: usize = 4096;
    let mut counts = GltfCounts::of(scene);
    let mut objects = BTreeMap::<u64, Object>::new();
    let light = options.environment.as_ref().map_or(Vec3::ONE, mean_light);
    let is_whole = matches!(options.objects, Objects::Whole { .. });
    let mut materials = if is_whole { Materials::shared() } else { Materials::default() };
    for (at, id) in scene.visible_ids().enumerate() {
        if at % POLLED_AFTER == 0 && !go_on(at as u64) {
            return Err(ExportError::Cancelled);
        }
        let surface = scene.surface_in_world(id);
        let polygon = polygon_seen_from(scene, id, options.eye_in_world);
        // The transform of a group can move coordinates beyond the range of `f32`.
        if !polygon.vertices().iter().all(|corner| corner.is_finite()) {
            counts.not_finite += 1;
            continue;
        }
        let stroke = scene.stroke_of(id);
        if !scene.has_area(id) {
            continue;
        }
        let material = materials.number_of(stroke);
        let (key, object_name) = object_of(id, stroke, name, options);
        let object =
            objects.entry(key).or_insert_with(|| Object { name: object_name(), parts: BTreeMap::new() });
        let secs = options.times.as_ref().map_or(0.0, |times| times.secs(id.index()));
        // Numbers from 2^24 on are rounded: the format has no attribute of 32-bit integers.
        let number = stroke.id().map_or(-1.0, |stroke| stroke.0 as f32);
        let view_cosine = options.eye_in_world.map_or(MEAN_VIEW_COSINE, |eye| cosine_to_eye(&polygon, eye));
        let seen = Seen { view_cosine, light };
        let paint = |corner| materials.get(material).corner(stroke, &surface, corner, seen);
        let part = object
            .parts
            .entry(materials.in_file(material))
            .or_insert_with(|| Part::new(is_whole, stroke.brush().is_some()));
        part.add(&polygon, &surface, &paint, [secs, number]);
        counts.polygons += 1;
        counts.turned += u64::from(surface.is_facing());
        counts.triangles += polygon.vertices().len() as u64 - 2;
    }
    let mut objects: Vec<Object> = objects.into_values().collect();
    if let Objects::Whole { is_compressed } = options.objects {
        objects.iter_mut().try_for_each(|object| shrink(object, is_compressed))?;
    }
    counts.objects = objects.len() as u64;
    let parts = || objects.iter().flat_map(|object| object.parts.values());
    let images = &materials.textures.images;
    let binary_bytes = parts().map(Part::bytes).chain(images.iter().map(|image| aligned(image.len()))).sum();
    let document = Document { name, objects: &objects, materials: &materials, options };
    let mut json = document.text(binary_bytes).into_bytes();
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
        for part in parts() {
            if !go_on(counts.polygons) {
                return Err(ExportError::Cancelled);
            }
            let mut padded = |bytes: &[u8]| {
                out.write_all(bytes)?;
                out.write_all(&[0; 4][..aligned(bytes.len()) - bytes.len()])
            };
            match &part.packed {
                Some(packed) => {
                    padded(&packed.vertices)?;
                    padded(&packed.indices)?;
                }
                None => {
                    padded(&part.vertices)?;
                    part.indices.iter().try_for_each(|index| padded(&index.to_le_bytes()))?;
                }
            }
        }
        for image in images {
            out.write_all(image)?;
            out.write_all(&[0; 4][..aligned(image.len()) - image.len()])?;
        }
    }
    out.flush()?;
    Ok(counts)
}

/// Makes the vertices of an object smaller, and compresses its buffers if `is_compressed` is set.
fn shrink(object: &mut Object, is_compressed: bool) -> Result<(), ExportError> {
    let parts = object.parts.values();
    let bounds = parts.map(|part| (part.min, part.max)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let grid = bounds.and_then(|(min, max)| Grid::of(min, max));
    object.parts.values_mut().for_each(|part| quantize(part, grid));
    if is_compressed {
        for part in object.parts.values_mut() {
            part.packed = Some(compress(part)?);
        }
    }
    Ok(())
}

/// Light on a matte surface, averaged over all normals.
fn mean_light(environment: &Environment) -> Vec3 {
    // Over all normals, the mean of the cosine to a light, clamped to 0, is a quarter.
    environment.ambient + environment.lights.iter().map(|(_, color)| *color * 0.25).sum::<Vec3>()
}

/// Cosine of the angle between a polygon's normal and the direction to the eye; always positive.
fn cosine_to_eye(polygon: &ConvexPolygon, eye_in_world: Vec3) -> f32 {
    let corners = polygon.vertices();
    let middle = corners.iter().sum::<Vec3>() / corners.len() as f32;
    let normal = polygon.area_vector().normalize_or_zero();
    normal.dot((eye_in_world - middle).normalize_or_zero()).abs()
}

/// Number and name of the exported object that a polygon belongs to.
fn object_of<'a>(
    id: PolygonId,
    stroke: &'a Stroke,
    file: &'a str,
    options: &'a ExportOptions,
) -> (u64, impl FnOnce() -> String + use<'a>) {
    let key = match (options.objects, stroke.id()) {
        (Objects::Whole { .. }, _) => 0,
        (Objects::Layers, _) => u64::from(stroke.layer()),
        (Objects::Strokes, Some(stroke)) => u64::from(stroke.0),
        // Each polygon without a stroke becomes a separate object.
        (Objects::Strokes, None) => 1 << 32 | u64::from(id.0),
    };
    let name = move || match (options.objects, stroke.id(), stroke.brush()) {
        (Objects::Whole { .. }, ..) => file.to_owned(),
        (Objects::Layers, ..) => match options.layer_names.get(stroke.layer() as usize) {
            Some(name) if !name.is_empty() => name.clone(),
            _ => format!("layer {}", stroke.layer()),
        },
        (Objects::Strokes, Some(id), Some(brush)) => format!("stroke {} ({})", id.0, brush.name),
        (Objects::Strokes, Some(id), None) => format!("stroke {}", id.0),
        (Objects::Strokes, None, _) => format!("polygon {}", id.0),
    };
    (key, name)
}
