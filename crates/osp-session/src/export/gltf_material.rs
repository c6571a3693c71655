use serde_json::{Value, json};

use crate::{
    brush::{Brush, Draw, Effect, Lighting},
    scene::Stroke,
};

/// A material of the exported file: the common properties of strokes of one brush. The material of a brush that
/// emits light includes the colour, because glTF does not multiply emission by the colours of vertices.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Material {
    brush: Option<&'static Brush>,
    /// Whether the background shines through.
    is_blended: bool,
    /// Emitted colour, linear red, green, blue.
    emitted: Option<[f32; 3]>,
}

impl Material {
    pub(super) fn of(stroke: &Stroke) -> Self {
        let color = linear_color(stroke.color());
        let brush = stroke.brush();
        let emits = brush.is_some_and(|brush| brush.emission_gain > 0.0);
        let is_blended = match brush {
            Some(brush) => matches!(brush.draw, Draw::Additive | Draw::Blended),
            None => color[3] < 1.0,
        };
        Self { brush, is_blended, emitted: emits.then(|| [color[0], color[1], color[2]]) }
    }

    fn strength(&self) -> f32 {
        let Some(brush) = self.brush else { return 1.0 };
        match brush.effect {
            // The core of a dot: a factor and no exponent.
            Effect::Dots => 0.16 * brush.emission_gain,
            Effect::Rainbow => (3.0 * brush.emission_gain).exp(),
            _ => 2.0 * (10.0 * brush.emission_gain).exp(),
        }
    }

    /// Whether it needs `KHR_materials_unlit`.
    pub(super) fn is_unlit(&self) -> bool {
        self.emitted.is_none()
            && self
                .brush
                .is_some_and(|brush| brush.lighting == Lighting::Unlit || brush.draw == Draw::Additive)
    }

    /// Whether it needs `KHR_materials_emissive_strength`.
    pub(super) fn is_emissive(&self) -> bool {
        self.emitted.is_some()
    }

    pub(super) fn json(&self) -> Value {
        let name = match (self.brush, self.is_blended) {
            (Some(brush), _) => brush.name.as_str(),
            (None, false) => "opaque",
            (None, true) => "transparent",
        };
        let is_cut_out = self.brush.is_some_and(|brush| brush.draw == Draw::Cutout);
        let roughness = match self.brush.map(|brush| brush.lighting) {
            Some(Lighting::Specular { gloss, .. }) => 1.0 - gloss,
            _ => 0.8,
        };
        let mut json = json!({
            "name": name,
            "doubleSided": true,
            "alphaMode": if self.is_blended { "BLEND" } else if is_cut_out { "MASK" } else { "OPAQUE" },
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": roughness },
        });
        if is_cut_out && let Some(brush) = self.brush {
            json["alphaCutoff"] = json!(brush.cutoff);
        }
        if let Some(color) = self.emitted {
            json["emissiveFactor"] = json!(color);
            json["extensions"] =
                json!({ "KHR_materials_emissive_strength": { "emissiveStrength": self.strength() } });
        } else if self.is_unlit() {
            json["extensions"] = json!({ "KHR_materials_unlit": {} });
        }
        json
    }
}

/// Converts a colour to linear values, which glTF requires for vertices.
pub(super) fn linear_color((r, g, b, a): (f32, f32, f32, f32)) -> [f32; 4] {
    let linear = |c: f32| {
        let c = c.clamp(0.0, 1.0);
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    [linear(r), linear(g), linear(b), a.clamp(0.0, 1.0)]
}
