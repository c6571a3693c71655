//! `osp info`: what a session holds.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::{
    Outcome,
    output::{complain, one_line, say},
    reading::ReadArgs,
    session::OpenSession,
};
use crate::{
    lab::report::thousands,
    recording::Pace,
    replay::{Summary, summarize},
};

/// Say what a session holds: strokes, points, polygons, what was erased, how long it took, the model's bounds, and what
/// was dropped and why.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp info recordings/room.ron
  osp info sketch.tilt --json")]
pub(super) struct InfoArgs {
    /// The session: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj or .obj.gz.
    file: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: ReadArgs,
}

#[derive(Serialize)]
struct JsonInfo<'a> {
    recording: String,
    format: &'a str,
    name: &'a str,
    source: &'a str,
    strokes: u64,
    points: u64,
    polygons: u64,
    polygons_visible_at_end: u64,
    erased: u64,
    erase_events: u64,
    undo_redo_events: u64,
    move_events: u64,
    head_poses: u64,
    duration_secs: f64,
    backward_time_steps: u64,
    bounds_m: Option<[[f32; 3]; 2]>,
    dropped: JsonDropped,
    skipped: u64,
    warnings: &'a [String],
}

#[derive(Serialize)]
struct JsonDropped {
    zero_length: u64,
    degenerate: u64,
    out_of_range: u64,
    excess_corners: u64,
    ignored_events: u64,
}

pub(super) fn run(args: &InfoArgs) -> anyhow::Result<Outcome> {
    let mut session = OpenSession::open(&args.file, &args.reading)?;
    let (summary, _, outcome) = summarize(&mut session, Pace::Samples(1));
    for warning in &session.notes().warnings {
        complain(&format!("warning: {warning}"));
    }
    if args.json {
        say(&json(args, &session, &summary)?)?;
    } else {
        say(&text(args, &session, &summary))?;
    }
    // What was read is shown all the same.
    outcome?;
    Ok(Outcome::Done)
}

fn duration_secs(summary: &Summary) -> f64 {
    summary.time_span_secs.map_or(0.0, |(first, last)| last - first)
}

fn json(args: &InfoArgs, session: &OpenSession, s: &Summary) -> anyhow::Result<String> {
    let counts = s.counts;
    let info = JsonInfo {
        recording: args.file.display().to_string(),
        format: session.format,
        name: &session.header.name,
        source: &session.header.source,
        strokes: counts.strokes,
        points: counts.points,
        polygons: counts.polygons,
        polygons_visible_at_end: counts.visible,
        erased: counts.erased_strokes,
        erase_events: s.erases,
        undo_redo_events: s.undos,
        move_events: s.moves,
        head_poses: s.heads,
        duration_secs: duration_secs(s),
        backward_time_steps: s.backward_steps,
        bounds_m: (!s.bounds.is_empty()).then(|| [s.bounds.min.to_array(), s.bounds.max.to_array()]),
        dropped: JsonDropped {
            zero_length: counts.drops.zero_length,
            degenerate: counts.drops.degenerate,
            out_of_range: counts.drops.out_of_range,
            excess_corners: counts.drops.excess_corners,
            ignored_events: counts.ignored_events,
        },
        skipped: session.notes().skipped,
        warnings: &session.notes().warnings,
    };
    Ok(serde_json::to_string(&info)?)
}

fn text(args: &InfoArgs, session: &OpenSession, s: &Summary) -> String {
    let counts = s.counts;
    let mut lines = vec![one_line(&args.file.to_string_lossy()).into_owned()];
    let mut line = |name: &str, value: String| lines.push(format!("  {name:<11} {value}"));
    line("format", session.format.to_owned());
    if !session.header.name.is_empty() {
        line("name", one_line(&session.header.name).into_owned());
    }
    if !session.header.source.is_empty() {
        line("source", one_line(&session.header.source).into_owned());
    }
    line(
        "strokes",
        format!("{} ({} erased at the end)", thousands(counts.strokes), thousands(counts.erased_strokes)),
    );
    line("points", thousands(counts.points));
    line(
        "polygons",
        format!("{} ({} in the model at the end)", thousands(counts.polygons), thousands(counts.visible)),
    );
    line(
        "edits",
        format!(
            "{} erase, {} undo or redo, {} move or group",
            thousands(s.erases),
            thousands(s.undos),
            thousands(s.moves)
        ),
    );
    line("head poses", thousands(s.heads));
    let backward = match s.backward_steps {
        0 => String::new(),
        n => format!(" (time runs backwards {} times)", thousands(n)),
    };
    line("duration", format!("{:.1} s{backward}", duration_secs(s)));
    if s.bounds.is_empty() {
        line("bounds", "none: there is no polygon".to_owned());
    } else {
        let (min, size) = (s.bounds.min, s.bounds.extent());
        line(
            "bounds",
            format!(
                "{:.4} x {:.4} x {:.4} m, from ({:.4}, {:.4}, {:.4})",
                size.x, size.y, size.z, min.x, min.y, min.z
            ),
        );
    }
    let drops = counts.drops;
    line(
        "dropped",
        format!(
            "{} segments of length zero, {} polygons without area, {} out of range, {} surplus corners; {} events ignored",
            thousands(drops.zero_length),
            thousands(drops.degenerate),
            thousands(drops.out_of_range),
            thousands(drops.excess_corners),
            thousands(counts.ignored_events)
        ),
    );
    if session.notes().skipped > 0 {
        line("skipped", format!("{} damaged pieces", thousands(session.notes().skipped)));
    }
    lines.join("\n")
}
