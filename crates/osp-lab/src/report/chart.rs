use std::{collections::BTreeSet, io};

use plotters::prelude::*;

use super::{
    ReplayReport,
    numbers::thousands,
    palette::{LineStyle, SAMPLE_PIXELS},
    picture::{Area, Backend, ChartFormat, Drawn, Picture, encode},
    printable::one_line,
    run::{Measured, RunReport},
};

const SIZE: (u32, u32) = (1280, 720);
/// Width of a median's curve, pixels.
const LINE_PIXELS: u32 = 3;
/// Largest number of points of a curve. Frames are divided into this many groups, and the median of each group is
/// drawn.
const GROUPS: u64 = 400;

/// Draws the frame times over the session, a curve for each index on a logarithmic scale, with the number of polygons
/// on the right-hand axis. Returns the bytes of the picture's file, or `None` if no frame was measured.
///
/// # Errors
/// The picture cannot be drawn.
pub fn draw_frame_times(report: &ReplayReport, format: ChartFormat) -> io::Result<Option<Vec<u8>>> {
    let is_empty = report.runs.iter().all(|run| run.curve().is_empty());
    (!is_empty).then(|| encode(&FrameTimes(report), format, SIZE)).transpose()
}

struct FrameTimes<'a>(&'a ReplayReport);

impl Picture for FrameTimes<'_> {
    fn draw_on<B: Backend>(&self, area: &Area<B>) -> Drawn {
        draw(self.0, area)
    }
}

struct Group {
    frame: f64,
    median_us: f64,
    max_us: f64,
}

fn groups(run: &RunReport, frames: u64) -> Vec<Group> {
    let width = frames.div_ceil(GROUPS).max(1);
    run.curve()
        .chunk_by(|a, b| a.frame / width == b.frame / width)
        .map(|chunk: &[Measured]| {
            let mut times: Vec<u64> = chunk.iter().map(|p| p.total_ns.max(1)).collect();
            times.sort_unstable();
            let us = |ns: u64| ns as f64 / 1000.0;
            Group {
                frame: chunk[chunk.len() / 2].frame as f64,
                median_us: us(times[(times.len() - 1) / 2]),
                max_us: us(times[times.len() - 1]),
            }
        })
        .collect()
}

/// Styles of the runs: a structure has the same style in all charts. If runs have occlusion culling, each combination
/// of structure and method has its own style.
fn styles(runs: &[RunReport]) -> Vec<LineStyle> {
    let style = |run: &RunReport| {
        let Some(occlusion) = &run.occlusion else { return LineStyle::of_structure(&run.index) };
        LineStyle::of_method(&run.index, number_of(&run.index, runs), occlusion.method)
    };
    runs.iter().map(style).collect()
}

/// Index of the run's structure among the structures of the runs.
fn number_of(index: &str, runs: &[RunReport]) -> usize {
    let before = runs.iter().take_while(|run| run.index != index);
    before.map(|run| &run.index).collect::<BTreeSet<_>>().len()
}

fn draw<B: Backend>(report: &ReplayReport, area: &Area<B>) -> Drawn {
    area.fill(&WHITE)?;
    let curves: Vec<Vec<Group>> = report.runs.iter().map(|run| groups(run, report.frames)).collect();
    let all = || curves.iter().flatten();
    let lowest = all().map(|g| g.median_us).fold(f64::INFINITY, f64::min);
    let highest = all().map(|g| g.max_us).fold(0.0, f64::max);
    let polygons = report.runs.iter().max_by_key(|run| run.curve().len());
    let most = polygons.and_then(|run| run.curve().iter().map(|p| p.polygons).max()).unwrap_or(0).max(1);
    let frames = 0.0..report.frames.max(1) as f64;

    let mut chart = ChartBuilder::on(area)
        .caption(format!("{}: time of a frame", one_line(&report.recording)), ("sans-serif", 26))
        .margin(16)
        .x_label_area_size(48)
        .y_label_area_size(80)
        .right_y_label_area_size(90)
        .build_cartesian_2d(frames.clone(), (lowest * 0.6..highest * 1.8).log_scale())?
        .set_secondary_coord(frames, 0.0..most as f64 * 1.05);
    let whole = |x: &f64| thousands(x.round().max(0.0) as u64);
    let tick = |us: &f64| match *us {
        us if us >= 1.0e6 => format!("{} s", us / 1.0e6),
        us if us >= 1.0e3 => format!("{} ms", us / 1.0e3),
        us => format!("{us} µs"),
    };
    let occludes = report.runs.iter().any(|run| run.occlusion.is_some());
    let what = match occludes {
        true => "insert + cull + occlusion (median line, slowest frame thin)",
        false => "insert + cull (median line, slowest frame thin)",
    };
    chart
        .configure_mesh()
        .light_line_style(RGBColor(240, 240, 240))
        .bold_line_style(RGBColor(220, 220, 220))
        .x_desc("frame")
        .y_desc(what)
        .x_label_formatter(&whole)
        .y_label_formatter(&tick)
        .label_style(("sans-serif", 16))
        .axis_desc_style(("sans-serif", 18))
        .draw()?;
    chart
        .configure_secondary_axes()
        .y_desc("polygons")
        .y_label_formatter(&whole)
        .label_style(("sans-serif", 16))
        .axis_desc_style(("sans-serif", 18))
        .draw()?;

    if let Some(run) = polygons {
        let step = (run.curve().len() / GROUPS as usize).max(1);
        let area = AreaSeries::new(
            run.curve().iter().step_by(step).map(|p| (p.frame as f64, p.polygons as f64)),
            0.0,
            RGBColor(150, 150, 150).mix(0.15),
        );
        chart.draw_secondary_series(area)?.label("polygons (right)").legend(|(x, y)| {
            Rectangle::new(
                [(x, y - 5), (x + SAMPLE_PIXELS, y + 5)],
                RGBColor(150, 150, 150).mix(0.3).filled(),
            )
        });
    }
    let styles = styles(&report.runs);
    for (style, curve) in styles.iter().zip(&curves) {
        chart.draw_series(LineSeries::new(curve.iter().map(|g| (g.frame, g.max_us)), style.faint()))?;
    }
    // The first curve is drawn last, so that it is on top.
    for (&style, curve) in styles.iter().zip(&curves).rev() {
        let points: Vec<_> = curve.iter().map(|g| (g.frame, g.median_us)).collect();
        style.draw(&mut chart, &points, LINE_PIXELS)?;
    }
    for (run, style) in report.runs.iter().zip(styles) {
        let nothing: [PathElement<(f64, f64)>; 0] = [];
        chart.draw_series(nothing)?.label(run.name()).legend(move |at| style.sample(at, LINE_PIXELS));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(200, 200, 200))
        .legend_area_size(SAMPLE_PIXELS + 8)
        .label_font(("sans-serif", 18))
        .draw()?;
    area.present()?;
    Ok(())
}
