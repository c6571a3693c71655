//! `osp draw-index`: a picture of an index's structure.

use std::path::PathBuf;

use anyhow::{anyhow, ensure};
use clap::{Args, ValueEnum};

use super::{
    Outcome,
    output::{complain, one_line, say},
    outputs::Outputs,
    parsers::index_parser,
    played::{IndexedFrameArgs, Played},
    query::{Numbers, ray_of},
};
use osp::{
    index::{IndexConfig, SpatialIndex},
    math::{Aabb, Ray},
};
use osp_lab::report::{
    CellColors, Side, SplitOutline, Structure, StructurePanel, StructurePicture, StructureView, thousands,
};
use osp_rivals::{Bsp, BspConfig, IndexKind};
use osp_session::{output_file::OutputKind, replay::Moment, scene::Scene};

/// Planes that are drawn at most.
const MOST_PLANES: usize = 2000;

/// Draw the cells of an index over the polygons, or its tree, as the index is after a frame.
///
/// Large trees are collapsed: the picture leaves out the deepest levels and says so. A legend names the levels.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp draw-index recordings/room.ron room.svg
  osp draw-index recordings/room.ron --index octree-rebuild --from top room.png
  osp draw-index recordings/room.ron --beside kd-tree --colors leaf both.svg
  osp draw-index recordings/room.ron --ray 0,1.6,6 0,0,-1 --from top ray.png
  osp draw-index recordings/room.ron --index bsp --planes --from top planes.png
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
    /// A second index, drawn beside the first.
    #[arg(long, value_name = "INDEX", value_parser = index_parser())]
    beside: Option<IndexKind>,
    /// What the colours of the cells tell: their `level`, or for each polygon the lowest node that holds it (`leaf`).
    #[arg(long, value_enum, default_value_t = Colors::Level)]
    colors: Colors,
    /// A ray, where it starts and in which direction it goes: the nodes that it enters stand out, and the first polygon that
    /// it meets is marked.
    #[arg(long, num_args = 2, value_names = ["X,Y,Z", "X,Y,Z"], allow_hyphen_values = true)]
    ray: Option<Vec<Numbers>>,
    /// Draw the planes of a `bsp` in place of the boxes of its nodes: the upper 2,000, each cut off by those above it.
    #[arg(long)]
    planes: bool,
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

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Colors {
    /// The level of a cell.
    Level,
    /// The lowest node that holds a polygon.
    Leaf,
}

/// The planes of a tree along the polygons' planes.
fn splits(scene: &Scene) -> anyhow::Result<Vec<SplitOutline>> {
    let mut tree = Bsp::new(BspConfig::default(), &IndexConfig::default());
    let mut bounds = Aabb::EMPTY;
    for id in scene.visible_ids() {
        tree.insert(id, &scene.bounds(id))?;
        tree.shape(id, &scene.polygon(id));
        bounds = bounds.union(&scene.bounds(id));
    }
    tree.commit();
    let mut outlines = Vec::new();
    tree.splits(&bounds, MOST_PLANES, &mut |depth, corners| {
        outlines.push(SplitOutline { depth, corners: corners.to_vec() });
    });
    Ok(outlines)
}

/// Where a ray meets the first polygon.
fn first_hit(index: &dyn SpatialIndex, scene: &Scene, ray: &Ray) -> Option<f32> {
    let hit = index.ray_nearest(ray, f32::INFINITY, &mut |id| scene.polygon(id).meet(ray));
    hit.map(|(_, t)| t)
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
    ensure!(
        !args.planes || (args.frame.index == IndexKind::Bsp && args.shown == Shown::Space),
        "--planes: expected with --index bsp and a picture of cells"
    );
    ensure!(
        args.beside.is_none() || !is_dot,
        "{}: a .dot holds one tree: expected no --beside",
        args.out.display()
    );
    let ray = args.ray.as_deref().map(ray_of).transpose()?;
    let Played { scene, pipeline, moment, .. } = Played::in_index(&args.frame)?;
    let file = &args.frame.session.file;
    let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
    let title_of =
        |moment: &Moment, index: IndexKind| format!("{name}, frame {}, {}", moment.frame, index.name());
    let title = title_of(&moment, args.frame.index);
    let structure = Structure::of(pipeline.index());
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
        let splits = if args.planes { splits(&scene)? } else { Vec::new() };
        let mut panels = vec![StructurePanel { title: title.clone(), structure: structure.clone(), splits }];
        if let Some(other) = args.beside {
            let played = Played::up_to(&args.frame.session, other)?;
            let structure = Structure::of(played.pipeline.index());
            panels.push(StructurePanel { title: title_of(&moment, other), structure, splits: Vec::new() });
        }
        let colors = match args.colors {
            Colors::Level => CellColors::Level,
            Colors::Leaf => CellColors::Leaf,
        };
        let ray = ray.map(|ray| (ray, first_hit(pipeline.index(), &scene, &ray)));
        let picture = StructurePicture { panels: &panels, view, scene: &scene, colors, ray };
        picture.write(output.path()).map_err(|e| anyhow!("{}: {e}", output.path().display()))?;
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
