use bytemuck::{Pod, Zeroable};

use osp_session::brush::{
    self, Brush, Draw, Effect, Family, Lighting,
    texture::{picture::Picture, solid::repeats},
};

/// Length of the shader's array of materials.
const MOST: usize = 160;
const NO_TEXTURE: u32 = u32::MAX;

/// A brush in the memory layout of the shader.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Material {
    f0: [f32; 4],
    numbers: [f32; 4],
    kinds: [u32; 4],
}

const ONE_SIDED: u32 = 4;
/// Flag of a texture that is not repeated.
const IS_CLAMPED: u32 = 8;

/// The material of polygons without a brush, then the material of each brush by its number.
pub(super) fn all() -> [Material; MOST] {
    let mut all = [Material::PLAIN; MOST];
    for (material, brush) in all[1..].iter_mut().zip(brush::all()) {
        *material = Material::of(brush);
    }
    all
}

impl Material {
    const PLAIN: Self =
        Self { f0: [0.0; 4], numbers: [0.0, 0.0, 1.0, 0.0], kinds: [0, 0, NO_TEXTURE, NO_TEXTURE] };

    fn of(brush: &Brush) -> Self {
        let (lighting, [r, g, b, gloss]) = match brush.lighting {
            Lighting::Unlit => (0, [0.0; 4]),
            Lighting::Lambert => (1, [0.0; 4]),
            Lighting::Specular { f0: (r, g, b), gloss } => (2, [r, g, b, gloss]),
        };
        let is_one_sided = brush.culls_back && matches!(brush.family, Family::Tube { .. });
        let flag = |is_so, flag| if is_so { flag } else { 0 };
        let kind = lighting | flag(is_one_sided, ONE_SIDED) | flag(!repeats(brush), IS_CLAMPED);
        let picture = brush.picture;
        let layer = |number: Option<usize>| number.map_or(NO_TEXTURE, |number| number as u32);
        // Opaque brushes discard no pixels, whatever their alpha.
        let cutoff = if brush.draw == Draw::Opaque { 0.0 } else { brush.cutoff };
        Self {
            f0: [r, g, b, gloss],
            numbers: [cutoff, brush.emission_gain, anisotropy(picture), 0.0],
            kinds: [
                kind,
                effect(brush.effect),
                layer(picture.map(Picture::layer)),
                layer(picture.filter(|_| brush.has_normal_map).and_then(Picture::relief_layer)),
            ],
        }
    }
}

/// The anisotropy of a texture in Tilt Brush. Some textures have opaque texels, which hide the strokes behind them. Such
/// textures get no anisotropy, because anisotropic samples of these texels are not opaque in every direction.
fn anisotropy(picture: Option<Picture>) -> f32 {
    match picture {
        Some(Picture::Streamer) => 5.0,
        Some(Picture::SoftTip | Picture::Hypercolor) => 4.0,
        Some(Picture::Fire) => 3.0,
        _ => 1.0,
    }
}

fn effect(effect: Effect) -> u32 {
    effect as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shaders;

    #[test]
    fn every_brush_has_a_material() {
        assert!(brush::all().len() < MOST, "the shader has room for {MOST}");
        assert!(shaders::PAINTED.contains(&format!("array<Material, {MOST}>")));
        let all = all();
        for brush in brush::all() {
            let material = all[1 + usize::from(brush.number())];
            assert_eq!(material, Material::of(brush), "{}", brush.name);
            let has_gaps = brush.along.is_some_and(|along| along.iter().any(|solid| *solid < 0.99));
            // Bars use only the middle of their texture, so they need no shape.
            let is_bar = brush.family == Family::BoxSection;
            let needs_shape = brush.draw == Draw::Cutout && has_gaps && !is_bar;
            assert!(!needs_shape || material.kinds[2] != NO_TEXTURE, "{} is cut out of nothing", brush.name);
        }
    }

    #[test]
    fn the_shader_knows_every_effect_by_its_number() {
        let name = |effect: Effect| {
            let mut name = String::new();
            for letter in format!("{effect:?}").chars() {
                if letter.is_uppercase() && !name.is_empty() {
                    name.push('_');
                }
                name.push(letter.to_ascii_uppercase());
            }
            name
        };
        for used in brush::all().iter().map(|brush| brush.effect).filter(|effect| *effect != Effect::None) {
            let line = format!("const {}: u32 = {}u;", name(used), effect(used));
            assert!(shaders::PAINTED.contains(&line), "{line}");
        }
    }
}
