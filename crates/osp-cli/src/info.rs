//! `osp info`: prints the contents of a session.

use std::{collections::BTreeSet, path::PathBuf};

use clap::Args;
use serde::Serialize;

use super::{
    author_rows::{self, AuthorRow, AuthorRows},
    brush_rows::{self, BrushRow, Plain},
    cost::Cost,
    output::{Outcome, one_line, print_result},
    read_session::{Keep, ReadSession},
    reading::ReadArgs,
    session::OpenSession,
};
use osp::math::Aabb;
use osp_lab::report::thousands;
use osp_session::{
    recording::{Environment, Event, Header, Layer, Pace},
    replay::{Summary, still_view},
    scene::{GroupNode, Scene},
};

/// Print the contents of a session.
///
/// The command prints strokes, points, polygons, erased strokes, duration and bounds. It also prints the number of rejected samples and polygons, with reasons. Then it prints authors, groups,
/// brushes, light, layers, and the parts of the file that osp does not show.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp info recordings/room.ron
  osp info sketch.tilt --json
  osp info sketch.tilt --cost
  osp info sketch.tilt --cost --budget-triangles 300000")]
pub(super) struct InfoArgs {
    /// The session: .ron, .ron.zst, .tilt, .apa, CASSIE .json, .poses, .obj, .obj.gz, .glb or .gltf.
    file: PathBuf,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Also print the parts of the sketch that cost most to draw. These are triangles and vertices of each brush,
    /// blended paint, and the strokes with the most triangles. Blended paint is measured as the average number of
    /// layers over a pixel of the artist's view; each layer is shaded.
    #[arg(long)]
    cost: bool,
    /// Number of triangles that a headset may draw in a frame. The default is the lower number of Meta's guidelines for
    /// Quest 2, 750,000 to 1,000,000.
    #[arg(long, value_name = "N", requires = "cost", default_value_t = 750_000, value_parser = clap::value_parser!(u64).range(1..))]
    budget_triangles: u64,
    #[command(flatten)]
    reading: ReadArgs,
}

/// Largest number of layers in the text, and of lines `not shown`.
const MOST_LISTED: usize = 20;

/// Largest number of groups that the text lists.
const MOST_GROUPS: usize = 100;

#[derive(Serialize)]
struct JsonInfo<'a> {
    recording: String,
    format: &'a str,
    name: &'a str,
    source: &'a str,
    /// All strokes that were drawn, including erased ones.
    strokes: u64,
    /// Strokes that are neither erased nor undone. Equals the sum over `brushes`, except for imported models: `brushes`
    /// does not count their strokes.
    strokes_at_end: u64,
    points: u64,
    polygons: u64,
    polygons_visible_at_end: u64,
    polygons_hidden_at_end: u64,
    polygons_without_area: u64,
    erased: u64,
    erase_events: u64,
    undo_redo_events: u64,
    move_events: u64,
    head_poses: u64,
    duration_secs: f64,
    backward_time_steps: u64,
    bounds_m: Option<[[f32; 3]; 2]>,
    dropped: JsonDropped,
    brushes: &'a [BrushRow],
    environment: Option<&'a Environment>,
    layers: &'a [Layer],
    left_out: &'a [String],
    #[serde(skip_serializing_if = "Vec::is_empty")]
    groups: Vec<JsonGroup>,
    /// Number of animation frames of Open Brush that have strokes.
    #[serde(skip_serializing_if = "Option::is_none")]
    animation_frames: Option<usize>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    authors: &'a [AuthorRow],
    skipped: u64,
    warnings: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    cost: Option<&'a Cost>,
}

#[derive(Serialize)]
struct JsonDropped {
    zero_length: u64,
    degenerate: u64,
    out_of_range: u64,
    excess_corners: u64,
    ignored_events: u64,
}

#[derive(Serialize)]
struct JsonGroup {
    group: u32,
    name: Option<String>,
    parent: Option<u32>,
    strokes: u64,
    polygons: u64,
    bounds_m: Option<[[f32; 3]; 2]>,
}

impl JsonGroup {
    fn of(node: &GroupNode) -> Self {
        Self {
            group: node.id.0,
            name: node.name.clone(),
            parent: node.parent.map(|parent| parent.0),
            strokes: node.strokes,
            polygons: node.polygons,
            bounds_m: corners(&node.bounds),
        }
    }
}

fn corners(bounds: &Aabb) -> Option<[[f32; 3]; 2]> {
    (!bounds.is_empty()).then(|| [bounds.min.to_array(), bounds.max.to_array()])
}

struct Contents {
    summary: Summary,
    tally: PolygonTally,
    brushes: Vec<BrushRow>,
    groups: Vec<GroupNode>,
    authors: Vec<AuthorRow>,
    /// Number of animation frames with strokes, if there are several.
    frames: Option<usize>,
    cost: Option<Cost>,
}

pub(super) fn run(args: &InfoArgs) -> anyhow::Result<Outcome> {
    let mut session = OpenSession::open(&args.file, &args.reading)?.counted();
    let (mut plain, mut authors, mut frames) = (Plain::default(), AuthorRows::default(), BTreeSet::new());
    let header = session.header.clone();
    let events = session.by_ref().inspect(|event| {
        if let Ok(event) = event {
            plain.note(event);
            authors.note(event);
            if let Event::Begin { paint: Some(paint), .. } = event {
                frames.extend(paint.sketch_extensions.as_ref().and_then(|extensions| extensions.frame()));
            }
        }
    });
    let (read_session, outcome) = ReadSession::of(header, events, Pace::Samples(1), Keep::Model, |_, _| {});
    let ReadSession { header, summary, end, direction_to_artist, .. } = read_session;
    let mut scene = end.scene;
    let cost = args.cost.then(|| {
        let view = still_view(&scene, &summary.bounds, header.camera, direction_to_artist, 1.0);
        Cost::of(&scene, &view, args.budget_triangles)
    });
    let (brushes, tally) = (plain.rows(&scene), PolygonTally::of(&scene));
    let (groups, authors) = (scene.group_tree(), authors.finish());
    session.warn();
    let frames = Some(frames.len()).filter(|count| *count > 1);
    let contents = Contents { summary, tally, brushes, groups, authors, frames, cost };
    if args.json {
        print_result(&json(args, &session, &contents)?)?;
    } else {
        print_result(&text(args, &session, &contents))?;
    }
    // Prints the readable part of a damaged session before the error.
    outcome?;
    Ok(Outcome::Done)
}

fn duration_secs(summary: &Summary) -> f64 {
    summary.time_span_secs.map_or(0.0, |(first, last)| last - first)
}

fn json(args: &InfoArgs, session: &OpenSession, contents: &Contents) -> anyhow::Result<String> {
    let Contents { summary: s, tally, brushes, groups, authors, frames, cost } = contents;
    let (counts, header) = (s.counts, &session.header);
    let info = JsonInfo {
        recording: args.file.display().to_string(),
        format: session.format,
        name: &session.header.name,
        source: &session.header.source,
        strokes: counts.strokes,
        strokes_at_end: at_end(brushes, s),
        points: counts.points,
        polygons: counts.polygons,
        polygons_visible_at_end: tally.drawn,
        polygons_hidden_at_end: tally.hidden,
        polygons_without_area: tally.without_area,
        erased: counts.erased_strokes,
        erase_events: s.erases,
        undo_redo_events: s.undos,
        move_events: s.moves,
        head_poses: s.heads,
        duration_secs: duration_secs(s),
        backward_time_steps: s.backward_steps,
        bounds_m: corners(&s.bounds),
        dropped: JsonDropped {
            zero_length: counts.drops.zero_length,
            degenerate: counts.drops.degenerate,
            out_of_range: counts.drops.out_of_range,
            excess_corners: counts.drops.excess_corners,
            ignored_events: counts.ignored_events,
        },
        brushes,
        environment: header.environment.as_deref(),
        layers: &header.layers,
        left_out: &header.left_out,
        groups: groups.iter().map(JsonGroup::of).collect(),
        animation_frames: *frames,
        authors,
        skipped: session.notes().skipped,
        warnings: &session.notes().warnings,
        cost: cost.as_ref(),
    };
    Ok(serde_json::to_string(&info)?)
}

fn text(args: &InfoArgs, session: &OpenSession, contents: &Contents) -> String {
    let Contents { summary: s, tally, brushes, groups, authors, frames, cost } = contents;
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
    line("strokes", strokes(counts.strokes, counts.erased_strokes, at_end(brushes, s)));
    line("points", thousands(counts.points));
    line("polygons", polygons(counts.polygons, *tally));
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
        line("skipped", format!("damaged parts: {}", thousands(session.notes().skipped)));
    }
    if let Some(count) = frames {
        line(
            "animation",
            format!("{} frames with strokes; osp shows all of them at once", thousands(*count as u64)),
        );
    }
    appearance(&session.header).into_iter().for_each(|(name, value)| line(name, value));
    lines.extend(author_rows::lines(authors));
    lines.extend(group_lines(groups));
    if !brushes.is_empty() {
        lines.push(brush_rows::table(brushes));
    }
    lines.extend(cost.iter().flat_map(Cost::lines));
    lines.join("\n")
}

/// Returns the number of strokes that are neither erased nor undone. Without undo events it does not use `brushes`,
/// which do not count the strokes of imported models.
fn at_end(brushes: &[BrushRow], s: &Summary) -> u64 {
    match s.undos {
        0 => s.counts.strokes.saturating_sub(s.counts.erased_strokes),
        _ => brushes.iter().map(|row| row.strokes).sum(),
    }
}

fn strokes(drawn: u64, erased: u64, at_end: u64) -> String {
    let undone = drawn.saturating_sub(erased + at_end);
    let (drawn, at_end, erased) = (thousands(drawn), thousands(at_end), thousands(erased));
    format!("{drawn} ({at_end} in the model at the end, {erased} erased, {} undone)", thousands(undone))
}

fn polygons(made: u64, tally: PolygonTally) -> String {
    let mut parts = vec![format!("{} in the model at the end", thousands(tally.drawn))];
    if tally.hidden > 0 {
        parts.push(format!("{} hidden", thousands(tally.hidden)));
    }
    if tally.without_area > 0 {
        parts.push(format!("{} without area are not drawn", thousands(tally.without_area)));
    }
    format!("{} ({})", thousands(made), parts.join(", "))
}

/// Returns one line for each group, indented below its parent.
fn group_lines(groups: &[GroupNode]) -> Vec<String> {
    let mut lines = Vec::new();
    for (node, number) in groups.iter().take(MOST_GROUPS).zip(0..) {
        let title = if number == 0 { "groups" } else { "" };
        let name = match &node.name {
            Some(name) => one_line(name).into_owned(),
            None => format!("group {}", node.id.0),
        };
        let size = match node.bounds.is_empty() {
            true => String::new(),
            false => {
                let (min, size) = (node.bounds.min, node.bounds.extent());
                format!(
                    ", {:.3} x {:.3} x {:.3} m from ({:.3}, {:.3}, {:.3})",
                    size.x, size.y, size.z, min.x, min.y, min.z
                )
            }
        };
        lines.push(format!(
            "  {title:<11} {:indent$}{name}: {} strokes, {} polygons{size}",
            "",
            thousands(node.strokes),
            thousands(node.polygons),
            indent = 2 * node.depth.min(20),
        ));
    }
    if groups.len() > MOST_GROUPS {
        lines.push(format!("  {:<11} … ({} in all)", "", thousands(groups.len() as u64)));
    }
    lines
}

/// Returns lines about the light, the layers, and the parts of the file that osp does not show.
fn appearance(header: &Header) -> Vec<(&'static str, String)> {
    let mut lines = Vec::new();
    if let Some(environment) = &header.environment {
        lines.push(("light", light(environment)));
    }
    if !header.layers.is_empty() {
        let name = |layer: &Layer| {
            let name = if layer.name.is_empty() { "(no name)" } else { &layer.name };
            format!("{}{}", one_line(name), if layer.hidden { " (hidden)" } else { "" })
        };
        let mut names: Vec<String> = header.layers.iter().take(MOST_LISTED).map(name).collect();
        if header.layers.len() > MOST_LISTED {
            names.push(format!("… ({} in all)", thousands(header.layers.len() as u64)));
        }
        lines.push(("layers", names.join(", ")));
    }
    let missing = header.left_out.iter().take(MOST_LISTED);
    lines.extend(missing.map(|what| ("not shown", one_line(what).into_owned())));
    if header.left_out.len() > MOST_LISTED {
        let more = header.left_out.len() - MOST_LISTED;
        lines.push(("not shown", format!("{} more", thousands(more as u64))));
    }
    lines
}

/// Describes an environment in words. Colours are shown as screen values from 0 to 255.
fn light(environment: &Environment) -> String {
    let color = |color: glam::Vec3| {
        let [r, g, b] = (color * 255.0).to_array().map(|part| part.round() as u32);
        format!("({r}, {g}, {b})")
    };
    let [down, up] = environment.sky;
    let mut parts = match environment.preset.as_str() {
        "" => Vec::new(),
        preset => vec![one_line(preset).into_owned()],
    };
    parts.push(format!("sky {} below to {} above", color(down), color(up)));
    parts.extend(environment.floor.map(|floor| format!("floor {}", color(floor))));
    if environment.fog.1 > 0.0 {
        parts.push(format!("fog {} of density {} per metre", color(environment.fog.0), environment.fog.1));
    }
    parts.push(format!("ambient {}", color(environment.ambient)));
    let lit = environment.lights.iter().filter(|(_, color)| *color != glam::Vec3::ZERO);
    parts.extend(lit.map(|&(_, light)| format!("light {}", color(light))));
    parts.join(", ")
}

/// The polygons of the strokes that are not erased.
#[derive(Clone, Copy, Debug, Default)]
struct PolygonTally {
    /// Visible polygons with an area.
    drawn: u64,
    /// Polygons with an area in hidden layers.
    hidden: u64,
    /// Visible polygons without an area.
    without_area: u64,
}

impl PolygonTally {
    fn of(scene: &Scene) -> Self {
        let mut tally = Self::default();
        for stroke in scene.strokes().iter().filter(|stroke| !stroke.is_taken_away()) {
            for id in stroke.polygon_ids() {
                match (stroke.is_visible(), scene.has_area(id)) {
                    (true, true) => tally.drawn += 1,
                    (true, false) => tally.without_area += 1,
                    (false, has_area) => tally.hidden += u64::from(has_area),
                }
            }
        }
        tally
    }
}
