//! `osp draw-insertion`: a film of polygons that fall through the paper's tree.

use std::path::PathBuf;

use anyhow::{Context, anyhow, ensure};
use indicatif::HumanBytes;

use super::{
    draw_args::DrawInsertionArgs,
    gif_file::GifFile,
    output::{Outcome, file_name, one_line, print_result},
    played::Played,
};
use osp_lab::report::{InsertionFilm, thousands};
use osp_session::replay::root_cube;

pub(super) fn run(args: &DrawInsertionArgs) -> anyhow::Result<Outcome> {
    let file: &PathBuf = &args.session.file;
    let output = args.force.outputs().reads([file]).add(&args.out, &[".gif"])?;
    let Played { header, summary, scene, .. } = Played::model(&args.session, |_, _| {})?;
    let film = InsertionFilm {
        title: format!("{}: its first polygons", file_name(file)),
        scene: &scene,
        polygons: scene.visible_ids().take(args.polygons as usize).collect(),
        root: root_cube(&header, &summary.bounds),
        levels: args.levels,
    };
    ensure!(!film.polygons.is_empty(), "{}: there is no polygon to insert", file.display());
    let name = || output.path().display().to_string();
    let work = film.work().with_context(name)?;
    let mut gif = GifFile::begin(output.create()?, film.size()).with_context(name)?.of_drawings();
    film.draw(|rgb, delay| gif.add(rgb, delay)).map_err(|error| anyhow!("{}: {error}", name()))?;
    let bytes = output.commit(gif.finish().with_context(name)?)?;
    let sum = |of: fn(&osp_lab::report::InsertionWork) -> u64| thousands(work.iter().map(of).sum());
    let size = bytes.map(|bytes| format!(", {}", HumanBytes(bytes))).unwrap_or_default();
    print_result(&format!(
        "{} polygons: osp-paper tests {} planes and moves none; octree-paper tests {} and inserts {} polygons -> {}{size}",
        thousands(work.len() as u64),
        sum(|work| work.osp_planes),
        sum(|work| work.octree_planes),
        sum(|work| work.octree_inserted),
        one_line(&name()),
    ))?;
    Ok(Outcome::Done)
}
