//! `osp pick`: finds the polygon under a point of a frame's picture.

use std::{str::FromStr, time::Instant};

use clap::Args;
use glam::{Vec2, Vec3};
use serde::Serialize;

use super::{
    output::{Outcome, print_result},
    parsers::camera_parser,
    played::{IndexedFrameArgs, Played},
    query::Work,
    ray_search::{self, RaySearchArgs},
};
use osp::{math::rotate, polygon::PolygonId};
use osp_session::replay::{CameraChoice, CameraPath};

/// Find the polygon under a point of a frame's picture.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp pick recordings/room.ron
  osp pick sketch.tilt --at 0.25,0.5 --frame 120 --camera orbit
  osp pick sketch.tilt --index bvh-sah --json
  osp pick room.ron --index bvh-sah --search best-first --radius 0.05

The command prints the polygon, its stroke, and the hit point in world space. It also prints the depth of this point \
along the view direction, and the number of polygons that were tested. With --radius, a sphere moves along the ray, \
and the point is the sphere's centre.")]
pub(super) struct PickArgs {
    /// The point of the picture: 0,0 is the upper left corner, 1,1 the lower right one.
    #[arg(long, default_value = "0.5,0.5", value_name = "X,Y")]
    at: At,
    /// Position of the eye: `auto` is the recorded head path, else the session's own camera, else `orbit`. `orbit`
    /// circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    camera: CameraChoice,
    #[command(flatten)]
    search: RaySearchArgs,
    #[command(flatten)]
    frame: IndexedFrameArgs,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
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

#[derive(Serialize)]
struct Picked {
    polygon: u32,
    stroke: Option<u32>,
    point_m: [f32; 3],
    distance_m: f32,
}

#[derive(Serialize)]
struct Report<'a> {
    recording: String,
    frame: u64,
    index: &'a str,
    picked: Option<Picked>,
    polygons_asked: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    work: Option<Work>,
    us: f64,
}

pub(super) fn run(args: &PickArgs) -> anyhow::Result<Outcome> {
    let (played, pipeline) = Played::in_index(&args.frame)?;
    let camera = CameraPath::new(args.camera, played.header.camera, &played.summary.bounds);
    let view = camera.view(&played.moment);
    // In the picture y points down, in the view up.
    let at = Vec2::new(args.at.0.x * 2.0 - 1.0, 1.0 - args.at.0.y * 2.0);
    let ray = view.ray_through(at);
    let up = rotate(view.world_from_view, Vec3::Y);
    let mut asked = 0;
    let mut meet = |id: PolygonId| {
        asked += 1;
        ray_search::meet(&played.scene.polygon_from(id, view.eye_in_world, up), &ray, args.search.radius_m())
    };
    let (index, far_m) = (pipeline.index(), view.projection.far_m);
    let search = args.search.of(index, &played.scene);
    let start = Instant::now();
    let (found, steps) = match &search {
        None => (index.ray_nearest(&ray, far_m, &mut meet), None),
        Some(search) => {
            let (found, steps) = search.nearest(&ray, &mut meet);
            (found.filter(|(_, distance_m)| *distance_m <= far_m), Some(steps))
        }
    };
    let us = start.elapsed().as_nanos() as f64 / 1000.0;
    let picked = found.map(|(id, distance_m)| Picked {
        polygon: id.0,
        stroke: played.scene.stroke_of(id).id().map(|stroke| stroke.0),
        point_m: (ray.origin + ray.direction * distance_m).to_array(),
        distance_m,
    });
    let report = Report {
        recording: args.frame.session.file.display().to_string(),
        frame: played.moment.frame,
        index: args.frame.index.name(),
        picked,
        polygons_asked: asked,
        work: steps.map(Work::from),
        us,
    };
    if args.json {
        print_result(&serde_json::to_string(&report)?)?;
        return Ok(Outcome::Done);
    }
    let looked = report.work.as_ref().map_or(String::new(), Work::text);
    let work = format!("{}{looked} tested {asked} polygons in {us:.1} µs", report.index);
    match &report.picked {
        None => print_result(&format!("the ray hits nothing; {work}"))?,
        Some(Picked { polygon, stroke, point_m: [x, y, z], distance_m }) => {
            let stroke =
                stroke.map_or("(part of no stroke)".to_owned(), |stroke| format!("of stroke {stroke}"));
            print_result(&format!(
                "polygon {polygon} {stroke} at ({x:.3}, {y:.3}, {z:.3}) m, {distance_m:.3} m deep; {work}"
            ))?;
        }
    }
    Ok(Outcome::Done)
}
