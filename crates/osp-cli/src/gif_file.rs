//! Writes films as GIF files. A frame holds only the changes since the frame before.

use std::{io, ops::RangeInclusive};

use color_quant::NeuQuant;
use gif::{Encoder, EncodingError, Frame, Repeat};

use osp_session::atomic_file::AtomicFile;

/// Largest number of colours of a frame. One more entry of its palette means "no change".
const COLORS: usize = 255;
const UNCHANGED: u8 = COLORS as u8;
/// Approximate number of pixels that are sampled to choose the colours of a frame.
const LOOKED_AT: usize = 50_000;

/// A film that is being written. Viewers repeat it forever.
pub(super) struct GifFile {
    encoder: Encoder<AtomicFile>,
    size: (u16, u16),
    /// The last frame as red, green and blue bytes. Empty before the first frame.
    shown: Vec<u8>,
    /// Choice of the palette for a frame with too many colours.
    choice: ColorChoice,
}

/// Choice of the palette for a frame with more colours than the palette holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ColorChoice {
    /// Colours that are close to all colours of the frame, for pictures with shades.
    Close,
    /// Exactly the most frequent colours. In drawings, rare colours occur only at the edges of letters and lines.
    #[cfg(feature = "bench")]
    Frequent,
}

impl GifFile {
    /// Starts a film of this size in pixels. Each side is at most 65,535.
    pub(super) fn begin(file: AtomicFile, (width, height): (u32, u32)) -> io::Result<Self> {
        let side = |side: u32| u16::try_from(side).map_err(io::Error::other);
        let size = (side(width)?, side(height)?);
        let mut encoder = Encoder::new(file, size.0, size.1, &[]).map_err(to_io)?;
        encoder.set_repeat(Repeat::Infinite).map_err(to_io)?;
        Ok(Self { encoder, size, shown: Vec::new(), choice: ColorChoice::Close })
    }

    /// Returns the same film for drawings: areas of a single colour keep their exact colour, so that they match the
    /// legend.
    #[cfg(feature = "bench")]
    pub(super) fn of_drawings(self) -> Self {
        Self { choice: ColorChoice::Frequent, ..self }
    }

    /// Appends a frame that is shown for `delay` hundredths of a second. `rgb` has red, green and blue bytes in rows
    /// from the top.
    pub(super) fn add(&mut self, rgb: &[u8], delay: u16) -> io::Result<()> {
        let mut frame = match self.changed(rgb) {
            Some((columns, rows)) => self.part(rgb, columns, rows),
            // Writes one pixel for an unchanged frame, because the file stores the delay with a picture.
            None => Frame::from_palette_pixels(1, 1, [0], [0, 0, 0], Some(0)),
        };
        frame.delay = delay;
        self.encoder.write_frame(&frame).map_err(to_io)?;
        self.shown.clear();
        self.shown.extend_from_slice(rgb);
        Ok(())
    }

    pub(super) fn finish(self) -> io::Result<AtomicFile> {
        self.encoder.into_inner().map_err(to_io)
    }

    /// Returns the smallest range of columns and rows with all pixels that differ from the last frame.
    fn changed(&self, rgb: &[u8]) -> Option<(RangeInclusive<usize>, RangeInclusive<usize>)> {
        let (width, height) = (usize::from(self.size.0), usize::from(self.size.1));
        if self.shown.is_empty() {
            return Some((0..=width - 1, 0..=height - 1));
        }
        let (mut columns, mut rows) = ((usize::MAX, 0), (usize::MAX, 0));
        let grow = |(low, high): (usize, usize), to: usize| (low.min(to), high.max(to));
        let pixels = rgb.chunks_exact(3).zip(self.shown.chunks_exact(3)).enumerate();
        for (at, _) in pixels.filter(|(_, (new, old))| new != old) {
            columns = grow(columns, at % width);
            rows = grow(rows, at / width);
        }
        (columns.0 <= columns.1).then_some((columns.0..=columns.1, rows.0..=rows.1))
    }

    /// Returns a rectangle of the picture. Pixels that equal the last frame get the entry "no change".
    fn part(
        &self,
        rgb: &[u8],
        columns: RangeInclusive<usize>,
        rows: RangeInclusive<usize>,
    ) -> Frame<'static> {
        let (left, top) = (*columns.start() as u16, *rows.start() as u16);
        let (width, height) = (columns.clone().count() as u16, rows.clone().count() as u16);
        let pixels: Vec<Option<[u8; 3]>> = rows
            .flat_map(|row| columns.clone().map(move |column| (row, column)))
            .map(|(row, column)| {
                let at = (row * usize::from(self.size.0) + column) * 3;
                let color = &rgb[at..at + 3];
                (self.shown.get(at..at + 3) != Some(color)).then(|| [color[0], color[1], color[2]])
            })
            .collect();
        let mut colors: Vec<[u8; 3]> = pixels.iter().flatten().copied().collect();
        colors.sort_unstable();
        colors.dedup();
        let (palette, entries) = match self.choice {
            _ if colors.len() <= COLORS => all_of(&colors),
            ColorChoice::Close => close(&pixels, &colors),
            #[cfg(feature = "bench")]
            ColorChoice::Frequent => frequent(&pixels, &colors),
        };
        let entry = |color: &[u8; 3]| colors.binary_search(color).map_or(UNCHANGED, |at| entries[at]);
        let indices: Vec<u8> = pixels.iter().map(|pixel| pixel.as_ref().map_or(UNCHANGED, entry)).collect();
        let frame = Frame::from_palette_pixels(width, height, indices, palette, Some(UNCHANGED));
        Frame { left, top, ..frame }
    }
}

/// A palette of at most [`COLORS`] colours plus one entry for "no change". Then for each of the sorted colours the
/// index of its palette entry.
type Palette = (Vec<u8>, Vec<u8>);

fn filled(mut palette: Vec<u8>) -> Vec<u8> {
    palette.resize((COLORS + 1) * 3, 0);
    palette
}

fn all_of(colors: &[[u8; 3]]) -> Palette {
    (filled(colors.concat()), (0..colors.len()).map(|at| at as u8).collect())
}

fn close(pixels: &[Option<[u8; 3]>], colors: &[[u8; 3]]) -> Palette {
    let rgba: Vec<u8> = pixels.iter().flatten().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
    let one_in = (rgba.len() / 4 / LOOKED_AT).clamp(1, 30) as i32;
    let chosen = NeuQuant::new(one_in, COLORS, &rgba);
    let entries = colors.iter().map(|&[r, g, b]| chosen.index_of(&[r, g, b, 255]) as u8).collect();
    (filled(chosen.color_map_rgb()), entries)
}

#[cfg(feature = "bench")]
fn frequent(pixels: &[Option<[u8; 3]>], colors: &[[u8; 3]]) -> Palette {
    let mut counts = vec![0_u32; colors.len()];
    for at in pixels.iter().flatten().filter_map(|pixel| colors.binary_search(pixel).ok()) {
        counts[at] += 1;
    }
    let mut order: Vec<usize> = (0..colors.len()).collect();
    order.sort_by_key(|&at| (std::cmp::Reverse(counts[at]), at));
    order.truncate(COLORS);
    let chosen: Vec<[u8; 3]> = order.iter().map(|&at| colors[at]).collect();
    let nearest = |color: &[u8; 3]| {
        let apart =
            |other: &[u8; 3]| -> u32 { (0..3).map(|i| u32::from(color[i].abs_diff(other[i])).pow(2)).sum() };
        (0..chosen.len()).min_by_key(|&at| apart(&chosen[at])).unwrap_or(0) as u8
    };
    (filled(chosen.concat()), colors.iter().map(nearest).collect())
}

fn to_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::Io(error) => error,
        other => io::Error::other(other),
    }
}

#[cfg(all(test, feature = "bench"))]
mod tests {
    use super::*;

    #[test]
    fn frequent_colours_stay_and_rare_ones_become_their_neighbours() {
        let red = [225, 0, 20];
        // Two pixels of each of 254 shades, one pixel of a further shade, and two red pixels.
        let shades = (0..=254).map(|shade| [shade; 3]);
        let pixels: Vec<_> = shades
            .clone()
            .take(254)
            .flat_map(|shade| [shade; 2])
            .chain([[254; 3], red, red])
            .map(Some)
            .collect();
        let mut colors: Vec<[u8; 3]> = shades.chain([red]).collect();
        colors.sort_unstable();
        let (palette, entries) = frequent(&pixels, &colors);
        assert_eq!(palette.len(), 256 * 3);
        let shown = |color: [u8; 3]| {
            let at = 3 * usize::from(entries[colors.binary_search(&color).expect("there")]);
            [palette[at], palette[at + 1], palette[at + 2]]
        };
        assert_eq!([shown(red), shown([7; 3]), shown([254; 3])], [red, [7; 3], [253; 3]]);
    }
}
