//! The arguments of `osp draw-insertion`.

use std::path::PathBuf;

use clap::Args;

use super::{outputs::ForceArgs, played::FrameArgs};

/// Film how polygons fall through the paper's tree, beside its octree.
///
/// On the left the planes of the tree halve a cube in turn. A polygon falls until a plane cuts it, or into a leaf. On
/// the right, all polygons are inserted again into the octree, which divides each node with more than one polygon.
/// Below are all nodes of the OSP tree, and the number of planes that each tree tests for each polygon.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp draw-insertion docs/figures/fall.ron fall.gif
  osp draw-insertion recordings/scribble.ron fall.gif --polygons 20 --levels 6")]
pub(super) struct DrawInsertionArgs {
    #[command(flatten)]
    pub(super) session: FrameArgs,
    /// The film to write.
    #[arg(value_name = "OUT.gif")]
    pub(super) out: PathBuf,
    /// Number of polygons: the first polygons of the model in this frame.
    #[arg(long, default_value_t = 8, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64))]
    pub(super) polygons: u32,
    /// Levels of planes of the paper's tree.
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=7))]
    pub(super) levels: u32,
    #[command(flatten)]
    pub(super) force: ForceArgs,
}
