//! Outlines and words in a picture.

use std::error::Error;

use glam::DVec2;
use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use super::picture::{Area, Backend};

pub(super) type Drawn = Result<(), Box<dyn Error>>;

/// Rounds a position to the nearest pixel.
pub(super) fn point(p: &DVec2) -> (i32, i32) {
    (p.x.round() as i32, p.y.round() as i32)
}

/// The mean of the corners of an outline, if it has any.
pub(super) fn middle(outline: &[DVec2]) -> Option<DVec2> {
    (!outline.is_empty()).then(|| outline.iter().sum::<DVec2>() / outline.len() as f64)
}

/// Fills a convex outline.
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
