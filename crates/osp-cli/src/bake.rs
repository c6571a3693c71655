//! `osp bake`: potentially visible sets of a finished model.

use std::{
    num::NonZero,
    path::PathBuf,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
    time::Instant,
};

use anyhow::bail;
use clap::Args;
use glam::Vec3;
use indicatif::HumanBytes;

use super::{
    output::{Outcome, one_line, print_result},
    outputs::ForceArgs,
    progress,
    reading::ReadArgs,
    session::OpenSession,
};
use osp::{index::IndexConfig, math::Aabb, polygon::PolygonId};
use osp_lab::{
    pvs::{BakeConfig, Baker, Pvs, ViewCells},
    report::thousands,
};
use osp_rivals::IndexKind;
use osp_session::{recording::Event, scene::Scene};

/// Compute potentially visible sets (PVS) of a finished model.
///
/// `osp verify --pvs` uses them. The command divides a space into cubic cells: the box of the head path or, if there is none, the model's box enlarged
/// by half. From some points of each cell it draws six pictures, and finds the polygons visible in them. The sets are
/// sampled, not exact: they miss polygons that are visible only from places between the points. `osp verify FILE
/// --whole --pvs OUT` counts the missed polygons.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp bake recordings/room.ron room.pvs
  osp bake castle.obj castle.pvs --cells 16 --samples 20
  osp verify recordings/room.ron --whole --pvs room.pvs")]
pub(super) struct BakeArgs {
    /// The session, of any format that replay reads.
    file: PathBuf,
    /// File to write, `.pvs`.
    out: PathBuf,
    /// Cells along the longest side of the space.
    #[arg(long, default_value_t = 8, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    cells: u32,
    /// Sample points of each cell; 9: its centre and corners.
    #[arg(long, default_value_t = BakeConfig::default().samples, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    samples: u32,
    /// Pixels of each picture, across and down.
    #[arg(long, default_value_t = BakeConfig::default().pixels, value_name = "N", value_parser = clap::value_parser!(u32).range(16..=8192))]
    pixels: u32,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    reading: ReadArgs,
}

pub(super) fn run(args: &BakeArgs) -> anyhow::Result<Outcome> {
    let output = args.force.outputs().reads([&args.file]).add(&args.out, &[".pvs"])?;
    let start = Instant::now();
    let (scene, heads) = model(args)?;
    let ids: Vec<PolygonId> = scene.visible_ids().collect();
    let bounds = ids.iter().fold(Aabb::EMPTY, |all, &id| all.union(&scene.bounds(id)));
    if bounds.is_empty() {
        bail!("{}: nothing is left in the model at its end", args.file.display());
    }
    let space = match heads.is_empty() {
        true => around(bounds.center(), bounds.extent() * 0.75),
        // Enlarges the space, so that rounding cannot move an eye on its border outside.
        false => around(heads.center(), heads.extent() * 0.505 + 0.01),
    };
    let cells = ViewCells::filling(&space, args.cells);
    let config = BakeConfig { samples: args.samples, pixels: args.pixels };
    let baker = Baker::new(&scene, &bounds, cells, config);
    let mut pvs = Pvs::new(&scene, cells, args.samples)?;
    for (cell, groups) in bake(&baker, &scene, &ids, &cells, args) {
        pvs.set_cell(cell, &groups);
    }
    output.write_by(|file| pvs.write_to(file))?;
    print_result(&format!(
        "{}: {} cells of {:.2} m, {} samples each, {} polygons; a set holds {:.1} % of the groups on average; {} in memory; {:.1} s",
        one_line(&args.out.to_string_lossy()),
        thousands(cells.len() as u64),
        cells.side_m,
        args.samples,
        thousands(ids.len() as u64),
        pvs.mean_share() * 100.0,
        HumanBytes(pvs.bytes() as u64),
        start.elapsed().as_secs_f64(),
    ))?;
    Ok(Outcome::Done)
}

fn around(center: Vec3, half: Vec3) -> Aabb {
    Aabb { min: center - half, max: center + half }
}

/// Returns the model at the end of the session, and a box around all positions of the head.
fn model(args: &BakeArgs) -> anyhow::Result<(Scene, Aabb)> {
    let mut session = OpenSession::open(&args.file, &args.reading)?.counted();
    let (mut scene, mut changes, mut heads) = (Scene::new(), Vec::new(), Aabb::EMPTY);
    for event in &mut session {
        let event = event?;
        if let Event::Head { p, .. } = &event {
            heads = heads.union(&Aabb { min: *p, max: *p });
        }
        scene.apply(&event, &mut changes);
        changes.clear();
        scene.free_unreachable();
    }
    session.warn();
    Ok((scene, heads))
}

/// Computes the sets of all cells on several threads.
fn bake(
    baker: &Baker<'_>,
    scene: &Scene,
    ids: &[PolygonId],
    cells: &ViewCells,
    args: &BakeArgs,
) -> Vec<(usize, Vec<u64>)> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let progress = progress::bar(cells.len() as u64, "cells", &args.file.to_string_lossy());
    let next = AtomicUsize::new(0);
    let work = || {
        let config = IndexConfig { capacity: ids.len(), ..IndexConfig::default() };
        let mut index = IndexKind::BvhSah.create(&config);
        for &id in ids {
            // The index rejects polygons that are not finite; these cannot be drawn.
            let _ = index.insert(id, &scene.bounds(id));
        }
        index.commit();
        let mut found = Vec::new();
        loop {
            let cell = next.fetch_add(1, Ordering::Relaxed);
            if cell >= cells.len() {
                return found;
            }
            found.push((cell, baker.cell(cell, &*index)));
            progress.inc(1);
        }
    };
    let found = thread::scope(|scope| {
        // If the system creates no more threads, the existing threads do the work, including this thread.
        let spawn = |_| thread::Builder::new().spawn_scoped(scope, work).ok();
        let workers: Vec<_> = (1..threads.min(cells.len())).map_while(spawn).collect();
        let mut found = work();
        found.extend(workers.into_iter().flat_map(|worker| worker.join().expect("a cell never panics")));
        found
    });
    progress.finish_and_clear();
    found
}
