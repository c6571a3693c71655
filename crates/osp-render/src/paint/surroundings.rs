use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use osp::math::{rotate, unit};
use osp_session::recording::Environment;

/// Light and sky in the memory layout of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Surroundings {
    sky_low: [f32; 4],
    sky_high: [f32; 4],
    sky_up: [f32; 4],
    floor: [f32; 4],
    fog: [f32; 4],
    ambient: [f32; 4],
    light_directions: [[f32; 4]; 2],
    lights: [[f32; 4]; 2],
    moment: [f32; 4],
    room_from_world: [f32; 4],
}

impl Surroundings {
    /// Light and sky of an environment. Without an environment, light and sky are those of Standard.
    pub(super) fn of(environment: Option<&Environment>) -> Self {
        let usual;
        let environment = match environment {
            Some(environment) => environment,
            None => {
                usual = standard();
                &usual
            }
        };
        let words = |v: Vec3, w: f32| v.extend(w).to_array();
        let up = rotate(unit(environment.sky_rotation), Vec3::Y);
        let direction = |i: usize| environment.lights[i].0.normalize_or(Vec3::NEG_Y);
        let has_lamps = f32::from(has_lamps(&environment.preset));
        let has_srgb_light = f32::from(environment.has_srgb_light);
        Self {
            sky_low: words(environment.sky[0], stars(environment)),
            sky_high: words(environment.sky[1], 0.0),
            sky_up: words(up, place(environment)),
            floor: words(environment.floor.unwrap_or_default(), 0.0),
            fog: words(environment.fog.0, environment.fog.1),
            ambient: words(environment.ambient, environment.reflection),
            light_directions: [words(direction(0), has_lamps), words(direction(1), has_srgb_light)],
            lights: environment.lights.map(|(_, color)| words(color, 0.0)),
            moment: [0.0, environment.shadows_end_m, 0.0, 0.0],
            room_from_world: unit(environment.room_rotation).to_array(),
        }
    }

    /// Direction of the first light; `None` if the light is off.
    pub(super) fn shining(&self) -> Option<Vec3> {
        let ([x, y, z, _], [r, g, b, _]) = (self.light_directions[0], self.lights[0]);
        (r.max(g).max(b) > 0.0).then_some(Vec3::new(x, y, z))
    }

    pub(super) fn set_time(&mut self, time_s: f32) {
        self.moment[0] = time_s;
    }
}

/// Whether surfaces reflect a room with lamps. In the other environments they reflect a sky of uniform light.
fn has_lamps(preset: &str) -> bool {
    !matches!(
        preset,
        "Blue" | "Hot" | "Illustrative" | "NightSky" | "NoLights" | "PinkLemonade" | "Pistachio" | "Space"
    )
}

/// Number of the scenery in the shader: 0 for no scenery, 1 for a floor in a colour of the environment.
fn place(environment: &Environment) -> f32 {
    match environment.preset.as_str() {
        _ if environment.floor.is_some() => 1.0,
        "Pedestal" => 2.0,
        "DressForm" => 3.0,
        "NightSky" => 4.0,
        "Space" => 5.0,
        _ => 0.0,
    }
}

/// 1 if the sky has stars, 2 if it also has the Milky Way, else 0.
fn stars(environment: &Environment) -> f32 {
    let is_dark = environment.sky.iter().all(|color| color.max_element() < 0.1);
    match environment.preset.as_str() {
        "NightSky" | "NoLights" if is_dark => 2.0,
        "Space" if is_dark => 1.0,
        _ => 0.0,
    }
}

/// The default environment of Tilt Brush, without its fog.
fn standard() -> Environment {
    Environment {
        preset: "Standard".to_owned(),
        sky: [Vec3::new(70.0, 70.0, 81.0) / 255.0, Vec3::new(0.035, 0.035, 0.086)],
        ambient: Vec3::splat(0.392),
        lights: [
            (Vec3::new(0.0, -0.866, -0.5), Vec3::new(0.778, 0.816, 0.991)),
            (Vec3::new(0.0, -0.643, 0.766), Vec3::new(0.428, 0.421, 0.346)),
        ],
        reflection: 0.3,
        ..Environment::default()
    }
}
