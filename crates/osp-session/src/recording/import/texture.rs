//! Textures of models: decoded pictures, and their mean colour over a polygon.

use std::{io::Cursor, sync::LazyLock};

use glam::{Vec2, Vec4};

use crate::recording::{Limits, error::Mismatch, opening::LFS_POINTER};

/// Number of texels of all pictures of a model for each polygon that the limits allow: 64 million by default, which
/// decode in about a second.
const TEXELS_A_POLYGON: u64 = 16;
/// A picture keeps at most this part of the texels that are left; its finer levels are dropped.
const KEPT_PART: u64 = 8;
/// Longest edge of a triangle in texels of the level that is sampled. A triangle gets [`SAMPLES`] samples.
const LONGEST_EDGE: f32 = 8.0;

/// The texels that a model's pictures may still have.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room(u64);

impl Room {
    pub(super) fn new(limits: &Limits) -> Self {
        Self(limits.polygons.saturating_mul(TEXELS_A_POLYGON))
    }
}

/// What a texture coordinate outside 0 to 1 means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Wrap {
    #[default]
    Repeat,
    Mirror,
    Clamp,
}

/// A picture in smaller and smaller levels, each texel the mean of four. Colours are sRGB.
#[derive(Debug)]
pub(super) struct Texture {
    levels: Vec<Level>,
}

#[derive(Debug)]
struct Level {
    width: usize,
    texels: Vec<[u8; 4]>,
}

impl Level {
    fn height(&self) -> usize {
        self.texels.len() / self.width
    }

    /// The level with half the width and height.
    fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height().div_ceil(2));
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let mut sum = Mean::default();
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let (x, y) = ((2 * x + dx).min(self.width - 1), (2 * y + dy).min(self.height() - 1));
                    sum.add(self.texels[y * self.width + x]);
                }
                let [r, g, b, a] = sum.linear().to_array();
                texels.push([srgb_byte(r), srgb_byte(g), srgb_byte(b), (a * 255.0).round() as u8]);
            }
        }
        Self { width, texels }
    }
}

/// A mean of texels. Colours count by their opacity, so that the colour of transparent texels does not show.
#[derive(Default)]
struct Mean {
    by_alpha: Vec4,
    plain: Vec4,
    count: f32,
}

impl Mean {
    fn add(&mut self, [r, g, b, a]: [u8; 4]) {
        let alpha = f32::from(a) / 255.0;
        let color = Vec4::new(linear_of(r), linear_of(g), linear_of(b), 1.0);
        self.by_alpha += color * alpha;
        self.plain += color;
        self.count += 1.0;
    }

    fn linear(&self) -> Vec4 {
        let of = if self.by_alpha.w > 0.0 { self.by_alpha } else { self.plain };
        (of / of.w).truncate().extend(self.by_alpha.w / self.count)
    }
}

impl Texture {
    /// Decodes a PNG, JPEG or WebP. With a cutoff, texels are opaque or transparent.
    pub(super) fn decode(bytes: &[u8], cutoff: Option<f32>, room: &mut Room) -> Result<Self, Mismatch> {
        let mut top = match bytes {
            [0x89, b'P', b'N', b'G', ..] => png(bytes, room)?,
            [0xFF, 0xD8, ..] => jpeg(bytes, room)?,
            [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => webp(bytes, room)?,
            _ => return Err(Mismatch::new(PICTURE, kind_of(bytes))),
        };
        if let Some(cutoff) = cutoff {
            let is_there = |a: u8| f32::from(a) / 255.0 >= cutoff;
            top.texels.iter_mut().for_each(|[.., a]| *a = if is_there(*a) { 255 } else { 0 });
        }
        let most = (room.0 / KEPT_PART).max(1);
        let mut levels = vec![top];
        while let Some(last) = levels.last().filter(|last| last.texels.len() > 1) {
            let next = last.halved();
            if last.texels.len() as u64 > most {
                levels.pop();
            }
            levels.push(next);
        }
        Ok(Self { levels })
    }

    /// The mean over a triangle: linear red, green, blue, and opacity.
    pub(super) fn mean(&self, uv: [Vec2; 3], wrap: [Wrap; 2]) -> Vec4 {
        let size = |level: &Level| Vec2::new(level.width as f32, level.height() as f32);
        let edges = [uv[1] - uv[0], uv[2] - uv[1], uv[0] - uv[2]];
        let longest =
            |level: &&Level| edges.iter().map(|edge| (*edge * size(level)).length()).fold(0.0, f32::max);
        let coarsest = self.levels.last();
        let Some(level) = self.levels.iter().find(|level| longest(level) <= LONGEST_EDGE).or(coarsest) else {
            return Vec4::ONE;
        };
        let mut mean = Mean::default();
        for [a, b, c] in SAMPLES {
            let at = uv[0] * a + uv[1] * b + uv[2] * c;
            let place = |v: f32, wrap: Wrap, count: usize| {
                let v = match wrap {
                    Wrap::Repeat => v - v.floor(),
                    Wrap::Mirror => 1.0 - ((v * 0.5 - (v * 0.5).floor()) * 2.0 - 1.0).abs(),
                    Wrap::Clamp => v.clamp(0.0, 1.0),
                };
                // A coordinate that is not a number becomes 0.
                ((v * count as f32) as usize).min(count - 1)
            };
            let (x, y) = (place(at.x, wrap[0], level.width), place(at.y, wrap[1], level.height()));
            mean.add(level.texels[y * level.width + x]);
        }
        mean.linear()
    }
}

/// Barycentric coordinates of the middles of sixteen equal parts of a triangle.
const SAMPLES: [[f32; 3]; 16] = {
    let mut samples = [[0.0; 3]; 16];
    let (mut at, mut row) = (0, 0);
    while row < 4 {
        let mut column = 0;
        while column < 2 * (4 - row) - 1 {
            let turned = (column % 2) as f32;
            let x = ((column / 2) as f32 + (1.0 + turned) / 3.0) / 4.0;
            let y = (row as f32 + (1.0 + turned) / 3.0) / 4.0;
            samples[at] = [1.0 - x - y, x, y];
            at += 1;
            column += 1;
        }
        row += 1;
    }
    samples
};

const PICTURE: &str = "a picture as PNG, JPEG or WebP";

fn kind_of(bytes: &[u8]) -> String {
    const KNOWN: [(&[u8], &str); 6] = [
        (b"\xABKTX 20", "KTX2"),
        (LFS_POINTER, "a pointer of Git LFS in place of the picture"),
        (b"DDS ", "DDS"),
        (b"BM", "BMP"),
        (b"GIF8", "GIF"),
        (b"\0\0\x02", "TGA"),
    ];
    let known = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic));
    known.map_or("another format", |(_, name)| name).to_owned()
}

/// Takes the texels of a picture from the room that is left.
fn take(room: &mut Room, width: usize, height: usize) -> Result<usize, Mismatch> {
    let texels = width.checked_mul(height).filter(|&texels| texels > 0 && texels as u64 <= room.0);
    let texels = texels.ok_or_else(|| {
        Mismatch::new(format!("pictures of at most {} texels", room.0), format!("one of {width} x {height}"))
    })?;
    room.0 -= texels as u64;
    Ok(texels)
}

/// A picture of one to four channels: grey, grey and opacity, colours, colours and opacity.
fn level(width: usize, raw: &[u8], channels: usize) -> Level {
    let texels = raw.chunks_exact(channels).map(|texel| match *texel {
        [v] => [v, v, v, 255],
        [v, a] => [v, v, v, a],
        [r, g, b] => [r, g, b, 255],
        _ => [texel[0], texel[1], texel[2], texel[3]],
    });
    Level { width, texels: texels.collect() }
}

fn png(bytes: &[u8], room: &mut Room) -> Result<Level, Mismatch> {
    let fault = |error: png::DecodingError| damaged("PNG", &error);
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    decoder.ignore_checksums(true);
    let mut reader = decoder.read_info().map_err(fault)?;
    let width = reader.info().width as usize;
    take(room, width, reader.info().height as usize)?;
    let mut raw = vec![0; reader.output_buffer_size().unwrap_or_default()];
    let frame = reader.next_frame(&mut raw).map_err(fault)?;
    raw.truncate(frame.buffer_size());
    Ok(level(width, &raw, frame.color_type.samples()))
}

fn jpeg(bytes: &[u8], room: &mut Room) -> Result<Level, Mismatch> {
    use zune_jpeg::zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};
    let fault = |error: zune_jpeg::errors::DecodeErrors| damaged("JPEG", &error);
    let options = DecoderOptions::default().jpeg_set_out_colorspace(ColorSpace::RGBA);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(fault)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    let texels = take(room, width, height)?;
    let raw = decoder.decode().map_err(fault)?;
    match raw.len() == 4 * texels {
        true => Ok(level(width, &raw, 4)),
        false => Err(Mismatch::new(PICTURE, "a JPEG of other colours")),
    }
}

fn webp(bytes: &[u8], room: &mut Room) -> Result<Level, Mismatch> {
    let fault = |error: image_webp::DecodingError| damaged("WebP", &error);
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(bytes)).map_err(fault)?;
    let (width, height) = decoder.dimensions();
    let texels = take(room, width as usize, height as usize)?;
    let channels = if decoder.has_alpha() { 4 } else { 3 };
    let mut raw = vec![0; texels * channels];
    decoder.read_image(&mut raw).map_err(fault)?;
    Ok(level(width as usize, &raw, channels))
}

fn damaged(kind: &str, error: &dyn std::fmt::Display) -> Mismatch {
    Mismatch::new(PICTURE, format!("a damaged {kind} ({error})"))
}

static LINEAR: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| linear_from_srgb(byte as f32 / 255.0)));
/// Bytes for linear values in steps of 1/65535.
static SRGB: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let byte = |v: u32| (srgb_from_linear(v as f32 / 65535.0) * 255.0).round() as u8;
    (0..=65535).map(byte).collect()
});

/// The linear value of a byte in sRGB.
pub(super) fn linear_of(byte: u8) -> f32 {
    LINEAR[usize::from(byte)]
}

/// The byte in sRGB of a linear value; values outside 0 to 1 are clamped.
pub(super) fn srgb_byte(linear: f32) -> u8 {
    SRGB[(linear.clamp(0.0, 1.0) * 65535.0).round() as usize]
}

pub(super) fn linear_from_srgb(srgb: f32) -> f32 {
    let c = f64::from(srgb.clamp(0.0, 1.0));
    (if c <= 0.04045 { c / 12.92 } else { libm::pow((c + 0.055) / 1.055, 2.4) }) as f32
}

/// A linear colour channel, converted to sRGB, 0 to 1.
pub(super) fn srgb_from_linear(linear: f32) -> f32 {
    let linear = f64::from(linear.clamp(0.0, 1.0));
    let srgb =
        if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 };
    srgb as f32
}
