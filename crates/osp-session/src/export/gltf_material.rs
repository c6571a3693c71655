use std::collections::BTreeMap;

use glam::Vec3;
use serde_json::{Value, json};

use super::gltf_texture::Textures;
use crate::{
    brush::{Brush, BrushAtRest, Draw, Effect, Lighting, Seen, Surface},
    scene::Stroke,
};

/// Reflectance at normal incidence of glTF's default material. `KHR_materials_specular` multiplies it by a factor.
const USUAL_F0: f32 = 0.04;

/// The extensions of materials that files may use, by name.
const EXTENSIONS: [&str; 2] = ["KHR_materials_specular", "KHR_materials_unlit"];

/// A material of the exported file, shared by the strokes of one brush.
#[derive(Clone, Debug)]
pub(super) struct Material {
    /// The brush, its colours at time 0, and the index of its texture in the file.
    brush: Option<(&'static Brush, BrushAtRest, Option<usize>)>,
    /// Whether the background shines through.
    is_blended: bool,
}

#[derive(Default)]
pub(super) struct Materials {
    /// Whether brushes share a material if their materials differ only in name.
    is_shared: bool,
    /// Numbers of the materials, by brush number (`None` without a brush) and by whether the material is blended.
    places: BTreeMap<(Option<u16>, bool), usize>,
    all: Vec<Material>,
    in_file: Vec<usize>,
    json: Vec<Value>,
    pub(super) textures: Textures,
}

impl Materials {
    /// Creates materials. Brushes share a material if their materials differ only in name.
    pub(super) fn shared() -> Self {
        Self { is_shared: true, ..Self::default() }
    }

    pub(super) fn number_of(&mut self, stroke: &Stroke) -> usize {
        let brush = stroke.brush();
        let is_blended = match brush {
            Some(brush) => matches!(brush.draw, Draw::Additive | Draw::Blended),
            None => stroke.color().3 < 1.0,
        };
        let key = (brush.map(Brush::number), is_blended);
        if let Some(number) = self.places.get(&key) {
            return *number;
        }
        let brush = brush.map(|brush| {
            let at_rest = BrushAtRest::of(brush);
            (brush, at_rest, self.textures.number_of(brush, &at_rest))
        });
        let material = Material { brush, is_blended };
        let mut json = material.json();
        let known = self.json.iter().position(|known| {
            json["name"] = known["name"].clone();
            self.is_shared && json == *known
        });
        self.in_file.push(known.unwrap_or_else(|| {
            self.json.push(material.json());
            self.json.len() - 1
        }));
        let number = self.all.len();
        self.all.push(material);
        self.places.insert(key, number);
        number
    }

    pub(super) fn get(&self, number: usize) -> &Material {
        &self.all[number]
    }

    pub(super) fn in_file(&self, number: usize) -> usize {
        self.in_file[number]
    }

    pub(super) fn json(&self) -> Vec<Value> {
        self.json.clone()
    }

    pub(super) fn extensions(&self) -> impl Iterator<Item = &'static str> {
        let uses = |name: &&str| self.all.iter().any(|material| material.extension().0 == *name);
        EXTENSIONS.into_iter().filter(uses)
    }
}

impl Material {
    /// The vertex attributes of a polygon's corner: linear red, green, blue and alpha; texture coordinates; and the
    /// colour and alpha of the stroke, sRGB.
    pub(super) fn corner(
        &self,
        stroke: &Stroke,
        surface: &Surface,
        corner: usize,
        seen: Seen,
    ) -> ([f32; 4], [f32; 2], [u8; 4]) {
        let ((r, g, b, a), uv, own) = (stroke.color(), surface.uv(corner), surface.alpha(corner));
        let [r, g, b] = surface.color().map_or([r, g, b], |color| color.map(|c| f32::from(c) / 255.0));
        let bytes = [r, g, b, own].map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8);
        let (color, uv) = match &self.brush {
            Some((_, at_rest, _)) => (at_rest.paint(Vec3::new(r, g, b), own, uv, seen), at_rest.uv(uv)),
            None => ([r, g, b, a * own], uv),
        };
        (linear(color), uv.to_array(), bytes)
    }

    fn extension(&self) -> (&'static str, Value) {
        let Some((brush, ..)) = self.brush else { return ("", Value::Null) };
        if brush.draw == Draw::Additive {
            return ("KHR_materials_unlit", json!({}));
        }
        match brush.lighting {
            Lighting::Unlit => ("KHR_materials_unlit", json!({})),
            Lighting::Lambert => ("KHR_materials_specular", json!({ "specularFactor": 0.0 })),
            Lighting::Specular { f0: (r, g, b), .. } => {
                let factors = [r, g, b].map(|f0| linear_from_srgb(f0) / USUAL_F0);
                ("KHR_materials_specular", json!({ "specularColorFactor": factors }))
            }
        }
    }

    fn json(&self) -> Value {
        let alpha_mode = match (&self.brush, self.is_blended) {
            (_, true) => "BLEND",
            (Some((brush, ..)), _) if brush.draw == Draw::Cutout => "MASK",
            _ => "OPAQUE",
        };
        let Some((brush, _, texture)) = self.brush else {
            return json!({
                "name": if self.is_blended { "transparent" } else { "opaque" },
                "doubleSided": true,
                "alphaMode": alpha_mode,
                "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.8 },
            });
        };
        let roughness = match brush.lighting {
            Lighting::Specular { gloss, .. } => 1.0 - gloss,
            Lighting::Unlit | Lighting::Lambert => 0.8,
        };
        let is_mirror = brush.effect == Effect::Disco;
        let mut surface =
            json!({ "metallicFactor": if is_mirror { 1.0 } else { 0.0 }, "roughnessFactor": roughness });
        if let Some(texture) = texture {
            surface["baseColorTexture"] = json!({ "index": texture });
        }
        let (extension, contents) = self.extension();
        let mut json = json!({
            "name": brush.name,
            "doubleSided": true,
            "alphaMode": alpha_mode,
            "pbrMetallicRoughness": surface,
            "extensions": { extension: contents },
        });
        if alpha_mode == "MASK" {
            json["alphaCutoff"] = json!(brush.cutoff);
        }
        json
    }
}

/// Converts an sRGB colour with alpha to the linear values that glTF requires for vertices.
fn linear([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    let [r, g, b] = [r, g, b].map(|c| linear_from_srgb(c.clamp(0.0, 1.0)));
    [r, g, b, a.clamp(0.0, 1.0)]
}

/// Converts a colour channel from sRGB to linear. Values above 1 continue the curve.
pub(super) fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

/// The inverse of [`linear_from_srgb`].
pub(super) fn srgb_from_linear(c: f32) -> f32 {
    if c <= 0.003_130_8 { c * 12.92 } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}
