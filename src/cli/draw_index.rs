//! `osp draw-index`: a picture of an index's structure.

use std::path::PathBuf;

use anyhow::{anyhow, ensure};
use clap::{Args, ValueEnum};

use super::{
    Outcome,
    output::{complain, one_line, say},
    outputs::Outputs,
    played::{IndexedFrameArgs, Played},
};
use crate::{
    lab::report::{Side, Structure, StructureView, thousands},
    output_file::OutputKind,
};

/// Draw the cells of an index over the polygons, or its tree, as the index is after a frame.
///
/// Large trees are collapsed: the picture leaves out the deepest levels and says so.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp draw-index recordings/room.ron room.svg
  osp draw-index recordings/room.ron --index octree-rebuild --from top room.png
  osp draw-index sketch.tilt --index bvh-sah --frame 40 --as tree tree.svg
  osp draw-index sketch.tilt --as tree tree.dot   (for Graphviz)")]
pub(super) struct DrawIndexArgs {
    #[command(flatten)]
    frame: IndexedFrameArgs,
    /// Where the picture goes: .svg or .png, or .dot for a tree.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// What is drawn.
    #[arg(long = "as", value_enum, default_value_t = Shown::Space)]
    shown: Shown,
    /// The side from which the cells are seen.
    #[arg(long, value_enum, default_value_t = From::Front)]
    from: From,
    /// Let the picture replace a file of another kind, but never the session.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Shown {
    /// The cells in parallel projection, coloured by level, over the polygons.
    Space,
    /// The tree, coloured by level, with the root at the top.
    Tree,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum From {
    /// x to the right, y up.
    Front,
    /// From above: x to the right, z down.
    Top,
    /// z to the left, y up.
    Right,
}

pub(super) fn run(args: &DrawIndexArgs) -> anyhow::Result<Outcome> {
    let ending = args.out.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let is_dot = ending == "dot";
    ensure!(
        is_dot || ending == "svg" || ending == "png",
        "{}: expected a name that ends in .svg, .png or .dot",
        args.out.display()
    );
    ensure!(
        !is_dot || args.shown == Shown::Tree,
        "{}: .dot is for a tree: add --as tree",
        args.out.display()
    );
    let kind = match ending.as_str() {
        "dot" => OutputKind::Dot,
        "svg" => OutputKind::Svg,
        _ => OutputKind::Png,
    };
    let output = Outputs::new(args.force).reads([&args.frame.session.file]).add("OUT", &args.out, kind)?;
    let Played { scene, pipeline, moment, .. } = Played::in_index(&args.frame)?;
    let structure = Structure::of(pipeline.index());
    let name =
        args.frame.session.file.file_name().unwrap_or(args.frame.session.file.as_os_str()).to_string_lossy();
    let title = format!("{name}, frame {}, {}", moment.frame, args.frame.index.name());
    if is_dot {
        output.write(structure.to_dot(&title).as_bytes())?;
    } else {
        let view = match (args.shown, args.from) {
            (Shown::Tree, _) => StructureView::Tree,
            (Shown::Space, From::Front) => StructureView::Space(Side::Front),
            (Shown::Space, From::Top) => StructureView::Space(Side::Top),
            (Shown::Space, From::Right) => StructureView::Space(Side::Right),
        };
        output.check()?;
        let drawn = structure.draw(view, &scene, &title, output.path());
        drawn.map_err(|e| anyhow!("{}: {e}", output.path().display()))?;
    }
    let nodes = structure.nodes();
    if nodes.is_empty() {
        complain(&format!("warning: {} has no nodes to show", args.frame.index.name()));
    }
    say(&format!(
        "{}: {} nodes, {} levels, {} polygons -> {}",
        one_line(&title),
        thousands(nodes.len() as u64),
        if nodes.is_empty() { 0 } else { structure.depth() + 1 },
        thousands(scene.counts().visible),
        one_line(&args.out.to_string_lossy())
    ))?;
    Ok(Outcome::Done)
}
