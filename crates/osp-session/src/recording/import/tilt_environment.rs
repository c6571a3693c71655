//! Light and background of a `.tilt`: a preset of the program, with the artist's changes.
//!
//! Lights and sky are in the space of the scene. The strokes are in the same space, unless the file has a transform of
//! the canvas. Fog density is per decimetre of the scene, independent of the scene's scale in the room.

use std::sync::LazyLock;

use glam::{Quat, Vec3};
use serde::Deserialize;

use super::{
    axes,
    tilt_fields::{Fields, TiltTransform, shorten},
};
use crate::recording::Environment;
use osp::math::rotate;

/// Number of scene units in a metre. A division by 0.1 would give other last digits.
const UNITS_PER_METER: f32 = 10.0;
/// Depth in the room at which the program's shadows have faded out, metres, for its field of view of 80 degrees.
const SHADOWS_END_M: f32 = 2.33;
/// Largest number of characters of a name from the file.
const MOST_NAME_CHARS: usize = 60;
/// The preset whose light is used if the file's preset is unknown.
const USUAL: &str = "Standard";

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Preset {
    name: String,
    guid: String,
    sky: Sky,
    #[serde(default)]
    floor: Option<[u8; 3]>,
    fog: (Vec3, f32),
    ambient: Vec3,
    #[serde(default)]
    light_1: Option<(Vec3, Vec3)>,
    #[serde(default)]
    light_2: Option<(Vec3, Vec3)>,
    reflection: f32,
    /// Name of the scenery around the sketch, which osp does not show.
    #[serde(default)]
    scenery: Option<String>,
}

#[derive(Debug, Deserialize)]
enum Sky {
    Gradient(Vec3, Vec3),
    Picture { down: [u8; 3], up: [u8; 3], tint: Vec3, exposure: f32 },
}

static PRESETS: LazyLock<Vec<Preset>> = LazyLock::new(|| {
    ron::Options::default()
        .with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME)
        .from_str(include_str!("environments.ron"))
        .expect("the crate's own table, which a test reads")
});

/// Red, green, blue and opacity as bytes.
type Bytes = [u8; 4];

/// Sky and fog that the artist changed.
#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct CustomEnvironment {
    #[serde(default)]
    gradient_colors: Option<[Bytes; 2]>,
    #[serde(default)]
    gradient_skew: Option<Quat>,
    #[serde(default)]
    fog_color: Option<Bytes>,
    #[serde(default)]
    fog_density: Option<f32>,
    #[serde(default)]
    reflection_intensity: Option<f32>,
    #[serde(default)]
    skybox: Option<String>,
}

/// Lights that the artist changed: `shadow` casts shadows.
#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct CustomLights {
    #[serde(default)]
    ambient: Option<Bytes>,
    #[serde(default)]
    shadow: Option<CustomLight>,
    #[serde(default)]
    no_shadow: Option<CustomLight>,
}

#[derive(Deserialize)]
#[serde(rename_all = "PascalCase")]
struct CustomLight {
    orientation: Quat,
    color: [f32; 4],
}

/// The environment of a sketch, in the axes of osp and the space of its strokes. Contents that are not shown are
/// appended to `left_out`.
pub(super) fn read(
    fields: &mut Fields<'_>,
    room_from_scene: TiltTransform,
    scene_from_canvas: TiltTransform,
    left_out: &mut Vec<String>,
) -> Option<Environment> {
    let preset = fields.read::<String>("EnvironmentPreset").and_then(|guid| {
        let preset = find(&guid);
        if preset.is_none() {
            let guid = shorten(&guid, MOST_NAME_CHARS);
            fields.warn(format_args!("expected the GUID of an environment; found `{guid}`"));
        }
        preset
    });
    let sky = fields.read::<CustomEnvironment>("Environment");
    let lights = fields.read::<CustomLights>("Lights");
    if preset.is_none() && sky.is_none() && lights.is_none() {
        return None;
    }
    let mut environment = match preset {
        Some(preset) => preset.environment(),
        None => Environment { preset: String::new(), floor: None, ..usual().environment() },
    };
    if let Some(sky) = &sky {
        let changed = sky.change(&environment);
        match changed.check() {
            Ok(()) => environment = changed,
            Err(expected) => fields.warn(format_args!("expected {expected} in `Environment`; found others")),
        }
        if let Some(name) = sky.skybox.as_ref().filter(|name| !name.is_empty()) {
            left_out.push(format!("the sky picture {}", shorten(name, MOST_NAME_CHARS)));
        }
    }
    if let Some(lights) = lights {
        let changed = lights.change(&environment);
        match changed.check() {
            Ok(()) => environment = changed,
            Err(expected) => fields.warn(format_args!("expected {expected} in `Lights`; found others")),
        }
    }
    if let Some(preset) = preset {
        left_out
            .extend(preset.scenery.iter().map(|what| format!("{what} of the environment {}", preset.name)));
    }
    // Versions that did not store their version number drew their thumbnails with the full bloom.
    let mut has = |name: &str| fields.read::<serde::de::IgnoredAny>(name).is_some();
    environment.has_full_bloom = !has("ApplicationVersion");
    // Of these versions, those that stored the version of their format added light as sRGB values.
    environment.has_srgb_light = environment.has_full_bloom && has("SchemaVersion");
    let environment = in_canvas(environment, room_from_scene, scene_from_canvas);
    match environment.check() {
        Ok(()) => Some(environment),
        Err(expected) => {
            fields.warn(format_args!("expected {expected} in the environment on the canvas; found others"));
            None
        }
    }
}

/// Transforms an environment, in the axes of osp, from the scene's space to the strokes' space.
fn in_canvas(
    environment: Environment,
    room_from_scene: TiltTransform,
    scene_from_canvas: TiltTransform,
) -> Environment {
    let [to_room, to_scene] =
        [&room_from_scene, &scene_from_canvas].map(|by| axes::rotation_from_unity(axes::unit(by.1)));
    let (back, scale) = (axes::inverse(to_scene), scene_from_canvas.2);
    let (fog_color, density) = environment.fog;
    Environment {
        sky_rotation: axes::product(back, environment.sky_rotation),
        room_rotation: axes::product(to_room, to_scene),
        lights: environment.lights.map(|(way, color)| (rotate(back, way), color)),
        fog: (fog_color, density * scale),
        shadows_end_m: SHADOWS_END_M / (room_from_scene.2 * scale).max(f32::MIN_POSITIVE),
        ..environment
    }
}

/// The GUID of the preset that an environment was made from, and whether the environment is still equal to the preset.
pub(crate) fn preset_of(environment: &Environment) -> Option<(&'static str, bool)> {
    let preset = PRESETS.iter().find(|preset| preset.name == environment.preset)?;
    let Environment { room_rotation, has_full_bloom, has_srgb_light, shadows_end_m, .. } = *environment;
    let usual =
        Environment { room_rotation, has_full_bloom, has_srgb_light, shadows_end_m, ..preset.environment() };
    Some((&preset.guid, usual == *environment))
}

fn find(guid: &str) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| preset.guid.eq_ignore_ascii_case(guid))
}

fn usual() -> &'static Preset {
    PRESETS.iter().find(|preset| preset.name == USUAL).expect("the crate's own table, which a test reads")
}

impl Preset {
    /// The preset's environment, in the axes of osp and the space of the scene.
    fn environment(&self) -> Environment {
        let sky = match self.sky {
            Sky::Gradient(down, up) => [down, up],
            Sky::Picture { down, up, tint, exposure } => {
                [down, up].map(|bytes| color(bytes) * tint * exposure)
            }
        };
        let light = |light: Option<(Vec3, Vec3)>| match light {
            Some((way, color)) => (unit(axes::position_from_unity(way)), color),
            None => Default::default(),
        };
        Environment {
            preset: self.name.clone(),
            sky,
            floor: self.floor.map(color),
            fog: (self.fog.0, self.fog.1 * UNITS_PER_METER),
            ambient: self.ambient,
            lights: [light(self.light_1), light(self.light_2)],
            reflection: self.reflection,
            ..Environment::default()
        }
    }
}

impl CustomEnvironment {
    fn change(&self, environment: &Environment) -> Environment {
        let mut changed = environment.clone();
        // The skew applies only to the artist's gradient. The sky of a preset is upright.
        if let Some(colors) = self.gradient_colors {
            changed.sky = colors.map(|[r, g, b, _]| color([r, g, b]));
            if let Some(skew) = self.gradient_skew {
                changed.sky_rotation = axes::rotation_from_unity(axes::unit(skew));
            }
        }
        if let Some([r, g, b, _]) = self.fog_color {
            changed.fog.0 = color([r, g, b]);
        }
        if let Some(density) = self.fog_density {
            changed.fog.1 = density * UNITS_PER_METER;
        }
        changed.reflection = self.reflection_intensity.unwrap_or(changed.reflection);
        changed
    }
}

impl CustomLights {
    fn change(&self, environment: &Environment) -> Environment {
        let mut changed = environment.clone();
        if let Some([r, g, b, _]) = self.ambient {
            changed.ambient = color([r, g, b]);
        }
        for (light, custom) in changed.lights.iter_mut().zip([&self.shadow, &self.no_shadow]) {
            if let Some(CustomLight { orientation, color: [r, g, b, _] }) = custom {
                let way = rotate(axes::unit(*orientation), Vec3::Z);
                *light = (axes::position_from_unity(way), Vec3::new(*r, *g, *b));
            }
        }
        changed
    }
}

fn color(bytes: [u8; 3]) -> Vec3 {
    Vec3::from_array(bytes.map(|byte| f32::from(byte) / 255.0))
}

/// The direction, normalised.
fn unit(way: Vec3) -> Vec3 {
    way / way.dot(way).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_of_the_table_is_sound_and_found() {
        assert_eq!(PRESETS.len(), 15);
        for preset in PRESETS.iter() {
            let environment = preset.environment();
            assert_eq!(environment.check(), Ok(()), "{}", preset.name);
            let found = find(&preset.guid.to_uppercase()).expect("it is in the table");
            assert_eq!(found.name, preset.name, "two environments have the same GUID");
        }
        assert_eq!(usual().environment().floor, Some(Vec3::new(14.0, 14.0, 16.0) / 255.0));
        assert!(find("no such environment").is_none());
    }
}
