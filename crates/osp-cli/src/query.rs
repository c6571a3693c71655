//! `osp query`: searches in a session's model.

use std::{str::FromStr, time::Instant};

use anyhow::{anyhow, bail, ensure};
use clap::{Args, ValueEnum};
use comfy_table::{Cell, CellAlignment};
use glam::{Vec2, Vec3};
use serde::Serialize;

use super::{
    output::{Outcome, print_result},
    parsers::camera_parser,
    played::{IndexedFrameArgs, Played},
    ray_search::{self, RaySearch, RaySearchArgs},
};
use osp::{
    index::{SpatialIndex, WorkCounts},
    math::{Aabb, Ray, Sphere, rotate},
    polygon::PolygonId,
};
use osp_lab::{
    outline::Steps,
    report::{columns_table, thousands},
};
use osp_session::{
    replay::{CameraChoice, CameraPath},
    scene::Scene,
};

/// Find polygons in a box or a sphere, near a point, along a ray, or under a point of a picture.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp query recordings/room.ron --box -1,0,-1 1,2,1
  osp query sketch.tilt --sphere 0,1.5,0 0.25 --frame 120
  osp query sketch.tilt --nearest 0,1.5,0 10 --index kd-tree --json
  osp query recordings/room.ron --ray 0,1.6,0 0,0,-1 --hits nearest
  osp query recordings/room.ron --ray 0,1.6,0 0,0,-1 --search best-first \\
      --radius 0.1 --index kd-tree
  osp query sketch.tilt --at 0.25,0.5 --frame 120 --camera orbit

The command prints the strokes found, and each polygon with its distance from the sphere's centre, the point or the \
ray's start. Then it prints the number of polygons that were tested exactly, and of nodes and boxes that the index \
tested. For a ray, nodes and boxes are counted only with --search or --radius.
Coordinates are in world space, metres. A polygon that touches a box or sphere counts as inside. The command tests \
the polygons themselves, not their boxes. Box and sphere queries test particles in their stored orientation; rays \
test them facing the ray's start.")]
pub(super) struct QueryArgs {
    #[command(flatten)]
    part: PartArgs,
    /// Position of the eye of --at: `auto` is the recorded head path, else the session's own camera, else `orbit`.
    /// `orbit` circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser(), requires = "at")]
    camera: CameraChoice,
    /// Polygons to report along a ray [default: `all` of --ray, the `nearest` of --at].
    #[arg(long, value_enum)]
    hits: Option<Hits>,
    #[command(flatten)]
    search: RaySearchArgs,
    #[command(flatten)]
    frame: IndexedFrameArgs,
    /// Print one JSON object, with all polygons found.
    #[arg(long)]
    json: bool,
}

#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
struct PartArgs {
    /// Find polygons in a box, by the corners with its smallest and its largest coordinates.
    #[arg(long = "box", num_args = 2, value_names = ["X,Y,Z", "X,Y,Z"], allow_hyphen_values = true)]
    bounds: Option<Vec<Numbers>>,
    /// Find polygons in a sphere, by its centre and its radius.
    #[arg(long, num_args = 2, value_names = ["X,Y,Z", "RADIUS"], allow_hyphen_values = true)]
    sphere: Option<Vec<Numbers>>,
    /// Find the polygons nearest to a point, by the point and the number of polygons.
    #[arg(long, num_args = 2, value_names = ["X,Y,Z", "COUNT"], allow_hyphen_values = true)]
    nearest: Option<Vec<Numbers>>,
    /// Find polygons along a ray, by its start and its direction.
    #[arg(long, num_args = 2, value_names = ["X,Y,Z", "X,Y,Z"], allow_hyphen_values = true)]
    ray: Option<Vec<Numbers>>,
    /// Find polygons under a point of the frame's picture: 0,0 is the upper left corner, 1,1 the lower right one.
    #[arg(long, value_name = "X,Y")]
    at: Option<At>,
}

/// A point of the picture, from the upper left corner.
#[derive(Clone, Copy, Debug)]
struct At(Vec2);

impl FromStr for At {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.split_once(',')
            .and_then(|(x, y)| Some(Vec2::new(x.trim().parse().ok()?, y.trim().parse().ok()?)))
            .filter(|at| at.cmpge(Vec2::ZERO).all() && at.cmple(Vec2::ONE).all())
            .map(Self)
            .ok_or_else(|| format!("expected X,Y, both from 0 to 1; found `{text}`"))
    }
}

/// Finite numbers, separated by commas.
#[derive(Clone, Debug)]
pub(super) struct Numbers(Vec<f32>);

impl FromStr for Numbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split(',').map(|number| number.trim().parse().ok().filter(|n: &f32| n.is_finite()));
        match numbers.collect::<Option<Vec<f32>>>() {
            Some(numbers) if matches!(numbers.len(), 1 | 3) => Ok(Self(numbers)),
            _ => Err(format!("expected one finite number or three, X,Y,Z; found `{text}`")),
        }
    }
}

/// Returns the ray of `--ray`. Its direction has unit length, so that hits are distances.
pub(super) fn ray_of(values: &[Numbers]) -> anyhow::Result<Ray> {
    let (origin, direction) = match values {
        [origin, direction] => (origin.point("--ray")?, direction.point("--ray")?),
        _ => bail!("--ray: expected a start and a direction"),
    };
    let direction = direction.as_dvec3().try_normalize();
    let direction = direction.ok_or_else(|| anyhow!("--ray: expected a direction, found 0,0,0"))?;
    Ok(Ray::new(origin, direction.as_vec3()))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Hits {
    /// All polygons that the ray meets.
    All,
    /// The nearest polygon.
    Nearest,
    /// The first polygon that is found.
    Any,
}

/// The part of the model to search.
#[derive(Clone, Copy, Debug)]
enum Part {
    Box(Aabb),
    Sphere(Sphere),
    Nearest(Vec3, usize),
    Ray(Ray),
    At(Vec2),
}

impl PartArgs {
    fn part(&self) -> anyhow::Result<Part> {
        match self {
            Self { bounds: Some(values), .. } => {
                let bounds = match values.as_slice() {
                    [min, max] => Aabb::new(min.point("--box")?, max.point("--box")?),
                    _ => bail!("--box: expected two corners"),
                };
                if bounds.is_empty() {
                    bail!("--box: expected the corner with the smallest coordinates first");
                }
                Ok(Part::Box(bounds))
            }
            Self { sphere: Some(values), .. } => {
                let (center, radius_m) = point_and_number(values, "--sphere")?;
                if radius_m < 0.0 {
                    bail!("--sphere: expected a radius of at least 0, found {radius_m}");
                }
                Ok(Part::Sphere(Sphere { center, radius_m }))
            }
            Self { nearest: Some(values), .. } => {
                let (point, count) = point_and_number(values, "--nearest")?;
                if count < 1.0 || count.fract() != 0.0 {
                    bail!("--nearest: expected a whole number of polygons, at least 1, found {count}");
                }
                Ok(Part::Nearest(point, count as usize))
            }
            Self { ray: Some(values), .. } => Ok(Part::Ray(ray_of(values)?)),
            Self { at: Some(At(at)), .. } => Ok(Part::At(*at)),
            _ => bail!("expected --box, --sphere, --nearest, --ray or --at"),
        }
    }
}

impl Numbers {
    fn point(&self, option: &str) -> anyhow::Result<Vec3> {
        match self.0[..] {
            [x, y, z] => Ok(Vec3::new(x, y, z)),
            _ => bail!("{option}: expected three numbers, X,Y,Z, found one"),
        }
    }
}

fn point_and_number(values: &[Numbers], option: &str) -> anyhow::Result<(Vec3, f32)> {
    match values {
        [point, Numbers(number)] if number.len() == 1 => Ok((point.point(option)?, number[0])),
        _ => bail!("{option}: expected X,Y,Z and then one number"),
    }
}

#[derive(Clone, Copy, Serialize)]
struct Found {
    polygon: u32,
    stroke: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    distance_m: Option<f32>,
}

#[derive(Clone, Copy, Serialize)]
struct Work {
    nodes: u64,
    boxes: u64,
}

impl Work {
    /// Returns the counts as a part of a sentence.
    fn text(&self) -> String {
        format!(" looked at {} nodes and {} boxes,", thousands(self.nodes), thousands(self.boxes))
    }
}

impl From<WorkCounts> for Work {
    fn from(WorkCounts { nodes, boxes, .. }: WorkCounts) -> Self {
        Self { nodes, boxes }
    }
}

impl From<Steps> for Work {
    fn from(Steps { nodes, boxes, .. }: Steps) -> Self {
        Self { nodes, boxes }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    recording: String,
    frame: u64,
    index: &'a str,
    polygons: usize,
    query: &'a str,
    found: Vec<Found>,
    strokes: Vec<u32>,
    polygons_asked: u64,
    work: Option<Work>,
    us: f64,
}

pub(super) fn run(args: &QueryArgs) -> anyhow::Result<Outcome> {
    let part = args.part.part()?;
    let is_along = matches!(part, Part::Ray(_) | Part::At(_));
    ensure!(args.hits.is_none() || is_along, "--hits: expected with --ray or --at");
    ensure!(!args.search.is_given() || is_along, "--search, --radius: expected with --ray or --at");
    ensure!(
        !args.search.is_given() || args.hits != Some(Hits::Any),
        "--hits any: expected without --search and --radius, because `any` is the first hit of the index's own search"
    );
    let (played, pipeline) = Played::in_index(&args.frame)?;
    let search = args.search.of(pipeline.index(), &played.scene);
    let mut along = Along {
        hits: args.hits.unwrap_or(if let Part::At(_) = part { Hits::Nearest } else { Hits::All }),
        radius_m: args.search.radius_m(),
        up: Vec3::Y,
        most_m: f32::INFINITY,
        search,
    };
    let ray = match part {
        Part::At(at) => {
            let view = CameraPath::new(args.camera, played.header.camera, &played.summary.bounds)
                .view(&played.moment);
            // In the picture y points down, in the view up.
            let ray = view.ray_through(Vec2::new(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0));
            let metres_a_depth = ray.direction.length();
            along.up = rotate(view.world_from_view, Vec3::Y);
            along.most_m = view.projection.far_m * metres_a_depth;
            Part::Ray(Ray::new(ray.origin, ray.direction / metres_a_depth))
        }
        part => part,
    };
    let start = Instant::now();
    let mut answer = run_query(pipeline.index(), &played.scene, &ray, &along);
    let us = start.elapsed().as_nanos() as f64 / 1000.0;
    let order = |found: &(PolygonId, Option<f32>)| (found.1.unwrap_or(0.0), found.0);
    answer.found.sort_unstable_by(|a, b| {
        let ((a_m, a), (b_m, b)) = (order(a), order(b));
        a_m.total_cmp(&b_m).then(a.cmp(&b))
    });
    let stroke_of = |id| played.scene.stroke_of(id).id().map(|stroke| stroke.0);
    let found: Vec<Found> = answer
        .found
        .iter()
        .map(|&(id, distance_m)| Found { polygon: id.0, stroke: stroke_of(id), distance_m })
        .collect();
    let mut strokes: Vec<u32> = found.iter().filter_map(|found| found.stroke).collect();
    strokes.sort_unstable();
    strokes.dedup();
    let report = Report {
        recording: args.frame.session.file.display().to_string(),
        frame: played.moment.frame,
        index: args.frame.index.name(),
        polygons: pipeline.index().len(),
        query: match part {
            Part::Box(_) => "box",
            Part::Sphere(_) => "sphere",
            Part::Nearest(..) => "nearest",
            Part::Ray(_) => "ray",
            Part::At(_) => "at",
        },
        found,
        strokes,
        polygons_asked: answer.asked,
        work: answer.work,
        us,
    };
    print_result(&if args.json { serde_json::to_string(&report)? } else { text(&report) })?;
    Ok(Outcome::Done)
}

#[derive(Default)]
struct Answer {
    found: Vec<(PolygonId, Option<f32>)>,
    asked: u64,
    /// Work of the query; `None` for the index's own search along a ray.
    work: Option<Work>,
}

/// Options of a search along a ray.
struct Along {
    hits: Hits,
    radius_m: f32,
    /// The upward direction of particles that face the ray's start.
    up: Vec3,
    most_m: f32,
    search: Option<RaySearch>,
}

fn run_query(index: &dyn SpatialIndex, scene: &Scene, part: &Part, along: &Along) -> Answer {
    let mut answer = Answer::default();
    let Answer { found, asked, work } = &mut answer;
    match *part {
        Part::Box(bounds) => {
            let mut ids = Vec::new();
            *work = Some(index.box_query(&bounds, &mut ids).into());
            *asked = ids.len() as u64;
            ids.retain(|&id| scene.polygon(id).touches(&bounds));
            found.extend(ids.into_iter().map(|id| (id, None)));
        }
        Part::Sphere(sphere) => {
            let reach_squared = sphere.radius_m * sphere.radius_m;
            let mut within = |id| {
                if scene.bounds(id).distance_squared(sphere.center) > reach_squared {
                    return false;
                }
                *asked += 1;
                let distance_m = scene.polygon(id).distance_m(sphere.center);
                let is_in = distance_m <= sphere.radius_m;
                if is_in {
                    found.push((id, Some(distance_m)));
                }
                is_in
            };
            *work = Some(index.sphere_query(&sphere, &mut within, &mut Vec::new()).into());
        }
        Part::Nearest(point, count) => {
            let mut near = Vec::new();
            let mut distance_m = |id| {
                *asked += 1;
                scene.polygon(id).distance_m(point)
            };
            *work = Some(index.nearest(point, count, &mut distance_m, &mut near).into());
            found.extend(near.into_iter().map(|(id, distance_m)| (id, Some(distance_m))));
        }
        Part::Ray(ray) => {
            let mut meet = |id| {
                *asked += 1;
                ray_search::meet(&scene.polygon_from(id, ray.origin, along.up), &ray, along.radius_m)
            };
            let mut nearest = |hit: &mut dyn FnMut(PolygonId) -> Option<f32>| {
                let Some(search) = &along.search else { return index.ray_nearest(&ray, along.most_m, hit) };
                let (found, steps) = search.nearest(&ray, hit);
                *work = Some(steps.into());
                found.filter(|(_, t)| *t <= along.most_m)
            };
            let hit = match along.hits {
                Hits::Nearest => nearest(&mut meet),
                Hits::Any => index.ray_any(&ray, along.most_m, &mut meet),
                Hits::All => {
                    // Returning no hit makes the search continue to the end of the ray.
                    nearest(&mut |id| {
                        found.extend(meet(id).map(|t| (id, Some(t))));
                        None
                    })
                }
            };
            found.extend(hit.map(|(id, t)| (id, Some(t))));
        }
        // Its ray was searched.
        Part::At(_) => {}
    }
    answer
}

/// Largest number of polygons that the table lists.
const MOST_LISTED: usize = 20;
/// Largest number of strokes that the first line names.
const MOST_NAMED: usize = 12;

fn text(report: &Report<'_>) -> String {
    let strokes: Vec<String> = report.strokes.iter().take(MOST_NAMED).map(u32::to_string).collect();
    let more = if report.strokes.len() > MOST_NAMED { ", …" } else { "" };
    let of = match report.strokes.len() {
        0 => String::new(),
        1 => format!(" of stroke {}", strokes[0]),
        n => format!(" of {} strokes ({}{more})", thousands(n as u64), strokes.join(", ")),
    };
    let looked = report.work.as_ref().map_or(String::new(), Work::text);
    let count = match report.found.len() {
        0 => "nothing".to_owned(),
        1 => "1 polygon".to_owned(),
        n => format!("{} polygons", thousands(n as u64)),
    };
    let head = format!(
        "{count}{of} of {} at frame {}; {}{looked} tested {} polygons in {:.1} µs",
        thousands(report.polygons as u64),
        report.frame,
        report.index,
        thousands(report.polygons_asked),
        report.us
    );
    if report.found.is_empty() {
        return head;
    }
    let mut table = columns_table();
    let has_distance = report.found[0].distance_m.is_some();
    let columns = if has_distance { 3 } else { 2 };
    table.set_header(&["polygon", "stroke", "distance, m"][..columns]);
    for found in report.found.iter().take(MOST_LISTED) {
        let cells = [
            found.polygon.to_string(),
            found.stroke.map_or("none".to_owned(), |stroke| stroke.to_string()),
            found.distance_m.map_or(String::new(), |distance_m| format!("{distance_m:.4}")),
        ];
        table.add_row(cells[..columns].iter().map(Cell::new));
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let rest = report.found.len().saturating_sub(MOST_LISTED);
    let rest = if rest > 0 {
        format!("\n… and {} more (--json lists all)", thousands(rest as u64))
    } else {
        String::new()
    };
    format!("{head}\n{table}{rest}")
}
