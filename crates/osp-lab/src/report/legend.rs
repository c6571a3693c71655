//! The legend of a picture.

use std::error::Error;

use plotters::prelude::*;

use super::picture::{Area, Backend};

/// A line of a legend: its colour, if it has one, and its text.
pub(super) type LegendLine = (Option<RGBAColor>, String);

/// Writes a legend in the lower left corner.
pub(super) fn legend<B: Backend>(lines: &[LegendLine], area: &Area<B>) -> Result<(), Box<dyn Error>> {
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
