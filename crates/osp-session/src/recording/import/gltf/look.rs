//! Camera and lights of a glTF file, and a list of the contents that are not shown.

use glam::{DMat3, DVec3, Quat, Vec3};
use gltf_json::{camera, extensions::scene::khr_lights_punctual as lights, mesh::Mode, validation::Checked};

use super::{
    container::File,
    extensions,
    nodes::{Seen, similarity},
};
use crate::recording::{Camera, Environment, Header, import::texture::srgb_from_linear};

/// Ambient light, which glTF does not store, like the sky. The values are those of a new sketch.
const AMBIENT: f32 = 0.392;
const SKY: [Vec3; 2] = [Vec3::new(0.27, 0.27, 0.32), Vec3::new(0.035, 0.035, 0.086)];

pub(super) fn source(file: &File) -> String {
    let written_by = file.root.asset.generator.iter().flat_map(|name| name.chars().take(100));
    let program: String = written_by.collect();
    if program.is_empty() { "glTF 2.0".to_owned() } else { format!("glTF 2.0 by {program}") }
}

/// Sets the camera, the lights and the list of missing contents in the header.
pub(super) fn fill(file: &File, seen: &[Seen], lost: &[String], header: &mut Header) {
    let mut left_out = Vec::new();
    let mut cameras = 0;
    for (place, number) in seen.iter().filter_map(|place| Some((place, place.camera?))) {
        let camera = file.root.cameras.get(number).and_then(|camera| pose(place, camera));
        match camera.filter(|_| header.camera.is_none()) {
            Some(camera) => {
                header.camera = Some(camera);
                if header.check().is_err() {
                    header.camera = None;
                    cameras += 1;
                }
            }
            None => cameras += 1,
        }
    }
    let (shining, others) = directional(file, seen);
    let missing = shining.len().saturating_sub(2) + others;
    if !shining.is_empty() {
        header.environment = Some(Box::new(environment(&shining)));
        if header.check().is_err() {
            header.environment = None;
        }
    }
    let mut leave_out = |count: usize, one: &str, many: &str| match count {
        0 => {}
        1 => left_out.push(format!("1 {one}")),
        _ => left_out.push(format!("{count} {many}")),
    };
    let root = &file.root;
    leave_out(
        cameras,
        "camera that is not the first with a perspective",
        "cameras that are not the first with a perspective",
    );
    leave_out(
        missing,
        "light that is not one of the two brightest directional ones",
        "lights that are not among the two brightest directional ones",
    );
    leave_out(
        root.skins.len(),
        "skin (meshes are shown as they lie in the file)",
        "skins (meshes are shown as they lie in the file)",
    );
    leave_out(root.animations.len(), "animation", "animations");
    let primitives = || root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let morphed = primitives().filter(|primitive| primitive.targets.iter().flatten().next().is_some());
    leave_out(morphed.count(), "mesh's morph targets", "meshes' morph targets");
    let is_thin = |mode: &Checked<Mode>| {
        matches!(mode, Checked::Valid(Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip))
    };
    let thin = primitives().filter(|primitive| is_thin(&primitive.mode)).count();
    leave_out(thin, "mesh of points or lines", "meshes of points or lines");
    leave_out(root.scenes.len().saturating_sub(1), "other scene", "other scenes");
    let single = root.materials.iter().filter(|material| !material.double_sided).count();
    leave_out(single, "material's single side (both are drawn)", "materials' single side (both are drawn)");
    left_out.extend(extensions::not_shown(root));
    left_out.extend_from_slice(lost);
    header.left_out.extend(left_out);
}

fn pose(place: &Seen, camera: &camera::Camera) -> Option<Camera> {
    let perspective = camera.perspective.as_ref()?;
    let near_m = Some(perspective.znear).filter(|near| *near > 0.0);
    Some(Camera {
        p: place.world.translation.as_vec3(),
        q: rotation(place.world.matrix3)?,
        fov_degrees: perspective.yfov.to_degrees(),
        near_m,
    })
}

/// The rotation of a node without its scales. If the scales shear the axes, the viewing direction is kept.
fn rotation(m: DMat3) -> Option<Quat> {
    let back = m.z_axis.try_normalize()?;
    let right = m.y_axis.cross(back).try_normalize()?;
    let (q, _) = similarity(DMat3::from_cols(right, back.cross(right), back))?;
    Some(q.as_quat())
}

/// Directional lights, the brightest first: direction of travel, colour, strength. Also returns the number of other
/// lights.
fn directional(file: &File, seen: &[Seen]) -> (Vec<(Vec3, Vec3, f32)>, usize) {
    let extension = file.root.extensions.as_ref().and_then(|of| of.khr_lights_punctual.as_ref());
    let described = extension.map_or(&[][..], |of| &of.lights);
    let (mut shining, mut others) = (Vec::new(), 0);
    for (place, number) in seen.iter().filter_map(|place| Some((place, place.light?))) {
        let light = described.get(number);
        let is_far = |light: &&lights::Light| {
            matches!(light.type_, Checked::Valid(lights::Type::Directional)) && light.intensity.is_finite()
        };
        let way = (place.world.matrix3 * DVec3::NEG_Z).try_normalize();
        match light.filter(is_far).zip(way) {
            Some((light, way)) => {
                let color = Vec3::from(light.color.map(srgb_from_linear));
                shining.push((way.as_vec3(), color, light.intensity.max(0.0)));
            }
            None => others += 1,
        }
    }
    shining.sort_by(|(.., a), (.., b)| b.total_cmp(a));
    (shining, others)
}

/// Makes an environment of the two brightest lights. Strengths are in lux, so they are scaled: the brightest light gets
/// full brightness.
fn environment(shining: &[(Vec3, Vec3, f32)]) -> Environment {
    let full = shining.first().map_or(1.0, |&(.., strength)| strength).max(f32::MIN_POSITIVE);
    let light = |at: usize| {
        shining
            .get(at)
            .map_or_else(Default::default, |&(way, color, strength)| (way, color * (strength / full)))
    };
    Environment {
        sky: SKY,
        ambient: Vec3::splat(AMBIENT),
        lights: [light(0), light(1)],
        reflection: 0.3,
        ..Environment::default()
    }
}
