//! The model as plain triangles: STL for printing, PLY and OBJ with colours. G. Turk, "The PLY Polygon File Format", 1994;
//! 3D Systems, "StereoLithography Interface Specification", 1989.

use std::io::Write;

use glam::Vec3;

use super::{ExportError, GltfCounts, gltf::polygon_seen_from};
use crate::scene::Scene;

/// A format of triangles without materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Binary, millimetres, z up, as programs for printers expect; without colours.
    Stl,
    /// Binary, metres, y up, a colour at each vertex.
    Ply,
    /// Text, metres, y up, a colour at each vertex (`v x y z r g b`), an object for each layer.
    Obj,
}

/// Writes the visible polygons of a scene. Particles face `eye_in_world`.
///
/// # Errors
/// The output fails, or the model has more triangles than the format can count.
pub fn write_mesh(
    scene: &Scene,
    layer_names: &[String],
    format: MeshFormat,
    eye_in_world: Option<Vec3>,
    out: &mut dyn Write,
) -> Result<GltfCounts, ExportError> {
    let mut counts = GltfCounts::of(scene);
    let mut corners = 0u64;
    let polygons = || {
        let ids = scene.visible_ids().filter(|&id| scene.has_area(id));
        ids.map(|id| (id, polygon_seen_from(scene, id, eye_in_world)))
    };
    for (id, polygon) in polygons() {
        let vertices = polygon.vertices();
        if vertices.iter().all(|corner| corner.is_finite()) {
            counts.polygons += 1;
            counts.triangles += vertices.len() as u64 - 2;
            corners += vertices.len() as u64;
            counts.turned += u64::from(scene.surface(id).is_facing());
        } else {
            counts.not_finite += 1;
        }
    }
    let polygons =
        || polygons().filter(|(_, polygon)| polygon.vertices().iter().all(|corner| corner.is_finite()));
    let color = |id| {
        let (r, g, b, a) = scene.color(id);
        [r, g, b, a].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
    };
    match format {
        MeshFormat::Stl => {
            counts.objects = 1;
            let triangles =
                u32::try_from(counts.triangles).map_err(|_| ExportError::TooLarge(50 * counts.triangles))?;
            out.write_all(&[b' '; 80])?;
            out.write_all(&triangles.to_le_bytes())?;
            for (_, polygon) in polygons() {
                let turned = |p: Vec3| Vec3::new(p.x, -p.z, p.y);
                let vertices = polygon.vertices();
                let normal = turned(polygon.area_vector().normalize_or_zero());
                for i in 1..vertices.len() - 1 {
                    let points = [vertices[0], vertices[i], vertices[i + 1]].map(|p| turned(p) * 1000.0);
                    for p in [normal, points[0], points[1], points[2]] {
                        p.to_array().iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))?;
                    }
                    out.write_all(&[0; 2])?;
                }
            }
        }
        MeshFormat::Ply => {
            counts.objects = 1;
            write!(
                out,
                "ply\nformat binary_little_endian 1.0\ncomment metres, +y up\nelement vertex {corners}\n"
            )?;
            ["x", "y", "z"].iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
            let colors = ["red", "green", "blue", "alpha"];
            colors.iter().try_for_each(|name| writeln!(out, "property uchar {name}"))?;
            let faces = counts.polygons;
            write!(out, "element face {faces}\nproperty list uchar uint vertex_indices\nend_header\n")?;
            for (id, polygon) in polygons() {
                for p in polygon.vertices() {
                    p.to_array().iter().try_for_each(|c| out.write_all(&c.to_le_bytes()))?;
                    out.write_all(&color(id))?;
                }
            }
            let mut next = 0u32;
            for (_, polygon) in polygons() {
                let count = polygon.vertices().len() as u32;
                out.write_all(&[count as u8])?;
                let end = next.checked_add(count).ok_or(ExportError::TooLarge(16 * corners))?;
                (next..end).try_for_each(|number| out.write_all(&number.to_le_bytes()))?;
                next = end;
            }
        }
        MeshFormat::Obj => {
            writeln!(out, "# metres\n# up: y")?;
            let (mut layer, mut next) = (None, 1u64);
            for (id, polygon) in polygons() {
                let of = scene.stroke_of(id).layer();
                if layer.replace(of) != Some(of) {
                    counts.objects += 1;
                    let name = layer_names.get(of as usize).filter(|name| !name.is_empty());
                    let name =
                        name.map_or_else(|| format!("layer {of}"), |name| name.replace(['\n', '\r'], " "));
                    writeln!(out, "o {name}")?;
                }
                let [r, g, b, _] = color(id).map(|c| f32::from(c) / 255.0);
                let vertices = polygon.vertices();
                vertices.iter().try_for_each(|p| writeln!(out, "v {} {} {} {r} {g} {b}", p.x, p.y, p.z))?;
                write!(out, "f")?;
                (next..next + vertices.len() as u64).try_for_each(|number| write!(out, " {number}"))?;
                writeln!(out)?;
                next += vertices.len() as u64;
            }
        }
    }
    out.flush()?;
    Ok(counts)
}
