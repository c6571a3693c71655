use std::{
    error::Error,
    path::{Path, PathBuf},
};

use plotters::{coord::Shift, prelude::*};
use thiserror::Error;

/// The error of a chart.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "their messages describe them")]
pub enum ChartError {
    /// The ending of the file name is neither `.png` nor `.svg`.
    #[error("{}: expected a file name ending in .png or .svg", .0.display())]
    Ending(PathBuf),
    /// No frame was measured.
    #[error("{}: there is no frame to draw", .0.display())]
    Empty(PathBuf),
    /// The picture could not be drawn or written.
    #[error("{}: {message}", path.display())]
    Draw { path: PathBuf, message: String },
}

/// The kinds of picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartFormat {
    /// A picture in pixels.
    Png,
    /// A vector picture.
    Svg,
}

impl ChartFormat {
    /// The kind of picture for the ending of a file name.
    pub fn of(path: &Path) -> Result<Self, ChartError> {
        match path
            .extension()
            .map(|ending| ending.to_ascii_lowercase())
            .as_deref()
            .and_then(|ending| ending.to_str())
        {
            Some("png") => Ok(Self::Png),
            Some("svg") => Ok(Self::Svg),
            _ => Err(ChartError::Ending(path.to_owned())),
        }
    }
}

/// A part of a picture.
pub(super) type Area<B> = DrawingArea<B, Shift>;

/// A target of drawing whose errors can be boxed.
pub(super) trait Backend: DrawingBackend<ErrorType: 'static> {}

impl<B: DrawingBackend<ErrorType: 'static>> Backend for B {}

/// A picture that can be drawn in pixels and as vectors.
pub(super) trait Picture {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Result<(), Box<dyn Error>>;
}

/// The bytes of a picture file.
pub(super) fn encode(
    picture: &impl Picture,
    format: ChartFormat,
    (width, height): (u32, u32),
) -> Result<Vec<u8>, Box<dyn Error>> {
    match format {
        ChartFormat::Svg => {
            let mut svg = String::new();
            picture.draw_on(&SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area())?;
            Ok(svg.into_bytes())
        }
        ChartFormat::Png => {
            let rgb = pixels(picture, (width, height))?;
            let mut bytes = Vec::new();
            let mut encoder = png::Encoder::new(&mut bytes, width, height);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Eight);
            let mut writer = encoder.write_header()?;
            writer.write_image_data(&rgb)?;
            writer.finish()?;
            Ok(bytes)
        }
    }
}

/// The pixels of a picture: red, green and blue, by rows from the top.
pub(super) fn pixels(picture: &impl Picture, (width, height): (u32, u32)) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut rgb = vec![0; width as usize * height as usize * 3];
    picture.draw_on(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area())?;
    Ok(rgb)
}
