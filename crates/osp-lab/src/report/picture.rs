use std::error::Error;

use plotters::{coord::Shift, prelude::*};

use super::ChartFormat;

/// Something that can be drawn as pixels and as lines.
pub(super) trait Picture {
    fn draw_on<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static;
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
            let mut rgb = vec![0; width as usize * height as usize * 3];
            picture.draw_on(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area())?;
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
