//! The arguments of `osp draw-index`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{
    index_settings_args::IndexSettingsArgs, outputs::ForceArgs, parsers::index_parser, played::FrameArgs,
    query::Numbers,
};
use osp_rivals::IndexKind;

/// Draw an index as cells or as a tree.
///
/// The index is in its state after a frame. The picture of a large tree omits the deepest levels and states that. A legend names the levels.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp draw-index recordings/room.ron room.svg
  osp draw-index recordings/room.ron --index octree-rebuild --from top room.png
  osp draw-index room.ron --index osp,kd-tree,bvh-sah --colors leaf three.svg
  osp draw-index recordings/room.ron --ray 0,1.6,6 0,0,-1 --from top ray.png
  osp draw-index recordings/room.ron --index bsp --planes --from top planes.png
  osp draw-index docs/figures/fall.ron --index osp-paper --as tree --levels 5 \\
      --names paper.svg
  osp draw-index room.ron --index osp-paper --planes --levels 7 cube.png
  osp draw-index room.ron --index osp-paper --depth 6 --cube 2 --planes p.png
  osp draw-index sketch.tilt --index bvh-sah --frame 40 --as tree tree.svg
  osp draw-index sketch.tilt --as tree tree.dot   (for Graphviz)")]
pub(super) struct DrawIndexArgs {
    #[command(flatten)]
    pub(super) session: FrameArgs,
    /// The picture to write: .svg or .png, or .dot for a tree.
    #[arg(value_name = "OUT")]
    pub(super) out: PathBuf,
    /// The indexes, separated by commas and drawn side by side (`osp replay --help` describes them).
    #[arg(long, default_value = "osp", value_delimiter = ',', value_parser = index_parser())]
    pub(super) index: Vec<IndexKind>,
    #[command(flatten)]
    pub(super) settings: IndexSettingsArgs,
    /// Whether to draw the cells or the tree. The tree of `osp-paper` has its empty nodes, planes and flags, too.
    #[arg(long = "as", value_enum, default_value_t = Shown::Space)]
    pub(super) shown: Shown,
    /// Side from which the cells are seen.
    #[arg(long, value_enum, default_value_t = SideArg::Front)]
    pub(super) from: SideArg,
    /// Draw at most the upper N levels.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) levels: Option<u32>,
    /// Write the numbers of the polygons, at most 500.
    #[arg(long)]
    pub(super) names: bool,
    /// Colour cells by `level`, or polygons by the lowest node that holds them (`leaf`).
    #[arg(long, value_enum, default_value_t = Colors::Level)]
    pub(super) colors: Colors,
    /// A ray, by its origin and its direction. Highlights the nodes that the ray enters, and marks the first polygon
    /// that it hits.
    #[arg(long, num_args = 2, value_names = ["X,Y,Z", "X,Y,Z"], allow_hyphen_values = true)]
    pub(super) ray: Option<Vec<Numbers>>,
    /// Draw the planes of a `bsp` or of `osp-paper` instead of the boxes of the nodes: the upper 2,000, each clipped by the
    /// planes above it.
    #[arg(long)]
    pub(super) planes: bool,
    #[command(flatten)]
    pub(super) force: ForceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Shown {
    /// The cells in parallel projection, coloured by level, over the polygons.
    Space,
    /// The tree, coloured by level, with the root at the top.
    Tree,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum SideArg {
    /// x to the right, y up.
    Front,
    /// From above: x to the right, z down.
    Top,
    /// z to the left, y up.
    Right,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Colors {
    /// The level of a cell.
    Level,
    /// The lowest node that holds a polygon.
    Leaf,
}
