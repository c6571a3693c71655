//! What pictures consist of: files, areas, outlines, words, legends, and a parallel projection.

use std::{error::Error, io, path::Path};

use glam::{DVec2, Vec3};
use plotters::{
    coord::Shift,
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use osp::math::Aabb;

/// The kinds of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartFormat {
    Png,
    Svg,
}

impl ChartFormat {
    /// The kind of picture for the ending of a file name. Without a known ending, such as for a pipe, it is SVG.
    pub fn of(path: &Path) -> Self {
        let is_png = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
        if is_png { Self::Png } else { Self::Svg }
    }
}

/// A part of a picture.
pub(crate) type Area<B> = DrawingArea<B, Shift>;

/// A target of drawing whose errors can be boxed.
pub(crate) trait Backend: DrawingBackend<ErrorType: 'static> {}

impl<B: DrawingBackend<ErrorType: 'static>> Backend for B {}

/// A picture that can be drawn in pixels and as vectors.
pub(crate) trait Picture {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn;
}

pub(crate) type Drawn = Result<(), Box<dyn Error>>;

/// The bytes of a picture's file. The size is in pixels.
pub(super) fn encode(picture: &impl Picture, format: ChartFormat, size: (u32, u32)) -> io::Result<Vec<u8>> {
    encoded(picture, format, size).map_err(|error| io::Error::other(error.to_string()))
}

fn encoded(
    picture: &impl Picture,
    format: ChartFormat,
    (width, height): (u32, u32),
) -> Result<Vec<u8>, Box<dyn Error>> {
    register_font();
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

pub(crate) fn pixels(picture: &impl Picture, (width, height): (u32, u32)) -> Result<Vec<u8>, Box<dyn Error>> {
    register_font();
    let mut rgb = vec![0; width as usize * height as usize * 3];
    picture.draw_on(&BitMapBackend::with_buffer(&mut rgb, (width, height)).into_drawing_area())?;
    Ok(rgb)
}

/// Registers a font for text, because the machine may have none. In a browser the browser's font is used.
fn register_font() {
    #[cfg(not(target_arch = "wasm32"))]
    register_own_font();
}

#[cfg(not(target_arch = "wasm32"))]
fn register_own_font() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        // Registering fails only for an invalid font; the text would then be missing from the picture.
        let _ = plotters::style::register_font(
            "sans-serif",
            FontStyle::Normal,
            epaint_default_fonts::UBUNTU_LIGHT,
        );
    });
}

/// The side from which a picture shows the cells of an index, in orthographic projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Looking along -z: x to the right, y up.
    Front,
    /// Looking down: x to the right, z down.
    Top,
    /// Looking along -x: z to the left, y up.
    Right,
}

impl Side {
    fn project(self, p: Vec3) -> DVec2 {
        let p = p.as_dvec3();
        match self {
            Self::Front => DVec2::new(p.x, p.y),
            Self::Top => DVec2::new(p.x, -p.z),
            Self::Right => DVec2::new(-p.z, p.y),
        }
    }
}

/// A parallel projection that fits a box into a picture.
pub(super) struct Plan {
    side: Side,
    origin: DVec2,
    pub(super) scale: f64,
    pub(super) size: DVec2,
}

impl Plan {
    pub(super) fn new(side: Side, bounds: &Aabb, (width, height): (u32, u32), margin: f64) -> Self {
        let (a, b) = (side.project(bounds.min), side.project(bounds.max));
        let size = DVec2::new(f64::from(width), f64::from(height));
        let room = (size - 2.0 * margin) / (a - b).abs().max(DVec2::splat(1.0e-9));
        Self { side, origin: (a + b) * 0.5, scale: room.min_element(), size }
    }

    pub(super) fn pixel(&self, p: Vec3) -> DVec2 {
        let from_middle = (self.side.project(p) - self.origin) * self.scale;
        self.size * 0.5 + DVec2::new(from_middle.x, -from_middle.y)
    }
}

/// A line of a legend: its colour, if it has one, and its text.
pub(super) type LegendLine = (Option<RGBAColor>, String);

/// Writes a legend in the lower left corner.
pub(super) fn legend<B: Backend>(lines: &[LegendLine], area: &Area<B>) -> Drawn {
    const LINE: i32 = 17;
    let height = area.dim_in_pixel().1 as i32;
    let top = height - 8 - LINE * lines.len() as i32;
    let widest = lines.iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0) as i32;
    let back = [(4, top - 4), (34 + widest * 8, height - 4)];
    area.draw(&Rectangle::new(back, WHITE.mix(0.85).filled()))?;
    for (i, (color, text)) in lines.iter().enumerate() {
        let y = top + LINE * i as i32;
        if let Some(color) = color {
            area.draw(&Rectangle::new([(10, y + 2), (22, y + 12)], color.filled()))?;
        }
        area.draw(&Text::new(text.clone(), (28, y), ("sans-serif", 14)))?;
    }
    Ok(())
}

/// Rounds a position to the nearest pixel.
pub(super) fn point(p: &DVec2) -> (i32, i32) {
    (p.x.round() as i32, p.y.round() as i32)
}

/// The mean of the corners of an outline, if it has any.
pub(super) fn middle(outline: &[DVec2]) -> Option<DVec2> {
    (!outline.is_empty()).then(|| outline.iter().sum::<DVec2>() / outline.len() as f64)
}

pub(super) fn fill<B: Backend>(area: &Area<B>, outline: &[DVec2], color: RGBAColor) -> Drawn {
    if outline.len() >= 3 {
        area.draw(&Polygon::new(outline.iter().map(point).collect::<Vec<_>>(), color.filled()))?;
    }
    Ok(())
}

/// Draws a closed line around an outline, or a line between two points.
pub(super) fn stroke<B: Backend>(area: &Area<B>, outline: &[DVec2], color: RGBAColor, width: u32) -> Drawn {
    let first = outline.first().filter(|_| outline.len() > 2);
    let path: Vec<(i32, i32)> = outline.iter().chain(first).map(point).collect();
    if path.len() > 1 {
        area.draw(&PathElement::new(path, color.stroke_width(width)))?;
    }
    Ok(())
}

/// Writes a text centred at `at`, pixels.
pub(super) fn write_at<B: Backend>(
    area: &Area<B>,
    text: &str,
    at: DVec2,
    size: u32,
    color: &RGBColor,
) -> Drawn {
    let style = TextStyle::from(("sans-serif", size).into_font()).color(color);
    area.draw(&Text::new(text.to_owned(), point(&at), style.pos(Pos::new(HPos::Center, VPos::Center))))?;
    Ok(())
}
