use std::io;

use serde_json::{Value, json};

use crate::brush::{Brush, BrushAtRest, texture::solid::repeats};

const REPEAT: u32 = 10497;
const CLAMP_TO_EDGE: u32 = 33071;
const LINEAR: u32 = 9729;
const LINEAR_MIPMAP_LINEAR: u32 = 9987;

/// The textures of a file. Brushes with the same picture share one PNG.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) images: Vec<Vec<u8>>,
    /// The image index of each texture, and whether the texture repeats along the stroke.
    all: Vec<(usize, bool)>,
}

impl Textures {
    pub(super) fn number_of(&mut self, brush: &Brush, at_rest: &BrushAtRest) -> Option<usize> {
        if !at_rest.has_texture() {
            return None;
        }
        let png = encode(at_rest).ok()?;
        let image = self.images.iter().position(|known| *known == png).unwrap_or_else(|| {
            self.images.push(png);
            self.images.len() - 1
        });
        let texture = (image, repeats(brush));
        let known = self.all.iter().position(|known| *known == texture);
        Some(known.unwrap_or_else(|| {
            self.all.push(texture);
            self.all.len() - 1
        }))
    }

    /// The samplers: first for textures that repeat along the stroke, then for textures that do not.
    pub(super) fn samplers() -> Vec<Value> {
        let sampler = |along: u32| json!({ "magFilter": LINEAR, "minFilter": LINEAR_MIPMAP_LINEAR, "wrapS": along, "wrapT": CLAMP_TO_EDGE });
        vec![sampler(REPEAT), sampler(CLAMP_TO_EDGE)]
    }

    pub(super) fn json(&self) -> Vec<Value> {
        let texture = |&(image, is_repeated): &(usize, bool)| json!({ "source": image, "sampler": if is_repeated { 0 } else { 1 } });
        self.all.iter().map(texture).collect()
    }
}

/// Encodes the texture of a brush at time 0 as PNG. The first row of texels is at `v` = 0.
fn encode(at_rest: &BrushAtRest) -> io::Result<Vec<u8>> {
    let side = at_rest.side();
    let texels: Vec<u8> = (0..side * side)
        .flat_map(|i| at_rest.texel(i % side, i / side))
        .map(|c| (c.clamp(0.0, 1.0) * 255.0).round() as u8)
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side as u32, side as u32);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&texels)?;
    writer.finish()?;
    Ok(bytes)
}
