use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Light and background of a session. Colours are sRGB values from 0 to 1. Shaders use them without conversion, as in
/// the original programs. Lights may be brighter than 1.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Environment {
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub preset: String,
    /// Sky colours straight down and straight up; the sky is a gradient between them.
    pub sky: [Vec3; 2],
    /// Rotation from the gradient's space, whose +y is up, to world space.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub sky_rotation: Quat,
    /// Rotation from world space to the space of the room. Glossy paint reflects the room's lamps.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub room_rotation: Quat,
    /// Colour of a floor that hides the sky below the horizon.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub floor: Option<Vec3>,
    /// Colour of the fog, and its density per metre of depth.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub fog: (Vec3, f32),
    pub ambient: Vec3,
    /// Two directional lights: direction of travel, of length 1, in world space, and colour.
    #[serde(default)]
    pub lights: [(Vec3, Vec3); 2],
    /// Strength of reflections on shiny surfaces.
    #[serde(default)]
    pub reflection: f32,
    /// Whether the light that spreads (bloom) gains a quarter of its brightness, as in early versions of Tilt Brush.
    /// Otherwise bloom loses a quarter.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub has_full_bloom: bool,
    /// Whether the second light and the ambient light are added as sRGB values, as in some early versions of Tilt Brush.
    /// Otherwise they are added as linear values.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub has_srgb_light: bool,
    /// Depth along the view at which shadows have faded out, metres. 0 if they do not fade.
    #[serde(default, skip_serializing_if = "crate::is_default")]
    pub shadows_end_m: f32,
}

impl Environment {
    pub const MAX_NAME_BYTES: usize = 64;
    const BRIGHTEST: f32 = 1.0e4;
    const DENSEST: f32 = 1.0e6;

    /// Checks that every number is in its range. The error describes the expected form.
    ///
    /// # Errors
    /// A number is not finite or out of its range.
    pub fn check(&self) -> Result<(), &'static str> {
        let colors = self.sky.iter().chain(&self.floor).chain([&self.fog.0, &self.ambient]);
        let mut colors = colors.chain(self.lights.iter().map(|(_, color)| color));
        if !colors.all(|c| c.is_finite() && c.min_element() >= 0.0 && c.max_element() <= Self::BRIGHTEST) {
            return Err("colours of the environment between 0 and 10000");
        }
        if !(0.0..=Self::DENSEST).contains(&self.fog.1) {
            return Err("a density of fog between 0 and 1000000 per metre");
        }
        if !(0.0..=Self::BRIGHTEST).contains(&self.reflection) {
            return Err("a reflection between 0 and 10000");
        }
        let is_direction = |way: Vec3| (way.dot(way) - 1.0).abs() <= 0.02;
        if !self.lights.iter().all(|&(way, color)| is_direction(way) || (way, color) == Default::default()) {
            return Err("directions of light of length 1 (or a light that is all 0)");
        }
        if !(0.0..=f32::MAX).contains(&self.shadows_end_m) {
            return Err("a depth of the end of shadows of at least 0 m");
        }
        if self.preset.len() > Self::MAX_NAME_BYTES {
            return Err("a preset's name of at most 64 bytes");
        }
        let is_rotation = |q: Quat| (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0).abs() <= 0.02;
        if is_rotation(self.sky_rotation) && is_rotation(self.room_rotation) {
            Ok(())
        } else {
            Err("a unit quaternion (x, y, z, w) of the sky, and of the room")
        }
    }
}
