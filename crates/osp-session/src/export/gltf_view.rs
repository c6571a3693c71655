//! Camera, lights and background of the exported file.

use std::f32::consts::PI;

use glam::{Quat, Vec3};
use osp::math::{rotate, unit};
use serde_json::{Value, json};

use super::gltf_material::{linear_from_srgb, srgb_from_linear};
use crate::recording::{Camera, Environment};

/// Near distance of a camera whose recording states none, metres.
const NEAR_M: f32 = 0.01;
/// Number of normals at which both sets of lights are compared.
const DIRECTIONS: usize = 256;
/// Number of iterations of the fit. Further iterations change the light by less than one part in 255.
const PASSES: usize = 64;
/// Weaker lights are skipped, because they are invisible; linear.
const DARK: f32 = 0.002;

/// Converts the camera of a session to a glTF camera and its node.
pub(super) fn camera(camera: &Camera) -> (Value, Value) {
    let near_m = camera.near_m.unwrap_or(NEAR_M);
    let perspective = json!({ "yfov": camera.fov_degrees.to_radians(), "znear": near_m, "aspectRatio": 1.0 });
    let q = unit(camera.q);
    (
        json!({ "type": "perspective", "perspective": perspective }),
        json!({ "name": "camera", "camera": 0, "translation": camera.p.to_array(), "rotation": q.to_array() }),
    )
}

/// Returns glTF lights and their nodes. The program adds the first light as an sRGB value. glTF adds linear light, and
/// has no ambient light. The file therefore has the session's two lights and six lights along the axes.
/// Their colours are fitted to the program's light on matte surfaces of all normals.
pub(super) fn lights(environment: &Environment) -> (Vec<Value>, Vec<Value>) {
    let own = environment.lights.map(|(way, _)| -way.normalize_or(Vec3::NEG_Y));
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    let towards: Vec<Vec3> = own.into_iter().chain(axes).collect();
    let colors = fitted(environment, &towards);
    let shining = towards.iter().zip(colors).filter(|(_, color)| color.max_element() > DARK);
    let (mut lights, mut nodes) = (Vec::new(), Vec::new());
    for (towards, color) in shining {
        let most = color.max_element();
        // A matte surface reflects the light's strength divided by pi.
        lights.push(json!({
            "type": "directional", "color": (color / most).to_array(), "intensity": most * PI,
        }));
        let number = nodes.len();
        nodes.push(json!({
            "name": format!("light {number}"),
            "rotation": Quat::from_rotation_arc(Vec3::Z, *towards).to_array(),
            "extensions": { "KHR_lights_punctual": { "light": number } },
        }));
    }
    (lights, nodes)
}

/// Fits linear colours of lights from these directions: non-negative least squares by coordinate descent.
fn fitted(environment: &Environment, towards: &[Vec3]) -> Vec<Vec3> {
    // Fibonacci's spiral spreads the directions evenly.
    let normal = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f32 / DIRECTIONS as f32;
        let angle = i as f32 * PI * (3.0 - 5.0_f32.sqrt());
        let aside = (1.0 - y * y).sqrt();
        Vec3::new(aside * angle.cos(), y, aside * angle.sin())
    };
    let normals: Vec<Vec3> = (0..DIRECTIONS).map(normal).collect();
    let on = |towards: Vec3, normal: Vec3| normal.dot(towards).max(0.0);
    let mut missing: Vec<Vec3> = normals
        .iter()
        .map(|&normal| Vec3::from(wanted(environment, normal).to_array().map(linear_from_srgb)))
        .collect();
    let mut colors = vec![Vec3::ZERO; towards.len()];
    for _ in 0..PASSES {
        for (color, &towards) in colors.iter_mut().zip(towards) {
            let (mut sum, mut squares) = (Vec3::ZERO, 0.0);
            for (normal, missing) in normals.iter().zip(&missing) {
                let share = on(towards, *normal);
                sum += *missing * share;
                squares += share * share;
            }
            let better = (*color + sum / squares).max(Vec3::ZERO);
            let change = better - *color;
            for (normal, missing) in normals.iter().zip(&mut missing) {
                *missing -= change * on(towards, *normal);
            }
            *color = better;
        }
    }
    colors
}

/// The program's light on a matte surface with this normal, as an sRGB value. The shader `painted.wgsl` has the same
/// formula.
fn wanted(environment: &Environment, normal: Vec3) -> Vec3 {
    let [first, second] =
        environment.lights.map(|(way, color)| (-way.normalize_or_zero().dot(normal), color));
    let first = first.1 * first.0.max(0.0);
    let share = 0.0882 + 0.4706 * second.0 + 0.4412 * second.0 * second.0;
    if environment.has_srgb_light {
        return first + environment.ambient + second.1 * share.max(0.0);
    }
    let linear = |color: Vec3| Vec3::from(color.to_array().map(linear_from_srgb));
    let sum = linear(environment.ambient) + linear(second.1) * share;
    first + Vec3::from(sum.max(Vec3::ZERO).to_array().map(srgb_from_linear))
}

/// Properties that glTF lacks: the sky, the fog, and the session's own lights. Colours are sRGB values.
pub(super) fn background(environment: &Environment) -> Value {
    let up = rotate(unit(environment.sky_rotation), Vec3::Y);
    let [down, above] = environment.sky;
    let mut sky = json!({ "down": down.to_array(), "up": above.to_array(), "direction": up.to_array() });
    if let Some(floor) = environment.floor {
        sky["floor"] = json!(floor.to_array());
    }
    let (fog, density) = environment.fog;
    let light =
        |(way, color): (Vec3, Vec3)| json!({ "direction": way.to_array(), "color": color.to_array() });
    json!({
        "preset": environment.preset,
        "sky": sky,
        "fog": { "color": fog.to_array(), "densityPerMetre": density },
        "ambient": environment.ambient.to_array(),
        "lights": environment.lights.map(light),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matte_surface_gets_the_light_of_the_session() {
        let slanted = Vec3::new(0.6, -0.8, 0.0);
        let environment = Environment {
            ambient: Vec3::splat(0.4),
            lights: [(slanted, Vec3::new(0.5, 0.4, 0.2)), (Vec3::Y, Vec3::new(0.1, 0.2, 0.3))],
            ..Environment::default()
        };
        let (lights, nodes) = lights(&environment);
        let shown = |normal: Vec3| -> Vec3 {
            let each = lights.iter().zip(&nodes).map(|(light, node)| {
                let number = |of: &Value, i: usize| of[i].as_f64().expect("a number") as f32;
                let rotation = Quat::from_array([0, 1, 2, 3].map(|i| number(&node["rotation"], i)));
                let color = Vec3::from([0, 1, 2].map(|i| number(&light["color"], i)));
                let strength = light["intensity"].as_f64().expect("a number") as f32 / PI;
                color * strength * normal.dot(rotation * Vec3::Z).max(0.0)
            });
            each.sum()
        };
        for normal in [-slanted, slanted, Vec3::X, Vec3::Z, Vec3::NEG_Y, Vec3::ONE.normalize()] {
            let wanted = wanted(&environment, normal);
            let found = shown(normal).powf(1.0 / 2.2);
            assert!((found - wanted).abs().max_element() < 0.12, "{normal}: {found}, not {wanted}");
        }
    }
}
