//! `osp pack`: packs finished sessions into a world.

use std::{path::Path, time::Duration};

use anyhow::ensure;
use glam::Vec3;
use indicatif::{HumanBytes, ProgressBar};

use super::{
    outcome::Outcome,
    output::{file_name, one_line, print_result, warn},
    pack_args::PackArgs,
    reading::ReadArgs,
    session::OpenSession,
};
use osp::math::Aabb;
use osp_lab::report::thousands;
use osp_net::world::{PackOrder, Place, Replacing, WorldError, WorldWriter};
use osp_session::scene::Scene;

pub(super) fn run(args: &PackArgs) -> anyhow::Result<Outcome> {
    let cells = args.repeat.map_or(0, |[n, m, k]| n as usize * m as usize * k as usize);
    ensure!(
        args.repeat.is_none() || cells >= args.files.len(),
        "--repeat: expected a place for each of {} sessions; found {cells}",
        args.files.len()
    );
    let replacing = if args.force { Replacing::World } else { Replacing::Never };
    let order = PackOrder::ALL.iter().find(|order| order.name() == args.order).copied().unwrap_or_default();
    let mut writer =
        WorldWriter::create(Place::to_write(&args.out)?, replacing, order).map_err(|error| match error {
            WorldError::Exists { .. } => anyhow::anyhow!("{error}; --force replaces it"),
            error => error.into(),
        })?;
    // The spinner is shown only on a terminal.
    let progress = ProgressBar::new_spinner();
    progress.enable_steady_tick(Duration::from_millis(200));
    let spacing_m = match (args.repeat, args.spacing) {
        (Some(_), None) => spacing(args)?,
        (_, spacing) => spacing.unwrap_or(0.0),
    };
    for (number, file) in args.files.iter().enumerate() {
        let name = file_name(file);
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
        warn(&format!(
            "warning: {} polygons skipped: they are out of range and cannot be drawn",
            thousands(packed.refused)
        ));
    }
    let manifest = &packed.manifest;
    print_result(&format!(
        "{}: {} polygons in {} blocks, {} objects, {}",
        one_line(&args.out),
        thousands(manifest.polygon_count()),
        thousands(manifest.blocks.len() as u64),
        thousands(manifest.object_count() as u64),
        HumanBytes(manifest.block_bytes()),
    ))?;
    Ok(Outcome::Done)
}

/// Returns the position of a cell in a grid, in cells. Counts cells along x first, then z, then y.
fn place([n, _, k]: [u32; 3], cell: usize) -> Vec3 {
    let (n, k) = (n as usize, k as usize);
    Vec3::new((cell % n) as f32, (cell / (n * k)) as f32, (cell / n % k) as f32)
}

/// Returns 1.1 times the longest side of the largest session, in metres.
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

/// Returns the model at the end of a session.
fn finished(file: &Path, reading: &ReadArgs) -> anyhow::Result<Scene> {
    let (mut scene, mut changes) = (Scene::new(), Vec::new());
    let mut session = OpenSession::open(file, reading)?;
    for event in &mut session {
        scene.apply(&event?, &mut changes);
        changes.clear();
        scene.free_unreachable();
    }
    session.warn();
    let skipped = session.notes().skipped;
    if skipped > 0 {
        warn(&format!("warning: {}: damaged parts skipped: {skipped}", file.display()));
    }
    Ok(scene)
}
