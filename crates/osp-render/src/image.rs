use std::{io, path::Path};

use super::RenderError;
use osp_session::atomic_file::write_atomically;

/// Largest rounding error of a colour component, 0 to 255, after averaging colours.
const ROUNDING: u8 = 2;

/// A finished picture: sRGB, 8 bits for each of red, green, blue and alpha, row by row from the top. Alpha is 255, except
/// in a [cut-out](Image::cut_out) picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    width: u32,
    height: u32,
    rgba: Vec<u8>,
}

impl Image {
    /// A picture from its bytes, four for each pixel.
    ///
    /// # Panics
    /// The number of bytes does not match the size.
    pub(super) fn new(width: u32, height: u32, rgba: Vec<u8>) -> Self {
        assert_eq!(rgba.len(), width as usize * height as usize * 4, "four bytes a pixel");
        Self { width, height, rgba }
    }

    /// The picture without its background, from the same picture before black and before white. What covers a pixel in
    /// part is transparent in part, and light that is added is transparent paint of its colour.
    ///
    /// # Panics
    /// The sizes differ.
    pub fn cut_out(black: &Self, white: &Self) -> Self {
        let pixel = |(black, white): (&[u8], &[u8])| {
            let through = (0..3).map(|i| white[i].saturating_sub(black[i])).min().unwrap_or_default();
            let alpha = 255 - through;
            let own = |i: usize| (u32::from(black[i]) * 255 / u32::from(alpha.max(1))).min(255) as u8;
            [own(0), own(1), own(2), alpha]
        };
        let rgba = black.rgba.chunks_exact(4).zip(white.rgba.chunks_exact(4)).flat_map(pixel).collect();
        Self::new(black.width, black.height, rgba)
    }

    pub fn width(&self) -> u32 {
        self.width
    }

    pub fn height(&self) -> u32 {
        self.height
    }

    /// The bytes, four for each pixel, row by row from the top.
    pub fn rgba(&self) -> &[u8] {
        &self.rgba
    }

    /// Number of pixels that differ from `other`'s; all of them if the sizes differ.
    pub fn differing_pixels(&self, other: &Self) -> usize {
        if (self.width, self.height) != (other.width, other.height) {
            return self.rgba.len() / 4;
        }
        self.rgba.chunks_exact(4).zip(other.rgba.chunks_exact(4)).filter(|(a, b)| a != b).count()
    }

    /// Number of pixels whose colour lies outside the range of colours of `other`'s pixel and its eight neighbours. A
    /// colour within this range can come from the edge of a surface that covers a little more or less of the pixel.
    ///
    /// If the sizes differ, all pixels count.
    pub fn unlike_pixels(&self, other: &Self) -> usize {
        if (self.width, self.height) != (other.width, other.height) {
            return self.rgba.len() / 4;
        }
        let (width, height) = (self.width as usize, self.height as usize);
        let is_unlike = |at: &usize| {
            let (x, y) = (at % width, at / width);
            let (mut low, mut high) = ([u8::MAX; 3], [0; 3]);
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                for x in x.saturating_sub(1)..(x + 2).min(width) {
                    let pixel = &other.rgba[(y * width + x) * 4..];
                    low = std::array::from_fn(|i| low[i].min(pixel[i]));
                    high = std::array::from_fn(|i| high[i].max(pixel[i]));
                }
            }
            let own = &self.rgba[at * 4..];
            (0..3).any(|i| {
                !(low[i].saturating_sub(ROUNDING)..=high[i].saturating_add(ROUNDING)).contains(&own[i])
            })
        };
        (0..width * height).filter(is_unlike).count()
    }

    /// Number of pixels whose colour is not that of the upper left corner.
    pub fn drawn_pixels(&self) -> usize {
        let mut pixels = self.rgba.chunks_exact(4);
        let first = pixels.next();
        pixels.filter(|pixel| Some(*pixel) != first).count()
    }

    /// Writes the picture as PNG to a file, which is replaced if it exists. The file is written completely or not at all.
    pub fn write_png(&self, path: &Path) -> Result<(), RenderError> {
        write_atomically(path, |out| self.write_png_to(out))
            .map_err(|error| RenderError::Write { path: path.to_owned(), reason: error.to_string() })
    }

    pub fn write_png_to(&self, out: &mut dyn io::Write) -> io::Result<()> {
        let mut encoder = png::Encoder::new(out, self.width, self.height);
        encoder.set_color(png::ColorType::Rgba);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        // By this `osp thumbs` knows its own pictures.
        encoder.add_text_chunk("Software".to_owned(), "osp".to_owned())?;
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.rgba)?;
        Ok(writer.finish()?)
    }
}
