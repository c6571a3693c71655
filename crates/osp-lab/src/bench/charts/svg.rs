use std::{error::Error, fmt::Write, ops::Range};

use plotters::{
    coord::{
        Shift,
        ranged1d::{AsRangedCoord, Ranged, ValueFormatter},
    },
    prelude::*,
};

use super::{Axis, Chart};
use crate::report::{FAINT_MESH, MESH, register_font, themed};

/// Size of a chart, pixels.
const SIZE: (u32, u32) = (960, 420);

impl Chart {
    /// The picture.
    ///
    /// # Errors
    /// It cannot be drawn.
    pub(in crate::bench) fn svg(&self) -> Result<String, Box<dyn Error>> {
        register_font();
        let mut svg = String::new();
        let points = || self.drawn().flat_map(|line| line.points.iter().chain(&line.thin));
        let (x, y) = (self.x.range(points().map(|p| p.0)), self.y.range(points().map(|p| p.1)));
        {
            let area = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
            match (self.x, self.y) {
                (Axis::Linear(_), Axis::Linear(_)) => self.draw(&area, x, y)?,
                (Axis::Linear(_), Axis::Log(_)) => self.draw(&area, x, y.log_scale())?,
                (Axis::Log(_), Axis::Linear(_)) => self.draw(&area, x.log_scale(), y)?,
                (Axis::Log(_), Axis::Log(_)) => self.draw(&area, x.log_scale(), y.log_scale())?,
            }
            area.present()?;
        }
        Ok(compact(&themed(&svg)))
    }

    fn draw<X, Y>(&self, area: &DrawingArea<SVGBackend<'_>, Shift>, x: X, y: Y) -> Result<(), Box<dyn Error>>
    where
        X: AsRangedCoord<Value = f64>,
        X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    {
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .margin_right(28)
            .x_label_area_size(44)
            .y_label_area_size(92)
            .build_cartesian_2d(x, y)?;
        chart
            .configure_mesh()
            .max_light_lines(4)
            .light_line_style(FAINT_MESH)
            .bold_line_style(MESH)
            .x_desc(self.x.name())
            .y_desc(self.y.name())
            .x_label_formatter(&|v| self.x.label(*v))
            .y_label_formatter(&|v| self.y.label(*v))
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 16))
            .draw()?;
        for line in self.drawn() {
            chart.draw_series(LineSeries::new(line.thin.iter().copied(), line.style.faint()))?;
        }
        // The first line lies on top.
        for line in self.drawn().rev() {
            line.style.draw(&mut chart, &line.points, 2)?;
        }
        Ok(())
    }
}

impl Axis {
    /// What stands beside a line of the mesh. Of the numbers of a decade 1, 2 and 5: nine do not fit on a short axis.
    fn label(self, value: f64) -> String {
        let decade = 10f64.powf(value.abs().log10().floor());
        let digit = (value.abs() / decade).round() as u32;
        match self {
            Self::Log(_) if !matches!(digit, 1 | 2 | 5 | 10) => String::new(),
            _ => tick(value),
        }
    }

    /// A range in which all values lie, never empty.
    fn range(self, values: impl Iterator<Item = f64>) -> Range<f64> {
        let (low, high) = values
            .filter(|v| v.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return 1.0..10.0;
        }
        match self {
            Self::Linear(name) if name == "frame" || name == "polygons" && low > 0.0 => {
                low..high.max(low + 1.0)
            }
            Self::Linear(_) => low.min(0.0)..(high * 1.05).max(low + 1.0),
            Self::Log(_) => {
                let low = low.max(1.0e-3);
                let (from, to) = (low / 1.4, high.max(low) * 1.4);
                let (first, last) = (from.log10().ceil(), to.log10().floor());
                // Powers of ten have labels; there should be two at least.
                if last > first { from..to } else { 10f64.powf(first - 1.0)..10f64.powf(last + 1.0) }
            }
        }
    }
}

/// A number short enough for an axis: 1,500 as 1.5 k.
fn tick(value: f64) -> String {
    let mut text = String::new();
    let (scaled, suffix) = match value.abs() {
        v if v >= 1.0e6 => (value / 1.0e6, " M"),
        v if v >= 1.0e3 => (value / 1.0e3, " k"),
        _ => (value, ""),
    };
    // Three significant digits, without trailing zeros; writing to a string does not fail.
    let rounded = format!("{scaled:.2}");
    let short =
        if rounded.contains('.') { rounded.trim_end_matches('0').trim_end_matches('.') } else { &rounded };
    let _ = write!(text, "{short}{suffix}");
    text
}

/// Without what the style of the page says once, and without line ends.
fn compact(svg: &str) -> String {
    let usual = [
        " opacity=\"1\"",
        " stroke-width=\"1\"",
        " font-family=\"sans-serif\"",
        " width=\"960\" height=\"420\"",
        " xmlns=\"http://www.w3.org/2000/svg\"",
    ];
    let mut compact = svg.replace(" \"/>", "\"/>").replace('\n', "");
    for attribute in usual {
        compact = compact.replace(attribute, "");
    }
    compact
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decade_has_three_labels() {
        let labels =
            |axis: Axis, scale: f64| (1..=10).map(|i| axis.label(f64::from(i) * scale)).collect::<Vec<_>>();
        assert_eq!(labels(Axis::Log("µs"), 1.0e3), ["1 k", "2 k", "", "", "5 k", "", "", "", "", "10 k"]);
        assert_eq!(labels(Axis::Log("µs"), 0.1), ["0.1", "0.2", "", "", "0.5", "", "", "", "", "1"]);
        assert!(labels(Axis::Linear("frame"), 1.0e3).iter().all(|label| !label.is_empty()));
        assert_eq!(Axis::Linear("frame").label(0.0), "0");
    }

    #[test]
    fn an_axis_has_labels() {
        for (low, high) in
            [(18.0, 35.0), (9.0, 11.0), (5.0, 5.0), (0.2, 4_000.0), (1.0e-9, 1.0e-9), (10.0, 10.0)]
        {
            let Range { start, end } = Axis::Log("µs").range([low, high].into_iter());
            let powers =
                (-4..9).map(|i| 10f64.powi(i) * 1.000_001).filter(|p| (start..=end * 1.000_01).contains(p));
            assert!(powers.count() >= 2, "{low} to {high}: {start} to {end}");
            assert!(start <= low.max(1.0e-3) && high <= end);
        }
    }
}
