//! Figures of many sessions against their size: a faint dot a session, and a line through the medians of sessions of like
//! size.

use std::{collections::BTreeMap, error::Error};

use plotters::{coord::Shift, prelude::*};

use super::{
    ChartFormat, chart::register_font, palette::LineStyle, picture::Picture, picture::encode, thousands,
};

/// Size of a chart, pixels.
const SIZE: (u32, u32) = (960, 460);
/// Groups of sessions of like size from one size to ten times it.
const GROUPS_OF_A_DECADE: f64 = 3.0;
const LINE_PIXELS: u32 = 2;
/// Dots of a line at most: of more, evenly spaced ones are drawn.
const DOTS: usize = 2000;

/// A structure with its look and its points, as (size, figure).
pub(crate) type Dots = (String, LineStyle, Vec<(f64, f64)>);

/// A chart of figures against sizes, both on logarithmic scales.
#[derive(Clone, Debug)]
pub(crate) struct Scatter {
    /// What lies below, and beside.
    pub(crate) axes: [&'static str; 2],
    /// The structures; what is not above 0 is left out.
    pub(crate) lines: Vec<Dots>,
}

impl Scatter {
    /// The points that a logarithmic scale has.
    fn points(&self) -> impl Iterator<Item = (&str, LineStyle, Vec<(f64, f64)>)> {
        self.lines.iter().map(|(name, style, points)| {
            let is_drawn = |(x, y): &&(f64, f64)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite();
            (name.as_str(), *style, points.iter().filter(is_drawn).copied().collect())
        })
    }

    /// Whether there is nothing to draw.
    pub(crate) fn is_empty(&self) -> bool {
        self.points().all(|(.., points)| points.is_empty())
    }

    /// The chart as SVG.
    pub(crate) fn svg(&self) -> Result<String, Box<dyn Error>> {
        register_font();
        Ok(String::from_utf8(encode(self, ChartFormat::Svg, SIZE)?)?)
    }
}

/// The medians of points of like size.
fn medians(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut groups: BTreeMap<i64, Vec<(f64, f64)>> = BTreeMap::new();
    for &(x, y) in points {
        groups.entry((x.log10() * GROUPS_OF_A_DECADE).floor() as i64).or_default().push((x, y));
    }
    let median = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let middle = |group: &Vec<(f64, f64)>| {
        let (xs, ys) = group.iter().copied().unzip();
        (median(xs), median(ys))
    };
    groups.values().map(middle).collect()
}

impl Picture for Scatter {
    fn draw_on<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<(), Box<dyn Error>>
    where
        B::ErrorType: 'static,
    {
        area.fill(&WHITE)?;
        let lines: Vec<_> = self.points().filter(|(.., points)| !points.is_empty()).collect();
        let all = || lines.iter().flat_map(|(.., points)| points);
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::INFINITY, 0.0), |(low, high), v| (v.min(low), v.max(high)));
            low * 0.7..high * 1.4
        };
        let (x, y) = (range(&mut all().map(|p| p.0)), range(&mut all().map(|p| p.1)));
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(84)
            .build_cartesian_2d(x.log_scale(), y.log_scale())?;
        let tick = |v: &f64| if *v >= 1.0 { thousands(v.round() as u64) } else { format!("{v}") };
        chart
            .configure_mesh()
            .light_line_style(RGBColor(240, 240, 240))
            .bold_line_style(RGBColor(220, 220, 220))
            .x_desc(self.axes[0])
            .y_desc(self.axes[1])
            .x_label_formatter(&tick)
            .y_label_formatter(&tick)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 15))
            .draw()?;
        for (_, style, points) in &lines {
            let dot = style.faint().filled();
            let step = points.len().div_ceil(DOTS).max(1);
            chart.draw_series(points.iter().step_by(step).map(|&point| Circle::new(point, 3, dot)))?;
        }
        // The first line lies on top.
        for (_, style, points) in lines.iter().rev() {
            style.draw(&mut chart, &medians(points), LINE_PIXELS)?;
        }
        for &(name, style, _) in &lines {
            let nothing: [PathElement<(f64, f64)>; 0] = [];
            chart.draw_series(nothing)?.label(name).legend(move |at| style.sample(at, LINE_PIXELS));
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(RGBColor(200, 200, 200))
            .legend_area_size(super::palette::SAMPLE_PIXELS + 8)
            .label_font(("sans-serif", 14))
            .draw()?;
        area.present()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_through_the_medians_of_sessions_of_like_size() {
        let points = [(100.0, 1.0), (110.0, 2.0), (120.0, 9.0), (1e4, 5.0)];
        assert_eq!(medians(&points), [(110.0, 2.0), (1e4, 5.0)]);
    }

    #[test]
    fn what_has_no_logarithm_is_not_drawn() {
        let of = |points: Vec<(f64, f64)>| Scatter {
            axes: ["x", "y"],
            lines: vec![("osp".to_owned(), LineStyle::of_structure("osp"), points)],
        };
        assert!(of(vec![(0.0, 1.0), (1.0, 0.0), (f64::NAN, 1.0)]).is_empty());
        let one = of(vec![(0.0, 1.0), (10.0, 3.0)]).svg().expect("drawn");
        assert!(one.starts_with("<svg") && one.contains("osp"), "{one}");
    }
}
