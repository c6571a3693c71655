use std::error::Error;

use plotters::prelude::*;

use crate::report::register_font;

/// Number of samples of a pixel along each axis, for text.
const FINE: u32 = 2;

/// Alignment of a line of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// The text begins at the position.
    Left,
    /// The text ends at the position.
    Right,
}

/// A picture to draw on: red, green and blue bytes, rows from the top. Drawing outside the picture has no effect.
#[derive(Clone, Debug)]
pub(super) struct Canvas {
    size: (usize, usize),
    /// The bytes of the picture.
    pub(super) rgb: Vec<u8>,
}

impl Canvas {
    /// A picture of this size in pixels, filled with one colour.
    pub(super) fn new((width, height): (u32, u32), color: RGBColor) -> Self {
        register_font();
        let size = (width as usize, height as usize);
        Self { size, rgb: [color.0, color.1, color.2].repeat(size.0 * size.1) }
    }

    /// Fills a rectangle from its upper left to its lower right corner, pixels.
    pub(super) fn fill(&mut self, from: (i32, i32), to: (i32, i32), color: RGBColor) {
        for (y, x) in (from.1..to.1).flat_map(|y| (from.0..to.0).map(move |x| (y, x))) {
            self.blend((x, y), [color.0, color.1, color.2], 255);
        }
    }

    /// Copies a picture of this width onto this picture.
    pub(super) fn lay(&mut self, at: (i32, i32), width: u32, rgb: &[u8]) {
        for (place, pixel) in (0..).zip(rgb.chunks_exact(3)) {
            let (x, y) = (place % width as i32, place / width as i32);
            self.blend((at.0 + x, at.1 + y), [pixel[0], pixel[1], pixel[2]], 255);
        }
    }

    /// Writes a line of text; `at` is a point of its baseline. The font size is in pixels.
    pub(super) fn text(
        &mut self,
        text: &str,
        at: (i32, i32),
        size: u32,
        color: RGBColor,
        side: Side,
    ) -> Result<(), Box<dyn Error>> {
        let font = ("sans-serif", size * FINE).into_font();
        // The last letter may extend slightly beyond the text's box.
        let (width, height) = (font.box_size(text)?.0 / FINE + 2, size * 3 / 2);
        let mut fine = vec![0; (width * height * FINE * FINE * 3) as usize];
        {
            let fine_size = (width * FINE, height * FINE);
            let area = BitMapBackend::with_buffer(&mut fine, fine_size).into_drawing_area();
            // Plotters puts the baseline half the size below the position.
            let place = (0, (size * FINE / 2) as i32);
            area.draw(&Text::new(text.to_owned(), place, font.color(&WHITE)))?;
            area.present()?;
        }
        let top = at.1 - size as i32;
        let left = if side == Side::Left { at.0 } else { at.0 + 2 - width as i32 };
        let (fine_width, color) = ((width * FINE * 3) as usize, [color.0, color.1, color.2]);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let sample = |at: u32| {
                let (row, column) = (y * FINE + at / FINE, x * FINE + at % FINE);
                u32::from(fine[row as usize * fine_width + column as usize * 3])
            };
            let cover = (0..FINE * FINE).map(sample).sum::<u32>() / (FINE * FINE);
            self.blend((left + x as i32, top + y as i32), color, cover);
        }
        Ok(())
    }

    /// Blends a pixel with a colour, whose opacity is `cover` / 255.
    fn blend(&mut self, (x, y): (i32, i32), color: [u8; 3], cover: u32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x < self.size.0 && y < self.size.1 {
            let pixel = (y * self.size.0 + x) * 3;
            for (under, over) in self.rgb[pixel..pixel + 3].iter_mut().zip(color) {
                *under = ((u32::from(over) * cover + u32::from(*under) * (255 - cover)) / 255) as u8;
            }
        }
    }
}
