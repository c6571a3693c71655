//! The report as one HTML page that needs no other file and no network.

mod html;

use std::error::Error;

use self::html::Html;
use super::{
    BenchReport, SessionResult,
    charts::{flight_charts, growth_charts, session_charts},
    moving,
    paper::{charts as paper_charts, notes, tables},
    rays::show,
    table::{best_grid, flight_grid, growth_grid, session_grid},
    verdict::{clock_note, verdict},
};
use crate::report::{css_variables, one_line, short, thousands};

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const UPLOT_LICENSE: &str = include_str!("uplot/LICENSE");

type Written = Result<(), Box<dyn Error>>;

/// The report as one HTML page that needs no other file: the verdict, the contents, and a chapter for each part with its tables
/// (sorted by a click on a head) and its charts (values under the pointer, lines shown and hidden). Without scripts the
/// tables are best first and the charts are pictures.
///
/// # Errors
/// A chart cannot be drawn.
pub fn page(report: &BenchReport) -> Result<String, Box<dyn Error>> {
    let mut chapters = Html::default();
    for session in &report.sessions {
        session_chapter(&mut chapters, session, &report.reference)?;
    }
    if report.sessions.len() > 1 {
        chapters.chapter(&format!("All sessions: {} beside the fastest of the others", report.reference));
        chapters.paragraph(&format!("Frame by frame, median; below 1, {} is faster.", report.reference));
        chapters.table("All sessions", &best_grid(&report.sessions, &report.reference));
        chapters.end_chapter();
    }
    growth_chapter(&mut chapters, report)?;
    flight_chapter(&mut chapters, report)?;
    rays_chapters(&mut chapters, report)?;
    moving_chapters(&mut chapters, report)?;
    paper_chapters(&mut chapters, report)?;
    method_chapter(&mut chapters, report);
    let (contents, chapters, sheet) = chapters.finish();

    let [light, dark] = css_variables();
    let mut page = Html::default();
    page.raw("<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">");
    page.raw("<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>");
    page.text(&title(report));
    page.raw("</title><style>");
    page.raw(UPLOT_STYLE);
    // The colours of the dark theme come before paper, which is always white.
    page.raw(&format!(
        ":root{{{light}}}@media (prefers-color-scheme:dark){{:root{{{dark}}}}}@media print{{:root{{{light}}}}}"
    ));
    page.raw(STYLE);
    page.raw("</style></head><body><header>");
    page.heading(1, "top", &title(report));
    page.raw("</header><section id=\"verdict\">");
    page.heading(2, "the-verdict", "Verdict");
    let verdict = verdict(report);
    if verdict.is_empty() {
        page.paragraph("There is nothing to compare: one structure was measured, or none.");
    }
    for (at, line) in verdict.iter().enumerate() {
        page.element(if at == 0 { "<p class=\"first\">" } else { "<p>" }, line, "</p>");
    }
    page.paragraph(
        "Computed from the rows below: times of a frame (insertion and culling; nothing is drawn), frame by frame, medians; of rays and neighbours: times of queries.",
    );
    page.raw("</section><nav id=\"contents\" aria-label=\"Contents\">");
    page.heading(2, "the-contents", "Contents");
    page.raw(&contents);
    page.raw("</nav><main>");
    page.raw(&chapters);
    page.raw("</main>");
    if !sheet.is_empty() {
        page.raw("<script type=\"application/json\" id=\"chart-data\">");
        page.raw(&sheet.to_json());
        page.raw("</script><script>/*\n");
        page.raw(UPLOT_LICENSE);
        page.raw("*/\n");
        page.raw(UPLOT);
        page.raw("</script>");
    }
    page.raw("<script>");
    page.raw(SCRIPT);
    page.raw("</script></body></html>\n");
    Ok(page.into_text())
}

fn title(report: &BenchReport) -> String {
    match &report.sessions[..] {
        [] => "osp bench".to_owned(),
        [session] => format!("osp bench: {}", one_line(&session.recording)),
        sessions => format!("osp bench: {} sessions", sessions.len()),
    }
}

fn method_chapter(page: &mut Html, report: &BenchReport) {
    page.chapter("How it was measured");
    page.paragraph(&report.machine.text());
    page.element("<p>Made by <code>", &report.command, "</code></p>");
    // The paper's chapter says itself what its frames are.
    if !report.sessions.is_empty() || !report.growth.is_empty() {
        page.paragraph(&format!(
            "All structures were measured in turns within one process, frame by frame. Intervals hold the median in 95 of 100 \
             cases. A ratio compares a frame with the same frame of {reference}; above 1 the structure is slower. It is the \
             median of the frames' ratios, and the two times beside it are medians of the same frames. A frame is insertion and \
             culling: nothing is drawn.",
            reference = report.reference
        ));
        page.paragraph(&clock_note(report));
    }
    page.end_chapter();
}

fn session_chapter(page: &mut Html, session: &SessionResult, reference: &str) -> Written {
    page.chapter(&format!(
        "{}: {} polygons, {} frames ({}, camera {})",
        one_line(&session.recording),
        thousands(session.polygons),
        thousands(session.frames),
        session.pace,
        session.camera
    ));
    page.paragraph(if session.indexes_agree {
        "All indexes saw the same polygons in every frame that they were measured on."
    } else {
        "NOT ALL INDEXES SAW THE SAME POLYGONS: the figures compare different work."
    });
    page.paragraph(&format!(
        "Best first. An index that is slow was measured on fewer frames; the column before the ratio has the median of the same \
         frames of {reference}."
    ));
    page.table(&session.recording, &session_grid(session));
    for chart in session_charts(session) {
        page.chart(&chart)?;
    }
    page.end_chapter();
    Ok(())
}

fn growth_chapter(page: &mut Html, report: &BenchReport) -> Written {
    let rows = &report.growth;
    if rows.is_empty() {
        return Ok(());
    }
    page.chapter("Growth: a synthetic session of loose strokes in a 4 m cube");
    page.paragraph(
        "Frame: inserts a batch and culls from inside; still: inserts nothing; all in view: the same from outside. Best first; \
         the column before a ratio has the reference's time for the same frames.",
    );
    let mut sizes: Vec<u32> = rows.iter().map(|row| row.polygons).collect();
    sizes.sort_unstable();
    sizes.dedup();
    for size in sizes {
        let about = format!("{} polygons", thousands(u64::from(size)));
        page.subheading(&about);
        page.table(&about, &growth_grid(rows.iter().filter(|row| row.polygons == size)));
    }
    for skipped in &report.skipped {
        page.paragraph(&format!(
            "{} was left out at {} polygons: filling it and drawing three frames takes about {} s.",
            skipped.index,
            thousands(u64::from(skipped.polygons)),
            short(skipped.expected_secs)
        ));
    }
    for chart in growth_charts(rows, &report.reference) {
        page.chart(&chart)?;
    }
    page.end_chapter();
    Ok(())
}

fn flight_chapter(page: &mut Html, report: &BenchReport) -> Written {
    if report.flights.is_empty() {
        return Ok(());
    }
    page.chapter("Flight through the finished models");
    page.table("Flight", &flight_grid(&report.flights));
    for chart in report.flights.iter().flat_map(flight_charts) {
        page.chart(&chart)?;
    }
    page.end_chapter();
    Ok(())
}

fn rays_chapters(page: &mut Html, report: &BenchReport) -> Written {
    for result in &report.rays {
        page.chapter(&show::heading(result));
        page.paragraph(&show::legend(&report.reference));
        page.table("Times of queries", &show::times(result));
        page.paragraph(show::WALKS);
        page.table("Work of queries", &show::walks(result));
        if !result.moved.is_empty() {
            page.paragraph(show::MOVED);
            page.table("Refit against rebuild", &show::moved(result));
        }
        for remark in show::remarks(result, &report.reference) {
            page.paragraph(&remark);
        }
        page.chart(&show::decay(result))?;
        page.end_chapter();
    }
    let by_size = show::charts_by_size(&report.rays, &report.reference);
    if !by_size.is_empty() {
        page.chapter("Rays, ranges and neighbours: as the synthetic session grows");
        for chart in by_size {
            page.chart(&chart)?;
        }
        page.end_chapter();
    }
    Ok(())
}

fn moving_chapters(page: &mut Html, report: &BenchReport) -> Written {
    for result in &report.moving {
        page.chapter(&moving::show::heading(result, &report.reference));
        for (about, grid) in moving::show::tables(result) {
            page.paragraph(&about);
            page.table(&about, &grid);
        }
        for remark in moving::show::remarks(result, &report.reference) {
            page.paragraph(&remark);
        }
        for chart in moving::show::charts(result, &report.reference) {
            page.chart(&chart)?;
        }
        page.end_chapter();
    }
    Ok(())
}

fn paper_chapters(page: &mut Html, report: &BenchReport) -> Written {
    for paper in &report.paper {
        page.chapter(&format!("The paper, as it is printed: {}", one_line(&paper.recording)));
        notes(paper).iter().for_each(|note| page.paragraph(note));
        for (title, grid) in tables(paper) {
            page.subheading(&title);
            page.table(&title, &grid);
        }
        for chart in paper_charts(paper) {
            page.chart(&chart)?;
        }
        page.end_chapter();
    }
    Ok(())
}
