//! Films, read by a decoder.

use std::fs::File;

use gif::{ColorOutput, DecodeOptions, Repeat};

/// The pictures of a film, red, green and blue, and the time of each, hundredths of a second.
pub(crate) struct Film {
    pub(crate) size: (usize, usize),
    pub(crate) frames: Vec<(Vec<[u8; 3]>, u16)>,
}

impl Film {
    pub(crate) fn open(path: &str) -> Self {
        let mut options = DecodeOptions::new();
        options.set_color_output(ColorOutput::RGBA);
        let mut decoder = options.read_info(File::open(path).expect("a film")).expect("a GIF");
        let size = (usize::from(decoder.width()), usize::from(decoder.height()));
        let (mut shown, mut frames) = (vec![[0; 3]; size.0 * size.1], Vec::new());
        while let Some(frame) = decoder.read_next_frame().expect("a whole frame") {
            let (left, top) = (usize::from(frame.left), usize::from(frame.top));
            for (at, pixel) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
                let (row, column) = (at / usize::from(frame.width), at % usize::from(frame.width));
                shown[(top + row) * size.0 + left + column] = [pixel[0], pixel[1], pixel[2]];
            }
            frames.push((shown.clone(), frame.delay));
        }
        assert!(decoder.repeat() == Repeat::Infinite, "it plays again and again");
        Self { size, frames }
    }
}
