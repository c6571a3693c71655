use super::{Axis, Chart, Line, grouped};
use crate::{
    bench::{Flight, FlightFrame, estimate::quantile},
    report::{GREEN, INK, LineStyle, ORANGE, VERMILION},
};

/// The looks of the lines of a flight, which stand for no structure.
const NO_CULLING: LineStyle = LineStyle::plain(INK);
const FRUSTUM: LineStyle = LineStyle::plain(ORANGE);
const BOTH: LineStyle = LineStyle::plain(GREEN);

/// The paper's figure 20, and where culling by occlusion pays.
pub(in crate::bench) fn flight_charts(flight: &Flight) -> Vec<Chart> {
    let series = |value: &dyn Fn(usize) -> f64| {
        let values: Vec<(f64, f64)> = (0..flight.frames.len()).map(|i| (i as f64, value(i))).collect();
        grouped(&values).0
    };
    let frames = &flight.frames;
    let us = |ns: u64| ns as f64 / 1000.0;
    let title = |what: &str| format!("{}, flight ({}): {what}", flight.recording, flight.camera);
    let slower = frames.iter().filter(|frame| frame.both_ns > frame.frustum_ns).count();
    let paper = "The paper (figure 20): frustum culling gains where polygons are out of view; with occlusion culling nearly all \
                 of the flight is faster, but parts are slower, because what is computed exceeds what is saved.";
    let break_even = match flight.break_even_ns_per_polygon {
        Some(ns) => format!(
            "Here: occlusion culling saves {:.1} polygons a frame and costs {:.1} µs; it pays where drawing a polygon costs \
             more than {ns:.1} ns.",
            flight.in_view - flight.drawn,
            flight.both_us.median - flight.frustum_us.median
        ),
        None => "Here: nothing in view is hidden by the chosen occluders; occlusion culling cannot pay."
            .to_owned(),
    };
    let saved = |frame: &FlightFrame| {
        let saved = frame.in_view.saturating_sub(frame.drawn);
        // Below a tenth of a nanosecond it pays whatever is drawn.
        (saved > 0).then(|| (frame.both_ns.saturating_sub(frame.frustum_ns) as f64 / saved as f64).max(0.1))
    };
    let points = frames.iter().enumerate().filter_map(|(i, frame)| Some((i as f64, saved(frame)?)));
    let break_even_ns: Vec<(f64, f64)> = points.collect();
    let mut sorted: Vec<f64> = break_even_ns.iter().map(|point| point.1).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    vec![
        Chart {
            title: title("polygons to draw"),
            remarks: vec![paper.to_owned(), break_even],
            x: Axis::Linear("frame"),
            y: Axis::Linear("polygons a frame"),
            lines: vec![
                Line::new("no culling", NO_CULLING, series(&|_| flight.polygons as f64)),
                Line::new("frustum", FRUSTUM, series(&|i| frames[i].in_view as f64)),
                Line::new("frustum and occlusion", BOTH, series(&|i| frames[i].drawn as f64)),
            ],
        },
        Chart {
            title: title("time of culling"),
            remarks: vec![format!("Culling by both took longer in {slower} of {} frames.", frames.len())],
            x: Axis::Linear("frame"),
            y: Axis::Log("µs"),
            lines: vec![
                Line::new("frustum", FRUSTUM, series(&|i| us(frames[i].frustum_ns))),
                Line::new("frustum and occlusion", BOTH, series(&|i| us(frames[i].both_ns))),
            ],
        },
        Chart {
            title: title("break-even of occlusion culling"),
            remarks: vec![format!(
                "Above the line drawing a polygon costs more than occlusion culling does for each polygon that it saves. It saves \
                 some in {} of {} frames; the line's median is {:.1} ns.",
                break_even_ns.len(),
                frames.len(),
                quantile(&sorted, 0.5)
            )],
            x: Axis::Linear("frame"),
            y: Axis::Log("ns for drawing a polygon"),
            lines: vec![Line::new("break-even", LineStyle::plain(VERMILION), break_even_ns)],
        },
    ]
}
