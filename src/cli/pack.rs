//! `osp pack`: finished sessions become a world.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::ensure;
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use glam::Vec3;
use indicatif::{HumanBytes, ProgressBar};

use super::{
    Outcome, numbers,
    output::{complain, one_line, say},
    reading::ReadArgs,
    session::OpenSession,
};
use crate::{
    lab::report::thousands,
    math::Aabb,
    scene::Scene,
    world::{PackOrder, Place, Replacing, WorldError, WorldWriter},
};

/// Pack finished sessions into a world that may be larger than memory, for `osp replay --world`.
///
/// What is there of each session at its end becomes blocks of up to 4,096 polygons, 64 blocks in an object (a file of a folder).
/// A manifest, which is written last, has the box, size and checksum of each block. Until then there is no world: what a pack that
/// was stopped has left is removed by the next one into the same place.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp pack recordings/*.ron --out sketches.world
  osp pack room.tilt --out city.world --repeat 20x1x20
  osp pack *.tilt --out s3://bucket/world       needs a build with the feature `worlds-cloud`

With --repeat a grid of places along x, y and z is filled with the sessions in turn, one a place: larger worlds to measure with.
An s3:// address takes its keys and region from AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION and AWS_ENDPOINT.")]
pub(super) struct PackArgs {
    /// The sessions, of any format that replay reads.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The folder for the world, or an s3:// address.
    #[arg(long, value_name = "DIR|URL")]
    out: String,
    /// In which order polygons fill blocks: along a curve through `space`, or `strokes`, as they were drawn.
    #[arg(long, value_name = "ORDER", default_value = PackOrder::default().name(), value_parser = order_parser())]
    order: PackOrder,
    /// Fill a grid of N by M by K places (along x, y and z) with the sessions in turn.
    #[arg(long, value_name = "NxMxK", value_parser = numbers::grid)]
    repeat: Option<[u32; 3]>,
    /// From one place of --repeat to the next, metres [default: the longest side of the largest session, and a tenth].
    #[arg(long, value_name = "METRES", requires = "repeat", value_parser = numbers::metres)]
    spacing: Option<f32>,
    /// Replace the world that is there, once the new one is whole.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    reading: ReadArgs,
}

fn order_parser() -> impl TypedValueParser<Value = PackOrder> {
    PossibleValuesParser::new(PackOrder::ALL.iter().map(|order| order.name())).try_map(|name| {
        let found = PackOrder::ALL.iter().find(|order| order.name() == name);
        found.copied().ok_or_else(|| format!("no order is called {name}"))
    })
}

pub(super) fn run(args: &PackArgs) -> anyhow::Result<Outcome> {
    let cells = args.repeat.map_or(0, |[n, m, k]| n as usize * m as usize * k as usize);
    ensure!(
        args.repeat.is_none() || cells >= args.files.len(),
        "--repeat: expected a place for each of {} sessions; found {cells}",
        args.files.len()
    );
    let replacing = if args.force { Replacing::World } else { Replacing::Never };
    let mut writer = WorldWriter::create(Place::to_write(&args.out)?, replacing, args.order).map_err(
        |error| match error {
            WorldError::Exists { .. } => anyhow::anyhow!("{error}; --force replaces it"),
            error => error.into(),
        },
    )?;
    // Shown on a terminal only.
    let progress = ProgressBar::new_spinner();
    progress.enable_steady_tick(Duration::from_millis(200));
    let spacing_m = match (args.repeat, args.spacing) {
        (Some(_), None) => spacing(args)?,
        (_, spacing) => spacing.unwrap_or(0.0),
    };
    for (number, file) in args.files.iter().enumerate() {
        let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
        progress.set_message(one_line(&name).into_owned());
        let scene = finished(file, &args.reading)?;
        let offsets = args.repeat.map_or_else(
            || vec![Vec3::ZERO],
            |counts| {
                (number..cells)
                    .step_by(args.files.len())
                    .map(|cell| place(counts, cell) * spacing_m)
                    .collect()
            },
        );
        writer.add(&name, &scene, &offsets)?;
    }
    let packed = writer.finish()?;
    progress.finish_and_clear();
    if packed.refused > 0 {
        complain(&format!(
            "warning: {} polygons left out: they are out of range, where nothing can be drawn",
            thousands(packed.refused)
        ));
    }
    let manifest = &packed.manifest;
    say(&format!(
        "{}: {} polygons in {} blocks, {} objects, {}",
        one_line(&args.out),
        thousands(manifest.polygon_count()),
        thousands(manifest.blocks().len() as u64),
        thousands(manifest.object_count() as u64),
        HumanBytes(manifest.block_bytes()),
    ))?;
    Ok(Outcome::Done)
}

/// The place of a cell of a grid: x first, then z, then y.
fn place([n, _, k]: [u32; 3], cell: usize) -> Vec3 {
    let (n, k) = (n as usize, k as usize);
    Vec3::new((cell % n) as f32, (cell / (n * k)) as f32, (cell / n % k) as f32)
}

/// The longest side of the largest session, and a tenth, metres.
fn spacing(args: &PackArgs) -> anyhow::Result<f32> {
    let mut longest_m = 0.0f32;
    for file in &args.files {
        let scene = finished(file, &args.reading)?;
        let bounds = scene.visible_ids().map(|id| scene.bounds(id)).filter(Aabb::is_valid);
        let bounds = bounds.fold(Aabb::EMPTY, |all, bounds| all.union(&bounds));
        if !bounds.is_empty() {
            longest_m = longest_m.max(bounds.extent().max_element());
        }
    }
    Ok(longest_m * 1.1)
}

/// A session's model at its end.
fn finished(file: &Path, reading: &ReadArgs) -> anyhow::Result<Scene> {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    let mut session = OpenSession::open(file, reading)?;
    for event in &mut session {
        scene.apply(&event?, &mut changes);
        changes.clear();
        scene.let_go();
    }
    session.notes().warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    let skipped = session.notes().skipped;
    if skipped > 0 {
        complain(&format!("warning: {}: {skipped} damaged pieces skipped", file.display()));
    }
    Ok(scene)
}
