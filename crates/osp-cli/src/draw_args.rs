//! The arguments of `osp draw-index`, `osp draw-insertion` and `osp draw-occlusion`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{
    numbers,
    outputs::ForceArgs,
    parsers::{camera_parser, index_parser},
    played::FrameArgs,
    query::Numbers,
    structure_args::{IndexSettingsArgs, score_parser},
};
use osp::occlusion::Score;
use osp_rivals::IndexKind;
use osp_session::{recording::Camera, replay::CameraChoice};

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

/// Draw the occluders of a frame, their shadows and the MSVBSP tree.
///
/// The picture shows the eye's view; each plane of the tree appears as a line. Below are the shadows in parallel
/// projection and the tree. The tree tests the bounding box of each polygon in view. The command finds the visible
/// polygons with the same method as `osp verify`. It also prints the occluders, best first.
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  osp draw-occlusion recordings/room.ron room.png
  osp draw-occlusion docs/figures/vanish.ron v.png --form both --occluders 2
  osp draw-occlusion recordings/room.ron planes.gif --occluders 3
  osp draw-occlusion recordings/room.ron tree.dot   (for Graphviz)

A .gif shows the growth of the tree: each picture has --every N planes more than the picture before, and marks the \
polygons that these planes hide. The picture omits planes that do not cross their cell.")]
pub(super) struct DrawOcclusionArgs {
    #[command(flatten)]
    pub(super) session: FrameArgs,
    /// File of the picture: .svg, .png or .gif, or .dot for the tree.
    #[arg(value_name = "OUT")]
    pub(super) out: PathBuf,
    /// Form of the tree: `conservative` (`msvbsp`), `paper` (`msvbsp-paper`, hides visible polygons), or `both` side by
    /// side.
    #[arg(long, value_enum, default_value_t = Form::Conservative)]
    pub(super) form: Form,
    /// Position of the eye: `auto` is the recorded head path, else the session's own camera, else `orbit`. `orbit`
    /// circles around the model, `follow` is behind the hand, `inside` turns in the middle of the model.
    #[arg(long, default_value = "auto", value_parser = camera_parser())]
    pub(super) camera: CameraChoice,
    /// Position of the eye, in place of --camera, in the form of a recording's header: `(p: (x, y, z), q: (x, y, z, w),
    /// fov_degrees: 60)` is the eye in metres, the rotation from view to world, and the vertical field of view.
    #[arg(long, conflicts_with = "camera")]
    pub(super) view: Option<Camera>,
    /// Largest number of occluders.
    #[arg(long, default_value = "6", value_name = "N", value_parser = numbers::occluders)]
    pub(super) occluders: usize,
    /// Score of an occluder: the `solid-angle` of its part in view, or equation (1) of the `paper`.
    #[arg(long, default_value = "solid-angle", value_parser = score_parser())]
    pub(super) score: Score,
    /// The side from which the shadows are seen [default: top, or a side if the eye looks up or down].
    #[arg(long, value_enum)]
    pub(super) from: Option<SideArg>,
    /// Planes that each picture of a .gif adds [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) every: Option<u32>,
    #[command(flatten)]
    pub(super) force: ForceArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Form {
    /// The conservative form.
    Conservative,
    /// The paper's form.
    Paper,
    /// Both, side by side.
    Both,
}
